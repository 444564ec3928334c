//! The sRGB transfer function (IEC 61966-2-1).

/// Linear light of an sRGB-encoded value, both in `[0, 1]`.
#[must_use]
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB encoding of linear light, both in `[0, 1]`.
#[must_use]
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The 8-bit code of a display-encoded value: rounded, with what is outside `[0, 1]` cut off and NaN as zero.
#[must_use]
pub fn to_u8(encoded: f32) -> u8 {
    (encoded.clamp(0.0, 1.0) * 255.0).round() as u8
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
