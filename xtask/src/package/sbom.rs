//! The software bill of materials: CycloneDX, by `cargo cyclonedx`.

use super::VERSION;
use crate::shell::{cargo, output, root, run as run_command};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The version of cargo-cyclonedx that releases use.
pub const TOOL: &str = "0.5.9";

/// What is described: the crate of the program and the one of the wheel, and what the files are called.
const CRATES: [(&str, &str); 2] = [("cli", "alhazen"), ("python", "alhazen-python")];

/// The files' names.
pub fn files() -> [String; 2] {
    CRATES.map(|(_, name)| format!("{name}-{VERSION}.cdx.json"))
}

/// Whether the tool is installed.
pub fn is_there() -> bool {
    output(&mut cargo(&["cyclonedx", "--version"])).is_ok()
}

/// Writes the bills to `folder`, of what the lock file has for all targets.
///
/// # Errors
/// If the tool is missing or fails, or a bill lists nothing.
pub fn make(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    ensure!(is_there(), "needs `cargo install --locked cargo-cyclonedx --version {TOOL}`");
    // The tool writes a file beside the manifest of every member. The name is one that no other file has.
    let name = format!("sbom-{}.tmp", std::process::id());
    let written = run_command(&mut cargo(&[
        "cyclonedx",
        "--format",
        "json",
        "--spec-version",
        "1.5",
        "--target",
        "all",
        "--all-features",
        "--override-filename",
        &name,
    ]));
    let moved = written.and_then(|()| {
        let places = CRATES.iter().zip(files());
        places.map(|((member, _), file)| keep(&written_for(member, &name), &folder.join(file))).collect()
    });
    for member in members()? {
        let _ = std::fs::remove_file(written_for(&member, &name)); // those that were moved are gone
    }
    moved
}

/// Where the tool writes the bill of a member.
fn written_for(member: &str, name: &str) -> PathBuf {
    let folder = if member == "xtask" { root().join(member) } else { root().join("crates").join(member) };
    folder.join(format!("{name}.json"))
}

fn members() -> anyhow::Result<Vec<String>> {
    let entries = std::fs::read_dir(root().join("crates")).context("no crates")?;
    let crates = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned());
    Ok(crates.chain(["xtask".into()]).collect())
}

/// Moves a bill to its place.
fn keep(from: &Path, to: &Path) -> anyhow::Result<PathBuf> {
    let text = std::fs::read_to_string(from).with_context(|| format!("no bill {}", from.display()))?;
    let count = components(&text)?;
    ensure!(count > 0, "{} lists nothing", from.display());
    std::fs::write(to, text).with_context(|| format!("cannot write {}", to.display()))?;
    eprintln!("{}: {count} components", to.display());
    Ok(to.to_owned())
}

/// How many components a bill lists.
fn components(text: &str) -> anyhow::Result<usize> {
    let bill: Value = serde_json::from_str(text).context("not JSON")?;
    ensure!(bill["bomFormat"] == "CycloneDX", "not CycloneDX");
    Ok(bill["components"].as_array().map_or(0, Vec::len))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bills_are_recognised() {
        assert_eq!(components(r#"{"bomFormat": "CycloneDX", "components": [{}, {}]}"#).unwrap(), 2);
        assert!(components(r#"{"bomFormat": "SPDX"}"#).is_err());
        assert!(components("").is_err());
    }

    #[test]
    fn members_are_found() {
        let members = members().unwrap();
        assert!(CRATES.iter().all(|(member, _)| members.iter().any(|m| m == member)), "{members:?}");
    }
}
