//! Eight lanes with AVX2 and FMA.

use super::pair::Pair;
use super::ymm::{ymm_arithmetic, ymm_operations};
use super::{Arithmetic, Outlined, Simd};
use crate::layout::WIDTH;
use std::arch::x86_64::*;

/// Proof that the processor has AVX2 and FMA.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// # Safety
    ///
    /// The processor must have AVX2 and FMA.
    #[inline(always)]
    pub unsafe fn new() -> Self {
        Avx2(())
    }
}

impl Arithmetic for Avx2 {
    type F = __m256;
    type U = __m256i;
    type M = __m256;

    ymm_arithmetic!();

    #[inline(always)]
    fn lt(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a, b) }
    }

    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a, b) }
    }

    #[inline(always)]
    fn and(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_and_ps(a, b) }
    }

    #[inline(always)]
    fn or(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_or_ps(a, b) }
    }

    #[inline(always)]
    fn bits(self, m: __m256) -> u32 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_movemask_ps(m) as u32 }
    }

    #[inline(always)]
    fn select(self, m: __m256, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_blendv_ps(a, b, m) }
    }

    #[inline(always)]
    fn select_u(self, m: __m256, a: __m256i, b: __m256i) -> __m256i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_blendv_epi8(a, b, _mm256_castps_si256(m)) }
    }

    #[inline(always)]
    fn flip_sign(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_xor_ps(a, _mm256_and_ps(b, _mm256_set1_ps(-0.0))) }
    }
}

impl Simd for Avx2 {
    type Sixteen = Pair<Avx2>;

    ymm_operations!();

    #[inline(always)]
    fn sixteen(self) -> Self::Sixteen {
        Pair(self)
    }

    #[inline(always)]
    fn keys(self, distance: __m256, m: Self::M) -> __m256i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let keys = _mm256_and_si256(_mm256_castps_si256(distance), _mm256_set1_epi32(!7));
            let keys = _mm256_or_si256(keys, lanes);
            _mm256_or_si256(keys, _mm256_xor_si256(_mm256_castps_si256(m), _mm256_set1_epi32(-1)))
        }
    }

    #[inline(always)]
    fn least_key(self, keys: __m256i) -> u32 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let x = _mm_min_epu32(_mm256_castsi256_si128(keys), _mm256_extracti128_si256::<1>(keys));
            let x = _mm_min_epu32(x, _mm_shuffle_epi32::<0b01_00_11_10>(x));
            let x = _mm_min_epu32(x, _mm_shuffle_epi32::<0b10_11_00_01>(x));
            _mm_cvtsi128_si32(x) as u32
        }
    }

    #[inline(always)]
    fn sorted(self, keys: __m256i) -> __m256i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let mut x = keys;
            // Bitonic network: each stage compares every lane with a partner and leaves the larger
            // key in the lower lane.
            let y = _mm256_shuffle_epi32::<0b10_11_00_01>(x);
            x = _mm256_blend_epi32::<0b10101010>(_mm256_max_epi32(x, y), _mm256_min_epi32(x, y));
            let y = _mm256_shuffle_epi32::<0b00_01_10_11>(x);
            x = _mm256_blend_epi32::<0b11001100>(_mm256_max_epi32(x, y), _mm256_min_epi32(x, y));
            let y = _mm256_shuffle_epi32::<0b10_11_00_01>(x);
            x = _mm256_blend_epi32::<0b10101010>(_mm256_max_epi32(x, y), _mm256_min_epi32(x, y));
            let y = _mm256_permutevar8x32_epi32(x, _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0));
            x = _mm256_blend_epi32::<0b11110000>(_mm256_max_epi32(x, y), _mm256_min_epi32(x, y));
            let y = _mm256_shuffle_epi32::<0b01_00_11_10>(x);
            x = _mm256_blend_epi32::<0b11001100>(_mm256_max_epi32(x, y), _mm256_min_epi32(x, y));
            let y = _mm256_shuffle_epi32::<0b10_11_00_01>(x);
            x = _mm256_blend_epi32::<0b10101010>(_mm256_max_epi32(x, y), _mm256_min_epi32(x, y));
            x
        }
    }

    #[inline(always)]
    fn compress(self, x: __m256i, _: __m256, bits: u32) -> __m256i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_permutevar8x32_epi32(x, self.load_u(&super::SET_BITS[(bits & 255) as usize])) }
    }

    #[inline(always)]
    fn call(self, outlined: impl Outlined<Self>) {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        #[inline(never)]
        fn compiled(s: Avx2, outlined: impl Outlined<Avx2>) {
            outlined.run(s);
        }
        // SAFETY: `self` proves that the instructions exist.
        unsafe { compiled(self, outlined) };
    }
}
