//! What runs on other platforms by an emulator, and whether it yields the same.

use super::Compiler;
use super::standard_library::StandardLibrary;
use crate::shell::{cargo, output, run as run_command};
use anyhow::{Context, ensure};
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// How programs of a platform are linked and run on this machine.
struct Emulator {
    platform: &'static str,
    linker: &'static str,
    /// A program and its arguments.
    runner: &'static str,
    /// What has them in Debian.
    packages: &'static str,
}

const EMULATORS: [Emulator; 2] = [
    Emulator {
        platform: "aarch64-unknown-linux-gnu",
        linker: "aarch64-linux-gnu-gcc",
        runner: "qemu-aarch64 -L /usr/aarch64-linux-gnu",
        packages: "qemu-user gcc-aarch64-linux-gnu libc6-dev-arm64-cross",
    },
    Emulator {
        platform: "x86_64-pc-windows-gnu",
        linker: "x86_64-w64-mingw32-gcc",
        runner: "wine",
        packages: "wine64 wine gcc-mingw-w64-x86-64-posix",
    },
];

/// Crates whose tests run there: elementary functions, kernels, formulas.
const TESTED: [&str; 3] = ["elementary", "accel", "optics"];

/// The program that prints hashes of pictures: `crates/cpu/examples/bits.rs`.
const PICTURES: [&str; 5] = ["--quiet", "--package", "cpu", "--example", "bits"];

/// Runs tests and renders on a platform; does nothing, and says so, where no emulator is known.
pub(super) fn run(compiler: &Compiler, platform: &str, library: StandardLibrary) -> anyhow::Result<()> {
    let Some(emulator) = EMULATORS.iter().find(|e| e.platform == platform) else {
        eprintln!("{platform}: nothing here runs its programs");
        return Ok(());
    };
    for program in [emulator.linker, emulator.runner] {
        let program = program.split(' ').next().unwrap_or_default();
        output(Command::new(program).arg("--version"))
            .with_context(|| format!("Debian's packages {} have it", emulator.packages))?;
    }
    let command = |subcommand: &str| {
        let mut command = compiler.cargo(subcommand, platform, library);
        let variable = platform.to_uppercase().replace('-', "_");
        command.env(format!("CARGO_TARGET_{variable}_LINKER"), emulator.linker);
        command.env(format!("CARGO_TARGET_{variable}_RUNNER"), emulator.runner);
        command
    };
    let mut tests = command("test");
    tests.args(["--lib", "--tests", "--no-fail-fast"]);
    TESTED.iter().for_each(|package| {
        tests.args(["--package", package]);
    });
    run_command(&mut tests)?;
    let here = output(cargo(&["run", "--locked"]).args(PICTURES))?;
    let there = output(command("run").args(PICTURES))?;
    let count = compare(&here, &there)?;
    eprintln!("{platform}: {count} scenes and their pictures are the same bit for bit");
    Ok(())
}

/// The number of scenes whose hashes, a line each, are the same; an error names those that differ.
fn compare(here: &str, there: &str) -> anyhow::Result<usize> {
    let lines = |text: &str| -> BTreeMap<String, String> {
        let pairs = text.lines().filter_map(|line| line.split_once(": "));
        pairs.map(|(name, hashes)| (name.to_owned(), hashes.trim().to_owned())).collect()
    };
    let (here, there) = (lines(here), lines(there));
    ensure!(!here.is_empty(), "there is nothing to compare");
    let names: BTreeSet<_> = here.keys().chain(there.keys()).collect();
    let differs = |name: &&str| here.get(*name) != there.get(*name);
    let differing: Vec<_> = names.into_iter().map(String::as_str).filter(differs).collect();
    ensure!(differing.is_empty(), "differs from this machine: {}", differing.join(", "));
    Ok(here.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_of_one_picture_is_seen() {
        let here = "a: scene 1, picture 2\nb: scene 3, picture 4\n";
        assert_eq!(compare(here, &here.replace('\n', "\r\n")).unwrap(), 2);
        let error = compare(here, &here.replace("picture 4", "picture 5")).unwrap_err();
        assert_eq!(error.to_string(), "differs from this machine: b");
        assert!(compare(here, "a: scene 1, picture 2\n").is_err());
        assert!(compare("", "").is_err());
    }
}
