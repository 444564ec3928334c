//! [`Instructions`] of AVX2: sixteen lanes are two registers.

use super::{Instructions, LANES, Stage, fetch_nothing};
use std::arch::is_x86_feature_detected;
use std::arch::x86_64::*;

/// Proof that the processor has AVX2, BMI1, BMI2, POPCNT and FMA.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(());

/// Lanes of a register.
const HALF: usize = LANES / 2;

impl Avx2 {
    /// If the processor has them.
    pub fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("popcnt")
            && is_x86_feature_detected!("fma");
        has.then_some(Avx2(()))
    }

    /// The places of the lanes in `mask`, which must be below `length`; zero for the others.
    #[inline(always)]
    fn checked(self, index: &[u32; LANES], mask: u32, length: usize) -> [u32; LANES] {
        let mut checked = [0; LANES];
        // SAFETY: `self` proves that the instructions exist; both arrays are two registers long.
        unsafe {
            let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let length = _mm256_set1_epi32(length.min(i32::MAX as usize) as i32);
            let mut behind = _mm256_setzero_si256();
            for half in [0, HALF] {
                let mask = _mm256_and_si256(_mm256_set1_epi32((mask >> half) as i32), bits);
                let places = _mm256_loadu_si256(index.as_ptr().add(half).cast());
                let places = _mm256_and_si256(_mm256_cmpeq_epi32(mask, bits), places);
                let not_below = _mm256_cmpeq_epi32(_mm256_max_epu32(places, length), places);
                behind = _mm256_or_si256(behind, not_below);
                _mm256_storeu_si256(checked.as_mut_ptr().add(half).cast(), places);
            }
            assert!(_mm256_testz_si256(behind, behind) != 0, "no such place");
        }
        checked
    }
}

/// For each mask of eight bits, the positions of its set bits, lowest first.
static SET_BITS: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut bit, mut n) = (0, 0);
        while bit < 8 {
            if mask & (1 << bit) != 0 {
                table[mask][n] = bit as u8;
                n += 1;
            }
            bit += 1;
        }
        mask += 1;
    }
    table
};

/// Four numbers of each of eight rows, of which register `l` has those of rows `l` and `l + 4`: each number of all rows.
///
/// # Safety
///
/// The processor must have AVX2.
#[inline(always)]
unsafe fn transposed([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    // SAFETY: the caller promises the instructions.
    unsafe {
        let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
        let (ab_high, cd_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }
}

impl Instructions for Avx2 {
    #[inline(always)]
    fn compress(self, mask: u32, from: &[u32; LANES], to: &mut [u32; LANES]) {
        let (low, high) = (mask as usize & 0xff, mask as usize >> 8 & 0xff);
        let first = low.count_ones() as usize;
        // SAFETY: `self` proves that the instructions exist. The halves are eight lanes long; the second one is written behind at
        // most eight lanes of sixteen.
        unsafe {
            let low = _mm256_cvtepu8_epi32(_mm_loadl_epi64(SET_BITS[low].as_ptr().cast()));
            let high = _mm256_cvtepu8_epi32(_mm_loadl_epi64(SET_BITS[high].as_ptr().cast()));
            let a = _mm256_loadu_si256(from.as_ptr().cast());
            let b = _mm256_loadu_si256(from.as_ptr().add(HALF).cast());
            _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(a, low));
            let behind = to.as_mut_ptr().add(first).cast();
            _mm256_storeu_si256(behind, _mm256_permutevar8x32_epi32(b, high));
        }
    }

    #[inline(always)]
    fn equal(self, lanes: &[u32; LANES], value: u32) -> u32 {
        // SAFETY: `self` proves that the instructions exist; the halves are eight lanes long.
        unsafe {
            let value = _mm256_set1_epi32(value as i32);
            let a = _mm256_cmpeq_epi32(_mm256_loadu_si256(lanes.as_ptr().cast()), value);
            let b = _mm256_cmpeq_epi32(_mm256_loadu_si256(lanes.as_ptr().add(HALF).cast()), value);
            let bits =
                [_mm256_movemask_ps(_mm256_castsi256_ps(a)), _mm256_movemask_ps(_mm256_castsi256_ps(b))];
            bits[0] as u32 | (bits[1] as u32) << HALF
        }
    }

    #[inline(always)]
    fn fetch(self, table: &[[f32; 3]], index: &[u32; LANES], mask: u32, to: [&mut [f32; LANES]; 3]) {
        if table.is_empty() {
            return fetch_nothing(mask, to);
        }
        let checked = self.checked(index, mask, table.len());
        let [to_x, to_y, to_z] = to;
        for half in [0, HALF] {
            // SAFETY: `self` proves that the instructions exist. All places are below the table's length, which has been checked; of each
            // vector three numbers are read. The arrays are two registers long.
            unsafe {
                let three = _mm_setr_epi32(-1, -1, -1, 0);
                macro_rules! vector {
                    ($lane:expr) => {
                        _mm_maskload_ps(table.as_ptr().add(checked[half + $lane] as usize).cast(), three)
                    };
                }
                macro_rules! two {
                    ($l:expr) => {
                        _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(vector!($l)), vector!($l + 4))
                    };
                }
                let [x, y, z, _] = transposed([two!(0), two!(1), two!(2), two!(3)]);
                _mm256_storeu_ps(to_x.as_mut_ptr().add(half), x);
                _mm256_storeu_ps(to_y.as_mut_ptr().add(half), y);
                _mm256_storeu_ps(to_z.as_mut_ptr().add(half), z);
            }
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
        for half in [0, HALF] {
            for first in (0..LANES).step_by(4) {
                // SAFETY: `self` proves that the instructions exist. All places are below the table's length, which has been checked; `first`
                // is at most twelve, and a row is sixteen numbers long, as the arrays are.
                unsafe {
                    macro_rules! four {
                        ($lane:expr) => {
                            _mm_loadu_ps(
                                table.as_ptr().add(checked[half + $lane] as usize).cast::<f32>().add(first),
                            )
                        };
                    }
                    macro_rules! two {
                        ($l:expr) => {
                            _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(four!($l)), four!($l + 4))
                        };
                    }
                    let numbers = transposed([two!(0), two!(1), two!(2), two!(3)]);
                    for (number, lanes) in numbers.into_iter().enumerate() {
                        _mm256_storeu_ps(to[first + number].as_mut_ptr().add(half).cast(), lanes);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn look_up(self, table: &[u32; LANES], index: &[u32; LANES], to: &mut [u32; LANES]) {
        // SAFETY: `self` proves that the instructions exist; all arrays are two registers long.
        unsafe {
            let table = table.as_ptr();
            let (low, high) = (_mm256_loadu_ps(table.cast()), _mm256_loadu_ps(table.add(HALF).cast()));
            for half in [0, HALF] {
                let index = _mm256_loadu_si256(index.as_ptr().add(half).cast());
                let (low, high) =
                    (_mm256_permutevar8x32_ps(low, index), _mm256_permutevar8x32_ps(high, index));
                // The fourth bit, where signs are.
                let in_high = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(index));
                _mm256_storeu_ps(to.as_mut_ptr().add(half).cast(), _mm256_blendv_ps(low, high, in_high));
            }
        }
    }

    #[inline(always)]
    fn call(self, stage: impl Stage) {
        #[target_feature(enable = "avx2,bmi1,bmi2,popcnt,fma")]
        #[inline(never)]
        fn compiled(i: Avx2, stage: impl Stage) {
            stage.run(i);
        }
        // SAFETY: `self` proves that the instructions exist.
        unsafe { compiled(self, stage) };
    }
}
