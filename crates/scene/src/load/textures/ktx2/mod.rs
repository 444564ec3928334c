//! Khronos textures, version 2: the largest level of the first picture of a file.
//!
//! The container is that of the KTX File Format Specification 2.0; what it holds is either a format of Vulkan or one of the
//! two universal formats of Basis: [`etc1s`] and [`uastc`].

mod container;
mod etc1s;
mod formats;
#[cfg(test)]
mod tests;
mod uastc;

use super::error::TextureError;
use super::float::float_pixels;
use super::size_limits::check_size;
use super::storage::{Storage, first_picture};
use crate::load::LoadOptions;
use crate::load::session::PIXEL;
use crate::{Image, LoadReport, Pixels};
use ::ktx2::{ColorModel, SupercompressionScheme};
use container::Container;
use std::borrow::Cow;
use std::io::Read;

/// Whether the bytes start as a Khronos texture of version 2 does.
pub(super) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(&::ktx2::MAGIC)
}

/// Decodes the largest level of the first picture in the file.
///
/// Universal formats and those of up to 16 bits without sign become [`Pixels::Rgba8`], the stored numbers as they are, whatever
/// transfer function the file names; floating-point formats stay floats. Rows and columns that run in another
/// direction than right and down are turned, and channels are swapped as the file asks for.
///
/// # Errors
/// A container or content that is damaged, and formats that are not known, which are named.
pub(super) fn decode_ktx2(
    name: &str,
    bytes: &[u8],
    options: &LoadOptions,
    report: &mut LoadReport,
) -> Result<Image, TextureError> {
    let file = Container::read(bytes)?;
    let header = &file.header;
    let (width, height) = (header.pixel_width, header.pixel_height.max(1));
    let storage = header.format.and_then(formats::storage);
    let pixel = storage.map_or(PIXEL, Storage::pixel_bytes);
    check_size(width.into(), height.into(), bytes.len(), pixel, options)?;
    if header.layer_count > 1 || header.face_count > 1 || header.pixel_depth > 1 {
        report.approximated("only the first picture of a cube, an array or a volume is used");
    }
    if file.premultiplied {
        report.approximated("colours that were multiplied by alpha are taken as they are");
    }
    let size = (width as usize, height as usize);
    let mut pixels = decoded(&file, size, report)?;
    if let Some(orientation) = file.text("KTXorientation") {
        turn(&mut pixels, size, orientation);
    }
    if let Some(swizzle) = file.text("KTXswizzle") {
        swap_channels(&mut pixels, swizzle);
    }
    Ok(Image { name: name.into(), width, height, pixels })
}

/// The pixels as they are stored.
fn decoded(file: &Container, size: (usize, usize), report: &mut LoadReport) -> Result<Pixels, TextureError> {
    let scheme = file.header.supercompression_scheme;
    let basis_lz = scheme == Some(SupercompressionScheme::BasisLZ);
    match (file.header.format, ColorModel::new(file.color_model)) {
        (None, Some(ColorModel::ETC1S)) if basis_lz => {
            etc1s::decode(file.global, file.pictures(), file.level, size).map(Pixels::Rgba8)
        }
        (None, Some(ColorModel::UASTC)) if !basis_lz => {
            let length = size.0.div_ceil(4) * size.1.div_ceil(4) * uastc::BLOCK_BYTES;
            let level = plain(file.level, scheme, length)?;
            uastc::decode(first_picture(&level, length)?, size).map(Pixels::Rgba8)
        }
        (None, model) => {
            let model = model.map_or_else(|| "nothing known".to_owned(), |m| format!("{m:?}"));
            Err(TextureError::Decode(format!("a universal format of {model} is not supported")))
        }
        (Some(format), _) => {
            let storage = formats::storage(format).ok_or_else(|| {
                TextureError::Decode(format!("the pixel format {format:?} is not supported"))
            })?;
            let level = plain(file.level, scheme, storage.length(size))?;
            storage.pixels(&level, size, report)
        }
    }
}

/// The first `length` bytes of a level without its general compression; fewer if it has no more.
fn plain(
    level: &[u8],
    scheme: Option<SupercompressionScheme>,
    length: usize,
) -> Result<Cow<'_, [u8]>, TextureError> {
    let failed = |method: &str, e: String| TextureError::Decode(format!("the {method} data: {e}"));
    let mut bytes = Vec::new();
    match scheme {
        None => return Ok(Cow::Borrowed(level)),
        // What follows is not asked for, so a small file cannot fill the memory.
        Some(SupercompressionScheme::Zstandard) => {
            ruzstd::decoding::StreamingDecoder::new(level)
                .map_err(|e| failed("Zstandard", e.to_string()))?
                .take(length as u64)
                .read_to_end(&mut bytes)
                .map_err(|e| failed("Zstandard", e.to_string()))?;
        }
        Some(SupercompressionScheme::ZLIB) => {
            flate2::read::ZlibDecoder::new(level)
                .take(length as u64)
                .read_to_end(&mut bytes)
                .map_err(|e| failed("zlib", e.to_string()))?;
        }
        Some(other) => {
            return Err(TextureError::Decode(format!("the compression {other:?} is not supported")));
        }
    }
    Ok(Cow::Owned(bytes))
}

/// Makes columns run to the right and rows down. `orientation` has a letter for each axis: `r` or `l`, then `d` or `u`.
fn turn(pixels: &mut Pixels, size: (usize, usize), orientation: &[u8]) {
    let (left, up) = (orientation.first() == Some(&b'l'), orientation.get(1) == Some(&b'u'));
    match pixels {
        Pixels::Rgba8(pixels) => mirror(pixels, size, left, up),
        Pixels::Rgb32F(pixels) => mirror(pixels, size, left, up),
        Pixels::Rgba32F(pixels) => mirror(pixels, size, left, up),
    }
}

fn mirror<T>(pixels: &mut [T], (width, height): (usize, usize), columns: bool, rows: bool) {
    if rows {
        let (above, below) = pixels.split_at_mut(height / 2 * width);
        let below = below.rchunks_exact_mut(width);
        above.chunks_exact_mut(width).zip(below).for_each(|(a, b)| a.swap_with_slice(b));
    }
    if columns {
        pixels.chunks_exact_mut(width).for_each(<[T]>::reverse);
    }
}

/// Takes each channel from where `swizzle` says: `r`, `g`, `b`, `a`, `0` or `1`. Anything else stays.
fn swap_channels(pixels: &mut Pixels, swizzle: &[u8]) {
    let Ok(swizzle) = <[u8; 4]>::try_from(swizzle) else { return };
    if swizzle == *b"rgba" {
        return;
    }
    match pixels {
        Pixels::Rgba8(pixels) => pixels.iter_mut().for_each(|p| *p = swizzled(*p, swizzle, 0, 255)),
        floats => {
            let all = (0..floats.len()).map(|i| swizzled(floats.stored(i), swizzle, 0.0, 1.0));
            *floats = float_pixels(all.collect());
        }
    }
}

fn swizzled<T: Copy>(old: [T; 4], swizzle: [u8; 4], zero: T, one: T) -> [T; 4] {
    std::array::from_fn(|c| match swizzle[c] {
        b'r' => old[0],
        b'g' => old[1],
        b'b' => old[2],
        b'a' => old[3],
        b'0' => zero,
        b'1' => one,
        _ => old[c],
    })
}
