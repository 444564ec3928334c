//! Scene files that include each other: where each one is, and what all of them may take together.

use std::path::{Path, PathBuf};

/// Scene files may refer to scene files this deep.
pub(super) const MAX_DEPTH: usize = 8;
/// Instances that one scene file may place, repeats and included files counted.
pub(super) const MAX_INSTANCES: usize = 4_000_000;
/// Triangles that the shapes of one scene file may have together, included files counted.
pub(super) const MAX_TRIANGLES: usize = 100_000_000;
/// Files that one scene file may load, included files counted.
pub(super) const MAX_FILES: usize = 10_000;

/// What is left of the limits on a scene file and everything that it includes.
pub(super) struct Budget {
    pub instances: usize,
    pub triangles: usize,
    pub files: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Self { instances: MAX_INSTANCES, triangles: MAX_TRIANGLES, files: MAX_FILES }
    }
}

/// Where a scene file is, and which files it was included from.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub path: &'a Path,
    pub folder: &'a Path,
    pub stack: &'a [PathBuf],
}

/// The path as the system sees it; as given if there is no such file.
pub(super) fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}
