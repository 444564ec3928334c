//! Names in folders, each folder read once: a scene may name thousands of files whose case is wrong.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Of larger folders the rest is not looked at.
const MAX_ENTRIES: usize = 100_000;

/// Entries of folders by their names in small letters.
#[derive(Debug, Default)]
pub(super) struct Listings(Mutex<HashMap<PathBuf, Arc<HashMap<String, OsString>>>>);

impl Listings {
    /// The entry of a folder that is called `name` but for the case of letters; the first one in order of names.
    pub fn find(&self, folder: &Path, name: &str) -> Option<OsString> {
        let mut known = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let listing = known.entry(folder.to_owned()).or_insert_with(|| Arc::new(list(folder))).clone();
        drop(known);
        listing.get(&name.to_lowercase()).cloned()
    }
}

fn list(folder: &Path) -> HashMap<String, OsString> {
    let mut names: Vec<OsString> = std::fs::read_dir(folder)
        .map(|entries| entries.take(MAX_ENTRIES).filter_map(Result::ok).map(|e| e.file_name()).collect())
        .unwrap_or_default();
    names.sort(); // the order of a folder's entries is the file system's affair
    let mut listing = HashMap::new();
    for name in names {
        listing.entry(name.to_string_lossy().to_lowercase()).or_insert(name);
    }
    listing
}
