//! Small conversions of colours that front ends need, from the optics.

use optics::math::luminance as luminance_of;
use optics::tonemap::srgb_encode_channel;
use optics::vec3f;

/// Relative luminance of linear RGB with Rec. 709 primaries.
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    luminance_of(vec3f(r, g, b))
}

/// A linear value in `[0, 1]` encoded as sRGB.
pub fn srgb_encode(linear: f32) -> f32 {
    srgb_encode_channel(linear)
}
