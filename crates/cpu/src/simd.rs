//! Vector instructions that loops over lanes do not become.
//!
//! Everything else in this crate is plain loops over sixteen lanes, which the compiler turns into vector instructions. That some of
//! the lanes move together, or that vectors are fetched from all over a table, it does not see. A type that implements
//! [`Instructions`] is also the proof that the processor has them; [`Portable`] is the scalar twin.

use crate::lanes::LANES;

/// What kernels need of the instruction set that they are compiled for.
pub(crate) trait Instructions: Copy {
    /// Moves the lanes of `from` whose bits are set in `mask` to the beginning of `to`, in order. Nothing is said of the others.
    fn compress(self, mask: u32, from: &[u32; LANES], to: &mut [u32; LANES]);

    /// Which lanes have this value, as bits.
    fn equal(self, lanes: &[u32; LANES], value: u32) -> u32;

    /// The vectors of a table at the places `index`, by coordinate and lane. The lanes whose bits are not set in `mask` get the table's
    /// first vector, or zero if there is none.
    ///
    /// # Panics
    ///
    /// If there is no such place.
    fn fetch(self, table: &[[f32; 3]], index: &[u32; LANES], mask: u32, to: [&mut [f32; LANES]; 3]);

    /// The rows of a table at the places `index`: number `k` of each goes to `to[k]`, by lane. The lanes whose bits are not set in `mask` get
    /// the table's first row, or zeros if there is none.
    ///
    /// # Panics
    ///
    /// If there is no such place.
    fn fetch_rows(
        self,
        table: &[[u32; LANES]],
        index: &[u32; LANES],
        mask: u32,
        to: [&mut [u32; LANES]; LANES],
    );

    /// Calls a stage, which is compiled for these instructions.
    fn call(self, stage: impl Stage);
}

/// A part of a kernel that is worth a call. What is inlined into it is compiled once for each set of instructions, however often it is
/// called and whatever the kernel is generic over.
pub(crate) trait Stage {
    /// Does it. To be inlined always: on its own it would not be compiled for the instructions.
    fn run<I: Instructions>(self, i: I);
}

/// Calls a stage with the best instructions that the processor has. They differ in speed only: no operation is fused or reordered.
pub(crate) fn call_with_best(stage: impl Stage) {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(i) = Avx512::detect() {
            return i.call(stage);
        }
        if let Some(i) = Avx2::detect() {
            return i.call(stage);
        }
    }
    Portable.call(stage);
}

/// Asks for the memory at a place of a table, which need not have it.
#[inline(always)]
pub(crate) fn prefetch<T>(table: &[T], place: usize) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: all processors of this architecture have the instruction. It reads nothing, and may be given any address.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(table.as_ptr().wrapping_add(place).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (table, place);
}

/// Every lane for itself, on any processor.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

impl Instructions for Portable {
    #[inline(always)]
    fn compress(self, mask: u32, from: &[u32; LANES], to: &mut [u32; LANES]) {
        let mut rest = mask & 0xffff;
        for to in to {
            if rest == 0 {
                break;
            }
            *to = from[rest.trailing_zeros() as usize];
            rest &= rest - 1;
        }
    }

    #[inline(always)]
    fn equal(self, lanes: &[u32; LANES], value: u32) -> u32 {
        lanes.iter().rev().fold(0, |bits, &lane| bits << 1 | u32::from(lane == value))
    }

    #[inline(always)]
    fn fetch(self, table: &[[f32; 3]], index: &[u32; LANES], mask: u32, to: [&mut [f32; LANES]; 3]) {
        let [x, y, z] = to;
        for lane in 0..LANES {
            let place = if mask & 1 << lane != 0 { Some(index[lane] as usize) } else { None };
            let vector = match place {
                Some(place) => table[place],
                None => table.first().copied().unwrap_or_default(),
            };
            [x[lane], y[lane], z[lane]] = vector;
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
        let mut rows = [&[0; LANES]; LANES];
        for (lane, row) in rows.iter_mut().enumerate() {
            let place = if mask & 1 << lane != 0 { Some(index[lane] as usize) } else { None };
            match place {
                Some(place) => *row = &table[place],
                None => *row = table.first().unwrap_or(row),
            }
        }
        for (number, to) in to.into_iter().enumerate() {
            *to = rows.map(|row| row[number]);
        }
    }

    #[inline(always)]
    fn call(self, stage: impl Stage) {
        #[inline(never)]
        fn compiled(stage: impl Stage) {
            stage.run(Portable);
        }
        compiled(stage);
    }
}

#[cfg(target_arch = "x86_64")]
use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Instructions, LANES, Portable, Stage};
    use std::arch::is_x86_feature_detected;
    use std::arch::x86_64::*;

    /// Proof that the processor has AVX-512 F, VL, DQ and BW, and all of [`Avx2`].
    #[derive(Clone, Copy)]
    pub(crate) struct Avx512(());

    impl Avx512 {
        /// If the processor has them.
        pub fn detect() -> Option<Self> {
            let has = Avx2::detect().is_some()
                && is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw");
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

    impl Instructions for Avx512 {
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
                assert_eq!(mask & 0xffff, 0, "nothing to fetch from");
                to.into_iter().for_each(|lanes| lanes.fill(0.0));
                return;
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
                let z =
                    _mm512_shuffle_ps::<0b01_00_01_00>(_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
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
                assert_eq!(mask & 0xffff, 0, "nothing to fetch from");
                to.into_iter().for_each(|lanes| lanes.fill(0));
                return;
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
        fn call(self, stage: impl Stage) {
            #[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,bmi1,bmi2,fma")]
            #[inline(never)]
            fn compiled(i: Avx512, stage: impl Stage) {
                stage.run(i);
            }
            // SAFETY: `self` proves that the instructions exist.
            unsafe { compiled(self, stage) };
        }
    }

    /// Proof that the processor has AVX2, BMI1, BMI2 and FMA.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx2(());

    impl Avx2 {
        /// If the processor has them.
        pub fn detect() -> Option<Self> {
            let has = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("fma");
            has.then_some(Avx2(()))
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
                let b = _mm256_loadu_si256(from.as_ptr().add(8).cast());
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
                let b = _mm256_cmpeq_epi32(_mm256_loadu_si256(lanes.as_ptr().add(8).cast()), value);
                let bits =
                    [_mm256_movemask_ps(_mm256_castsi256_ps(a)), _mm256_movemask_ps(_mm256_castsi256_ps(b))];
                bits[0] as u32 | (bits[1] as u32) << 8
            }
        }

        #[inline(always)]
        fn fetch(self, table: &[[f32; 3]], index: &[u32; LANES], mask: u32, to: [&mut [f32; LANES]; 3]) {
            Portable.fetch(table, index, mask, to);
        }

        #[inline(always)]
        fn fetch_rows(
            self,
            table: &[[u32; LANES]],
            index: &[u32; LANES],
            mask: u32,
            to: [&mut [u32; LANES]; LANES],
        ) {
            Portable.fetch_rows(table, index, mask, to);
        }

        #[inline(always)]
        fn call(self, stage: impl Stage) {
            #[target_feature(enable = "avx2,bmi1,bmi2,fma")]
            #[inline(never)]
            fn compiled(i: Avx2, stage: impl Stage) {
                stage.run(i);
            }
            // SAFETY: `self` proves that the instructions exist.
            unsafe { compiled(self, stage) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Calls `check` with every set of instructions that this processor has.
    fn with_all(check: impl Fn(&dyn Erased)) {
        check(&Portable);
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(i) = Avx2::detect() {
                check(&i);
            }
            if let Some(i) = Avx512::detect() {
                check(&i);
            }
        }
    }

    /// [`Instructions`] behind a reference.
    trait Erased {
        fn compress(&self, mask: u32, from: &[u32; LANES], to: &mut [u32; LANES]);
        fn equal(&self, lanes: &[u32; LANES], value: u32) -> u32;
        fn fetch(&self, table: &[[f32; 3]], index: &[u32; LANES], mask: u32) -> [[f32; LANES]; 3];
        fn fetch_rows(
            &self,
            table: &[[u32; LANES]],
            index: &[u32; LANES],
            mask: u32,
        ) -> [[u32; LANES]; LANES];
    }

    impl<I: Instructions> Erased for I {
        fn compress(&self, mask: u32, from: &[u32; LANES], to: &mut [u32; LANES]) {
            Instructions::compress(*self, mask, from, to);
        }

        fn equal(&self, lanes: &[u32; LANES], value: u32) -> u32 {
            Instructions::equal(*self, lanes, value)
        }

        fn fetch(&self, table: &[[f32; 3]], index: &[u32; LANES], mask: u32) -> [[f32; LANES]; 3] {
            let mut to = [[f32::NAN; LANES]; 3];
            let [x, y, z] = &mut to;
            Instructions::fetch(*self, table, index, mask, [x, y, z]);
            to
        }

        fn fetch_rows(
            &self,
            table: &[[u32; LANES]],
            index: &[u32; LANES],
            mask: u32,
        ) -> [[u32; LANES]; LANES] {
            let mut to = [[7; LANES]; LANES];
            Instructions::fetch_rows(*self, table, index, mask, to.each_mut());
            to
        }
    }

    #[test]
    fn any_lanes_move_to_the_front() {
        let from: [u32; LANES] = std::array::from_fn(|lane| 100 + lane as u32);
        with_all(|i| {
            for mask in 0..1u32 << LANES {
                let expected: Vec<u32> =
                    (0..LANES).filter(|lane| mask & 1 << lane != 0).map(|lane| from[lane]).collect();
                let mut to = [7; LANES];
                i.compress(mask, &from, &mut to);
                assert_eq!(to[..expected.len()], expected, "mask {mask:b}");
            }
        });
    }

    #[test]
    fn equal_lanes_are_found() {
        let lanes = [3, 1, 3, 0, 0, 0, u32::MAX, 3, 2, 2, 2, 2, 2, 2, 2, 3];
        with_all(|i| {
            assert_eq!(i.equal(&lanes, 3), 0b1000_0000_1000_0101);
            assert_eq!(i.equal(&lanes, u32::MAX), 0b0100_0000);
            assert_eq!(i.equal(&lanes, 9), 0);
        });
    }

    #[test]
    fn vectors_come_from_all_over_the_table() {
        let table: Vec<[f32; 3]> = (0..50).map(|i| [0, 100, 200].map(|k| (i + k) as f32)).collect();
        let index: [u32; LANES] = std::array::from_fn(|lane| (lane as u32 * 37 + 49) % 50);
        with_all(|i| {
            for mask in [0xffff, 0, 0b1010_0110_0000_0001] {
                let fetched = i.fetch(&table, &index, mask);
                for lane in 0..LANES {
                    let place = if mask & 1 << lane != 0 { index[lane] as usize } else { 0 };
                    assert_eq!([0, 1, 2].map(|k: usize| fetched[k][lane]), table[place], "lane {lane}");
                }
            }
            assert_eq!(i.fetch(&[], &index, 0), [[0.0; LANES]; 3]);
        });
    }

    #[test]
    fn rows_come_from_all_over_the_table() {
        let table: Vec<[u32; LANES]> = (0..50).map(|i| std::array::from_fn(|k| 100 * i + k as u32)).collect();
        let index: [u32; LANES] = std::array::from_fn(|lane| (lane as u32 * 37 + 49) % 50);
        with_all(|i| {
            for mask in [0xffff, 0, 0b1010_0110_0000_0001] {
                let fetched = i.fetch_rows(&table, &index, mask);
                for lane in 0..LANES {
                    let place = if mask & 1 << lane != 0 { index[lane] as usize } else { 0 };
                    assert_eq!(fetched.map(|numbers| numbers[lane]), table[place], "lane {lane}");
                }
            }
            assert_eq!(i.fetch_rows(&[], &index, 0), [[0; LANES]; LANES]);
            let behind = || i.fetch_rows(&table[..20], &index, 0xffff);
            assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(behind)).is_err());
        });
    }

    #[test]
    fn places_behind_the_table_are_refused() {
        with_all(|i| {
            let index = [0, 0, 0, 50, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
            let fetch = || i.fetch(&vec![[1.0; 3]; 50], &index, 0b1000);
            assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(fetch)).is_err());
        });
    }
}
