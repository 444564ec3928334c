//! The estimate of one pixel.

use crate::ExactSum;
use crate::exact::ExactLanes;

/// What is known of one pixel's colour: sums over its samples, from which come mean, variance and standard error.
///
/// All sums are exact ([`ExactSum`]), so equal sets of samples give equal statistics whatever their order or
/// grouping. Every sample has weight one: a pixel filter is importance sampled, not splatted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelStats {
    sum: [ExactSum; 3],
    sum_of_squares: [ExactSum; 3],
    count: u64,
    invalid: u64,
}

impl PixelStats {
    /// The largest radiance that a sample may have in any channel: 2⁴⁰, about 1.1·10¹². What is beyond is dropped
    /// as invalid: it would not leave the exact sums enough room. Four million samples of this size still fit.
    pub const MAX_SAMPLE: f32 = 1_099_511_627_776.0;

    /// Adds one sample: linear RGB radiance.
    ///
    /// A sample with a channel that is NaN, infinite or beyond ±[`MAX_SAMPLE`](Self::MAX_SAMPLE) is not added but
    /// counted as invalid; then the result is `false`. A sample whose square is beyond 2⁶³ still has the right
    /// mean, but its variance is only a lower bound.
    #[inline]
    pub fn add(&mut self, rgb: [f32; 3]) -> bool {
        let valid = rgb.iter().all(|c| c.abs() <= Self::MAX_SAMPLE); // false for NaN
        if !valid {
            self.invalid += 1;
            return false;
        }
        for ((sum, square), &c) in self.sum.iter_mut().zip(&mut self.sum_of_squares).zip(&rgb) {
            let c = f64::from(c);
            *sum += ExactSum::from_f64(c);
            *square += ExactSum::from_f64(c * c);
        }
        self.count += 1;
        true
    }

    /// Adds samples one by one, as [`PixelStats::add`] does, but faster where they are many and neither negative nor
    /// huge.
    #[inline(always)]
    pub fn add_all(&mut self, samples: impl IntoIterator<Item = [f32; 3]>) {
        const LIMIT: f32 = 262_144.0; // 2¹⁸
        const { assert!(LIMIT as f64 * LIMIT as f64 <= ExactLanes::MAX_TERM, "squares must fit, too") };
        let mut lanes = ExactLanes::default();
        for rgb in samples {
            // Adding zero makes -0 positive. Negative numbers, infinity and NaN have larger bits than the limit.
            let [r, g, b] = rgb.map(|c| c + 0.0);
            let largest = r.to_bits().max(g.to_bits()).max(b.to_bits());
            if largest > LIMIT.to_bits() || lanes.count() == ExactLanes::MAX_COUNT {
                self.add(rgb);
                continue;
            }
            let [r, g, b] = [r, g, b].map(f64::from);
            lanes.add([r, g, b, 0.0, r * r, g * g, b * b, 0.0]);
        }
        for c in 0..3 {
            self.sum[c] += lanes.sum(c);
            self.sum_of_squares[c] += lanes.sum(c + 4);
        }
        self.count += lanes.count();
    }

    /// Adds `count` samples of which only the sums are known, as a GPU keeps them. The sums count as exact.
    ///
    /// If a sum is not finite, all `count` samples are dropped as invalid, and the result is `false`.
    pub fn add_sums(&mut self, sum: [f64; 3], sum_of_squares: [f64; 3], count: u64) -> bool {
        if !sum.iter().chain(&sum_of_squares).all(|s| s.is_finite()) {
            self.invalid += count;
            return false;
        }
        for c in 0..3 {
            self.sum[c] += ExactSum::from_f64(sum[c]);
            self.sum_of_squares[c] += ExactSum::from_f64(sum_of_squares[c].max(0.0));
        }
        self.count += count;
        true
    }

    /// Replaces the sums of one colour, 0 to 2.
    pub(crate) fn set_sums(&mut self, colour: usize, sum: ExactSum, sum_of_squares: ExactSum) {
        (self.sum[colour], self.sum_of_squares[colour]) = (sum, sum_of_squares);
    }

    /// Replaces the numbers of samples.
    pub(crate) fn set_counts(&mut self, count: u64, invalid: u64) {
        (self.count, self.invalid) = (count, invalid);
    }

    /// How many samples were taken, valid or not.
    #[must_use]
    pub fn taken(&self) -> u64 {
        self.count.saturating_add(self.invalid)
    }

    /// Counts `count` samples as invalid that something else has already dropped.
    pub fn add_invalid(&mut self, count: u64) {
        self.invalid += count;
    }

    /// Adds the samples of `other`.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        for c in 0..3 {
            self.sum[c] += other.sum[c];
            self.sum_of_squares[c] += other.sum_of_squares[c];
        }
        self.count += other.count;
        self.invalid += other.invalid;
    }

    /// How many samples were added, the invalid ones not included.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// How many samples were dropped as invalid.
    #[must_use]
    pub fn invalid(&self) -> u64 {
        self.invalid
    }

    /// The sum of the samples.
    #[must_use]
    pub fn sum(&self) -> [ExactSum; 3] {
        self.sum
    }

    /// The sum of the squares of the samples.
    #[must_use]
    pub fn sum_of_squares(&self) -> [ExactSum; 3] {
        self.sum_of_squares
    }

    /// The mean of the samples: the estimate of the pixel's radiance. Zero without samples.
    #[must_use]
    pub fn mean(&self) -> [f64; 3] {
        let n = self.count.max(1) as f64;
        self.sum.map(|s| s.to_f64() / n)
    }

    /// The unbiased variance of one sample, `(Σx² - (Σx)²/n) / (n - 1)`, at least zero. `None` below two samples.
    ///
    /// It takes the samples for independent. Low-discrepancy samples are better than that, so for them this
    /// variance, and the standard error that follows from it, is an upper estimate.
    #[must_use]
    pub fn variance(&self) -> Option<[f64; 3]> {
        if self.count < 2 {
            return None;
        }
        let n = self.count as f64;
        Some(std::array::from_fn(|c| {
            let sum = self.sum[c].to_f64();
            ((self.sum_of_squares[c].to_f64() - sum * (sum / n)) / (n - 1.0)).max(0.0)
        }))
    }

    /// The variance of the mean, `variance / n`. `None` below two samples.
    #[must_use]
    pub fn variance_of_mean(&self) -> Option<[f64; 3]> {
        Some(self.variance()?.map(|v| v / self.count as f64))
    }

    /// The standard error of the mean, `√(variance / n)`. `None` below two samples.
    #[must_use]
    pub fn standard_error(&self) -> Option<[f64; 3]> {
        Some(self.variance_of_mean()?.map(f64::sqrt))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_variance_of_known_samples() {
        let mut stats = PixelStats::default();
        assert_eq!((stats.mean(), stats.variance()), ([0.0; 3], None));
        for x in [1.0, 2.0, 3.0, 4.0] {
            assert!(stats.add([x, 10.0 * x, 0.25]));
        }
        assert_eq!(stats.count(), 4);
        assert_eq!(stats.mean(), [2.5, 25.0, 0.25]);
        let variance = stats.variance().unwrap();
        let expected = [5.0 / 3.0, 500.0 / 3.0, 0.0];
        assert!(variance.iter().zip(expected).all(|(v, e)| (v - e).abs() < 1e-12), "{variance:?}");
        assert!((stats.standard_error().unwrap()[0] - (5.0_f64 / 12.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn invalid_samples_are_counted_and_dropped() {
        let mut stats = PixelStats::default();
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2e12, f32::MAX] {
            assert!(!stats.add([1.0, bad, 1.0]));
        }
        assert!(!stats.add_sums([f64::NAN, 0.0, 0.0], [0.0; 3], 7));
        assert!(stats.add([PixelStats::MAX_SAMPLE, 1e-30, -1.0]));
        assert_eq!((stats.count(), stats.invalid()), (1, 12));
        assert!(stats.mean().iter().all(|m| m.is_finite()));
    }

    #[test]
    fn many_samples_at_once_are_the_same_bits() {
        let row = |i: u32| {
            let x = (i as f32 * 0.37).sin();
            match i % 50 {
                0 => [0.0, -0.0, 1e-30],
                1 => [f32::NAN, 1.0, 2.0],
                2 => [1e9, 3.0, 67_108_864.0],
                3 => [-1.0, x, x * x],
                _ => [x * x, x.abs() * 1e-9, 1e7 * x.abs()],
            }
        };
        let (mut one_by_one, mut at_once) = (PixelStats::default(), PixelStats::default());
        (0..5000).for_each(|i| {
            one_by_one.add(row(i));
        });
        at_once.add_all((0..5000).map(row));
        assert_eq!(one_by_one, at_once);
        assert!(at_once.invalid() > 0 && at_once.count() > 4000);
    }

    #[test]
    fn sums_and_samples_agree() {
        let (mut one_by_one, mut batch) = (PixelStats::default(), PixelStats::default());
        one_by_one.add([1.0, 2.0, 0.5]);
        one_by_one.add([3.0, 0.0, 0.5]);
        batch.add_sums([4.0, 2.0, 1.0], [10.0, 4.0, 0.5], 2);
        assert_eq!(one_by_one, batch);
    }
}
