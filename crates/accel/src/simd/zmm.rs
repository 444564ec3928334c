//! Sixteen lanes in a `zmm` register.

use super::avx512::Avx512;
use super::{Arithmetic, Sixteen};
use std::arch::x86_64::*;

/// Proof that the processor has AVX-512 F, VL, DQ and BW.
#[derive(Clone, Copy)]
pub(crate) struct Avx512Sixteen(());

impl Avx512Sixteen {
    /// The instructions are the same as those for eight lanes.
    #[inline(always)]
    pub fn new(_: Avx512) -> Self {
        Avx512Sixteen(())
    }
}

impl Arithmetic for Avx512Sixteen {
    type F = __m512;
    type U = __m512i;
    type M = __mmask16;

    #[inline(always)]
    fn splat(self, x: f32) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_set1_ps(x) }
    }

    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_sub_ps(a, b) }
    }

    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_mul_ps(a, b) }
    }

    #[inline(always)]
    fn div(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_div_ps(a, b) }
    }

    #[inline(always)]
    fn min(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_min_ps(a, b) }
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
    fn neg_mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_fnmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn flip_sign(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe {
            let (a, b) = (_mm512_castps_si512(a), _mm512_castps_si512(b));
            // a ^ (b & sign)
            _mm512_castsi512_ps(_mm512_ternarylogic_epi32::<0x78>(a, b, _mm512_set1_epi32(i32::MIN)))
        }
    }

    #[inline(always)]
    fn lt(self, a: __m512, b: __m512) -> __mmask16 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
    }

    #[inline(always)]
    fn le(self, a: __m512, b: __m512) -> __mmask16 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) }
    }

    #[inline(always)]
    fn and(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a & b
    }

    #[inline(always)]
    fn or(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a | b
    }

    #[inline(always)]
    fn bits(self, m: __mmask16) -> u32 {
        u32::from(m)
    }

    #[inline(always)]
    fn select(self, m: __mmask16, a: __m512, b: __m512) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_mask_blend_ps(m, a, b) }
    }

    #[inline(always)]
    fn bits_as_f(self, x: __m512i) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_castsi512_ps(x) }
    }

    #[inline(always)]
    fn splat_u(self, x: u32) -> __m512i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_set1_epi32(x as i32) }
    }

    #[inline(always)]
    fn select_u(self, m: __mmask16, a: __m512i, b: __m512i) -> __m512i {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_mask_blend_epi32(m, a, b) }
    }
}

impl Sixteen<Avx512> for Avx512Sixteen {
    #[inline(always)]
    fn join(self, [low, high]: [__m256; 2]) -> __m512 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high) }
    }

    #[inline(always)]
    fn halves(self, x: __m512) -> [__m256; 2] {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { [_mm512_castps512_ps256(x), _mm512_extractf32x8_ps::<1>(x)] }
    }

    #[inline(always)]
    fn halves_u(self, x: __m512i) -> [__m256i; 2] {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { [_mm512_castsi512_si256(x), _mm512_extracti32x8_epi32::<1>(x)] }
    }
}
