//! Crates as Flatpak's builder fetches them: it has no network while it compiles.

use anyhow::Context;
use serde_json::{Value, json};

/// The list of sources for a Flatpak manifest, of the crates that `lock`, a `Cargo.lock`, names.
///
/// Cargo finds them through the configuration file at the end of the list, in `cargo/config.toml`.
///
/// # Errors
/// If the text is no lock file, or a crate comes from somewhere else than crates.io.
pub fn sources(lock: &str) -> anyhow::Result<Value> {
    let lock: toml::Table = toml::from_str(lock).context("no lock file")?;
    let packages = lock.get("package").and_then(|list| list.as_array()).context("no packages")?;
    let mut sources = Vec::new();
    for package in packages {
        let field = |name: &str| package.get(name).and_then(|value| value.as_str());
        if field("source").is_none() {
            continue; // ours
        }
        let name = field("name").context("a package without a name")?;
        let version = field("version").with_context(|| format!("{name} has no version"))?;
        let sum = field("checksum").with_context(|| format!("{name} {version} is not of a registry"))?;
        let place = format!("cargo/vendor/{name}-{version}");
        sources.push(json!({
            "type": "archive",
            "archive-type": "tar-gzip",
            "url": format!("https://static.crates.io/crates/{name}/{name}-{version}.crate"),
            "sha256": sum,
            "dest": place,
        }));
        sources.push(json!({
            "type": "inline",
            "contents": json!({ "package": sum, "files": {} }).to_string(),
            "dest": place,
            "dest-filename": ".cargo-checksum.json",
        }));
    }
    let configuration = "[source.crates-io]\nreplace-with = \"vendored-sources\"\n\n\
                         [source.vendored-sources]\ndirectory = \"cargo/vendor\"\n";
    sources.push(json!({
        "type": "inline",
        "contents": configuration,
        "dest": "cargo",
        "dest-filename": "config.toml",
    }));
    Ok(Value::Array(sources))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crates_have_an_address_and_a_checksum() {
        let lock = std::fs::read_to_string(crate::shell::root().join("Cargo.lock")).unwrap();
        let sources = sources(&lock).unwrap();
        let list = sources.as_array().unwrap();
        let count = lock.matches("\nchecksum = ").count();
        assert!(count > 100 && list.len() == 2 * count + 1, "{} of {count}", list.len());
        let clap =
            list.iter().find(|s| s["dest"].as_str().unwrap().starts_with("cargo/vendor/clap-")).unwrap();
        assert!(clap["url"].as_str().unwrap().starts_with("https://static.crates.io/crates/clap/clap-4."));
        assert_eq!(clap["sha256"].as_str().unwrap().len(), 64);
    }

    #[test]
    fn crates_of_other_places_are_refused() {
        let lock = "[[package]]\nname = \"a\"\nversion = \"1.0.0\"\nsource = \"git+https://example.org/a\"\n";
        assert!(sources(lock).unwrap_err().to_string().contains("a 1.0.0"));
        assert!(sources("[[package]").is_err());
    }
}
