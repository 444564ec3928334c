//! `cargo xtask test`: all tests, GPU tests included, with a summary of what passed and what was skipped.

use crate::shell::{cargo, shared_dir};
use crate::test_programs::{self, Finished};
use crate::{cluster_tools, display, vulkan};
use anyhow::{Context, ensure};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Run all tests of the workspace.
///
/// With the shared test data (ALHAZEN_SHARED, or a folder `shared` beside the repository) tests against references run,
/// too; without it they say that they are skipped.
///
/// GPU tests run on the Vulkan driver that the machine has, if it has ray tracing pipelines. Else Mesa's software driver
/// is set up: installed with apt by root on Debian (on Debian 12 from its backports, which are added to apt's sources),
/// otherwise unpacked beside the build. Where neither works those tests say that they are skipped. That driver is used by way
/// of the crate `lavapipe`, with which shaders compile in seconds; those that did not change are in `target` from the last time.
///
/// Without more arguments test programs run side by side, and the last lines name those that took longest.
///
/// Tests that open windows do so on a display without a screen: Xvfb is set up in the same ways where it is missing.
///
/// Tests of cluster jobs run openjd-cli and shellcheck, which pip installs beside the build.
#[derive(Debug, clap::Args)]
pub struct TestArgs {
    /// Take the Vulkan drivers as they are: install and unpack nothing.
    #[arg(long)]
    no_driver: bool,
    /// Only what needs no GPU: tests that need one say that they are skipped.
    #[arg(long, conflicts_with = "no_driver")]
    quick: bool,
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
    let mut variables = cluster_tools::prepare();
    if args.quick {
        // A list without a driver in it.
        variables
            .extend(["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].map(|name| (name.into(), "/dev/null".into())));
        merge(&mut variables, display::prepare());
    } else if args.no_driver {
        eprintln!("GPU tests: on whatever drivers there are");
    } else {
        variables.extend(driver());
        merge(&mut variables, display::prepare());
    }
    run_tests(&args.arguments, &variables)
}

/// Adds variables; of two search paths both count.
pub fn merge(all: &mut vulkan::Variables, more: vulkan::Variables) {
    for (name, value) in more {
        match all.iter_mut().find(|(known, _)| *known == name) {
            Some((_, known)) if name == "LD_LIBRARY_PATH" => *known = format!("{value}:{known}"),
            Some((_, known)) => *known = value,
            None => all.push((name, value)),
        }
    }
}

/// Sees to it that there is a driver, and says which; the variables by which tests find it.
pub fn driver() -> vulkan::Variables {
    let vulkan = vulkan::prepare();
    eprintln!("{}", vulkan.message);
    vulkan.variables
}

/// Runs the tests in an environment with `variables` in addition: with more arguments as `cargo test` does, without any all
/// programs side by side.
pub fn run_tests(arguments: &[String], variables: &vulkan::Variables) -> anyhow::Result<()> {
    match shared_dir() {
        Some(dir) => eprintln!("test data: {}", dir.display()),
        None => eprintln!("test data: none; tests that need it will say so"),
    }
    let start = Instant::now();
    let (mut totals, mut skipped) = (Totals::default(), Vec::new());
    let mut passed = true;
    let arguments = if arguments.is_empty() {
        let programs = test_programs::build()?;
        let (building, running) = (start.elapsed(), Instant::now());
        let finished = test_programs::run(programs, variables, print_program)?;
        for program in &finished {
            program.stdout.iter().for_each(|line| totals.add(line));
            skipped.extend(
                program.stderr.iter().filter_map(|line| line.strip_prefix(SKIPPED)).map(str::to_owned),
            );
        }
        eprint!("{}", test_programs::slowest(&finished, SHOWN));
        let work: Duration = finished.iter().filter_map(|program| program.worked).sum();
        eprintln!(
            "building took {} s, running {} s, in which cores worked {} s",
            building.as_secs(),
            running.elapsed().as_secs(),
            work.as_secs()
        );
        passed = finished.iter().all(|program| program.passed);
        &["--doc".to_owned()][..]
    } else {
        arguments
    };
    passed &= run_cargo(arguments, variables, &mut totals, &mut skipped)?;
    if !skipped.is_empty() {
        eprintln!("{} tests were skipped, wholly or in part:", skipped.len());
        skipped.iter().for_each(|what| eprintln!("  {what}"));
    }
    let Totals { programs, passed: successes, failed, ignored } = totals;
    let seconds = start.elapsed().as_secs();
    eprintln!(
        "{successes} passed, {failed} failed, {ignored} ignored in {programs} test programs, {seconds} s"
    );
    ensure!(passed, "tests failed");
    Ok(())
}

/// How many of the programs and tests that took longest are named.
const SHOWN: usize = 12;

/// Prints what a program said, as cargo does.
fn print_program(program: &Finished) {
    let seconds = program.elapsed.as_secs_f64();
    eprintln!("     Ran {} in {seconds:.1} s", program.name);
    program.stderr.iter().for_each(|line| eprintln!("{line}"));
    program.stdout.iter().for_each(|line| println!("{line}"));
    if !program.passed {
        eprintln!("error: {} failed", program.name);
    }
}

/// Runs `cargo test` and takes note of what its programs say. Returns whether all passed.
fn run_cargo(
    arguments: &[String],
    variables: &vulkan::Variables,
    totals: &mut Totals,
    skipped: &mut Vec<String>,
) -> anyhow::Result<bool> {
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast"]);
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.envs(variables.iter().map(|(name, value)| (name, value)));
    let mut child = command.spawn().context("cannot run cargo test")?;
    let stdout = child.stdout.take().context("cargo test has no output")?;
    let stderr = child.stderr.take().context("cargo test has no error output")?;
    // Skips are told on stderr, past the harness's capture.
    let told = std::thread::spawn(move || {
        let mut told = Vec::new();
        pass_on(stderr, std::io::stderr(), |line| {
            told.extend(line.strip_prefix(SKIPPED).map(str::to_owned));
        })
        .map(|()| told)
    });
    pass_on(stdout, std::io::stdout(), |line| totals.add(line))?;
    skipped.extend(told.join().map_err(|_| anyhow::anyhow!("cannot read the tests' errors"))??);
    Ok(child.wait()?.success())
}

/// What a test's line begins with that skips itself.
const SKIPPED: &str = "skipped: ";

/// Copies lines as they come, and shows each to `see`.
fn pass_on(from: impl Read, mut to: impl Write, mut see: impl FnMut(&str)) -> std::io::Result<()> {
    for line in BufReader::new(from).split(b'\n') {
        let line = line?;
        see(&String::from_utf8_lossy(&line));
        // A reader that has seen enough does not end the tests.
        let _ = to.write_all(&line).and_then(|()| to.write_all(b"\n"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_is_passed_on_and_seen() {
        let mut seen = Vec::new();
        let mut out = Vec::new();
        let text = b"skipped: a: no GPU\nok\n";
        pass_on(&text[..], &mut out, |l| seen.extend(l.strip_prefix(SKIPPED).map(str::to_owned)))
            .expect("memory");
        assert_eq!((&out[..], &seen[..]), (&text[..], &["a: no GPU".to_owned()][..]));
    }

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
