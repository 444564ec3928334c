//! Builds the program that is packed.

use super::platform::{APPLE_TARGETS, Platform};
use crate::shell::{cargo, run as run_command, target_dir};
use anyhow::ensure;
use std::path::PathBuf;
use std::process::Command;

/// The C library of the oldest Linux systems that programs and wheels run on: Debian 10, RHEL 8, Ubuntu 18.10.
pub const OLDEST_GLIBC: &str = "2.28";

/// Cargo's arguments for one target. `zig`: Zig links, against [`OLDEST_GLIBC`] or statically.
fn arguments(platform: &Platform, target: &str, zig: bool) -> Vec<String> {
    let command = if zig { "zigbuild" } else { "build" };
    let mut arguments: Vec<_> =
        [command, "--locked", "--profile", "dist", "--package", "cli", "--target"].map(String::from).into();
    let is_gnu = platform.is_linux() && !platform.is_static();
    arguments.push(if zig && is_gnu { format!("{target}.{OLDEST_GLIBC}") } else { target.to_owned() });
    if !platform.has_window {
        arguments.push("--no-default-features".into());
    }
    arguments
}

/// Builds the program of a platform and returns its path.
///
/// # Errors
/// If cargo, `cargo zigbuild` or `lipo` fails.
pub fn build(platform: &Platform, zig: bool) -> anyhow::Result<PathBuf> {
    ensure!(!zig || platform.is_linux(), "--zig is for Linux");
    let folder = target_dir()?;
    let universal = platform.target == "universal2-apple-darwin";
    let targets = if universal { APPLE_TARGETS.to_vec() } else { vec![platform.target] };
    let mut built = Vec::new();
    for target in targets {
        let arguments = arguments(platform, target, zig);
        let mut command = cargo(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
        if target.ends_with("-windows-msvc") {
            // Otherwise the program needs Visual C++'s runtime library, which not every Windows has.
            command.env("CARGO_TARGET_X86_64_PC_WINDOWS_MSVC_RUSTFLAGS", "-Ctarget-feature=+crt-static");
        }
        run_command(&mut command)?;
        built.push(folder.join(target).join("dist").join(platform.program()));
    }
    if let [program] = &built[..] {
        return Ok(program.clone());
    }
    let program = super::folder()?.join(platform.program());
    let mut lipo = Command::new("lipo");
    run_command(lipo.args(["-create", "-output"]).arg(&program).args(&built))?;
    Ok(program)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zig_links_against_the_oldest_library() {
        let gnu = Platform::find(Some("aarch64-unknown-linux-gnu")).unwrap();
        let line = arguments(&gnu, gnu.target, true).join(" ");
        assert!(line.starts_with("zigbuild ") && line.ends_with("aarch64-unknown-linux-gnu.2.28"), "{line}");
        let line = arguments(&gnu, gnu.target, false).join(" ");
        assert!(line.starts_with("build ") && line.ends_with("aarch64-unknown-linux-gnu"), "{line}");
        let musl = Platform::find(Some("x86_64-unknown-linux-musl")).unwrap();
        let line = arguments(&musl, musl.target, true).join(" ");
        assert!(line.ends_with("x86_64-unknown-linux-musl --no-default-features"), "{line}");
    }

    #[test]
    fn zig_is_for_linux() {
        let windows = Platform::find(Some("x86_64-pc-windows-msvc")).unwrap();
        assert!(build(&windows, true).unwrap_err().to_string().contains("Linux"));
    }
}
