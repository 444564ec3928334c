//! Vector instructions that loops over lanes do not become.
//!
//! Everything else in this crate is plain loops over sixteen lanes, which the compiler turns into vector instructions. That some of
//! the lanes move together, or that vectors are fetched from all over a table, it does not see. A type that implements
//! [`Instructions`] is also the proof that the processor has them; [`Portable`] is the scalar twin.

use crate::batch::lanes::LANES;
#[cfg(target_arch = "x86_64")]
use {avx2::Avx2, avx512::Avx512};

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;

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

    /// The numbers of a small table at the places `index`, of which the lowest four bits count.
    fn look_up(self, table: &[u32; LANES], index: &[u32; LANES], to: &mut [u32; LANES]);

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
        if let Some(i) = Avx512::<true>::detect() {
            return i.call(stage);
        }
        if let Some(i) = Avx512::<false>::detect() {
            return i.call(stage);
        }
        if let Some(i) = Avx2::detect() {
            return i.call(stage);
        }
    }
    Portable.call(stage);
}

/// Fetches from a table that is empty: zeros, if `mask` asks for nothing.
#[cfg(target_arch = "x86_64")]
#[cold]
fn fetch_nothing<T: Default + Copy, const N: usize>(mask: u32, to: [&mut [T; LANES]; N]) {
    assert_eq!(mask & 0xffff, 0, "nothing to fetch from");
    to.into_iter().for_each(|lanes| lanes.fill(T::default()));
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
    fn look_up(self, table: &[u32; LANES], index: &[u32; LANES], to: &mut [u32; LANES]) {
        for lane in 0..LANES {
            to[lane] = table[index[lane] as usize % LANES];
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
            if let Some(i) = Avx512::<true>::detect() {
                check(&i);
            }
            if let Some(i) = Avx512::<false>::detect() {
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
        fn look_up(&self, table: &[u32; LANES], index: &[u32; LANES]) -> [u32; LANES];
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

        fn look_up(&self, table: &[u32; LANES], index: &[u32; LANES]) -> [u32; LANES] {
            let mut to = [7; LANES];
            Instructions::look_up(*self, table, index, &mut to);
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
    fn small_tables_are_looked_up() {
        let table: [u32; LANES] = std::array::from_fn(|k| u32::MAX - 7 * k as u32);
        let index: [u32; LANES] =
            [0, 15, 8, 7, 3, 3, 16, 31, u32::MAX, 0x8000_0004, 1, 2, 12, 13, 14, 0x7fff_fff9];
        with_all(|i| {
            let expected = index.map(|place| table[(place & 15) as usize]);
            assert_eq!(i.look_up(&table, &index), expected);
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
