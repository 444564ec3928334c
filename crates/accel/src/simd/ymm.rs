//! Operations on `ymm` registers that AVX2 and AVX-512 have in common.

/// Common methods of [`super::Arithmetic`]. The invoking module has the intrinsics in scope.
macro_rules! ymm_arithmetic {
    () => {
        #[inline(always)]
        fn splat(self, x: f32) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_set1_ps(x) }
        }

        #[inline(always)]
        fn add(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_add_ps(a, b) }
        }

        #[inline(always)]
        fn sub(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_sub_ps(a, b) }
        }

        #[inline(always)]
        fn mul(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_mul_ps(a, b) }
        }

        #[inline(always)]
        fn div(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_div_ps(a, b) }
        }

        #[inline(always)]
        fn min(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_min_ps(a, b) }
        }

        #[inline(always)]
        fn max(self, a: __m256, b: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_max_ps(a, b) }
        }

        #[inline(always)]
        fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_fmadd_ps(a, b, c) }
        }

        #[inline(always)]
        fn neg_mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_fnmadd_ps(a, b, c) }
        }

        #[inline(always)]
        fn splat_u(self, x: u32) -> __m256i {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_set1_epi32(x as i32) }
        }

        #[inline(always)]
        fn bits_as_f(self, x: __m256i) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_castsi256_ps(x) }
        }
    };
}

/// Common methods of [`super::Simd`].
macro_rules! ymm_operations {
    () => {
        #[inline(always)]
        fn transposed(self, [a, b, c, d, e, f, g, h]: [__m256; WIDTH]) -> [__m256; WIDTH] {
            // SAFETY: `self` proves that the instructions exist.
            unsafe {
                // Pairs of numbers of two rows, pairs of pairs, halves.
                let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
                let (ef, gh) = (_mm256_unpacklo_ps(e, f), _mm256_unpacklo_ps(g, h));
                let (ab_high, cd_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
                let (ef_high, gh_high) = (_mm256_unpackhi_ps(e, f), _mm256_unpackhi_ps(g, h));
                let abcd = [
                    _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
                    _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
                    _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
                    _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
                ];
                let efgh = [
                    _mm256_shuffle_ps::<0b01_00_01_00>(ef, gh),
                    _mm256_shuffle_ps::<0b11_10_11_10>(ef, gh),
                    _mm256_shuffle_ps::<0b01_00_01_00>(ef_high, gh_high),
                    _mm256_shuffle_ps::<0b11_10_11_10>(ef_high, gh_high),
                ];
                [
                    _mm256_permute2f128_ps::<0x20>(abcd[0], efgh[0]),
                    _mm256_permute2f128_ps::<0x20>(abcd[1], efgh[1]),
                    _mm256_permute2f128_ps::<0x20>(abcd[2], efgh[2]),
                    _mm256_permute2f128_ps::<0x20>(abcd[3], efgh[3]),
                    _mm256_permute2f128_ps::<0x31>(abcd[0], efgh[0]),
                    _mm256_permute2f128_ps::<0x31>(abcd[1], efgh[1]),
                    _mm256_permute2f128_ps::<0x31>(abcd[2], efgh[2]),
                    _mm256_permute2f128_ps::<0x31>(abcd[3], efgh[3]),
                ]
            }
        }

        #[inline(always)]
        fn load(self, x: &[f32; WIDTH]) -> __m256 {
            // SAFETY: `self` proves that the instruction exists; `x` is eight lanes long.
            unsafe { _mm256_loadu_ps(x.as_ptr()) }
        }

        #[inline(always)]
        fn store(self, x: __m256, to: &mut [f32; WIDTH]) {
            // SAFETY: `self` proves that the instruction exists; `to` is eight lanes long.
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), x) }
        }

        #[inline(always)]
        fn sqrt(self, a: __m256) -> __m256 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_sqrt_ps(a) }
        }

        #[inline(always)]
        fn load_u(self, x: &[u32; WIDTH]) -> __m256i {
            // SAFETY: `self` proves that the instruction exists; `x` is eight lanes long.
            unsafe { _mm256_loadu_si256(x.as_ptr().cast()) }
        }

        #[inline(always)]
        fn store_u(self, x: __m256i, to: &mut [u32; WIDTH]) {
            // SAFETY: `self` proves that the instruction exists; `to` is eight lanes long.
            unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), x) }
        }

        #[inline(always)]
        fn permute(self, table: __m256i, index: __m256i) -> __m256i {
            // SAFETY: `self` proves that the instructions exist.
            unsafe { _mm256_permutevar8x32_epi32(table, index) }
        }

        #[inline(always)]
        fn least(self, a: __m256) -> f32 {
            // SAFETY: `self` proves that the instructions exist.
            unsafe {
                let x = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
                let x = _mm_min_ps(x, _mm_movehl_ps(x, x));
                _mm_cvtss_f32(_mm_min_ss(x, _mm_movehdup_ps(x)))
            }
        }

        #[inline(always)]
        fn prefetch<const N: usize>(self, first: *const u8) {
            for line in 0..N {
                // SAFETY: prefetching has no effect that the program can see, whatever the address.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(first.wrapping_add(64 * line).cast()) };
            }
        }
    };
}

pub(super) use {ymm_arithmetic, ymm_operations};
