//! Writing what was rendered: the file name's ending decides the format.

use crate::exr_camera::exr_camera;
use crate::metadata::names_in;
use film::{AovData, Film, Image, ImageError, Part, ProtectedFiles};
use film::{ExrCompression, ExrFile, Precision};
use post::ToneMapping;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// No writer knows the ending.
    #[error("{path}: unknown picture format; known are .png, .jpg, .exr and .hdr")]
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
    /// Eight bits, tone mapped, lossy.
    Jpeg,
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
            "jpg" | "jpeg" => Ok(Self::Jpeg),
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
        Format::Jpeg => tone.apply(&shown()).write_jpeg_encoded(path)?,
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

/// A file that could not be written where it was asked for.
#[derive(Debug)]
pub struct Failed<E> {
    /// Where it was to be.
    pub path: PathBuf,
    /// Why it is not there.
    pub error: E,
    /// Where the contents are instead; `None` if they could be written nowhere.
    pub kept: Option<PathBuf>,
}

/// Writes all of `paths` by `write`, each even if others fail. What cannot be written to its place is written beside it, or
/// else into the folder for temporary files, as `NAME.kept-PROCESS.ENDING`: hours of work must not be lost to a name.
///
/// Returns the files that are not where they were asked for.
pub fn write_each<E>(paths: &[PathBuf], write: impl Fn(&Path) -> Result<(), E>) -> Vec<Failed<E>> {
    let failed = |path: &PathBuf| {
        let error = write(path).err()?;
        let kept = places_beside(path).into_iter().find(|place| write(place).is_ok());
        Some(Failed { path: path.clone(), error, kept })
    };
    paths.iter().filter_map(failed).collect()
}

/// Where what cannot be written to `path` may be kept.
fn places_beside(path: &Path) -> [PathBuf; 2] {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
    let name = format!("{stem}.kept-{}{ending}", std::process::id());
    [path.with_file_name(&name), std::env::temp_dir().join(name)]
}

/// Finds out before rendering whether a picture, or a part if `is_part`, can be written to `path` and replaces nothing that
/// is no output: an input, or a part of a picture by a finished one.
///
/// # Errors
/// See [`OutputError`]; [`film::ImageError::Protected`] and [`film::ImageError::NotAFile`] among others.
pub fn prove(path: &Path, is_part: bool, inputs: &ProtectedFiles) -> Result<(), OutputError> {
    Format::of(path)?;
    inputs.check(path)?;
    film::prove_writable(path)?;
    if !is_part && Part::is_at(path) {
        let reason = "there is a part of a picture or a checkpoint".into();
        return Err(ImageError::Protected { path: path.to_owned(), reason }.into());
    }
    Ok(())
}

/// Where picture `frame` of a sequence goes: `picture.png` becomes `picture.0007.png`, and in `picture-####.png`, as in any
/// name with `#`, these are replaced by as many digits.
pub fn frame_path(path: &Path, frame: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if let Some(start) = name.find('#') {
        let digits = name[start..].chars().take_while(|c| *c == '#').count();
        let (before, after) = (&name[..start], &name[start + digits..]);
        return path.with_file_name(format!("{before}{frame:0digits$}{after}"));
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    path.with_extension(format!("{frame:04}.{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered() {
        let named = |name: &str, frame| frame_path(Path::new(name), frame).to_string_lossy().into_owned();
        assert_eq!(named("a/b.png", 7), "a/b.0007.png");
        assert_eq!(named("a/b.12.png", 12345), "a/b.12.12345.png");
        assert_eq!(named("a#/b_###_left.exr", 7), "a#/b_007_left.exr");
    }

    #[test]
    fn every_output_is_tried_and_what_fails_is_kept_elsewhere() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("folder.png")).expect("a folder");
        let paths = [at("missing/a.png"), at("folder.png"), at("c.png")];
        let failed = write_each(&paths, |path| Image::black(2, 2, 3).write_png_encoded(path));
        assert_eq!(failed.len(), 2);
        assert!(Image::open(at("c.png")).is_ok());
        for failed in failed {
            let kept = failed.kept.expect("somewhere");
            assert_eq!(Image::open(&kept).expect("whole").width(), 2);
            std::fs::remove_file(kept).expect("removed");
        }
    }

    #[test]
    fn inputs_and_parts_are_refused_before_rendering() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        let film = Film::with_window(2, 2, film::Rect::full(2, 2), &[]).expect("small");
        let whole = film::Block { window: film::Rect::full(2, 2), samples: 0..1 };
        let part = Part::new(film, film::Coverage::default(), whole).expect("empty");
        part.write(&path).expect("written");
        let none = ProtectedFiles::default();
        prove(&path, true, &none).expect("parts are made again");
        for error in [prove(&path, false, &none), prove(&path, true, &ProtectedFiles::new([&path]))] {
            let error = error.expect_err("protected");
            assert!(matches!(error, OutputError::Image(ImageError::Protected { .. })), "{error}");
        }
        assert!(Part::read(&path).is_ok(), "it is as it was");
    }
}
