//! Small conversions of colours that front ends need, from the optics.

use optics::math::luminance as luminance_of;
use optics::tonemap::{srgb_decode_channel, srgb_encode_channel};
use optics::vec3f;

/// Relative luminance of linear RGB with Rec. 709 primaries.
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    luminance_of(vec3f(r, g, b))
}

/// A linear value in `[0, 1]` encoded as sRGB.
pub fn srgb_encode(linear: f32) -> f32 {
    srgb_encode_channel(linear)
}

/// The linear RGB of a colour that is written `#rrggbb` in hexadecimal, as sRGB; `None` for another text.
pub fn hex_color(text: &str) -> Option<[f32; 3]> {
    let digits =
        text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let number = u32::from_str_radix(digits, 16).ok()?;
    Some([16, 8, 0].map(|shift| srgb_decode_channel((number >> shift & 255) as f32 / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_written_in_hexadecimal() {
        assert_eq!(hex_color("#ff0000"), Some([1.0, 0.0, 0.0]));
        let grey = hex_color("#7F7f7f").expect("grey");
        assert!((srgb_encode(grey[1]) * 255.0 - 127.0).abs() < 1e-3);
        for wrong in ["ff0000", "#ff000", "#ff00000", "#gg0000", "#+f0000", "red"] {
            assert_eq!(hex_color(wrong), None, "{wrong}");
        }
    }
}
