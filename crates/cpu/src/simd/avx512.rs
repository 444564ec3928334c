//! [`Instructions`] of AVX-512.

use super::avx2::Avx2;
use super::{Instructions, LANES, Stage, fetch_nothing};
use std::arch::is_x86_feature_detected;
use std::arch::x86_64::*;

/// Proof that the processor has AVX-512 F, VL, DQ and BW, and all of [`Avx2`]; if `GFNI`, also GFNI, as all have that are younger than
/// 2019: the compiler uses it to reverse bits, which random numbers do all the time.
#[derive(Clone, Copy)]
pub(crate) struct Avx512<const GFNI: bool>(());

impl<const GFNI: bool> Avx512<GFNI> {
    /// If the processor has them.
    pub fn detect() -> Option<Self> {
        let has = Avx2::detect().is_some()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw")
            && (!GFNI || is_x86_feature_detected!("gfni"));
        has.then_some(Avx512(()))
    }

    /// The places of the lanes in `mask`, which must be below `length`; zero for the others.
    #[inline(always)]
    fn checked(self, index: &[u32; LANES], mask: u32, length: usize) -> [u32; LANES] {
        let mut checked = [0; LANES];
        // SAFETY: `self` proves that the instructions exist; both arrays are sixteen lanes long.
        unsafe {
            let places = _mm512_maskz_loadu_epi32(mask as u16, index.as_ptr().cast());
            let length = _mm512_set1_epi32(length.min(i32::MAX as usize) as i32);
            assert!(_mm512_cmpge_epu32_mask(places, length) == 0, "no such place");
            _mm512_storeu_si512(checked.as_mut_ptr().cast(), places);
        }
        checked
    }
}

impl<const GFNI: bool> Instructions for Avx512<GFNI> {
    #[inline(always)]
    fn compress(self, mask: u32, from: &[u32; LANES], to: &mut [u32; LANES]) {
        // SAFETY: `self` proves that the instructions exist; both arrays are sixteen lanes long.
        unsafe {
            let lanes = _mm512_loadu_si512(from.as_ptr().cast());
            let moved = _mm512_maskz_compress_epi32(mask as u16, lanes);
            _mm512_storeu_si512(to.as_mut_ptr().cast(), moved);
        }
    }

    #[inline(always)]
    fn equal(self, lanes: &[u32; LANES], value: u32) -> u32 {
        // SAFETY: `self` proves that the instructions exist; the array is sixteen lanes long.
        unsafe {
            let lanes = _mm512_loadu_si512(lanes.as_ptr().cast());
            u32::from(_mm512_cmpeq_epi32_mask(lanes, _mm512_set1_epi32(value as i32)))
        }
    }

    #[inline(always)]
    fn fetch(self, table: &[[f32; 3]], index: &[u32; LANES], mask: u32, to: [&mut [f32; LANES]; 3]) {
        if table.is_empty() {
            return fetch_nothing(mask, to);
        }
        let checked = self.checked(index, mask, table.len());
        // SAFETY: `self` proves that the instructions exist. All places are below the table's length, which has been checked; of each
        // vector three numbers are read. The arrays are sixteen lanes long.
        unsafe {
            macro_rules! vector {
                ($lane:expr) => {
                    _mm_maskz_loadu_ps(0b111, table.as_ptr().add(checked[$lane] as usize).cast())
                };
            }
            // Vectors l, l + 4, l + 8 and l + 12 in one register; then each quarter is transposed.
            macro_rules! four {
                ($l:expr) => {{
                    let a = _mm512_castps128_ps512(vector!($l));
                    let a = _mm512_insertf32x4::<1>(a, vector!($l + 4));
                    let a = _mm512_insertf32x4::<2>(a, vector!($l + 8));
                    _mm512_insertf32x4::<3>(a, vector!($l + 12))
                }};
            }
            let (a, b, c, d) = (four!(0), four!(1), four!(2), four!(3));
            let (ab, cd) = (_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d));
            let z = _mm512_shuffle_ps::<0b01_00_01_00>(_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
            let (x, y) =
                (_mm512_shuffle_ps::<0b01_00_01_00>(ab, cd), _mm512_shuffle_ps::<0b11_10_11_10>(ab, cd));
            let [to_x, to_y, to_z] = to;
            _mm512_storeu_ps(to_x.as_mut_ptr(), x);
            _mm512_storeu_ps(to_y.as_mut_ptr(), y);
            _mm512_storeu_ps(to_z.as_mut_ptr(), z);
        }
    }

    #[inline(always)]
    fn fetch_rows(
        self,
        table: &[[u32; LANES]],
        index: &[u32; LANES],
        mask: u32,
        to: [&mut [u32; LANES]; LANES],
    ) {
        if table.is_empty() {
            return fetch_nothing(mask, to);
        }
        let checked = self.checked(index, mask, table.len());
        // SAFETY: `self` proves that the instructions exist. All places are below the table's length, which has been checked, and a row is
        // sixteen numbers long, as the arrays are.
        unsafe {
            macro_rules! row {
                ($lane:expr) => {
                    _mm512_loadu_ps(table.as_ptr().add(checked[$lane] as usize).cast())
                };
            }
            // Four rows: each quarter is transposed.
            macro_rules! four {
                ($l:expr) => {{
                    let (a, b, c, d) = (row!($l), row!($l + 1), row!($l + 2), row!($l + 3));
                    let (ab, cd) = (_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d));
                    let (ab_high, cd_high) = (_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
                    [
                        _mm512_shuffle_ps::<0b01_00_01_00>(ab, cd),
                        _mm512_shuffle_ps::<0b11_10_11_10>(ab, cd),
                        _mm512_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
                        _mm512_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
                    ]
                }};
            }
            let fours = [four!(0), four!(4), four!(8), four!(12)];
            for k in 0..4 {
                // Then quarters are.
                let [a, b, c, d] = [fours[0][k], fours[1][k], fours[2][k], fours[3][k]];
                let (ab_even, cd_even) = (
                    _mm512_shuffle_f32x4::<0b10_00_10_00>(a, b),
                    _mm512_shuffle_f32x4::<0b10_00_10_00>(c, d),
                );
                let (ab_odd, cd_odd) = (
                    _mm512_shuffle_f32x4::<0b11_01_11_01>(a, b),
                    _mm512_shuffle_f32x4::<0b11_01_11_01>(c, d),
                );
                let columns = [
                    _mm512_shuffle_f32x4::<0b10_00_10_00>(ab_even, cd_even),
                    _mm512_shuffle_f32x4::<0b10_00_10_00>(ab_odd, cd_odd),
                    _mm512_shuffle_f32x4::<0b11_01_11_01>(ab_even, cd_even),
                    _mm512_shuffle_f32x4::<0b11_01_11_01>(ab_odd, cd_odd),
                ];
                for (quarter, column) in columns.into_iter().enumerate() {
                    _mm512_storeu_ps(to[4 * quarter + k].as_mut_ptr().cast(), column);
                }
            }
        }
    }

    #[inline(always)]
    fn look_up(self, table: &[u32; LANES], index: &[u32; LANES], to: &mut [u32; LANES]) {
        // SAFETY: `self` proves that the instructions exist; all arrays are sixteen lanes long.
        unsafe {
            let (table, index) =
                (_mm512_loadu_si512(table.as_ptr().cast()), _mm512_loadu_si512(index.as_ptr().cast()));
            _mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_permutexvar_epi32(index, table));
        }
    }

    #[inline(always)]
    fn call(self, stage: impl Stage) {
        #[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,bmi1,bmi2,popcnt,fma")]
        #[inline(never)]
        fn compiled(i: impl Instructions, stage: impl Stage) {
            stage.run(i);
        }
        #[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,gfni,avx2,bmi1,bmi2,popcnt,fma")]
        #[inline(never)]
        fn compiled_with_gfni(i: impl Instructions, stage: impl Stage) {
            stage.run(i);
        }
        // SAFETY: `self` proves that the instructions exist.
        unsafe { if GFNI { compiled_with_gfni(self, stage) } else { compiled(self, stage) } };
    }
}
