//! Text files that are written whole or not at all.

use alhazen::{ImageError, write_atomically};
use std::io::Write;
use std::path::Path;

/// Writes a file. On a full disk nothing is left of it, and what was there stays.
///
/// # Errors
/// Those of [`write_atomically`].
pub fn write(path: &Path, text: &str) -> Result<(), ImageError> {
    write_atomically(path, |writer| {
        let failed = |source| ImageError::Write { path: path.to_owned(), source };
        writer.write_all(text.as_bytes()).map_err(failed)
    })
}
