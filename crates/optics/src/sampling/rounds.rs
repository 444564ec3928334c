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
    use crate::estimator::*;
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

    /// The share of the squared level of a picture that is added to the squared radiance that errors are relative to.
    pub const LEVEL_SHARE: f32 = 0.01;

    /// Joins what parts of a picture say: x, y are summed up, of z, w the least counts.
    pub fn round_gather(a: Vec4f, b: Vec4f) -> Vec4f {
        vec4f(a.x + b.x, a.y + b.y, min(a.z, b.z), min(a.w, b.w))
    }

    /// The level of a pixel: the mean of its colours' magnitudes.
    pub fn pixel_level(mean: Vec3f) -> f32 {
        (abs(mean.x) + abs(mean.y) + abs(mean.z)) / 3.0
    }

    /// The mean over all pixels.
    pub fn mean_of_pixels(sum: f32, pixels: u32) -> f32 {
        sum / f32(pixels)
    }

    /// What is added to the squared radiance that errors are relative to: `given`, or, if that is below zero, what follows from the
    /// picture's `level`.
    pub fn error_offset(given: f32, level: f32) -> f32 {
        select(given, LEVEL_SHARE * level * level, given < 0.0)
    }

    /// [`variance_of_sums`] of each colour.
    pub fn variances_of_sums(sums: Vec3f, sums_of_squares: Vec3f, count: f32) -> Vec3f {
        vec3f(
            variance_of_sums(sums.x, sums_of_squares.x, count),
            variance_of_sums(sums.y, sums_of_squares.y, count),
            variance_of_sums(sums.z, sums_of_squares.z, count),
        )
    }

    /// The mean of the colours' relative variances; see [`relative_variance`].
    pub fn relative_variances(mean: Vec3f, variance: Vec3f, offset: f32) -> f32 {
        (relative_variance(mean.x, variance.x, offset)
            + relative_variance(mean.y, variance.y, offset)
            + relative_variance(mean.z, variance.z, offset))
            / 3.0
    }

    /// The relative variance of a pixel's mean of `count` samples, by the variance of one.
    pub fn relative_error(mean: Vec3f, variance: Vec3f, count: f32, offset: f32) -> f32 {
        relative_variances(mean, mean_of_sum(variance, count), offset)
    }

    /// What a pixel's neighbours say: weighted sums of their means and of the variances of their samples.
    #[derive(Clone, Copy, Debug)]
    pub struct Neighbours {
        /// Of the means.
        pub mean: Vec3f,
        /// Of the variances of one sample.
        pub variance: Vec3f,
        /// Of the weights.
        pub weight: f32,
    }

    /// No neighbours yet.
    pub fn neighbours_none() -> Neighbours {
        Neighbours { mean: vec3f(0.0, 0.0, 0.0), variance: vec3f(0.0, 0.0, 0.0), weight: 0.0 }
    }

    /// Adds a neighbour, by its weight of [`neighbour_weight`].
    pub fn neighbours_add(n: Neighbours, weight: f32, mean: Vec3f, variance: Vec3f) -> Neighbours {
        Neighbours {
            mean: n.mean + weight * mean,
            variance: n.variance + weight * variance,
            weight: n.weight + weight,
        }
    }

    /// √v of a pixel, where v is the relative variance that its neighbours have; 1 if it has none.
    pub fn neighbours_say(n: Neighbours, offset: f32) -> f32 {
        let sum = max(n.weight, 1e-20);
        sqrt(select(1.0, relative_variances(n.mean / sum, n.variance / sum, offset), n.weight > 0.0))
    }

    /// The logarithm of factor `number` of `count` that divide a range; the last one is its upper end.
    pub fn factor_logarithm(low: f32, high: f32, number: u32, count: u32) -> f32 {
        mix(low, high, f32(number + 1u32) / f32(count))
    }

    /// A factor from its logarithm to base 2.
    pub fn factor_of(logarithm: f32) -> f32 {
        exp2(logarithm)
    }

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
    use crate::vec3f;

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
    fn equal_neighbours_say_what_each_does() {
        let (mean, variance) = (vec3f(2.0, 2.0, 2.0), vec3f(1.0, 2.0, 3.0));
        let both =
            neighbours_add(neighbours_add(neighbours_none(), 0.3, mean, variance), 0.2, mean, variance);
        assert!((neighbours_say(both, 0.0) - 0.5f32.sqrt()).abs() < 1e-5);
        assert_eq!(neighbours_say(neighbours_none(), 0.0), 1.0);
        assert_eq!(error_offset(0.5, 3.0), 0.5);
        assert!((error_offset(-1.0, 3.0) - 0.09).abs() < 1e-6);
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
