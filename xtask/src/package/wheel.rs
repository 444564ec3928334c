//! Wheels and the source distribution of the Python package, by maturin.

use super::platform::{APPLE_TARGETS, Platform};
use crate::python::{Environment, folder as python_folder};
use crate::shell::{root, run as run_command};
use anyhow::ensure;
use std::path::Path;
use std::process::Command;

/// The builder, and Zig for Linux: exact versions with the hashes of their files, so that a release is built as it was tried.
const TOOLS: &str = "packaging/requirements.txt";

/// Maturin's arguments for a platform's wheel.
fn arguments(platform: &Platform) -> Vec<&'static str> {
    let mut arguments =
        vec!["build", "--locked", "--strip", "--profile", "dist", "--target", platform.target];
    if let Some(tag) = platform.wheel {
        arguments.extend(["--compatibility", tag]);
    }
    if platform.is_linux() {
        arguments.push("--zig");
    }
    arguments
}

/// Builds the wheel of a platform into `folder`.
///
/// # Errors
/// If pip or maturin fails.
pub fn wheel(platform: &Platform, python: &Path, folder: &Path) -> anyhow::Result<()> {
    if platform.target == "universal2-apple-darwin" {
        for target in APPLE_TARGETS {
            run_command(Command::new("rustup").args(["target", "add", target]))?;
        }
    }
    run_maturin(&arguments(platform), python, folder)
}

/// Packs the source distribution into `folder`.
///
/// # Errors
/// If pip or maturin fails.
pub fn sdist(python: &Path, folder: &Path) -> anyhow::Result<()> {
    run_maturin(&["sdist"], python, folder)
}

fn run_maturin(arguments: &[&str], python: &Path, folder: &Path) -> anyhow::Result<()> {
    let builder = Environment::kept(python, &python_folder()?.join("release-builder"))?;
    let tools = root().join(TOOLS);
    builder.install(&[
        "--require-hashes",
        "--only-binary",
        ":all:",
        "--requirement",
        &tools.to_string_lossy(),
    ])?;
    let mut maturin = builder.python();
    maturin.args(["-m", "maturin"]).args(arguments);
    maturin.args(["--manifest-path", "crates/python/Cargo.toml", "--out"]).arg(folder).current_dir(root());
    run_command(&mut maturin)?;
    let packed = std::fs::read_dir(folder)?.flatten().any(|entry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        name.ends_with(".whl") || name.ends_with(".tar.gz")
    });
    ensure!(packed, "maturin has left nothing in {}", folder.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::platform::PLATFORMS;
    use super::*;

    #[test]
    fn wheels_for_linux_name_the_oldest_library() {
        for platform in PLATFORMS.iter().filter(|p| p.is_linux()) {
            let line = arguments(platform).join(" ");
            let tag = if platform.is_static() { "musllinux_1_2" } else { "manylinux_2_28" };
            assert!(line.contains(&format!("--compatibility {tag} --zig")), "{line}");
        }
        let glibc = super::super::binary::OLDEST_GLIBC.replace('.', "_");
        assert!(PLATFORMS.iter().any(|p| p.wheel.is_some_and(|tag| tag == format!("manylinux_{glibc}"))));
    }
}
