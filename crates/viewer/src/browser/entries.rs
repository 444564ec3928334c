//! What is in a folder.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A file or a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its name, with replacements for what is no Unicode.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
    /// Whether it is a folder, or a link to one.
    pub is_folder: bool,
    /// Its size; 0 of folders.
    pub bytes: u64,
    /// When it was last written, where the system knows.
    pub modified: Option<SystemTime>,
}

impl Entry {
    /// Whether it is hidden, as Unix has it.
    pub fn is_hidden(&self) -> bool {
        self.name.starts_with('.')
    }

    /// Whether its name ends as one of `endings`, which are in lower case and without a dot.
    pub fn ends_as(&self, endings: &[&str]) -> bool {
        let ending = self.path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        endings.iter().any(|known| known.eq_ignore_ascii_case(ending))
    }
}

/// All entries of a folder: folders first, then files, by name. What vanishes meanwhile is left
/// out.
///
/// # Errors
/// When the system does not show the folder.
pub fn list(folder: &Path) -> std::io::Result<Vec<Entry>> {
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let Ok(data) = std::fs::metadata(&path) else { continue };
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let is_folder = data.is_dir();
        let bytes = if is_folder { 0 } else { data.len() };
        entries.push(Entry { name, path, is_folder, bytes, modified: data.modified().ok() });
    }
    entries.sort_by(|a, b| b.is_folder.cmp(&a.is_folder).then_with(|| by_name(&a.name, &b.name)));
    Ok(entries)
}

/// Orders names as people count: without regard to case, and `frame-9` before `frame-10`.
fn by_name(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.chars().peekable(), b.chars().peekable());
    loop {
        let (Some(&l), Some(&r)) = (left.peek(), right.peek()) else {
            return left.peek().is_some().cmp(&right.peek().is_some()).then_with(|| a.cmp(b));
        };
        let order = if l.is_ascii_digit() && r.is_ascii_digit() {
            let [l, r] = [&mut left, &mut right].map(number);
            l.len().cmp(&r.len()).then_with(|| l.cmp(&r))
        } else {
            left.next();
            right.next();
            l.to_lowercase().cmp(r.to_lowercase())
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

/// The digits that come next, without zeros in front.
fn number(text: &mut std::iter::Peekable<std::str::Chars<'_>>) -> String {
    let mut digits = String::new();
    while let Some(digit) = text.next_if(char::is_ascii_digit) {
        if digit != '0' || !digits.is_empty() {
            digits.push(digit);
        }
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_come_first_and_names_are_in_order() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["b.obj", "frame-10.png", "Frame-9.png", "frame-010.png", "a.txt", ".hidden"] {
            std::fs::write(folder.path().join(name), "1234").expect("written");
        }
        for name in ["zoo", "Art"] {
            std::fs::create_dir(folder.path().join(name)).expect("made");
        }
        let entries = list(folder.path()).expect("listed");
        let names: Vec<&str> = entries.iter().map(|e| e.name.as_str()).collect();
        let expected =
            ["Art", "zoo", ".hidden", "a.txt", "b.obj", "Frame-9.png", "frame-010.png", "frame-10.png"];
        assert_eq!(names, expected);
        assert_eq!((entries[0].bytes, entries[4].bytes), (0, 4));
        assert!(entries[4].ends_as(&["gltf", "obj"]) && !entries[3].ends_as(&["gltf", "obj"]));
        assert!(entries[2].is_hidden() && entries[0].is_folder);
    }

    #[test]
    fn folders_that_are_not_there_are_an_error() {
        assert!(list(Path::new("/no/such/folder")).is_err());
    }
}
