//! `cargo xtask web`: the page of `crates/web`: built, served, tested in a browser.

mod browser;
mod build;
mod serve;
mod toolchain;

use crate::shell::target_dir;
use std::path::PathBuf;

/// Build the page into `target/web`, and serve or test it.
///
/// It needs a compiler for wasm32: the toolchain's own if it has that target or its source (component `rust-src`), else
/// Debian's, which is unpacked beside the build. The test needs Chromium.
#[derive(Debug, clap::Args)]
pub struct WebArgs {
    /// Serve the page on this machine alone, at http://127.0.0.1:PORT.
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "8080")]
    serve: Option<u16>,
    /// Open the page in a headless Chromium: all built-in scenes and a dropped file have to look as on the CPU, and the page has to work by mouse, by keyboard and on a phone's screen.
    #[arg(long)]
    test: bool,
    /// Take the documentation's picture of the page, to a .png.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Take the page that is there already.
    #[arg(long)]
    no_build: bool,
    /// The browser of the test.
    #[arg(long, value_name = "FILE", default_value = "chromium")]
    browser: PathBuf,
}

/// Runs the command.
pub fn run(args: &WebArgs) -> anyhow::Result<()> {
    let page = target_dir()?.join("web");
    if !args.no_build {
        build::build(&page)?;
    }
    if args.test {
        browser::test(&page, &args.browser)?;
    }
    if let Some(file) = &args.picture {
        browser::picture(&page, &args.browser, file)?;
    }
    if let Some(port) = args.serve {
        let server = serve::Server::start(&page, port)?;
        eprintln!("{} (ends with Ctrl+C)", server.address());
        server.wait();
    }
    Ok(())
}
