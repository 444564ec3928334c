//! From scene-referred radiance to display values. Applied once, at the very end.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod tonemap {
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Clip and encode as sRGB.
    pub const TONEMAP_SRGB: u32 = 0u32;
    /// Clip; no encoding.
    pub const TONEMAP_NONE: u32 = 1u32;
    /// Reinhard on luminance.
    pub const TONEMAP_REINHARD: u32 = 2u32;
    /// ACES filmic, Narkowicz' fit.
    pub const TONEMAP_ACES: u32 = 3u32;
    /// AgX.
    pub const TONEMAP_AGX: u32 = 4u32;
    /// Khronos PBR Neutral.
    pub const TONEMAP_NEUTRAL: u32 = 5u32;

    /// Encodes one linear display value in `[0, 1]` as sRGB (IEC 61966-2-1).
    pub fn srgb_encode_channel(x: f32) -> f32 {
        let c = saturate(x);
        select(1.055 * pow(max(c, 0.0031308), 1.0 / 2.4) - 0.055, 12.92 * c, c <= 0.0031308)
    }

    /// Decodes one sRGB value in `[0, 1]` to linear.
    pub fn srgb_decode_channel(x: f32) -> f32 {
        let c = saturate(x);
        select(pow((max(c, 0.04045) + 0.055) / 1.055, 2.4), c / 12.92, c <= 0.04045)
    }

    /// Encodes a linear display colour as sRGB, clipping to `[0, 1]`.
    pub fn srgb_encode(c: Vec3f) -> Vec3f {
        vec3f(srgb_encode_channel(c.x), srgb_encode_channel(c.y), srgb_encode_channel(c.z))
    }

    /// Decodes an sRGB colour to linear.
    pub fn srgb_decode(c: Vec3f) -> Vec3f {
        vec3f(srgb_decode_channel(c.x), srgb_decode_channel(c.y), srgb_decode_channel(c.z))
    }

    /// Moves a colour away from (`saturation` > 1) or towards its luminance.
    pub fn saturate_color(c: Vec3f, saturation: f32) -> Vec3f {
        let y = luminance(c);
        let grey = vec3f(y, y, y);
        grey + (c - grey) * saturation
    }

    /// Reinhard et al. 2002, eq. 3, on luminance: L / (1 + L).
    pub fn reinhard(c: Vec3f) -> Vec3f {
        c * (1.0 / (1.0 + luminance(c)))
    }

    /// One channel of [`aces`].
    pub fn aces_channel(x: f32) -> f32 {
        saturate((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14))
    }

    /// Fit of the ACES reference rendering transform. Source: K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2016.
    pub fn aces(c: Vec3f) -> Vec3f {
        vec3f(aces_channel(c.x), aces_channel(c.y), aces_channel(c.z))
    }

    /// Sigmoid of AgX' default look, a sixth-order fit. `x`: log-encoded value in `[0, 1]`.
    pub fn agx_contrast(x: f32) -> f32 {
        let x2 = x * x;
        let x4 = x2 * x2;
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232
    }

    /// One channel of AgX between its two matrices: log₂ encoding over 16.5 stops, then contrast.
    pub fn agx_channel(x: f32) -> f32 {
        let encoded = (log2(max(x, 1e-10)) + 12.47393) / (4.026069 + 12.47393);
        agx_contrast(saturate(encoded))
    }

    /// AgX, linear out. Source: T. Sobotka's AgX, in the minimal fit of B. Wrensch, "Minimal AgX Implementation", 2023.
    pub fn agx(c: Vec3f) -> Vec3f {
        let inset = vec3f(
            0.842479062253094 * c.x + 0.0784335999999992 * c.y + 0.0792237451477643 * c.z,
            0.0423282422610123 * c.x + 0.878468636469772 * c.y + 0.0791661274605434 * c.z,
            0.0423756549057051 * c.x + 0.0784336 * c.y + 0.879142973793104 * c.z,
        );
        let v = vec3f(agx_channel(inset.x), agx_channel(inset.y), agx_channel(inset.z));
        let outset = vec3f(
            1.19687900512017 * v.x - 0.0980208811401368 * v.y - 0.0990297440797205 * v.z,
            -0.0528968517574562 * v.x + 1.15190312990417 * v.y - 0.0989611768448433 * v.z,
            -0.0529716355144438 * v.x - 0.0980434501171241 * v.y + 1.15107367264116 * v.z,
        );
        // The look is defined on a display of gamma 2.2.
        vec3f(pow(max(outset.x, 0.0), 2.2), pow(max(outset.y, 0.0), 2.2), pow(max(outset.z, 0.0), 2.2))
    }

    /// Khronos PBR Neutral: keeps base colours as they are and compresses only highlights.
    /// Source: Khronos Group, "PBR Neutral Tone Mapper Specification", 2024.
    pub fn neutral(c: Vec3f) -> Vec3f {
        let start = 0.8 - 0.04;
        let darkest = min(c.x, min(c.y, c.z));
        let offset = select(0.04, darkest - 6.25 * darkest * darkest, darkest < 0.08);
        let shifted = c - vec3f(offset, offset, offset);
        let peak = max_component(shifted);
        if peak < start {
            return shifted;
        }
        let d = 1.0 - start;
        let new_peak = 1.0 - d * d / (peak + d - start);
        let compressed = shifted * (new_peak / peak);
        let g = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
        compressed + (vec3f(new_peak, new_peak, new_peak) - compressed) * g
    }

    /// The whole way from radiance to what is written to a display or a PNG, in `[0, 1]`.
    ///
    /// - `mapper`: `TONEMAP_…`. `exposure`: factor on radiance. `saturation`: applied after the curve; 1 changes nothing.
    pub fn tonemap(mapper: u32, radiance: Vec3f, exposure: f32, saturation: f32) -> Vec3f {
        let c = vec3f(max(radiance.x, 0.0), max(radiance.y, 0.0), max(radiance.z, 0.0)) * exposure;
        let mut mapped = c;
        if mapper == TONEMAP_REINHARD {
            mapped = reinhard(c);
        }
        if mapper == TONEMAP_ACES {
            mapped = aces(c);
        }
        if mapper == TONEMAP_AGX {
            mapped = agx(c);
        }
        if mapper == TONEMAP_NEUTRAL {
            mapped = neutral(c);
        }
        mapped = saturate_color(mapped, saturation);
        if mapper == TONEMAP_NONE {
            return vec3f(saturate(mapped.x), saturate(mapped.y), saturate(mapped.z));
        }
        srgb_encode(mapped)
    }
}

#[cfg(test)]
mod tests {
    use super::tonemap::*;
    use wgsl_rs::std::*;

    const ALL: [u32; 6] =
        [TONEMAP_SRGB, TONEMAP_NONE, TONEMAP_REINHARD, TONEMAP_ACES, TONEMAP_AGX, TONEMAP_NEUTRAL];

    #[test]
    fn srgb_is_its_own_inverse() {
        for i in 0..=255 {
            let x = i as f32 / 255.0;
            assert!((srgb_encode_channel(srgb_decode_channel(x)) - x).abs() < 1e-5);
        }
        assert!((srgb_encode_channel(0.5) - 0.735_357).abs() < 1e-5);
    }

    #[test]
    fn mappers_are_monotonic_in_grey_and_stay_in_range() {
        for mapper in ALL {
            let mut last = -1.0;
            for i in 0..400 {
                let x = 10f32.powf(i as f32 / 50.0 - 4.0);
                let y = tonemap(mapper, vec3f(x, x, x), 1.0, 1.0);
                assert!((0.0..=1.0).contains(&y.x), "mapper {mapper}: {x} → {y:?}");
                assert!(y.x >= last - 2e-3, "mapper {mapper} falls at {x}: {last} → {}", y.x);
                assert!((y.x - y.y).abs() < 3e-3 && (y.x - y.z).abs() < 3e-3, "mapper {mapper}: {x} → {y:?}");
                last = y.x;
            }
            let black = tonemap(mapper, vec3f(0.0, 0.0, 0.0), 1.0, 1.0);
            assert!(black.x < 0.01, "mapper {mapper}: black is {black:?}");
        }
    }

    /// Values of the published curves.
    #[test]
    fn published_values() {
        assert!((aces_channel(1.0) - 0.8038).abs() < 1e-4);
        assert!((reinhard(vec3f(1.0, 1.0, 1.0)).x - 0.5).abs() < 1e-6);
        // Neutral leaves a mid grey alone but for the 4 % of Fresnel.
        assert!((neutral(vec3f(0.5, 0.5, 0.5)).x - 0.46).abs() < 1e-6);
    }

    #[test]
    fn extreme_and_coloured_input_gives_finite_output() {
        for mapper in ALL {
            for c in [vec3f(1e30, 0.0, 0.0), vec3f(1e-30, 1e-38, 0.0), vec3f(-1.0, 5.0, 0.1)] {
                let y = tonemap(mapper, c, 1.6, 1.5);
                for v in y.to_array() {
                    assert!(v.is_finite() && (0.0..=1.0).contains(&v), "mapper {mapper}: {c:?} → {y:?}");
                }
            }
        }
    }
}
