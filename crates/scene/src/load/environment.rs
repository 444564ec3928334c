//! Environment maps: equirectangular Radiance HDR and OpenEXR pictures.

use super::{LoadError, LoadOptions, textures};
use crate::{Image, LoadReport, Pixels};
use std::path::Path;

/// Loads an equirectangular environment map (`.hdr`, `.exr`) as linear [`Pixels::Rgb32F`], row 0 towards +Y.
///
/// Values that are negative or not finite are mended; that, and an aspect ratio other than 2 : 1, goes into `report`.
/// An eight-bit picture is accepted as sRGB and reported, as it holds no more than display white.
///
/// # Errors
/// [`LoadError::Read`] and [`LoadError::TooLarge`]; [`LoadError::Malformed`] if the picture cannot be decoded, EXR files
/// with compression methods or channel layouts that are not supported among them.
pub fn load(path: &Path, options: &LoadOptions, report: &mut LoadReport) -> Result<Image, LoadError> {
    options.session(path, |options| load_within(path, options, report))
}

fn load_within(path: &Path, options: &LoadOptions, report: &mut LoadReport) -> Result<Image, LoadError> {
    let bytes = options.read(path)?;
    report.bytes_read += bytes.len() as u64;
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let mut image = textures::decode(&name, &bytes, options, report)
        .map_err(|error| LoadError::malformed(path, "environment map", error.to_string()))?;
    if !image.pixels.is_float() {
        report.approximated(format!("environment {name}: an eight-bit picture holds no bright lights"));
    }
    image.pixels = Pixels::Rgb32F(image.pixels.into_linear());
    if u64::from(image.width) != 2 * u64::from(image.height) {
        report.info(format!("environment {name}: {} × {} is not 2 : 1", image.width, image.height));
    }
    Ok(image)
}
