//! Where tests find their data and leave their pictures.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The root folder of this repository.
#[must_use]
pub fn repository_root() -> PathBuf {
    let crate_dir = Path::new(env!("CARGO_MANIFEST_DIR"));
    crate_dir.ancestors().nth(2).unwrap_or(crate_dir).to_owned()
}

/// The folder with the test data that is too large for the repository: what the environment variable
/// `ALHAZEN_SHARED` names, or else `shared` beside the repository. `None` if there is no such folder.
#[must_use]
pub fn shared_dir() -> Option<PathBuf> {
    let named = std::env::var_os("ALHAZEN_SHARED").map(PathBuf::from);
    let dir = named.or_else(|| Some(repository_root().parent()?.join("shared")))?;
    dir.is_dir().then_some(dir)
}

/// As [`shared_dir`], for a test that cannot run without it: when there is none, says on stderr that `test_name` is
/// skipped (past the test harness's capture) and returns `None`.
///
/// # Panics
/// When there is none and the environment variable `ALHAZEN_FORBID_SKIPS` is `1`, as in continuous integration.
#[must_use]
pub fn require_shared(test_name: &str) -> Option<PathBuf> {
    let dir = shared_dir();
    if dir.is_none() {
        let why = "the shared data folder is missing; set ALHAZEN_SHARED to it";
        skip(test_name, why, skips_are_forbidden(&["1"]));
    }
    dir
}

/// For a test that needs a GPU that is not there: says on stderr that `test_name` is skipped, and `why` (what was looked
/// for, and why each device did not do).
///
/// # Panics
/// When the environment variable `ALHAZEN_FORBID_SKIPS` is `1` (no test may be skipped) or `gpu` (no test that needs a
/// GPU may be).
pub fn skip_without_gpu(test_name: &str, why: &str) {
    skip(test_name, why, skips_are_forbidden(&["1", "gpu"]));
}

/// For a test that needs a program that is not there: says on stderr that `test_name` is skipped, and `why`.
///
/// # Panics
/// When the environment variable `ALHAZEN_FORBID_SKIPS` is `1`, as in continuous integration.
pub fn skip_without_tool(test_name: &str, why: &str) {
    skip(test_name, why, skips_are_forbidden(&["1"]));
}

fn skips_are_forbidden(values: &[&str]) -> bool {
    std::env::var_os("ALHAZEN_FORBID_SKIPS").is_some_and(|v| values.iter().any(|value| v == *value))
}

fn skip(test_name: &str, why: &str, forbidden: bool) {
    assert!(!forbidden, "{test_name} must not be skipped, but {why}");
    let _ = writeln!(std::io::stderr(), "skipped: {test_name}: {why}"); // a lost message is no failure
}

/// Where a failing test called `name` leaves its pictures: a folder of that name in `ALHAZEN_TEST_OUT`, or else in
/// `target/test-failures`. It may not exist yet.
#[must_use]
pub fn output_dir(name: &str) -> PathBuf {
    let base = std::env::var_os("ALHAZEN_TEST_OUT").map(PathBuf::from);
    let safe = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    base.unwrap_or_else(|| repository_root().join("target/test-failures"))
        .join(name.chars().map(safe).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_has_a_workspace() {
        let manifest = std::fs::read_to_string(repository_root().join("Cargo.toml")).unwrap();
        assert!(manifest.contains("[workspace]"));
    }

    #[test]
    fn names_of_tests_become_names_of_folders() {
        assert!(output_dir("a::b/../c d").ends_with("a--b-..-c-d"));
    }

    #[test]
    fn skips_are_allowed_by_default() {
        skip("this_test", "it only tests the message", false);
    }

    #[test]
    #[should_panic(expected = "this_test must not be skipped")]
    fn skips_can_be_forbidden() {
        skip("this_test", "it only tests the message", true);
    }
}
