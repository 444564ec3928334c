//! `cargo xtask cross`: whether everything compiles for the other platforms, and yields the same there.

mod emulation;
mod standard_library;

use crate::shell::{cargo, run as run_command, target_dir};
use anyhow::ensure;
use standard_library::StandardLibrary;
use std::path::PathBuf;
use std::process::Command;

/// Platforms, and the packages that are checked for them with all that those need.
const PLATFORMS: [(&str, &[&str]); 6] = [
    ("aarch64-apple-darwin", &["cli"]),
    ("x86_64-apple-darwin", &["cli"]),
    ("x86_64-pc-windows-msvc", &["cli"]),
    ("x86_64-pc-windows-gnu", &["cli"]),
    ("aarch64-unknown-linux-gnu", &["cli"]),
    // Without files, threads and windows of its own: the page (`cargo xtask web`).
    ("wasm32-unknown-unknown", &["web"]),
];

/// Check that everything compiles for other platforms; with `--run`, run tests and render there.
///
/// Standard libraries that the toolchain lacks are built from its source (component `rust-src`), or
/// else added by rustup.
#[derive(Debug, clap::Args)]
pub struct CrossArgs {
    /// Platforms, such as aarch64-apple-darwin [default: all that Alhazen supports].
    platforms: Vec<String>,
    /// Also run tests and render all built-in scenes under an emulator, where one is installed, and
    /// compare the pictures with those of this machine bit for bit.
    #[arg(long)]
    run: bool,
    /// Only that, without checking that everything compiles.
    #[arg(long)]
    only_run: bool,
    /// Another compiler than cargo's, such as one that has the source of its standard library.
    #[arg(long, value_name = "FILE")]
    rustc: Option<PathBuf>,
}

/// Checks each platform; the error names those that failed.
pub fn run(args: &CrossArgs) -> anyhow::Result<()> {
    let known = || PLATFORMS.iter().map(|(name, _)| *name);
    if let Some(unknown) = args.platforms.iter().find(|p| !known().any(|name| name == *p)) {
        anyhow::bail!("{unknown} is none of {}", known().collect::<Vec<_>>().join(", "));
    }
    let compiler = Compiler { rustc: args.rustc.clone(), target: target_dir()?.join("cross") };
    let wanted = |name: &str| args.platforms.is_empty() || args.platforms.iter().any(|p| p == name);
    let mut failed = Vec::new();
    for (platform, packages) in PLATFORMS.iter().filter(|(name, _)| wanted(name)) {
        if let Err(error) = platform_passes(&compiler, platform, packages, args) {
            eprintln!("{platform}: {error:#}");
            failed.push(*platform);
        }
    }
    ensure!(failed.is_empty(), "failed: {}", failed.join(", "));
    Ok(())
}

fn platform_passes(
    compiler: &Compiler,
    platform: &str,
    packages: &[&str],
    args: &CrossArgs,
) -> anyhow::Result<()> {
    let library = StandardLibrary::find(compiler, platform)?;
    if !args.only_run {
        let mut command = compiler.cargo("check", platform, library);
        packages.iter().for_each(|package| {
            command.args(["--package", package]);
        });
        run_command(&mut command)?;
    }
    if args.run || args.only_run {
        emulation::run(compiler, platform, library)?;
    }
    Ok(())
}

/// What compiles for other platforms.
struct Compiler {
    /// `None`: cargo's own.
    rustc: Option<PathBuf>,
    /// The folder that it builds in, apart from what is built for this machine.
    target: PathBuf,
}

impl Compiler {
    /// A cargo command for a platform.
    fn cargo(&self, subcommand: &str, platform: &str, library: StandardLibrary) -> Command {
        let mut command = cargo(&[subcommand, "--locked", "--target", platform]);
        if library == StandardLibrary::FromSource {
            // An unstable option of cargo, which stable compilers allow by this variable.
            command.arg("-Zbuild-std=std,panic_abort").env("RUSTC_BOOTSTRAP", "1");
        }
        command.env("CARGO_TARGET_DIR", &self.target);
        self.rustc.iter().for_each(|rustc| {
            command.env("RUSTC", rustc);
        });
        command
    }

    /// The compiler's own command.
    fn rustc(&self) -> Command {
        Command::new(self.rustc.clone().unwrap_or_else(|| "rustc".into()))
    }
}
