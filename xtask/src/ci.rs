//! `cargo xtask ci`: what continuous integration checks.

use crate::shell::{cargo, run as run_command, shared_dir};
use crate::{cluster_tools, display, python, test};
use anyhow::ensure;

/// Which skips tests may not make: with the test data none at all, without it none for want of a GPU, because a
/// software driver is set up.
fn forbidden_skips() -> &'static str {
    if shared_dir().is_some() { "1" } else { "gpu" }
}

/// Checks formatting, lints, documentation, tests and the Python package. Every step runs; the error names those that failed.
pub fn run() -> anyhow::Result<()> {
    let mut docs = cargo(&["doc", "--workspace", "--no-deps"]);
    docs.env("RUSTDOCFLAGS", "-Dwarnings");
    let mut variables = test::driver();
    test::merge(&mut variables, display::prepare());
    variables.extend(cluster_tools::prepare());
    variables.push(("ALHAZEN_FORBID_SKIPS".into(), forbidden_skips().into()));
    let results = [
        ("format", run_command(&mut cargo(&["fmt", "--all", "--check"]))),
        (
            "lint",
            run_command(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"])),
        ),
        ("docs", run_command(&mut docs)),
        ("test", test::run_tests(&[], &variables)),
        ("python", python::run(&python::PythonArgs::for_ci())),
    ];
    let failed: Vec<_> = results.iter().filter(|(_, r)| r.is_err()).map(|(name, _)| *name).collect();
    ensure!(failed.is_empty(), "failed: {}", failed.join(", "));
    eprintln!("format, lint, docs, test and python passed");
    Ok(())
}
