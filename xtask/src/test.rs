//! `cargo xtask test`: all tests, with a summary.

use crate::shell::{cargo, shared_dir};
use anyhow::{Context, ensure};
use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;
use std::time::Instant;

/// Run all tests of the workspace.
///
/// With the shared test data (ALHAZEN_SHARED, or a folder `shared` beside the repository) tests against references run,
/// too; without it they say that they are skipped.
#[derive(Debug, clap::Args)]
pub struct TestArgs {
    /// More arguments for `cargo test`, such as a test's name.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// Sums of all test programs.
#[derive(Debug, Default, PartialEq)]
struct Totals {
    programs: usize,
    passed: usize,
    failed: usize,
    ignored: usize,
}

impl Totals {
    /// Adds a line such as `test result: ok. 39 passed; 0 failed; 1 ignored; …`; other lines change nothing.
    fn add(&mut self, line: &str) {
        let Some((_, counts)) = line.strip_prefix("test result: ").and_then(|l| l.split_once(". ")) else {
            return;
        };
        self.programs += 1;
        for part in counts.split("; ") {
            match part.split_once(' ').map(|(n, what)| (n.parse::<usize>(), what)) {
                Some((Ok(n), "passed")) => self.passed += n,
                Some((Ok(n), "failed")) => self.failed += n,
                Some((Ok(n), "ignored")) => self.ignored += n,
                _ => {}
            }
        }
    }
}

/// Runs the tests.
pub fn run(args: &TestArgs) -> anyhow::Result<()> {
    run_tests(&args.arguments, false)
}

/// Runs the tests with more arguments for `cargo test`; with `forbid_skips`, one that would skip itself fails.
pub fn run_tests(arguments: &[String], forbid_skips: bool) -> anyhow::Result<()> {
    match shared_dir() {
        Some(dir) => eprintln!("test data: {}", dir.display()),
        None => eprintln!("test data: none; tests that need it will say so"),
    }
    let start = Instant::now();
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast"]);
    command.args(arguments).stdout(Stdio::piped());
    if forbid_skips {
        command.env("ALHAZEN_FORBID_SKIPS", "1");
    }
    let mut child = command.spawn().context("cannot run cargo test")?;
    let mut totals = Totals::default();
    let stdout = child.stdout.take().context("cargo test has no output")?;
    for line in BufReader::new(stdout).split(b'\n') {
        let line = line?;
        totals.add(&String::from_utf8_lossy(&line));
        let mut out = std::io::stdout().lock();
        // A reader that has seen enough does not end the tests.
        let _ = out.write_all(&line).and_then(|()| out.write_all(b"\n"));
    }
    let status = child.wait()?;
    let Totals { programs, passed, failed, ignored } = totals;
    let seconds = start.elapsed().as_secs();
    eprintln!("{passed} passed, {failed} failed, {ignored} ignored in {programs} test programs, {seconds} s");
    ensure!(status.success(), "tests failed");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn result_lines_are_summed() {
        let mut totals = Totals::default();
        totals.add("running 3 tests");
        totals.add(
            "test result: ok. 39 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 4.88s",
        );
        totals.add("test result: FAILED. 2 passed; 3 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.1s");
        assert_eq!(totals, Totals { programs: 2, passed: 41, failed: 3, ignored: 1 });
    }
}
