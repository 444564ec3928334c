//! `SHA256SUMS`: what `sha256sum --check` reads.

use anyhow::{Context, ensure};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// The name of the list.
pub const FILE: &str = "SHA256SUMS";

/// The SHA-256 of a file, in hexadecimal.
pub fn of_file(path: &Path) -> anyhow::Result<String> {
    let mut file = std::fs::File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut hash).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(hash.finalize().iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("texts can be written to");
        text
    }))
}

/// Writes the list of all files that lie in `folder` itself.
///
/// # Errors
/// If there is none, or one cannot be read.
pub fn write(folder: &Path) -> anyhow::Result<()> {
    let mut lines = BTreeMap::new();
    for entry in std::fs::read_dir(folder).with_context(|| format!("no folder {}", folder.display()))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.file_type()?.is_file() && name != FILE {
            lines.insert(name, of_file(&entry.path())?);
        }
    }
    ensure!(!lines.is_empty(), "{} has no files", folder.display());
    let text = lines.iter().fold(String::new(), |text, (name, sum)| text + sum + "  " + name + "\n");
    std::fs::write(folder.join(FILE), text).context("cannot write SHA256SUMS")
}

/// The list in `folder`: from names to sums.
///
/// # Errors
/// If there is none, or a line is not `SUM  NAME`.
pub fn read(folder: &Path) -> anyhow::Result<BTreeMap<String, String>> {
    let path = folder.join(FILE);
    let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let parse = |line: &str| {
        let (sum, name) = line.split_once("  ")?;
        let is_sum = sum.len() == 64 && sum.bytes().all(|b| b.is_ascii_hexdigit());
        is_sum.then(|| (name.to_owned(), sum.to_owned()))
    };
    text.lines().map(|line| parse(line).with_context(|| format!("not a checksum: {line}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_written_and_read() {
        let folder = tempfile::tempdir().unwrap();
        assert!(write(folder.path()).is_err(), "nothing to list");
        std::fs::write(folder.path().join("b"), b"").unwrap();
        std::fs::write(folder.path().join("a"), b"abc").unwrap();
        write(folder.path()).unwrap();
        write(folder.path()).unwrap(); // the list is not part of itself
        let list = read(folder.path()).unwrap();
        // FIPS 180-4's example, and that of the empty text.
        assert_eq!(list["a"], "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_eq!(list["b"], "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
        assert_eq!(list.len(), 2);
        std::fs::write(folder.path().join(FILE), "short  a\n").unwrap();
        assert!(read(folder.path()).is_err());
    }
}
