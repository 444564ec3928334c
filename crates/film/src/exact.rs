//! Sums that do not depend on the order of their terms.

use std::ops::AddAssign;

/// A sum of finite numbers in 128-bit fixed point, in steps of 2⁻⁶⁴ (5·10⁻²⁰).
///
/// Floating-point addition is not associative, so a picture added up tile by tile, or by several machines, would
/// differ in its last bits from one made whole. Integer addition is associative: any split and any order gives
/// the same bits. Each term is cut towards zero to a multiple of 2⁻⁶⁴ as it comes in; that, not the addition, is the
/// only error. The sum saturates at ±2⁶³ (9·10¹⁸).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ExactSum(i128);

impl ExactSum {
    /// The sum of no terms.
    pub const ZERO: Self = Self(0);

    /// The sum with the single term `x`, which must be finite: NaN counts as a huge number here. Check first.
    #[inline]
    #[must_use]
    pub fn from_f64(x: f64) -> Self {
        // Without branches but for the rare overflow: dark, bright and black samples mix in every picture.
        let bits = x.to_bits();
        let exponent = ((bits >> 52) & 0x7ff) as i32;
        // |x| = mantissa · 2^(exponent - 1086), with the leading one of the mantissa in bit 63. In steps of 2⁻⁶⁴, that
        // is (mantissa << 64) >> shift. Subnormal numbers are far below the step and become zero.
        let mantissa = (bits << 11) | (1 << 63);
        let shift = 1086 - exponent;
        let mantissa = if shift < 128 { mantissa } else { 0 };
        let magnitude =
            if shift > 0 { ((u128::from(mantissa) << 64) >> (shift & 127)) as i128 } else { i128::MAX };
        let sign = i128::from(bits as i64 >> 63);
        Self((magnitude ^ sign) - sign)
    }

    /// The sum, rounded to the nearest `f64`.
    #[inline]
    #[must_use]
    pub fn to_f64(self) -> f64 {
        const STEP: f64 = 1.0 / 18_446_744_073_709_551_616.0; // 2⁻⁶⁴
        self.0 as f64 * STEP
    }

    /// The sum in steps of 2⁻⁶⁴, for storing it without loss.
    #[must_use]
    pub fn to_bits(self) -> i128 {
        self.0
    }

    /// The inverse of [`ExactSum::to_bits`].
    #[must_use]
    pub fn from_bits(bits: i128) -> Self {
        Self(bits)
    }
}

/// Sums of eight series of numbers in `[0, 2³⁷]`, of at most 2048 terms each, on the way to [`ExactSum`]s: the same bits, in
/// vector registers.
///
/// Each term is cut into a multiple of 2⁻¹⁴ and a rest, each rest into steps of 2⁻⁶⁴; both are integers in 64 bits. To find them
/// takes no conversion: the last bits of a sum with a large number ([`COARSE`], [`FINE`]) are the other term in fixed point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ExactLanes {
    coarse: [u64; 8],
    fine: [u64; 8],
    count: u64,
}

/// Numbers from this to twice this are 2⁻¹⁴ apart.
const COARSE: f64 = 274_877_906_944.0; // 2³⁸
/// Numbers within a third of this are 2⁻⁶⁴ apart.
const FINE: f64 = 1.5 / 4096.0; // 1.5·2⁻¹²

impl ExactLanes {
    /// How many numbers may be added to each sum.
    pub const MAX_COUNT: u64 = 2048;
    /// The largest number that may be added.
    pub const MAX_TERM: f64 = COARSE / 2.0;

    /// Adds one number to each sum.
    #[inline(always)]
    pub fn add(&mut self, terms: [f64; 8]) {
        for (lane, x) in terms.into_iter().enumerate() {
            let with_coarse = x + COARSE;
            // From -2⁻¹⁵ to 2⁻¹⁵; no difference here is rounded.
            let rest = x - (with_coarse - COARSE);
            let with_fine = rest + FINE;
            // What has been rounded up is one step too large.
            let too_large = u64::from(with_fine - FINE > rest);
            self.coarse[lane] = self.coarse[lane].wrapping_add(with_coarse.to_bits());
            self.fine[lane] = self.fine[lane].wrapping_add(with_fine.to_bits()).wrapping_sub(too_large);
        }
        self.count += 1;
    }

    /// How many numbers have been added to each sum.
    #[inline(always)]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// One of the sums.
    #[inline(always)]
    pub fn sum(&self, lane: usize) -> ExactSum {
        let without = |sum: u64, each: f64| sum.wrapping_sub(each.to_bits().wrapping_mul(self.count));
        // At most 2048 terms of 2⁵¹ steps of 2⁻¹⁴, or of 2⁴⁹ steps of 2⁻⁶⁴, which may be negative.
        let coarse = i128::from(without(self.coarse[lane], COARSE));
        let fine = i128::from(without(self.fine[lane], FINE) as i64);
        ExactSum((coarse << 50) + fine)
    }
}

impl AddAssign for ExactSum {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.0 = self.0.saturating_add(other.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_above_the_step_survive_exactly() {
        for x in [0.0, -0.0, 1.0, -1.0, 0.1_f32, 1e-9, -3.25e7, 1.0e12, 2f32.powi(-40)] {
            assert_eq!(ExactSum::from_f64(f64::from(x)).to_f64(), f64::from(x), "{x}");
        }
        assert_eq!(ExactSum::from_f64(2f64.powi(-64)).to_bits(), 1);
        assert_eq!(ExactSum::from_f64(2f64.powi(-65)).to_bits(), 0);
        assert_eq!(ExactSum::from_f64(f64::MIN_POSITIVE / 2.0).to_bits(), 0);
    }

    #[test]
    fn huge_numbers_saturate() {
        let mut sum = ExactSum::from_f64(1e30);
        assert_eq!(sum.to_bits(), i128::MAX);
        sum += ExactSum::from_f64(1e30);
        assert_eq!(sum.to_bits(), i128::MAX);
        assert_eq!(ExactSum::from_f64(-1e30).to_bits(), -i128::MAX);
        let below = 2f64.powi(63) * (1.0 - f64::EPSILON / 2.0);
        assert_eq!(ExactSum::from_f64(below).to_f64(), below);
    }

    proptest! {
        #[test]
        fn lanes_sum_the_same_bits(
            terms in prop::collection::vec(prop::array::uniform8((0.0..1.0_f64, -90_i32..37)), 0..100),
        ) {
            let (mut lanes, mut sums) = (ExactLanes::default(), [ExactSum::ZERO; 8]);
            for row in &terms {
                // Sometimes exactly zero or a power of two.
                let row = row.map(|(x, e)| if x < 0.1 { 0.0 } else { x.clamp(0.5, 0.9) * 2f64.powi(e + 1) });
                let row = row.map(|x| x.min(ExactLanes::MAX_TERM));
                lanes.add(row);
                for (sum, x) in sums.iter_mut().zip(row) {
                    *sum += ExactSum::from_f64(x);
                }
            }
            for (lane, sum) in sums.iter().enumerate() {
                prop_assert_eq!(lanes.sum(lane), *sum);
            }
        }

        #[test]
        fn order_and_grouping_do_not_matter(
            terms in prop::collection::vec(-1e6_f32..1e6, 1..64),
            cut in 0_usize..64,
            exponent in -30_i32..6,
        ) {
            let terms: Vec<f64> = terms.iter().map(|&t| f64::from(t * 10f32.powi(exponent))).collect();
            let sum = |terms: &mut dyn Iterator<Item = f64>| {
                let mut sum = ExactSum::ZERO;
                terms.for_each(|t| sum += ExactSum::from_f64(t));
                sum
            };
            let whole = sum(&mut terms.iter().copied());
            let (a, b) = terms.split_at(cut.min(terms.len()));
            let mut parts = sum(&mut b.iter().rev().copied());
            parts += sum(&mut a.iter().copied());
            prop_assert_eq!(whole, parts);
            let plain: f64 = terms.iter().sum();
            let scale: f64 = terms.iter().map(|t| t.abs()).sum();
            prop_assert!((whole.to_f64() - plain).abs() <= 1e-12 * scale + 64.0 * 2f64.powi(-64));
        }
    }
}
