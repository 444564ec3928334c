//! Small functions on numbers and colours.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
#[allow(clippy::excessive_precision, clippy::approx_constant)]
pub mod math {
    use crate::constants::*;
    use wgsl_rs::std::*;

    /// x².
    pub fn sqr(x: f32) -> f32 {
        x * x
    }

    /// x⁵, the power of Schlick's approximation.
    pub fn pow5(x: f32) -> f32 {
        let x2 = x * x;
        x2 * x2 * x
    }

    /// Square root that treats small negative numbers, as rounding makes them, as zero.
    pub fn safe_sqrt(x: f32) -> f32 {
        sqrt(max(x, 0.0))
    }

    /// The largest of three components.
    pub fn max_component(v: Vec3f) -> f32 {
        max(max(v.x, v.y), v.z)
    }

    /// The mean of three components: for choices that should not favour green.
    pub fn mean_component(v: Vec3f) -> f32 {
        (v.x + v.y + v.z) * (1.0 / 3.0)
    }

    /// Relative luminance of linear Rec. 709 RGB (ITU-R BT.709-6, Y row).
    pub fn luminance(c: Vec3f) -> f32 {
        0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z
    }

    /// The integer nearest to `x`, whose magnitude must be below 2²².
    ///
    /// Compilers vectorise this. Conversions to integers they do one by one: those saturate, in WGSL and in Rust.
    pub fn nearest_integer(x: f32) -> i32 {
        // 1.5·2²³: numbers around it have no fraction, and their bits count up.
        bitcast_i32(x + 12582912.0) - 1262485504
    }

    /// Cosine (x) and sine (y) of `turns` whole turns. Exact at multiples of a quarter turn, error below 2·10⁻⁷ else.
    ///
    /// Polynomials of Cephes (`sinf`, `cosf`) after reduction to ±1/8 turn. Being arithmetic only, it gives the same
    /// numbers on every machine, and compilers can vectorise it.
    /// The magnitude of `turns` must be below a million; accuracy is that of its fractional part.
    pub fn cos_sin_turns(turns: f32) -> Vec2f {
        let quarters = turns * 4.0;
        let nearest = nearest_integer(quarters);
        let x = (quarters - f32(nearest)) * HALF_PI;
        let x2 = x * x;
        let s = x + x * x2 * (-1.6666654611e-1 + x2 * (8.3321608736e-3 - 1.9515295891e-4 * x2));
        let c = 1.0 - 0.5 * x2
            + x2 * x2 * (4.166664568298827e-2 + x2 * (-1.388731625493765e-3 + x2 * 2.443315711809948e-5));
        let quadrant = u32(nearest) & 3u32;
        let swap = (quadrant & 1u32) != 0u32;
        let cos_abs = select(c, s, swap);
        let sin_abs = select(s, c, swap);
        let cos_negative = quadrant == 1u32 || quadrant == 2u32;
        let sin_negative = quadrant >= 2u32;
        vec2f(select(cos_abs, -cos_abs, cos_negative), select(sin_abs, -sin_abs, sin_negative))
    }

    /// Angle of the vector (`x`, `y`) from the x axis in turns, for `y` ≥ 0: in `[0, ½]`. Relative error below 4·10⁻⁷; of the
    /// zero vector the result is not a number.
    ///
    /// The polynomial of Cephes (`atanf`) after reduction to ±1/16 turn; arithmetic only, as [`cos_sin_turns`].
    pub fn upper_angle_turns(x: f32, y: f32) -> f32 {
        let run = abs(x);
        let small = min(run, y);
        let large = max(run, y);
        // tan(a − 1/8 turn) = (tan a − 1) / (tan a + 1).
        let turned = small > 0.41421356 * large;
        let t = select(small, small - large, turned) / select(large, small + large, turned);
        let t2 = t * t;
        let series =
            -3.33329491539e-1 + t2 * (1.99777106478e-1 + t2 * (-1.38776856032e-1 + t2 * 8.05374449538e-2));
        let octant = (t + t * t2 * series) * (1.0 / TAU) + select(0.0, 0.125, turned);
        let quadrant = select(octant, 0.25 - octant, y > run);
        select(quadrant, 0.5 - quadrant, x < 0.0)
    }

    /// Whether `x` is neither NaN nor infinite. Looks at the exponent's bits: shader compilers may assume that
    /// comparisons never see NaN.
    pub fn is_finite(x: f32) -> bool {
        (bitcast_u32(x) & 0x7f800000u32) != 0x7f800000u32
    }

    /// Whether all components are finite.
    pub fn is_finite3(v: Vec3f) -> bool {
        is_finite(v.x) && is_finite(v.y) && is_finite(v.z)
    }
}

#[cfg(test)]
mod tests {
    use super::math::*;

    #[test]
    fn integers_are_nearest() {
        for i in -4_194_303..4_194_303 {
            assert_eq!(nearest_integer(i as f32), i);
        }
        for i in -400_000..400_000 {
            let x = i as f32 / 64.0;
            assert_eq!(nearest_integer(x), x.round_ties_even() as i32, "{x}");
        }
    }

    #[test]
    fn cos_sin_turns_agrees_with_libm() {
        for i in 0..100_000 {
            let turns = i as f32 / 100_000.0 * 3.0 - 1.0;
            let cs = cos_sin_turns(turns);
            let angle = f64::from(turns) * std::f64::consts::TAU;
            assert!((f64::from(cs.x) - angle.cos()).abs() < 3e-7, "cos of {turns} turns is {}", cs.x);
            assert!((f64::from(cs.y) - angle.sin()).abs() < 3e-7, "sin of {turns} turns is {}", cs.y);
        }
    }

    #[test]
    fn upper_angles_agree_with_libm() {
        for i in 0..=100_000 {
            let angle = f64::from(i) / 100_000.0 * std::f64::consts::PI;
            for scale in [1.0, 1e-12, 1e12] {
                let (x, y) = ((angle.cos() * scale) as f32, (angle.sin() * scale) as f32);
                let expected = f64::from(y).atan2(f64::from(x)) / std::f64::consts::TAU;
                let error = f64::from(upper_angle_turns(x, y)) - expected;
                assert!(error.abs() <= 4e-7 * expected, "angle of ({x}, {y}): off by {error}");
            }
        }
        assert_eq!(upper_angle_turns(3.0, 0.0), 0.0);
        assert_eq!(upper_angle_turns(-3.0, 0.0), 0.5);
    }

    #[test]
    fn finiteness_is_seen() {
        assert!(is_finite(0.0) && is_finite(-1e38) && is_finite(f32::MIN_POSITIVE / 2.0));
        assert!(!is_finite(f32::NAN) && !is_finite(f32::INFINITY) && !is_finite(f32::NEG_INFINITY));
    }
}
