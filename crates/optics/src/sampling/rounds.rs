//! Which pixels of a picture deserve more samples: what a round of adaptive sampling decides for each of them.
//!
//! With `v` the variance of one sample of a pixel relative to its squared radiance, a picture's relative squared error is least
//! when pixels have samples in proportion to √v (Neyman, "On the Two Different Aspects of the Representative Method", 1934). `v` is
//! what a pixel's neighbours say: a pixel that decides about itself is biased.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod rounds {
    use wgsl_rs::std::*;

    /// Half the side of the window of neighbours, in pixels.
    pub const ROUND_RADIUS: u32 = 2u32;
    /// Standard deviation of the window's weights, in pixels.
    pub const ROUND_SIGMA: f32 = 1.5;
    /// Samples come by so many at a time: a few more or less change little, and points of a sequence come in fours.
    pub const ROUND_QUANTUM: f32 = 4.0;
    /// A round makes the samples of a pixel at most this many times what they were: variances that few samples have found are
    /// uncertain.
    pub const ROUND_GROWTH: f32 = 4.0;

    /// The unbiased variance of one of `count` samples, at least zero; 0 below two samples.
    pub fn variance_of_sums(sum: f32, sum_of_squares: f32, count: f32) -> f32 {
        let variance = (sum_of_squares - sum * (sum / max(count, 1.0))) / max(count - 1.0, 1.0);
        select(0.0, max(variance, 0.0), count >= 2.0)
    }

    /// How much a neighbour `dx` and `dy` pixels away says; nothing at no distance.
    pub fn neighbour_weight(dx: f32, dy: f32) -> f32 {
        let squared = dx * dx + dy * dy;
        select(0.0, exp(-0.5 * squared / (ROUND_SIGMA * ROUND_SIGMA)), squared > 0.0)
    }

    /// A variance relative to the squared mean, to which `offset` is added: at least zero.
    pub fn relative_variance(mean: f32, variance: f32, offset: f32) -> f32 {
        select(0.0, variance / max(mean * mean + offset, 1e-37), variance > 0.0)
    }

    /// Samples that a pixel should have when the round is over: none can give back what it has.
    ///
    /// - `scale`: samples for a weight of one. `weight`: √v. `taken`: samples that it has.
    pub fn samples_deserved(scale: f32, weight: f32, taken: f32) -> f32 {
        clamp(scale * weight, taken, ROUND_GROWTH * taken)
    }

    /// Samples that a pixel gets in the round.
    pub fn samples_of_round(deserved: f32, taken: f32) -> u32 {
        u32(floor((deserved - taken) / ROUND_QUANTUM + 0.5) * ROUND_QUANTUM)
    }
}

#[cfg(test)]
mod tests {
    use super::rounds::*;

    #[test]
    fn variances_are_those_of_the_definition() {
        // 1, 2, 3, 4: variance 5/3.
        assert!((variance_of_sums(10.0, 30.0, 4.0) - 5.0 / 3.0).abs() < 1e-6);
        assert_eq!(variance_of_sums(3.0, 9.0, 1.0), 0.0);
        assert_eq!(variance_of_sums(30.0, 89.9, 10.0), 0.0, "rounding makes no negative variance");
    }

    #[test]
    fn pixels_say_nothing_about_themselves() {
        assert_eq!(neighbour_weight(0.0, 0.0), 0.0);
        assert!(neighbour_weight(1.0, 0.0) > neighbour_weight(1.0, 1.0));
        assert_eq!(neighbour_weight(-2.0, 1.0), neighbour_weight(1.0, 2.0));
        assert!((neighbour_weight(0.0, 1.5) - (-0.5f32).exp()).abs() < 1e-6);
    }

    #[test]
    fn black_and_quiet_pixels_have_no_variance() {
        assert_eq!(relative_variance(0.0, 0.0, 0.0), 0.0);
        assert_eq!(relative_variance(5.0, 0.0, 0.0), 0.0);
        assert!((relative_variance(0.3, 0.5, 0.01) - 5.0).abs() < 1e-5);
        assert!(relative_variance(0.0, 1e-3, 0.0).is_finite());
    }

    #[test]
    fn pixels_keep_what_they_have_and_do_not_grow_too_fast() {
        let added = |scale, weight, taken| samples_of_round(samples_deserved(scale, weight, taken), taken);
        assert_eq!(added(100.0, 0.05, 16.0), 0);
        assert_eq!(added(100.0, 0.31, 16.0), 16, "whole quanta");
        assert_eq!(added(1e30, 1.0, 16.0), 48);
        assert_eq!(added(0.0, 0.0, 0.0), 0);
    }
}
