//! Writing what was rendered: the file name's ending decides the format.

use crate::ToneMapping;
use film::{ExrCompression, ExrFile, Precision};
use film::{Film, ImageError};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// No writer knows the ending.
    #[error("{path}: unknown picture format; known are .png, .exr and .hdr")]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file could not be encoded or written.
    #[error("cannot write the picture")]
    Image(#[from] ImageError),
}

/// Formats that [`write()`] knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Eight bits, tone mapped.
    Png,
    /// Linear radiance, all layers, settings as metadata.
    Exr,
    /// Linear radiance, shared exponent.
    Hdr,
}

impl Format {
    /// The format that a file name asks for.
    ///
    /// # Errors
    /// [`OutputError::UnknownFormat`].
    pub fn of(path: &Path) -> Result<Self, OutputError> {
        match path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase().as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            "hdr" => Ok(Self::Hdr),
            _ => Err(OutputError::UnknownFormat { path: path.to_owned() }),
        }
    }
}

/// Writes the film: complete, or not at all; an existing file is replaced only by a complete one.
///
/// `metadata` goes into EXR files as it is.
///
/// # Errors
/// See [`OutputError`].
pub fn write(
    path: &Path,
    film: &Film,
    tone: &ToneMapping,
    metadata: &BTreeMap<String, String>,
) -> Result<(), OutputError> {
    match Format::of(path)? {
        Format::Png => tone.apply(&film.to_image()).write_png_encoded(path)?,
        Format::Hdr => film.to_image().write_hdr(path)?,
        Format::Exr => {
            let file = ExrFile::from_film(film, Precision::Float);
            let file = metadata.iter().fold(file, |f, (k, v)| f.with_metadata(k, v));
            file.write(path, ExrCompression::Zip)?;
        }
    }
    Ok(())
}
