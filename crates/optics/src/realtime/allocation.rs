//! How many samples a pixel gets in a frame.
//!
//! The number depends on frames before only, never on the samples that it counts: the mean of a frame's samples is then an
//! unbiased estimate whatever the rule, as the mean of a fixed number would be.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod allocation {
    use wgsl_rs::std::*;

    /// Variance of one sample, from the mean and the mean of squares of `count` samples; 0 for fewer than two.
    pub fn sample_variance(mean: f32, mean_of_squares: f32, count: f32) -> f32 {
        let biased = max(mean_of_squares - mean * mean, 0.0);
        select(0.0, biased * count / max(count - 1.0, 1.0), count >= 2.0)
    }

    /// Variance as it is seen, where what is shown of a luminance y is y / (y + white), from 0 to 1.
    ///
    /// - `variance`, `mean`: of luminance, which is not negative. `white`: the luminance that is shown as one half, positive.
    pub fn seen_variance(variance: f32, mean: f32, white: f32) -> f32 {
        let scale = 1.0 / max(white, 1e-10);
        let slope = scale / ((1.0 + mean * scale) * (1.0 + mean * scale));
        variance * slope * slope
    }

    /// In a map of noise: a pixel without a past.
    pub const NOTHING_KNOWN: f32 = -1.0;

    /// Variance of a mean of `count` samples, from mean and mean of squares of these.
    pub fn mean_variance(mean: f32, mean_of_squares: f32, count: f32) -> f32 {
        sample_variance(mean, mean_of_squares, count) / max(count, 1.0)
    }

    /// Variance of a pixel's samples as it is seen: the larger one of what the pixel itself says of it, and what those around it do.
    /// For the others see [`seen_variance`].
    pub fn seen_noise(own: f32, around: f32, mean: f32, white: f32) -> f32 {
        seen_variance(max(own, around), mean, white)
    }

    /// The noise around a pixel spreads to it: `most` so far, and that of a neighbour `away` pixels from it, which counts less by
    /// how far away it is, to nothing beyond `radius`.
    ///
    /// It is that of a sample, so that a neighbour whose past is short does not ask for samples of a pixel whose past is long; and one
    /// without a past asks for itself only.
    pub fn spread_noise(most: f32, noise: f32, away: u32, radius: u32) -> f32 {
        max(most, noise * (1.0 - f32(away) / f32(radius + 1u32)))
    }

    /// Noise of a pixel's mean from that of its samples; where nothing was known of it, the most that can be.
    pub fn noise_of_mean(noise: f32, count: f32) -> f32 {
        select(noise / max(count, 1.0), 1.0, noise == NOTHING_KNOWN)
    }

    /// Whether a pixel that needs no samples gets one for the sake of what may have changed: once in `period` frames on average.
    /// `u`: uniform number in `[0, 1)`.
    pub fn is_refreshed(u: f32, period: u32) -> bool {
        period > 0u32 && u * f32(period) < 1.0
    }

    /// What a frame can afford of what its pixels want, for [`samples_afforded`].
    pub fn affordable_share(affordable: u32, wanted: u32) -> f32 {
        f32(affordable) / max(f32(wanted), 1.0)
    }

    /// Noise as a grey: what is tolerated is shown as one half.
    pub fn shown_noise(noise: f32, tolerance: f32) -> f32 {
        0.5 * noise / tolerance
    }

    /// A number of samples as a grey, of which `most` are white.
    pub fn shown_samples(count: f32, most: f32) -> f32 {
        count / max(most, 1.0)
    }

    /// Samples that a pixel still needs until the variance of its mean is at most `tolerance`.
    ///
    /// - `variance`: of one sample, as the tolerance has it. `kept`: samples that its history is worth.
    pub fn samples_missing(variance: f32, kept: f32, tolerance: f32) -> f32 {
        max(variance / max(tolerance, 1e-20) - kept, 0.0)
    }

    /// Samples of a pixel in this frame: none if none is missing, else from `least` to `most`.
    pub fn samples_wanted(missing: f32, least: u32, most: u32) -> u32 {
        let whole = u32(clamp(ceil(missing), 0.0, 65536.0));
        select(min(max(whole, least), max(most, least)), 0u32, missing <= 0.0)
    }

    /// A number of samples scaled to what a frame can afford, rounded at random so that the mean is kept.
    ///
    /// - `wanted`: samples. `scale`: in `[0, 1]`. `u`: uniform number in `[0, 1)`.
    pub fn samples_afforded(wanted: u32, scale: f32, u: f32) -> u32 {
        u32(floor(f32(wanted) * clamp(scale, 0.0, 1.0) + u))
    }
}

#[cfg(test)]
mod tests {
    use super::allocation::*;

    #[test]
    fn variances_are_those_of_the_definition() {
        // 1, 3: mean 2, squares 5, variance 2.
        assert!((sample_variance(2.0, 5.0, 2.0) - 2.0).abs() < 1e-6);
        assert_eq!(sample_variance(2.0, 5.0, 1.0), 0.0);
        assert_eq!(sample_variance(2.0, 3.9, 8.0), 0.0, "rounding makes no negative variance");
    }

    /// The slope of what is seen, by differences.
    #[test]
    fn bright_noise_is_seen_less() {
        for (mean, white) in [(0.0f32, 1.0f32), (0.3, 1.0), (5.0, 2.0), (100.0, 0.5)] {
            let shown = |y: f32| f64::from(y) / (f64::from(y) + f64::from(white));
            let h = 1e-2 * (mean + white);
            let slope = (shown(mean + h) - shown(mean - h)) / (2.0 * f64::from(h));
            let seen = f64::from(seen_variance(0.04, mean, white));
            assert!((seen / (0.04 * slope * slope) - 1.0).abs() < 1e-3, "{mean} {white}: {seen}");
        }
    }

    #[test]
    fn pixels_get_what_they_need_and_no_more() {
        let need = |variance, kept| samples_wanted(samples_missing(variance, kept, 0.001), 4, 16);
        assert_eq!(need(1.0, 0.0), 16);
        assert_eq!(need(0.01, 0.0), 10);
        assert_eq!(need(0.01, 9.0), 4, "at least the least");
        assert_eq!(need(0.01, 10.0), 0, "converged");
        assert_eq!(need(0.0, 0.0), 0);
        assert_eq!(samples_wanted(f32::INFINITY, 4, 16), 16);
    }

    #[test]
    fn noise_spreads_less_far_away() {
        assert_eq!(spread_noise(0.0, 1.0, 0, 3), 1.0);
        assert_eq!(spread_noise(0.0, 1.0, 2, 3), 0.5);
        assert_eq!(spread_noise(0.7, 1.0, 2, 3), 0.7);
        assert_eq!(noise_of_mean(NOTHING_KNOWN, 0.0), 1.0);
        assert_eq!(noise_of_mean(0.5, 2.0), 0.25);
    }

    /// What is left after rounding is what the scale says, on average.
    #[test]
    fn budgets_are_kept_on_average() {
        let n = 10_000;
        let sum: u32 = (0..n).map(|i| samples_afforded(7, 0.3, (i as f32 + 0.5) / n as f32)).sum();
        assert!((f64::from(sum) / f64::from(n) - 2.1).abs() < 1e-3);
        assert_eq!(samples_afforded(16, 1.0, 0.999), 16);
    }
}
