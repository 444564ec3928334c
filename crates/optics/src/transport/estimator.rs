//! Statistics of Monte Carlo estimates.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod estimator {
    use crate::math::*;
    use wgsl_rs::std::*;

    /// The largest radiance that a sample may have: 2⁴⁰.
    pub const MAX_SAMPLE: f32 = 1099511627776.0;

    /// Whether a sample's radiance can be counted.
    pub fn is_valid_radiance(c: Vec3f) -> bool {
        is_finite3(c) && max_component(abs(c)) <= MAX_SAMPLE
    }

    /// The squares of a sample's colours.
    pub fn squared(c: Vec3f) -> Vec3f {
        c * c
    }

    /// Running mean and sum of squared differences from it.
    #[derive(Clone, Copy, Debug)]
    pub struct Moments {
        /// Number of samples.
        pub count: f32,
        /// Their mean.
        pub mean: f32,
        /// Sum of squared differences from the mean.
        pub m2: f32,
    }

    /// No samples yet.
    pub fn moments_empty() -> Moments {
        Moments { count: 0.0, mean: 0.0, m2: 0.0 }
    }

    /// Adds one sample. Source: Welford, "Note on a Method for Calculating Corrected Sums of Squares and Products", 1962.
    pub fn moments_add(m: Moments, x: f32) -> Moments {
        let count = m.count + 1.0;
        let delta = x - m.mean;
        let mean = m.mean + delta / count;
        Moments { count: count, mean: mean, m2: m.m2 + delta * (x - mean) }
    }

    /// The moments of both sets of samples together. Source: Chan, Golub and LeVeque 1979.
    pub fn moments_merge(a: Moments, b: Moments) -> Moments {
        let count = a.count + b.count;
        if count <= 0.0 {
            return moments_empty();
        }
        let delta = b.mean - a.mean;
        let mean = a.mean + delta * (b.count / count);
        Moments { count: count, mean: mean, m2: a.m2 + b.m2 + delta * delta * (a.count * b.count / count) }
    }

    /// Unbiased variance of one sample; 0 for fewer than two.
    pub fn moments_variance(m: Moments) -> f32 {
        select(0.0, m.m2 / max(m.count - 1.0, 1.0), m.count >= 2.0)
    }

    /// Variance of one sample by moments of means, which have `samples` samples in all: means of several samples vary less than
    /// samples do.
    pub fn variance_of_means(means: Moments, samples: f32) -> f32 {
        moments_variance(means) * samples / max(means.count, 1.0)
    }

    /// The mean of `count` samples; of none, the sum.
    pub fn mean_of_sum(sum: Vec3f, count: f32) -> Vec3f {
        sum / max(count, 1.0)
    }

    /// Standard error of the mean.
    pub fn moments_standard_error(m: Moments) -> f32 {
        sqrt(moments_variance(m) / max(m.count, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::estimator::*;

    #[test]
    fn moments_agree_with_the_definition_whole_and_merged() {
        let xs: Vec<f32> = (0..1000).map(|i| 5.0 + ((i * 7919) % 1000) as f32 / 1000.0).collect();
        let whole = xs.iter().fold(moments_empty(), |m, x| moments_add(m, *x));
        let (left, right) = xs.split_at(300);
        let merged = moments_merge(
            left.iter().fold(moments_empty(), |m, x| moments_add(m, *x)),
            right.iter().fold(moments_empty(), |m, x| moments_add(m, *x)),
        );
        // 0, 0.001, … 0.999 in some order: mean 5.4995, variance (n² − 1) / 12 / n² · n / (n − 1).
        for m in [whole, merged] {
            assert!((m.mean - 5.4995).abs() < 1e-4, "{m:?}");
            assert!((moments_variance(m) - 1001.0 / 12_000.0).abs() < 1e-4, "{m:?}");
        }
        assert_eq!(moments_variance(moments_add(moments_empty(), 3.0)), 0.0);
        assert_eq!(moments_merge(moments_empty(), moments_empty()).count, 0.0);
    }
}
