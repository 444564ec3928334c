//! The sRGB transfer function (IEC 61966-2-1).

use optics::tonemap::{srgb_decode_channel, srgb_encode_channel};

/// Linear light of an sRGB-encoded value, both clipped to `[0, 1]`.
#[must_use]
pub fn srgb_to_linear(encoded: f32) -> f32 {
    srgb_decode_channel(encoded)
}

/// The sRGB encoding of linear light, both clipped to `[0, 1]`.
#[must_use]
pub fn linear_to_srgb(linear: f32) -> f32 {
    srgb_encode_channel(linear)
}

/// The 8-bit code of a display-encoded value: rounded, with what is outside `[0, 1]` cut off and NaN as zero.
#[must_use]
pub fn to_u8(encoded: f32) -> u8 {
    (encoded.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// The 16-bit code of a display-encoded value, as [`to_u8`].
#[must_use]
pub fn to_u16(encoded: f32) -> u16 {
    (encoded.clamp(0.0, 1.0) * 65535.0).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_codes_survive_a_round_trip() {
        for code in 0..=255_u8 {
            assert_eq!(to_u8(linear_to_srgb(srgb_to_linear(f32::from(code) / 255.0))), code);
        }
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-5);
        assert_eq!([to_u8(f32::NAN), to_u8(-1.0), to_u8(f32::INFINITY)], [0, 0, 255]);
    }
}
