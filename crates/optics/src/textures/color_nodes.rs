//! Colours: hue, saturation and value; light of a temperature.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod color_nodes {
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Hue in turns, saturation and value of a colour whose components are not negative.
    /// Source: A. R. Smith, "Color Gamut Transform Pairs", SIGGRAPH 1978.
    pub fn rgb_to_hsv(c: Vec3f) -> Vec3f {
        let value = max_component(c);
        let chroma = value - min(min(c.x, c.y), c.z);
        if chroma <= 0.0 {
            return vec3f(0.0, 0.0, value);
        }
        let mut sextant = 4.0 + (c.x - c.y) / chroma;
        if c.x == value {
            sextant = (c.y - c.z) / chroma;
        } else if c.y == value {
            sextant = 2.0 + (c.z - c.x) / chroma;
        }
        let hue = sextant * (1.0 / 6.0);
        vec3f(hue - floor(hue), chroma / value, value)
    }

    /// The inverse of [`rgb_to_hsv`].
    pub fn hsv_to_rgb(c: Vec3f) -> Vec3f {
        vec3f(hsv_component(c, 5.0), hsv_component(c, 3.0), hsv_component(c, 1.0))
    }

    /// A component of [`hsv_to_rgb`]: 5 is red, 3 green, 1 blue.
    pub fn hsv_component(c: Vec3f, n: f32) -> f32 {
        let k = (n * (1.0 / 6.0) + c.x) - floor(n * (1.0 / 6.0) + c.x);
        let ramp = min(6.0 * k, 4.0 - 6.0 * k);
        c.z * (1.0 - c.y * saturate(ramp))
    }

    /// A colour with its hue turned, and its saturation and value multiplied. `hue` in turns.
    pub fn adjust_hsv(c: Vec3f, hue: f32, saturation: f32, value: f32) -> Vec3f {
        let hsv = rgb_to_hsv(max(c, vec3f(0.0, 0.0, 0.0)));
        hsv_to_rgb(vec3f(hsv.x + hue, saturate(hsv.y * saturation), hsv.z * value))
    }

    /// Linear Rec. 709 colour of a black body of luminance 1. `kelvin`: from 1667 to 25,000, else the nearest of these.
    /// Negative components, of reds that the primaries do not reach, become 0.
    /// Source: Kim et al., "Design of Advanced Color Temperature Control System for HDTV Applications", 2002.
    pub fn blackbody_color(kelvin: f32) -> Vec3f {
        let t = clamp(kelvin, 1667.0, 25000.0);
        let r = 1000.0 / t;
        let mut x = ((-3.0258469 * r + 2.1070379) * r + 0.2226347) * r + 0.240390;
        if t < 4000.0 {
            x = ((-0.2661239 * r - 0.2343589) * r + 0.8776956) * r + 0.179910;
        }
        let mut y = ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483;
        if t < 2222.0 {
            y = ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683;
        } else if t < 4000.0 {
            y = ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867;
        }
        let big_x = x / y;
        let big_z = (1.0 - x - y) / y;
        let rgb = vec3f(
            3.2404542 * big_x - 1.5371385 - 0.4985314 * big_z,
            -0.9692660 * big_x + 1.8760108 + 0.0415560 * big_z,
            0.0556434 * big_x - 0.2040259 + 1.0572252 * big_z,
        );
        max(rgb, vec3f(0.0, 0.0, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::color_nodes::*;
    use wgsl_rs::std::*;

    #[test]
    fn hue_saturation_and_value_come_back() {
        for i in 0..1_000 {
            let at = |k: f32| (i as f32 * k).fract() * 2.0;
            let c = vec3f(at(0.618), at(0.7549), at(0.5698));
            let back = hsv_to_rgb(rgb_to_hsv(c));
            for (a, b) in c.to_array().into_iter().zip(back.to_array()) {
                assert!((a - b).abs() < 1e-5, "{c:?} {back:?}");
            }
        }
        let green = adjust_hsv(vec3f(0.8, 0.2, 0.2), 1.0 / 3.0, 1.0, 1.0);
        assert!((green.y - 0.8).abs() < 1e-5 && (green.x - 0.2).abs() < 1e-5, "{green:?}");
        assert_eq!(adjust_hsv(vec3f(0.8, 0.2, 0.2), 0.0, 0.0, 0.5).to_array(), [0.4; 3]);
    }

    /// White at 6500 K, red below and blue above; luminance 1.
    #[test]
    fn black_bodies_go_from_red_to_blue() {
        let d65 = blackbody_color(6504.0);
        assert!((d65.x - 1.0).abs() < 0.06 && (d65.z - 1.0).abs() < 0.06, "{d65:?}");
        let (warm, cold) = (blackbody_color(2700.0), blackbody_color(12_000.0));
        assert!(warm.x > 2.0 * warm.z && cold.z > 1.3 * cold.x, "{warm:?} {cold:?}");
        for kelvin in [2222.0, 4000.0] {
            let (below, above) = (blackbody_color(kelvin - 0.1), blackbody_color(kelvin + 0.1));
            assert!((below - above).to_array().iter().all(|d| d.abs() < 0.01), "{below:?} {above:?}");
        }
        for kelvin in [1000.0, 3000.0, 5000.0, 9000.0] {
            let c = blackbody_color(kelvin);
            let luminance = 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
            assert!((luminance - 1.0).abs() < 0.02, "{kelvin}: {luminance}");
        }
    }
}
