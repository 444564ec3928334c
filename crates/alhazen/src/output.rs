//! Writing what was rendered: the file name's ending decides the format.

use crate::ToneMapping;
use crate::exr_camera::exr_camera;
use crate::metadata::names_in;
use film::{AovData, Film, Image, ImageError};
use film::{ExrCompression, ExrFile, Precision};
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
    /// Eight or sixteen bits, tone mapped.
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

/// How much of a picture its file keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoding {
    /// Bits of colour in EXR files.
    pub exr_precision: Precision,
    /// Compression of EXR files.
    pub exr_compression: ExrCompression,
    /// PNG files with 16 bits a channel instead of 8.
    pub png16: bool,
}

impl Default for Encoding {
    /// EXR with 32 bits and deflate, PNG with 8 bits.
    fn default() -> Self {
        Self { exr_precision: Precision::Float, exr_compression: ExrCompression::Zip, png16: false }
    }
}

/// Writes the film: complete, or not at all; an existing file is replaced only by a complete one.
///
/// `metadata` goes into EXR files as it is; the camera that it names, into the standard attributes as well.
///
/// # Errors
/// See [`OutputError`].
pub fn write(
    path: &Path,
    film: &Film,
    tone: &ToneMapping,
    metadata: &BTreeMap<String, String>,
) -> Result<(), OutputError> {
    write_as(path, film, None, tone, metadata, &Encoding::default())
}

/// As [`write()`], in a certain encoding, and with another colour than the film's own if there is one, such as without its noise.
/// An EXR file has that of the film as the layer `noisy` then.
///
/// # Errors
/// See [`OutputError`].
pub fn write_as(
    path: &Path,
    film: &Film,
    colour: Option<&Image>,
    tone: &ToneMapping,
    metadata: &BTreeMap<String, String>,
    encoding: &Encoding,
) -> Result<(), OutputError> {
    let shown = || colour.cloned().unwrap_or_else(|| film.to_image());
    match Format::of(path)? {
        Format::Png if encoding.png16 => tone.apply(&shown()).write_png16_encoded(path)?,
        Format::Png => tone.apply(&shown()).write_png_encoded(path)?,
        Format::Hdr => shown().write_hdr(path)?,
        Format::Exr => {
            let mut file = ExrFile::new(film.width(), film.height(), film.window());
            file.push_colour(&shown(), encoding.exr_precision);
            if colour.is_some() {
                file.push_layer("noisy", &["R", "G", "B"], &film.to_image(), encoding.exr_precision);
            }
            file.push_aovs(film);
            for &aov in film.aovs() {
                if let Some(AovData::Shares(pixels)) = film.aov(aov) {
                    file.push_cryptomatte(aov, &pixels, &names_in(metadata, aov));
                }
            }
            file.camera = exr_camera(metadata);
            let file = metadata.iter().fold(file, |f, (k, v)| f.with_metadata(k, v));
            file.write(path, encoding.exr_compression)?;
        }
    }
    Ok(())
}
