//! What `deny.toml` allows is what `Cargo.lock` has: licences and sources, checked without any tool but cargo.

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
