//! Where code comes from: what `deny.toml` allows is what `Cargo.lock` has, checked without any tool but cargo; actions and
//! compilers of workflows are pinned, and every fuzz target runs.

use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The entries of a list of texts in `deny.toml`, which has one to a line or all in one.
fn list(key: &str) -> BTreeSet<String> {
    let text = std::fs::read_to_string(root().join("deny.toml")).expect("deny.toml");
    let (_, rest) = text.split_once(&format!("\n{key} = [")).unwrap_or_else(|| panic!("no {key}"));
    let (list, _) = rest.split_once(']').expect("an end");
    list.split(',').map(|t| t.trim().trim_matches('"').to_owned()).filter(|t| !t.is_empty()).collect()
}

/// Whether an SPDX expression can be met with the licences that are allowed. `OR` binds weaker than `AND`; the slash that
/// older crates write means `OR`.
fn is_met(expression: &str, allowed: &BTreeSet<String>) -> bool {
    fn split<'a>(text: &'a str, word: &str) -> Vec<&'a str> {
        let (mut parts, mut start, mut depth) = (Vec::new(), 0, 0);
        for (at, letter) in text.char_indices() {
            match letter {
                '(' => depth += 1,
                ')' => depth -= 1,
                _ if depth == 0 && at >= start && text[at..].starts_with(word) => {
                    parts.push(text[start..at].trim());
                    start = at + word.len();
                }
                _ => {}
            }
        }
        parts.push(text[start..].trim());
        parts
    }
    let text = expression.replace('/', " OR ");
    fn met(text: &str, allowed: &BTreeSet<String>) -> bool {
        let alternatives = split(text, " OR ");
        if alternatives.len() > 1 {
            return alternatives.iter().any(|text| met(text, allowed));
        }
        let all = split(text, " AND ");
        if all.len() > 1 {
            return all.iter().all(|text| met(text, allowed));
        }
        match text.strip_prefix('(').and_then(|text| text.strip_suffix(')')) {
            Some(inner) => met(inner, allowed),
            None => allowed.contains(text),
        }
    }
    met(&text, allowed)
}

#[test]
fn expressions_are_understood() {
    let allowed = BTreeSet::from(["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"].map(str::to_owned));
    for good in [
        "MIT",
        "GPL-3.0 OR MIT",
        "MIT/GPL-3.0",
        "Zlib AND (GPL-3.0 OR MIT)",
        "Apache-2.0 WITH LLVM-exception",
    ] {
        assert!(is_met(good, &allowed), "{good}");
    }
    for bad in ["GPL-3.0", "MIT AND GPL-3.0", "Apache-2.0", "Zlib AND (GPL-3.0 OR ISC)", ""] {
        assert!(!is_met(bad, &allowed), "{bad}");
    }
}

#[test]
fn every_crate_has_a_licence_and_a_source_that_are_allowed() {
    let (licences, registries) = (list("allow"), list("allow-registry"));
    assert!(licences.contains("MIT") && registries.len() == 1);
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("a list");
    assert!(packages.len() > 100, "only {} packages", packages.len());
    for package in packages {
        let name = format!("{} {}", package["name"], package["version"]);
        let licence = package["license"].as_str().unwrap_or_default();
        assert!(is_met(licence, &licences), "{name}: `{licence}` is not allowed by deny.toml");
        let Some(source) = package["source"].as_str() else { continue }; // ours
        let registry = source.strip_prefix("registry+").unwrap_or_default();
        assert!(registries.contains(registry), "{name}: {source} is not allowed by deny.toml");
    }
}

/// The workflows of GitHub, by name.
fn workflows() -> Vec<(String, String)> {
    let folder = root().join(".github/workflows");
    let entries = std::fs::read_dir(folder).expect("workflows").map(|e| e.expect("readable").path());
    let read = |path: PathBuf| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        (name, std::fs::read_to_string(path).expect("text"))
    };
    entries.map(read).collect()
}

/// Lines of a workflow that use an action of somebody else without its commit, or without its version as a comment.
fn unpinned(workflow: &str) -> Vec<&str> {
    let is_pinned = |action: &str| {
        let (action, comment) = action.split_once(" # ").unwrap_or((action, ""));
        let (name, commit) = action.trim().split_once('@').unwrap_or((action, ""));
        let is_commit = commit.len() == 40 && commit.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
        let is_version = comment
            .strip_prefix('v')
            .is_some_and(|v| v.split('.').all(|number| number.parse::<u32>().is_ok()));
        // A workflow of this repository is of the same commit.
        name.starts_with("./") || (name.contains('/') && is_commit && is_version)
    };
    let uses = |line: &&str| {
        let line = line.trim_start().trim_start_matches("- ");
        line.strip_prefix("uses:").is_some_and(|action| !is_pinned(action.trim()))
    };
    workflow.lines().filter(uses).map(str::trim).collect()
}

#[test]
fn actions_are_pinned_by_commit() {
    let mut count = 0;
    for (name, workflow) in workflows() {
        assert_eq!(unpinned(&workflow), [""; 0], "in {name}");
        count += workflow.matches("uses:").count();
    }
    assert!(count > 10, "only {count} actions");
}

#[test]
fn actions_that_are_not_pinned_are_noticed() {
    let commit = "0123456789abcdef0123456789abcdef01234567";
    for good in ["uses: ./.github/workflows/ci.yml".to_owned(), format!("- uses: a/b@{commit} # v1.2.3")] {
        assert_eq!(unpinned(&good), [""; 0], "{good}");
    }
    for bad in [
        "- uses: a/b@v4".to_owned(),
        format!("uses: a/b@{commit}"),
        format!("  - uses: a/b@{commit} # main"),
        format!("uses: a/b@{} # v1", &commit[1..]),
        format!("uses: a/b@{} # v1", commit.to_uppercase()),
        "uses: a/b".to_owned(),
    ] {
        assert_eq!(unpinned(&bad), [bad.trim()], "{bad}");
    }
}

/// One action has one commit in all workflows.
#[test]
fn workflows_agree_about_versions_of_actions() {
    let mut commits = std::collections::BTreeMap::new();
    for (file, workflow) in workflows() {
        for action in
            workflow.lines().filter_map(|line| line.split_once("uses:")).map(|(_, action)| action.trim())
        {
            let Some((name, commit)) = action.split_once('@') else { continue };
            let first = commits.entry(name.to_owned()).or_insert_with(|| commit.to_owned());
            assert_eq!(first, commit, "{name} in {file}");
        }
    }
}

/// Whoever may write into a checkout, publish or sign says so for a single job.
#[test]
fn workflows_may_only_read_unless_a_job_says_otherwise() {
    for (name, workflow) in workflows() {
        let head = workflow.split("\njobs:").next().expect("text");
        assert!(head.contains("\npermissions:\n  contents: read\n"), "{name} has the default permissions");
        assert!(!head.contains(": write"), "{name} may write everywhere");
        assert!(!workflow.contains("secrets."), "{name} reads a secret; trusted publishing needs none");
        assert!(!workflow.contains("pull_request_target"), "{name} runs strangers' changes with rights");
        let checkouts = workflow.matches("uses: actions/checkout@").count();
        let without = workflow.matches("persist-credentials: false").count();
        assert_eq!(checkouts, without, "{name} leaves a token in a checkout");
    }
}

#[test]
fn deny_runs_for_the_workspace_and_for_fuzzing() {
    let (_, workflow) = workflows().into_iter().find(|(name, _)| name == "ci.yml").expect("ci.yml");
    assert!(workflow.contains("cargo install --locked cargo-deny --version "));
    assert!(workflow.contains("cargo deny --locked check\n"));
    assert!(workflow.contains("cargo deny --locked --manifest-path fuzz/Cargo.toml check "));
}

/// Names of the fuzz targets: `fuzz/Cargo.toml` has a `[[bin]]` for each.
fn fuzz_targets() -> BTreeSet<String> {
    let manifest = std::fs::read_to_string(root().join("fuzz/Cargo.toml")).expect("fuzz/Cargo.toml");
    let tables = manifest.split("[[bin]]").skip(1);
    let name = |table: &str| {
        let line = table.lines().find_map(|line| line.strip_prefix("name = "));
        line.expect("a name").trim_matches('"').to_owned()
    };
    tables.map(name).collect()
}

#[test]
fn every_fuzz_target_runs_every_week() {
    let (_, workflow) = workflows().into_iter().find(|(name, _)| name == "fuzz.yml").expect("fuzz.yml");
    let (_, list) = workflow.split_once("        target:\n").expect("a list of targets");
    let items = list.lines().map_while(|line| line.strip_prefix("          - "));
    let listed: BTreeSet<String> = items.map(str::to_owned).collect();
    assert!(listed.len() > 10, "only {listed:?}");
    assert_eq!(listed, fuzz_targets());
    assert!(workflow.contains("schedule:") && workflow.contains("|| '1800'"), "half an hour a week");
    assert!(workflow.contains("--sanitizer address"));
    for target in fuzz_targets() {
        let seeds = root().join("fuzz/seeds").join(&target).read_dir();
        assert!(seeds.is_ok_and(|mut seeds| seeds.next().is_some()), "{target} has nothing to begin from");
    }
}

#[test]
fn the_compiler_of_releases_and_of_fuzzing_is_pinned() {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).expect("Cargo.toml");
    let oldest =
        manifest.lines().find_map(|line| line.strip_prefix("rust-version = ")).expect("rust-version");
    let oldest = oldest.trim_matches('"');
    let workflows = workflows();
    let toolchain = |name: &str| {
        let (_, text) = workflows.iter().find(|(file, _)| file == name).expect("the workflow");
        let line = text.lines().find_map(|line| line.trim().strip_prefix("TOOLCHAIN: ")).expect("TOOLCHAIN");
        line.trim_matches('"').to_owned()
    };
    assert!(toolchain("release.yml").starts_with(&format!("{oldest}.")), "not {oldest}");
    let nightly = toolchain("fuzz.yml");
    assert!(nightly.strip_prefix("nightly-20").is_some_and(|date| date.split('-').count() == 3), "{nightly}");
}
