//! Eight lanes with AVX-512 masks and compression.

use super::ymm::{ymm_arithmetic, ymm_operations};
use super::zmm::Avx512Sixteen;
use super::{Arithmetic, Outlined, Simd};
use crate::layout::WIDTH;
use std::arch::x86_64::*;
use std::hint::black_box;

/// Proof that the processor has AVX-512 F, VL, DQ and BW.
#[derive(Clone, Copy)]
pub(crate) struct Avx512 {
    /// Lanes that get the smaller key in a stage of the sorting network: every second lane, every
    /// second pair, the upper half. `black_box` hides their values from the compiler, which would
    /// otherwise replace masked instructions by slower blends.
    odd: __mmask8,
    pairs: __mmask8,
    upper: __mmask8,
}

impl Avx512 {
    /// # Safety
    ///
    /// The processor must have AVX-512 F, VL, DQ and BW.
    #[inline(always)]
    pub unsafe fn new() -> Self {
        Avx512 { odd: black_box(0b1010_1010), pairs: black_box(0b1100_1100), upper: black_box(0b1111_0000) }
    }
}

impl Arithmetic for Avx512 {
    type F = __m256;
    type U = __m256i;
    type M = __mmask8;

    ymm_arithmetic!();

    #[inline(always)]
    fn lt(self, a: __m256, b: __m256) -> __mmask8 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
    }

    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> __mmask8 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b) }
    }

    #[inline(always)]
    fn and(self, a: __mmask8, b: __mmask8) -> __mmask8 {
        a & b
    }

    #[inline(always)]
    fn or(self, a: __mmask8, b: __mmask8) -> __mmask8 {
        a | b
    }

    #[inline(always)]
    fn bits(self, m: __mmask8) -> u32 {
        m as u32
    }

    #[inline(always)]
    fn select(self, m: __mmask8, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_mask_blend_ps(m, a, b) }
    }

    #[inline(always)]
    fn select_u(self, m: __mmask8, a: __m256i, b: __m256i) -> __m256i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_mask_blend_epi32(m, a, b) }
    }

    #[inline(always)]
    fn flip_sign(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let (a, b) = (_mm256_castps_si256(a), _mm256_castps_si256(b));
            // a ^ (b & sign)
            _mm256_castsi256_ps(_mm256_ternarylogic_epi32::<0x78>(a, b, _mm256_set1_epi32(i32::MIN)))
        }
    }
}

impl Simd for Avx512 {
    type Sixteen = Avx512Sixteen;

    ymm_operations!();

    #[inline(always)]
    fn sixteen(self) -> Self::Sixteen {
        Avx512Sixteen::new(self)
    }

    #[inline(always)]
    fn keys(self, distance: __m256, m: Self::M) -> __m256i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            // lane | (distance & !7)
            let keys = _mm256_ternarylogic_epi32::<0xF8>(
                lanes,
                _mm256_castps_si256(distance),
                _mm256_set1_epi32(!7),
            );
            _mm256_mask_blend_epi32(m, _mm256_set1_epi32(-1), keys)
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
            x = _mm256_mask_min_epi32(_mm256_max_epi32(x, y), self.odd, x, y);
            let y = _mm256_shuffle_epi32::<0b00_01_10_11>(x);
            x = _mm256_mask_min_epi32(_mm256_max_epi32(x, y), self.pairs, x, y);
            let y = _mm256_shuffle_epi32::<0b10_11_00_01>(x);
            x = _mm256_mask_min_epi32(_mm256_max_epi32(x, y), self.odd, x, y);
            let y = _mm256_permutevar8x32_epi32(x, _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0));
            x = _mm256_mask_min_epi32(_mm256_max_epi32(x, y), self.upper, x, y);
            let y = _mm256_shuffle_epi32::<0b01_00_11_10>(x);
            x = _mm256_mask_min_epi32(_mm256_max_epi32(x, y), self.pairs, x, y);
            let y = _mm256_shuffle_epi32::<0b10_11_00_01>(x);
            x = _mm256_mask_min_epi32(_mm256_max_epi32(x, y), self.odd, x, y);
            x
        }
    }

    #[inline(always)]
    fn compress(self, x: __m256i, m: __mmask8, _: u32) -> __m256i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm256_maskz_compress_epi32(m, x) }
    }

    #[inline(always)]
    fn call(self, outlined: impl Outlined<Self>) {
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        #[inline(never)]
        fn compiled(s: Avx512, outlined: impl Outlined<Avx512>) {
            outlined.run(s);
        }
        // SAFETY: `self` proves that the instructions exist.
        unsafe { compiled(self, outlined) };
    }
}
