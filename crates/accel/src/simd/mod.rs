//! SIMD operations on eight lanes, for every instruction set that traversal is compiled for.
//!
//! A value of a type that implements [`Simd`] proves that the processor has the instructions. Such
//! values are only made inside functions that enable the instruction set, after a check of
//! [`InstructionSet`]. Therefore the methods are safe.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
#[cfg(target_arch = "aarch64")]
pub(crate) mod neon;
#[cfg(target_arch = "x86_64")]
mod ymm;
#[cfg(target_arch = "x86_64")]
mod zmm;

pub(crate) mod float4;
mod instruction_set;
mod pair;

pub use instruction_set::InstructionSet;

use crate::layout::WIDTH;

/// Arithmetic on vectors of `f32` and `u32`, of any number of lanes.
///
/// `min` and `max` return the second operand if either is NaN. Comparisons with NaN are false.
pub(crate) trait Arithmetic: Copy {
    /// A vector of `f32`.
    type F: Copy;
    /// A vector of `u32`.
    type U: Copy;
    /// A mask: one truth value a lane.
    type M: Copy;

    fn splat(self, x: f32) -> Self::F;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a * b + c`, rounded once.
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `c - a * b`, rounded once.
    fn neg_mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a`, negated where `b` is negative.
    fn flip_sign(self, a: Self::F, b: Self::F) -> Self::F;
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// Bit `i` is lane `i`.
    fn bits(self, m: Self::M) -> u32;
    /// `b` where the mask is set, `a` elsewhere.
    fn select(self, m: Self::M, a: Self::F, b: Self::F) -> Self::F;
    /// The bits of integers as floats.
    fn bits_as_f(self, x: Self::U) -> Self::F;
    fn splat_u(self, x: u32) -> Self::U;
    /// `b` where the mask is set, `a` elsewhere.
    fn select_u(self, m: Self::M, a: Self::U, b: Self::U) -> Self::U;
}

/// Vectors of eight lanes: memory access, sorting and permutations.
pub(crate) trait Simd: Arithmetic {
    /// The type for vectors of sixteen lanes.
    type Sixteen: Sixteen<Self>;

    fn sixteen(self) -> Self::Sixteen;
    /// The transposed 8×8 matrix: lane `j` of vector `i` becomes lane `i` of vector `j`.
    fn transposed(self, rows: [Self::F; WIDTH]) -> [Self::F; WIDTH];
    fn load(self, x: &[f32; WIDTH]) -> Self::F;
    fn store(self, x: Self::F, to: &mut [f32; WIDTH]);
    fn sqrt(self, a: Self::F) -> Self::F;
    /// The smallest lane.
    fn least(self, a: Self::F) -> f32;
    fn load_u(self, x: &[u32; WIDTH]) -> Self::U;
    fn store_u(self, x: Self::U, to: &mut [u32; WIDTH]);
    /// Lane `i` of the result is the lane of `table` that the low three bits of lane `i` of `index`
    /// name.
    fn permute(self, table: Self::U, index: Self::U) -> Self::U;
    /// Sort keys: the bits of the distance (not negative) with the lane in the low three bits where
    /// the mask is set, `u32::MAX` elsewhere.
    fn keys(self, distance: Self::F, m: Self::M) -> Self::U;
    /// The smallest key, as an unsigned number.
    fn least_key(self, keys: Self::U) -> u32;
    /// The keys as signed numbers in descending order: those of lanes that were not set come last.
    fn sorted(self, keys: Self::U) -> Self::U;
    /// Prefetches `N` cache lines from `first` on, where there is an instruction for it. The
    /// address is never dereferenced and may be invalid.
    #[inline(always)]
    fn prefetch<const N: usize>(self, _first: *const u8) {}
    /// Moves the lanes that are set in `bits` (`m` as bits) to the front. The others are undefined.
    fn compress(self, x: Self::U, m: Self::M, bits: u32) -> Self::U;
    /// Calls a function that is compiled for this instruction set and not inlined.
    fn call(self, part: impl Outlined<Self>);
}

/// A piece of a kernel that is called instead of inlined, so that it does not compete with its
/// caller for registers.
pub(crate) trait Outlined<S: Simd> {
    /// The function body. Implementations must be `#[inline(always)]`; otherwise they are compiled
    /// without the instruction set.
    fn run(self, s: S);
}

/// Vectors of sixteen lanes, for arithmetic on sixteen rays at once.
pub(crate) trait Sixteen<Half: Arithmetic>: Arithmetic {
    /// Lanes 0 to 7 and lanes 8 to 15.
    fn join(self, halves: [Half::F; 2]) -> Self::F;
    fn halves(self, x: Self::F) -> [Half::F; 2];
    fn halves_u(self, x: Self::U) -> [Half::U; 2];
}

/// Prefetches the cache line at `place`, which may be an invalid address.
#[inline(always)]
pub(crate) fn prefetch<T>(place: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: SSE is part of x86-64. The instruction accepts any address.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(place.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = place;
}

/// For each mask of eight bits, the positions of its set bits, lowest first.
#[cfg_attr(target_arch = "x86_64", allow(dead_code))]
pub(crate) static SET_BITS: [[u32; WIDTH]; 256] = {
    let mut table = [[0; WIDTH]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut bit, mut n) = (0, 0);
        while bit < WIDTH {
            if mask & (1 << bit) != 0 {
                table[mask][n] = bit as u32;
                n += 1;
            }
            bit += 1;
        }
        mask += 1;
    }
    table
};
