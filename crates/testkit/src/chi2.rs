//! The χ² test: do samples follow the density that they claim?

use crate::{SIGNIFICANCE, chi2_p_value, sidak};

/// Cells with a smaller expected count are pooled: below it, the statistic does not follow the χ² distribution.
const MIN_EXPECTED: f64 = 5.0;

/// The result of a χ² test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chi2 {
    /// Pearson's statistic, `Σ (observed - expected)² / expected` over the cells after pooling.
    pub statistic: f64,
    /// Degrees of freedom: the number of cells after pooling, less one. With a single cell it is zero, and the p-value
    /// is that of its total.
    pub degrees: usize,
    /// The chance of a statistic at least as large if the samples follow the density. Zero if samples fell where
    /// the density is zero.
    pub p_value: f64,
    /// How many bins went into the pooled cells.
    pub pooled: usize,
    /// The bin with the largest share in the statistic, and that share.
    pub worst: (usize, f64),
}

/// Pearson's χ² test of bin counts.
///
/// - `observed`: how many samples fell into each bin.
/// - `expected`: how many should have: the number of samples times the integral of the density over the bin. The
///   counts are *not* scaled to agree, so a density that does not integrate to one fails. If the sampler may fail to
///   give a sample, count that as one more bin.
///
/// Bins that expect fewer than five samples are pooled, smallest first. The expected counts need an accurate
/// integration: with a million samples, an error of 0.1 % in each of 1000 bins is already half of the allowance.
///
/// Power: with `n` samples in `k` bins, a density that is wrong by a relative root mean square `e` raises the statistic
/// by `n·e²`, and it is caught for sure at about `5·√(2k)` above the mean; for k = 1000 and e = 3 %, n = 250,000.
///
/// # Panics
/// If the slices differ in length, are empty, or an expected count is negative or not finite.
#[must_use]
pub fn chi2_test(observed: &[u64], expected: &[f64]) -> Chi2 {
    assert!(!observed.is_empty() && observed.len() == expected.len(), "nothing to compare");
    let bad = expected.iter().position(|e| !(e.is_finite() && *e >= 0.0));
    assert!(bad.is_none(), "bin {bad:?} has an impossible expected count");

    // An expected count that is only rounding must not excuse samples that cannot be.
    let impossible = (0..observed.len()).find(|&i| observed[i] > 0 && expected[i] < 1e-9);
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));

    let mut cells: Vec<(f64, f64, usize)> = Vec::new(); // observed, expected, first bin
    let (mut open, mut pooled) = ((0.0, 0.0, order[0]), 0);
    for bin in order {
        let (o, e) = (observed[bin] as f64, expected[bin]);
        if open.1 == 0.0 && open.0 == 0.0 && e >= MIN_EXPECTED {
            cells.push((o, e, bin));
            continue;
        }
        open = (open.0 + o, open.1 + e, bin);
        pooled += 1;
        if open.1 >= MIN_EXPECTED {
            cells.push(open);
            open = (0.0, 0.0, bin);
        }
    }
    if open.0 > 0.0 || open.1 > 0.0 {
        match cells.last_mut() {
            Some(last) => *last = (last.0 + open.0, last.1 + open.1, last.2),
            None => cells.push(open),
        }
    }

    let mut statistic = 0.0;
    let mut worst = (0, 0.0);
    for &(o, e, bin) in &cells {
        let share = if e > 0.0 { (o - e) * (o - e) / e } else { 0.0 };
        statistic += share;
        if share > worst.1 {
            worst = (bin, share);
        }
    }
    let degrees = cells.len().saturating_sub(1);
    // A single cell has no freedom, but its total can still be wrong.
    let mut p_value = chi2_p_value(statistic, degrees.max(1));
    if let Some(bin) = impossible {
        p_value = 0.0;
        worst = (bin, f64::INFINITY);
    }
    Chi2 { statistic, degrees, p_value, pooled, worst }
}

/// Asserts that bin counts follow the expected ones (see [`chi2_test`]). A correct sampler fails with a chance below
/// 0.1 % over all `tests` calls together (Šidák correction): pass how many times the test calls this.
///
/// # Panics
/// If they do not, saying `what` failed, and as [`chi2_test`] does.
#[track_caller]
pub fn assert_chi2(what: &str, observed: &[u64], expected: &[f64], tests: usize) {
    let result = chi2_test(observed, expected);
    let least = sidak(SIGNIFICANCE, tests);
    let (bin, share) = result.worst;
    assert!(
        result.p_value >= least,
        "{what}: samples do not follow the density: χ² = {:.1} with {} degrees of freedom, p = {:.3e} < {least:.3e}; \
         worst bin {bin}: observed {}, expected {:.2} (share {share:.1}); in total observed {}, expected {:.2}",
        result.statistic,
        result.degrees,
        result.p_value,
        observed[bin],
        expected[bin],
        observed.iter().sum::<u64>(),
        expected.iter().sum::<f64>(),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;

    /// Samples of the density `1 + slope·(2x - 1)` on `[0, 1)` by inversion, in `bins` bins.
    fn histogram(slope: f64, bins: usize, n: usize, seed: u64) -> Vec<u64> {
        let mut random = Random::new(seed);
        let mut counts = vec![0; bins];
        for _ in 0..n {
            let u = random.uniform();
            let x = if slope == 0.0 {
                u
            } else {
                let b = 1.0 - slope;
                (-b + (b * b + 4.0 * slope * u).sqrt()) / (2.0 * slope)
            };
            counts[((x * bins as f64) as usize).min(bins - 1)] += 1;
        }
        counts
    }

    fn expected(slope: f64, bins: usize, n: usize) -> Vec<f64> {
        let cdf = |x: f64| (1.0 - slope) * x + slope * x * x;
        let edge = |i: usize| i as f64 / bins as f64;
        (0..bins).map(|i| n as f64 * (cdf(edge(i + 1)) - cdf(edge(i)))).collect()
    }

    #[test]
    fn correct_samplers_pass() {
        for seed in 0..20 {
            for slope in [0.0, 0.5, 1.0] {
                assert_chi2(
                    "linear",
                    &histogram(slope, 200, 50_000, seed),
                    &expected(slope, 200, 50_000),
                    60,
                );
            }
        }
    }

    #[test]
    fn p_values_are_uniform() {
        let n = 400;
        let p = |seed| chi2_test(&histogram(0.0, 50, 5000, seed), &expected(0.0, 50, 5000)).p_value;
        let mut counts = [0; 10];
        (0..n).for_each(|seed| counts[((p(seed + 1000) * 10.0) as usize).min(9)] += 1);
        assert_chi2("p-values", &counts, &[n as f64 / 10.0; 10], 1);
    }

    #[test]
    #[should_panic(expected = "samples do not follow the density")]
    fn a_sampler_with_a_slightly_wrong_slope_is_caught() {
        assert_chi2("biased", &histogram(0.53, 200, 1_000_000, 1), &expected(0.5, 200, 1_000_000), 60);
    }

    #[test]
    #[should_panic(expected = "samples do not follow the density")]
    fn a_density_that_does_not_integrate_to_one_is_caught() {
        let expected: Vec<f64> = expected(0.5, 20, 100_000).iter().map(|e| e * 1.02).collect();
        assert_chi2("not normalised", &histogram(0.5, 20, 100_000, 1), &expected, 1);
    }

    #[test]
    #[should_panic(expected = "worst bin 2: observed 1")]
    fn a_sample_where_the_density_is_zero_is_caught() {
        assert_chi2("impossible", &[500, 499, 1], &[500.0, 500.0, 0.0], 1);
    }

    #[test]
    #[should_panic(expected = "samples do not follow")]
    fn a_single_cell_with_a_wrong_total_is_caught() {
        assert_chi2("total", &[850], &[1000.0], 1);
    }

    #[test]
    fn small_bins_are_pooled() {
        let result = chi2_test(&[1, 0, 2, 3, 50], &[1.0, 1.0, 2.0, 2.0, 50.0]);
        assert_eq!((result.pooled, result.degrees), (4, 1));
        assert!(result.p_value > 0.5);
        let empty = chi2_test(&[0, 0], &[0.0, 0.0]);
        assert_eq!((empty.degrees, empty.p_value), (0, 1.0));
    }
}
