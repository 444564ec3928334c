//! `cargo xtask cross`: whether everything compiles for the other platforms.

use crate::shell::{cargo, output, run as run_command};
use anyhow::ensure;
use std::process::Command;

/// Platforms, and the packages that are checked for them with all that those need.
const PLATFORMS: [(&str, &[&str]); 6] = [
    ("aarch64-apple-darwin", &["cli"]),
    ("x86_64-apple-darwin", &["cli"]),
    ("x86_64-pc-windows-msvc", &["cli"]),
    ("x86_64-pc-windows-gnu", &["cli"]),
    ("aarch64-unknown-linux-gnu", &["cli"]),
    // Without files, threads and windows of its own.
    ("wasm32-unknown-unknown", &["optics", "scene", "accel", "film", "backend", "gpu", "post"]),
];

/// Check that everything compiles for other platforms. Nothing is linked or run.
///
/// Standard libraries that the toolchain lacks are added by rustup.
#[derive(Debug, clap::Args)]
pub struct CrossArgs {
    /// Platforms, such as aarch64-apple-darwin [default: all that Alhazen supports].
    platforms: Vec<String>,
}

/// Checks each platform; the error names those that do not compile.
pub fn run(args: &CrossArgs) -> anyhow::Result<()> {
    let known = || PLATFORMS.iter().map(|(name, _)| *name);
    if let Some(unknown) = args.platforms.iter().find(|p| !known().any(|name| name == *p)) {
        anyhow::bail!("{unknown} is none of {}", known().collect::<Vec<_>>().join(", "));
    }
    let wanted = |name: &str| args.platforms.is_empty() || args.platforms.iter().any(|p| p == name);
    let mut failed = Vec::new();
    for (platform, packages) in PLATFORMS.iter().filter(|(name, _)| wanted(name)) {
        if let Err(error) = check(platform, packages) {
            eprintln!("{platform}: {error:#}");
            failed.push(*platform);
        }
    }
    ensure!(failed.is_empty(), "does not compile for {}", failed.join(", "));
    Ok(())
}

fn check(platform: &str, packages: &[&str]) -> anyhow::Result<()> {
    let installed = output(Command::new("rustup").args(["target", "list", "--installed"]));
    if !installed.is_ok_and(|list| list.lines().any(|line| line == platform)) {
        run_command(Command::new("rustup").args(["target", "add", platform]))?;
    }
    let mut command = cargo(&["check", "--locked", "--target", platform]);
    packages.iter().for_each(|package| {
        command.args(["--package", package]);
    });
    run_command(&mut command)
}
