//! The licences of what is linked: most ask for their text to go with the program.

use super::platform::{APPLE_TARGETS, Platform};
use crate::shell::{cargo, output};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Words that names of files with licences begin with.
const NAMES: [&str; 6] = ["licen", "copying", "copyright", "notice", "unlicense", "ofl"];

/// The licences of all crates that `package`, `cli` or `python`, is made of on a platform, with their texts.
///
/// # Errors
/// If cargo fails, or a crate has no licence.
pub fn text(platform: &Platform, package: &str) -> anyhow::Result<String> {
    let crates = linked(platform, package)?;
    let folders = folders()?;
    let mut list = String::new();
    let mut users: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (name, licence) in &crates {
        ensure!(!licence.is_empty(), "{name} has no licence");
        writeln!(list, "  {name}: {licence}")?;
        let Some(folder) = folders.get(name) else { continue };
        for text in texts(folder)? {
            users.entry(text).or_default().push(name.clone());
        }
    }
    ensure!(!users.is_empty(), "no crate has the text of its licence");
    let mut page = format!("Alhazen contains these crates, under these licences:\n\n{list}");
    for (text, names) in users {
        let rule = "-".repeat(80);
        write!(page, "\n{rule}\n{}\n{rule}\n\n{}\n", names.join(", "), text.trim_end())?;
    }
    Ok(page)
}

/// Crates of other people, as `name version`, and their licences.
fn linked(platform: &Platform, package: &str) -> anyhow::Result<BTreeMap<String, String>> {
    let universal = platform.target == "universal2-apple-darwin";
    let target = if universal { APPLE_TARGETS[0] } else { platform.target };
    let mut tree = cargo(&[
        "tree",
        "--locked",
        "--package",
        package,
        "--edges",
        "normal",
        "--prefix",
        "none",
        "--no-dedupe",
    ]);
    tree.args(["--format", "{p}|{l}", "--target", target]);
    if package == "cli" && !platform.has_window {
        tree.arg("--no-default-features");
    }
    let lines = output(&mut tree)?;
    Ok(lines.lines().filter_map(parse).collect())
}

/// A line of the tree; none for crates of the workspace, which have a path.
fn parse(line: &str) -> Option<(String, String)> {
    let (package, licence) = line.split_once('|')?;
    let mut words = package.split_whitespace();
    let (name, version) = (words.next()?, words.next()?.strip_prefix('v')?);
    let is_ours = words.any(|word| word.starts_with("(/") || word.contains(":\\"));
    (!is_ours).then(|| (format!("{name} {version}"), licence.trim().to_owned()))
}

/// Where the sources of all crates of the lock file lie.
fn folders() -> anyhow::Result<BTreeMap<String, PathBuf>> {
    let metadata = output(&mut cargo(&["metadata", "--locked", "--format-version", "1"]))?;
    let metadata: Value = serde_json::from_str(&metadata).context("cargo metadata")?;
    let packages = metadata["packages"].as_array().context("cargo metadata has no packages")?;
    let folder = |package: &Value| {
        let name = format!("{} {}", package["name"].as_str()?, package["version"].as_str()?);
        Some((name, Path::new(package["manifest_path"].as_str()?).parent()?.to_owned()))
    };
    Ok(packages.iter().filter_map(folder).collect())
}

/// The licences that lie beside a crate's manifest.
fn texts(folder: &Path) -> anyhow::Result<BTreeSet<String>> {
    let mut texts = BTreeSet::new();
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().to_lowercase();
        if NAMES.iter().any(|begin| name.starts_with(begin)) && entry.path().is_file() {
            let bytes = std::fs::read(entry.path())?;
            texts.insert(String::from_utf8_lossy(&bytes).replace("\r\n", "\n").trim().to_owned());
        }
    }
    texts.remove("");
    Ok(texts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_tree_are_understood() {
        let crates = [
            "memchr v2.7.4|Unlicense OR MIT",
            "serde_derive v1.0.1 (proc-macro)|MIT OR Apache-2.0",
            "optics v0.1.0 (/home/a/alhazen/crates/optics)|MIT",
            "optics v0.1.0 (C:\\a\\alhazen\\crates\\optics)|MIT",
            "",
        ]
        .map(parse);
        let name = |found: &Option<(String, String)>| found.as_ref().map(|(name, _)| name.clone());
        assert_eq!(crates[0], Some(("memchr 2.7.4".into(), "Unlicense OR MIT".into())));
        assert_eq!(name(&crates[1]).as_deref(), Some("serde_derive 1.0.1"));
        assert_eq!(crates[2..], [None, None, None]);
    }

    #[test]
    fn licences_are_found_by_their_names() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in
            [("LICENSE-MIT", "MIT\r\n"), ("COPYING", "MIT"), ("lib.rs", "code"), ("NOTICE", "")]
        {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        assert_eq!(texts(folder.path()).unwrap(), BTreeSet::from(["MIT".to_owned()]));
    }
}
