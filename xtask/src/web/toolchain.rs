//! A compiler for wasm32.

use crate::shell::{cargo, output, target_dir};
use crate::vulkan::apt;
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The platform of pages.
pub const PLATFORM: &str = "wasm32-unknown-unknown";

/// Debian's compiler, the source of its standard library, and a linker.
const PACKAGES: [&str; 6] =
    ["rustc-web", "libstd-rust-web-1.96", "libstd-rust-web-dev", "rust-web-src", "libllvm22", "lld-22"];

/// Which compiler, and where its standard library comes from.
pub enum Toolchain {
    /// Cargo's own, which has the platform.
    Own,
    /// Cargo's own, which has the source of the standard library.
    OwnFromSource,
    /// Debian's, unpacked into a folder.
    Unpacked(PathBuf),
}

impl Toolchain {
    /// Looks for one; the last resort is to unpack one.
    pub fn find() -> anyhow::Result<Self> {
        let sysroot = output(Command::new("rustc").args(["--print", "sysroot"]))?;
        let rustlib = PathBuf::from(sysroot.trim()).join("lib/rustlib");
        if rustlib.join(PLATFORM).join("lib").is_dir() {
            return Ok(Self::Own);
        }
        if rustlib.join("src/rust/library/Cargo.lock").is_file() {
            return Ok(Self::OwnFromSource);
        }
        let folder = target_dir()?.join("web-toolchain");
        let wrapper = folder.join("rustc");
        if !wrapper.is_file() {
            ensure!(
                apt::is_there(),
                "this toolchain has no {PLATFORM}: `rustup target add {PLATFORM}` adds it"
            );
            eprintln!("there is no compiler for {PLATFORM}: unpacking Debian's into {}", folder.display());
            unpack(&folder, &wrapper)?;
        }
        Ok(Self::Unpacked(folder))
    }

    /// A cargo command that compiles for pages, into a folder of its own.
    pub fn cargo(&self, arguments: &[&str]) -> anyhow::Result<Command> {
        let mut command = cargo(arguments);
        command.args(["--target", PLATFORM]).env("CARGO_TARGET_DIR", target_dir()?.join("cross"));
        // Vectors of 16 bytes, which all browsers have that have WebGPU. Paths want more stack than a megabyte.
        let flags = "-C target-feature=+simd128 -C link-arg=-zstack-size=8388608";
        command.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS", flags);
        if !matches!(self, Self::Own) {
            // An unstable option of cargo, which stable compilers allow by this variable.
            command.arg("-Zbuild-std=std,panic_abort").env("RUSTC_BOOTSTRAP", "1");
        }
        if let Self::Unpacked(folder) = self {
            command.env("RUSTC", folder.join("rustc"));
            let linker = folder.join("root/usr/lib/llvm-22/bin/wasm-ld");
            command.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER", linker);
        }
        Ok(command)
    }
}

/// Unpacks the packages, and writes a program that starts the compiler where it finds its libraries.
fn unpack(folder: &Path, wrapper: &Path) -> anyhow::Result<()> {
    let root = folder.join("root");
    apt::unpack_packages(&PACKAGES, &folder.join("apt"), &root)?;
    let root = root.canonicalize().with_context(|| format!("cannot find {}", root.display()))?;
    let usr = format!("{}/usr", root.display());
    let text = format!(
        "#!/bin/sh\n\
         # Written by `cargo xtask web` of Alhazen: Debian's compiler for pages, where its libraries are.\n\
         export LD_LIBRARY_PATH='{usr}/lib/x86_64-linux-gnu:{usr}/lib/llvm-22/lib'\n\
         exec '{usr}/bin/rustc' \"$@\"\n"
    );
    std::fs::write(wrapper, text).with_context(|| format!("cannot write {}", wrapper.display()))?;
    crate::display::make_executable(wrapper)
}
