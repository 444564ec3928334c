//! How light fades with distance where that is a matter of taste.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod falloff {
    use crate::constants::*;
    use wgsl_rs::std::*;

    /// Light over what physics says of it, at a distance in metres. Light fades as 1 / (c + l d + q d²) instead of 1 / d².
    ///
    /// - `coefficients`: c, l in 1/m and q in 1/m², none negative and one of them positive; (0, 0, 1) is physics.
    ///
    /// 1 for lights that are infinitely far away: they do not fade. Finite: near a light with q alone it is 1 / q.
    pub fn falloff_factor(coefficients: Vec3f, distance: f32) -> f32 {
        let d2 = distance * distance;
        let fades = coefficients.x + coefficients.y * distance + coefficients.z * d2;
        // Never reached by samples, which have a distance; but 0 / 0 must not be.
        select(d2 / max(fades, 1e-30), 1.0, distance >= FAR || d2 <= 1e-30)
    }

    /// The distance in metres at which c + l d + q d² reaches `ratio`, at most [`FAR`]: beyond it a light of `ratio` times an
    /// irradiance gives less than that. 0 if it gives less everywhere.
    pub fn falloff_distance(coefficients: Vec3f, ratio: f32) -> f32 {
        let excess = ratio - coefficients.x;
        let half = 0.5 * coefficients.y;
        // The root that does not cancel, and that is also right without a quadratic term.
        let divisor = half + sqrt(half * half + coefficients.z * max(excess, 0.0));
        select(min(excess / max(divisor, 1e-30), FAR), 0.0, excess <= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::falloff::*;
    use crate::constants::FAR;
    use crate::vec3f;

    #[test]
    fn the_inverse_square_is_physics() {
        for distance in [1e-3, 0.7, 30.0, 1e6, FAR] {
            assert_eq!(falloff_factor(vec3f(0.0, 0.0, 1.0), distance), 1.0);
        }
        assert_eq!(falloff_distance(vec3f(0.0, 0.0, 1.0), 9.0), 3.0);
    }

    #[test]
    fn at_the_distance_it_has_fallen_by_the_ratio() {
        for coefficients in [[1.0, 0.09, 0.032], [0.0, 1.0, 0.0], [0.5, 0.0, 2.0], [1.0, 0.2, 0.0]] {
            let [c, l, q] = coefficients;
            for ratio in [1.5_f32, 20.0, 1e4] {
                let d = falloff_distance(coefficients.into(), ratio);
                let there = c + l * d + q * d * d;
                assert!((there / ratio - 1.0).abs() < 1e-5, "{there} instead of {ratio}: {coefficients:?}");
                let factor = falloff_factor(coefficients.into(), d);
                assert!((factor * ratio / (d * d) - 1.0).abs() < 1e-5, "{factor} at {d}: {coefficients:?}");
            }
        }
    }

    #[test]
    fn a_light_that_never_fades_reaches_everything_or_nothing() {
        let constant = vec3f(2.0, 0.0, 0.0);
        assert_eq!(falloff_distance(constant, 1.9), 0.0);
        assert_eq!(falloff_distance(constant, 2.1), FAR);
    }
}
