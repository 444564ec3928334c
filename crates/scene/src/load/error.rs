//! Why a scene could not be loaded.

use super::wording;
use crate::report::{plain, without_quotes};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Why a scene could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file could not be opened or read.
    #[error("cannot read {}", shown(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// No loader knows the file name's ending.
    #[error(
        "{}: unknown file type; known are .obj, .gltf, .glb, .pbrt, .ply, .stl, .alhazen and .toml scene files",
        shown(path)
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file is larger than [`crate::LoadOptions::max_file_size`] or asks for more memory than it can fill.
    #[error("{}: {what} is too large ({size} against a limit of {limit})", shown(path))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What is too large.
        what: String,
        /// Its size.
        size: u64,
        /// The limit.
        limit: u64,
    },
    /// The scene takes more memory than [`crate::LoadOptions::max_memory`].
    #[error(
        "{}: with its {what} the scene takes {size} bytes of memory; {limit} are allowed (`--max-memory`)",
        shown(path)
    )]
    OverBudget {
        /// The scene's file.
        path: PathBuf,
        /// What went over the limit, a word in the plural.
        what: String,
        /// What the scene takes with it, in bytes.
        size: u64,
        /// The limit, in bytes.
        limit: u64,
    },
    /// The system has no memory left.
    #[error("{}: there is no memory for {what} of {size} bytes", shown(path))]
    OutOfMemory {
        /// The scene's file.
        path: PathBuf,
        /// What could not be allocated.
        what: String,
        /// Its size in bytes.
        size: u64,
    },
    /// Loading takes longer than [`crate::LoadOptions::max_load_time`].
    #[error("{}: loading takes longer than {limit:?} (`--max-load-time`)", shown(path))]
    TookTooLong {
        /// The scene's file.
        path: PathBuf,
        /// The limit.
        limit: Duration,
    },
    /// The file does not follow its format.
    #[error("{}: {}: {}", shown(path), plain(object), plain(message))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in the file: a line, an object, an accessor.
        object: String,
        /// What is wrong, with the offending value.
        message: String,
    },
    /// The file follows its format, but does not say where the data of something are.
    #[error("{}: {}: the file does not say where its data are", shown(path), plain(object))]
    NoData {
        /// The file.
        path: PathBuf,
        /// What has no data.
        object: String,
    },
    /// There is no built-in scene of this name.
    #[error("there is no built-in scene `{}`; known are {known}", plain(name))]
    UnknownScene {
        /// The name.
        name: String,
        /// The names that there are, separated by commas.
        known: String,
    },
    /// The file has no material variant of the name that was asked for.
    #[error(
        "{}: there is no material variant `{}`; there are: {}",
        shown(path),
        plain(variant),
        plain(known)
    )]
    UnknownVariant {
        /// The file.
        path: PathBuf,
        /// The name.
        variant: String,
        /// The names that there are, separated by commas.
        known: String,
    },
    /// The file requires an extension that is not known.
    #[error(
        "{}: requires the unknown extension {} (try --lenient to render without it)",
        shown(path),
        plain(extension)
    )]
    UnknownExtension {
        /// The file.
        path: PathBuf,
        /// Its name.
        extension: String,
    },
    /// The file's data needs an extension that is known but not supported, such as a compression.
    #[error("{}: {} needs the extension {extension}, which is not supported yet", shown(path), plain(object))]
    UnsupportedExtension {
        /// The file.
        path: PathBuf,
        /// What cannot be read without it.
        object: String,
        /// Its name.
        extension: String,
    },
}

impl LoadError {
    /// A [`LoadError::Malformed`].
    pub fn malformed(path: &Path, object: impl Into<String>, message: impl Into<String>) -> Self {
        let message = wording::without_types(&message.into()).into_owned();
        Self::Malformed { path: path.to_owned(), object: object.into(), message }
    }

    /// The error without what it quotes of a file that the user did not name: whoever wrote the scene chose that file.
    pub(super) fn discreet(self, is_named: impl Fn(&Path) -> bool) -> Self {
        match self {
            Self::Malformed { path, object, message } if !is_named(&path) => {
                let (object, message) = (without_quotes(&object), without_quotes(&message));
                Self::Malformed { path, object, message }
            }
            other => other,
        }
    }
}

/// A path as messages show it.
fn shown(path: &Path) -> String {
    plain(&path.to_string_lossy()).into_owned()
}
