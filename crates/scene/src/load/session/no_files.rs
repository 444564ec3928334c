//! In the place of `confinement` where programs have no files of their own, as in browsers: whoever has a scene there has
//! its bytes.

use super::Budget;
use crate::LoadError;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock};

/// The files that a session may read: none.
#[derive(Debug)]
pub(super) struct Confinement {
    /// What the user calls the files of a scene.
    named: RwLock<Vec<PathBuf>>,
}

impl Confinement {
    /// For the scene that the user `named`.
    pub fn new(named: &Path, _allowed: &[PathBuf]) -> Self {
        Self { named: RwLock::new(vec![named.to_owned()]) }
    }

    /// Adds a file that the user named.
    pub fn name(&self, file: &Path) {
        self.call(file);
    }

    /// Adds a name of a file that the user named.
    pub fn call(&self, name: &Path) {
        self.named.write().unwrap_or_else(PoisonError::into_inner).push(name.to_owned());
    }

    /// The content of a file.
    ///
    /// # Errors
    /// [`LoadError::Read`]: there are no files.
    pub fn read(&self, path: &Path, _limit: u64, _budget: &Budget) -> Result<Vec<u8>, LoadError> {
        let source = io::Error::new(io::ErrorKind::Unsupported, "there are no files here");
        Err(LoadError::Read { path: path.to_owned(), source })
    }

    /// Whether [`Confinement::read`] would find a regular file.
    pub fn is_file(&self, _path: &Path) -> bool {
        false
    }

    /// The file of this name that the scene may not read.
    pub fn elsewhere(&self, _path: &Path) -> Option<PathBuf> {
        None
    }

    /// The canonical path of a folder whose entries the scene may learn.
    pub fn folder(&self, _path: &Path) -> Option<PathBuf> {
        None
    }

    /// Whether this is a file that the user named.
    pub fn is_named(&self, path: &Path) -> bool {
        self.named.read().unwrap_or_else(PoisonError::into_inner).iter().any(|named| named == path)
    }
}
