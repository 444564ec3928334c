//! [`Lanes`] of AVX2 with FMA, and of AVX-512.

use super::{Lanes, Sixteen, Stage};
use std::arch::is_x86_feature_detected;
use std::arch::x86_64::*;

/// Proof that the processor has AVX2 and FMA.
#[derive(Clone, Copy)]
pub struct Avx2(());

/// Proof that the processor has AVX-512 F, besides AVX2 and FMA.
#[derive(Clone, Copy)]
pub struct Avx512(());

impl Avx2 {
    /// If the processor has them.
    pub fn detect() -> Option<Self> {
        (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")).then_some(Self(()))
    }

    /// Runs a stage with twelve of the sixteen registers as accumulators.
    pub fn run(self, stage: impl Stage) {
        #[target_feature(enable = "avx2,fma")]
        fn run(lanes: Avx2, stage: impl Stage) {
            stage.run::<Avx2, 6>(lanes);
        }
        // SAFETY: `self` proves that the instructions exist.
        unsafe { run(self, stage) }
    }
}

impl Avx512 {
    /// If the processor has them.
    pub fn detect() -> Option<Self> {
        (Avx2::detect().is_some() && is_x86_feature_detected!("avx512f")).then_some(Self(()))
    }

    /// Runs a stage with twelve of the 32 registers as accumulators: the two multipliers take four
    /// cycles each, and what the widths of pictures are multiples of counts for more than a few
    /// registers.
    pub fn run(self, stage: impl Stage) {
        #[target_feature(enable = "avx2,fma,avx512f")]
        fn run(lanes: Avx512, stage: impl Stage) {
            stage.run::<Avx512, 12>(lanes);
        }
        // SAFETY: `self` proves that the instructions exist.
        unsafe { run(self, stage) }
    }
}

impl Lanes for Avx2 {
    type V = [__m256; 2];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::V {
        self.halves(value, value)
    }

    #[inline(always)]
    fn halves(self, low: f32, high: f32) -> Self::V {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { [_mm256_set1_ps(low), _mm256_set1_ps(high)] }
    }

    #[inline(always)]
    fn load(self, from: &Sixteen) -> Self::V {
        let from = from.as_ptr();
        // SAFETY: `self` proves that the instructions exist; sixteen numbers are two registers.
        unsafe { [_mm256_loadu_ps(from), _mm256_loadu_ps(from.add(8))] }
    }

    #[inline(always)]
    fn store(self, value: Self::V, to: &mut Sixteen) {
        let to = to.as_mut_ptr();
        // SAFETY: `self` proves that the instructions exist; sixteen numbers are two registers.
        unsafe {
            _mm256_storeu_ps(to, value[0]);
            _mm256_storeu_ps(to.add(8), value[1]);
        }
    }

    #[inline(always)]
    fn add(self, a: Self::V, b: Self::V) -> Self::V {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { [_mm256_add_ps(a[0], b[0]), _mm256_add_ps(a[1], b[1])] }
    }

    #[inline(always)]
    fn mul(self, a: Self::V, b: Self::V) -> Self::V {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { [_mm256_mul_ps(a[0], b[0]), _mm256_mul_ps(a[1], b[1])] }
    }

    #[inline(always)]
    fn max(self, a: Self::V, b: Self::V) -> Self::V {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { [_mm256_max_ps(a[0], b[0]), _mm256_max_ps(a[1], b[1])] }
    }

    #[inline(always)]
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { [_mm256_fmadd_ps(a[0], b[0], c[0]), _mm256_fmadd_ps(a[1], b[1], c[1])] }
    }

    #[inline(always)]
    fn power_of_two(self, rounded: Self::V) -> Self::V {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let one = _mm256_castps_si256(_mm256_set1_ps(1.0));
            let exponent = |v| _mm256_slli_epi32::<23>(_mm256_castps_si256(v));
            let [low, high] = [exponent(rounded[0]), exponent(rounded[1])];
            [
                _mm256_castsi256_ps(_mm256_add_epi32(low, one)),
                _mm256_castsi256_ps(_mm256_add_epi32(high, one)),
            ]
        }
    }
}

impl Lanes for Avx512 {
    type V = __m512;

    #[inline(always)]
    fn splat(self, value: f32) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_set1_ps(value) }
    }

    #[inline(always)]
    fn halves(self, low: f32, high: f32) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_mask_blend_ps(0xff00, _mm512_set1_ps(low), _mm512_set1_ps(high)) }
    }

    #[inline(always)]
    fn load(self, from: &Sixteen) -> __m512 {
        // SAFETY: `self` proves that the instructions exist; sixteen numbers are a register.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }

    #[inline(always)]
    fn store(self, value: __m512, to: &mut Sixteen) {
        // SAFETY: `self` proves that the instructions exist; sixteen numbers are a register.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), value) }
    }

    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_add_ps(a, b) }
    }

    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_mul_ps(a, b) }
    }

    #[inline(always)]
    fn max(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_max_ps(a, b) }
    }

    #[inline(always)]
    fn mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_fmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn power_of_two(self, rounded: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let one = _mm512_castps_si512(_mm512_set1_ps(1.0));
            let exponent = _mm512_slli_epi32::<23>(_mm512_castps_si512(rounded));
            _mm512_castsi512_ps(_mm512_add_epi32(exponent, one))
        }
    }
}
