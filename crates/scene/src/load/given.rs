//! Files that a program has as bytes, by the names that scenes call them.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Files in memory: of a page in a browser, which has no others, or out of an archive. They come before those on disk.
///
/// Clones share the bytes.
#[derive(Clone, Debug, Default)]
pub struct GivenFiles(BTreeMap<PathBuf, Arc<[u8]>>);

impl GivenFiles {
    /// Adds a file, or replaces the one that has this name. `name` may have folders, such as `textures/wood.png`.
    pub fn add(&mut self, name: impl AsRef<Path>, bytes: impl Into<Arc<[u8]>>) {
        self.0.insert(plain(name.as_ref()), bytes.into());
    }

    /// Names of all files, in order.
    pub fn names(&self) -> impl Iterator<Item = &Path> {
        self.0.keys().map(PathBuf::as_path)
    }

    /// The bytes of a file. Of files that came without their folders, as those that are dropped on a page, the one that has
    /// the last part of the name, if no other has it, too.
    pub(super) fn find(&self, path: &Path) -> Option<&[u8]> {
        let path = plain(path);
        if let Some(bytes) = self.0.get(&path) {
            return Some(bytes);
        }
        let last = path.file_name()?;
        let mut alike = self.0.iter().filter(|(name, _)| {
            let is_loose = name.components().count() == 1;
            is_loose && name.file_name().is_some_and(|name| name.eq_ignore_ascii_case(last))
        });
        let (_, bytes) = alike.next()?;
        alike.next().is_none().then_some(bytes)
    }
}

/// The name without `.`, and without folders that `..` leaves again.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => drop(plain.pop()),
            part => plain.push(part),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LoadError, LoadOptions};

    fn given(files: &[(&str, &[u8])]) -> GivenFiles {
        let mut given = GivenFiles::default();
        files.iter().for_each(|(name, bytes)| given.add(name, *bytes));
        given
    }

    #[test]
    fn names_are_found_however_they_are_written() {
        let files = given(&[("model/./a.bin", b"a"), ("Wood.PNG", b"w")]);
        assert_eq!(files.find(Path::new("model/tex/../a.bin")), Some(&b"a"[..]));
        assert_eq!(files.find(Path::new("textures/wood.png")), Some(&b"w"[..]), "it came without its folder");
        assert_eq!(files.find(Path::new("other/a.bin")), None, "that one has a folder, and it is another");
        let two = given(&[("wood.png", b"1"), ("WOOD.png", b"2")]);
        assert_eq!(two.find(Path::new("t/Wood.png")), None, "which of the two?");
    }

    #[test]
    fn scenes_are_loaded_from_memory() {
        let obj = b"mtllib look.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let mtl = b"newmtl red\nKd 1 0 0\n";
        let given_files = given(&[("no such folder/a.obj", obj), ("no such folder/look.mtl", mtl)]);
        let options = LoadOptions { given_files, ..LoadOptions::default() };
        let loaded = crate::load::load(Path::new("no such folder/a.obj"), &options).expect("it was given");
        assert_eq!(loaded.scene.materials[0].name, "red");
        let missing = crate::load::load(Path::new("no such folder/b.obj"), &options);
        assert!(matches!(missing, Err(LoadError::Read { .. })), "{missing:?}");
        let small = LoadOptions { max_file_size: 10, ..options };
        let large = crate::load::load(Path::new("no such folder/a.obj"), &small);
        assert!(matches!(large, Err(LoadError::TooLarge { .. })), "{large:?}");
    }
}
