//! Where the standard library of a platform comes from.

use super::Compiler;
use crate::shell::{output, run as run_command};
use anyhow::Context;
use std::path::PathBuf;
use std::process::Command;

/// How the compiler gets a platform's standard library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StandardLibrary {
    /// It is installed.
    Installed,
    /// Cargo builds it.
    FromSource,
}

impl StandardLibrary {
    /// Looks for an installed one, then for its source; the last resort is rustup.
    pub(super) fn find(compiler: &Compiler, platform: &str) -> anyhow::Result<Self> {
        let sysroot = output(compiler.rustc().args(["--print", "sysroot"]))?;
        let rustlib = PathBuf::from(sysroot.trim()).join("lib/rustlib");
        if rustlib.join(platform).join("lib").is_dir() {
            return Ok(Self::Installed);
        }
        if rustlib.join("src/rust/library/Cargo.lock").is_file() {
            return Ok(Self::FromSource);
        }
        run_command(Command::new("rustup").args(["target", "add", platform]))
            .context("there is neither a standard library nor its source (rust-src)")?;
        Ok(Self::Installed)
    }
}
