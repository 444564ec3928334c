//! How large images may be.

use super::error::TextureError;
use crate::load::LoadOptions;

/// Images of up to this many pixels are accepted however few bytes they come from.
const FREE_PIXELS: u64 = 1 << 24;
/// No image has more pixels than this.
pub(super) const MAX_PIXELS: u64 = 1 << 28;
/// Above any sensible compression ratio: Deflate reaches 1032 bytes from one, eight one-bit pixels each.
const MAX_PIXELS_PER_BYTE: u64 = 1 << 14;

/// Refuses sizes that the file's bytes cannot fill, or that the scene has no memory for; `pixel`: bytes that a pixel takes.
pub(super) fn check_size(
    width: u64,
    height: u64,
    bytes: usize,
    pixel: u64,
    options: &LoadOptions,
) -> Result<(), TextureError> {
    let pixels = width.saturating_mul(height);
    let plausible = (bytes as u64).saturating_mul(MAX_PIXELS_PER_BYTE).clamp(FREE_PIXELS, MAX_PIXELS);
    if pixels == 0 {
        return Err(TextureError::Decode(format!("{width} × {height} pixels")));
    }
    if pixels > plausible {
        return Err(TextureError::TooLarge { width, height, bytes });
    }
    // The call as a whole fails then; this image is left out so that nothing more is allocated.
    let taken = options.budget().take(pixels.saturating_mul(pixel), "images");
    taken.map_err(|error| TextureError::Decode(error.to_string()))
}
