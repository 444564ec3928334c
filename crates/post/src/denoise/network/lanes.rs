//! Sixteen numbers at a time, with the vector instructions that the processor has.
//!
//! Kernels are written once, generic over [`Lanes`], and compiled for each set of instructions. A
//! type that implements [`Lanes`] is also the proof that the processor has them; [`Portable`] is
//! the scalar twin. All that fuse multiplication and addition give the same bits: a lane's
//! operations and their order do not depend on how wide registers are.

#[cfg(target_arch = "aarch64")]
use neon::Neon;
#[cfg(target_arch = "x86_64")]
use x86::{Avx2, Avx512};

#[cfg(target_arch = "aarch64")]
#[path = "lanes_neon.rs"]
mod neon;
#[cfg(target_arch = "x86_64")]
#[path = "lanes_x86.rs"]
mod x86;

/// Numbers in a vector of [`Lanes`].
pub const LANES: usize = 16;

/// Numbers that are worked on together, in memory.
pub type Sixteen = [f32; LANES];

/// What kernels need of a set of vector instructions.
pub trait Lanes: Copy {
    /// Sixteen numbers in registers.
    type V: Copy;
    /// The same number in all lanes.
    fn splat(self, value: f32) -> Self::V;
    /// One number in the lower eight lanes, another in the upper eight.
    fn halves(self, low: f32, high: f32) -> Self::V;
    /// From memory.
    fn load(self, from: &Sixteen) -> Self::V;
    /// To memory.
    fn store(self, value: Self::V, to: &mut Sixteen);
    /// `a + b`.
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a b`.
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    /// The larger ones. Of a pair with a NaN, either.
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
    /// `a b + c`, rounded once where the processor can.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// `2^n`, for `n` in -126 to 127 given as `n +` [`ROUNDER`].
    fn power_of_two(self, rounded: Self::V) -> Self::V;
}

/// Adding it to a small number rounds that to an integer, which is then in the lowest bits: 1.5 ·
/// 2²³.
pub const ROUNDER: f32 = 12_582_912.0;

/// The part of a kernel that is compiled for each set of instructions.
pub trait Stage {
    /// Does it, with `PIXELS` as the number of accumulators that fit the registers. To be inlined
    /// always, with all that it calls: on its own it would not be compiled for the instructions.
    fn run<L: Lanes, const PIXELS: usize>(self, lanes: L);
}

/// A set of instructions that the processor has.
#[derive(Clone, Copy)]
pub enum InstructionSet {
    /// AVX-512 F: one register.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
    /// AVX2 and FMA: two registers.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// NEON: four registers.
    #[cfg(target_arch = "aarch64")]
    Neon(Neon),
    /// What every processor has.
    Portable,
}

impl InstructionSet {
    /// All that the processor has, the fastest first.
    pub fn available() -> Vec<Self> {
        let mut sets = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            sets.extend(Avx512::detect().map(Self::Avx512));
            sets.extend(Avx2::detect().map(Self::Avx2));
        }
        #[cfg(target_arch = "aarch64")]
        sets.extend(Neon::detect().map(Self::Neon));
        sets.push(Self::Portable);
        sets
    }

    /// The fastest that the processor has.
    pub fn best() -> Self {
        Self::available()[0]
    }

    /// Runs a stage with it.
    pub fn run(self, stage: impl Stage) {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(lanes) => lanes.run(stage),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(lanes) => lanes.run(stage),
            #[cfg(target_arch = "aarch64")]
            Self::Neon(lanes) => lanes.run(stage),
            Self::Portable => stage.run::<Portable, 2>(Portable),
        }
    }
}

/// Plain loops.
#[derive(Clone, Copy)]
pub struct Portable;

/// Whether `f32::mul_add` is an instruction, and not a slow function.
const HAS_FMA: bool = cfg!(any(target_feature = "fma", target_arch = "aarch64"));

impl Lanes for Portable {
    type V = Sixteen;

    #[inline(always)]
    fn splat(self, value: f32) -> Sixteen {
        [value; LANES]
    }

    #[inline(always)]
    fn halves(self, low: f32, high: f32) -> Sixteen {
        let mut both = [low; LANES];
        both[LANES / 2..].fill(high);
        both
    }

    #[inline(always)]
    fn load(self, from: &Sixteen) -> Sixteen {
        *from
    }

    #[inline(always)]
    fn store(self, value: Sixteen, to: &mut Sixteen) {
        *to = value;
    }

    #[inline(always)]
    fn add(self, mut a: Sixteen, b: Sixteen) -> Sixteen {
        for i in 0..LANES {
            a[i] += b[i];
        }
        a
    }

    #[inline(always)]
    fn mul(self, mut a: Sixteen, b: Sixteen) -> Sixteen {
        for i in 0..LANES {
            a[i] *= b[i];
        }
        a
    }

    #[inline(always)]
    fn max(self, mut a: Sixteen, b: Sixteen) -> Sixteen {
        for i in 0..LANES {
            a[i] = if a[i] > b[i] { a[i] } else { b[i] };
        }
        a
    }

    #[inline(always)]
    fn mul_add(self, a: Sixteen, b: Sixteen, mut c: Sixteen) -> Sixteen {
        for i in 0..LANES {
            c[i] = if HAS_FMA { a[i].mul_add(b[i], c[i]) } else { a[i] * b[i] + c[i] };
        }
        c
    }

    #[inline(always)]
    fn power_of_two(self, mut rounded: Sixteen) -> Sixteen {
        for value in &mut rounded {
            *value = f32::from_bits((value.to_bits() << 23).wrapping_add(1.0f32.to_bits()));
        }
        rounded
    }
}

/// `e^x` for `x` at most zero: relative error below 1e-6, and 0 or less than 2e-38 below -87.
///
/// `x = n ln 2 + r` with `|r| ≤ ln(2) / 2`; the polynomial is the Taylor series of `e^r` to degree
/// seven, whose remainder there is below 1e-8.
#[inline(always)]
pub fn exp<L: Lanes>(l: L, x: L::V) -> L::V {
    // ln 2 in two parts: products of the first with small integers are exact (Cody and Waite,
    // 1980).
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    const SERIES: [f32; 8] = [1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    let x = l.max(x, l.splat(-87.0));
    let rounded = l.mul_add(x, l.splat(std::f32::consts::LOG2_E), l.splat(ROUNDER));
    let n = l.add(rounded, l.splat(-ROUNDER));
    let r = l.mul_add(n, l.splat(-LN_2[0]), x);
    let r = l.mul_add(n, l.splat(-LN_2[1]), r);
    let mut sum = l.splat(SERIES[0]);
    for factor in &SERIES[1..] {
        sum = l.mul_add(sum, r, l.splat(*factor));
    }
    l.mul(sum, l.power_of_two(rounded))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `e^x` of sixteen numbers.
    struct Exp<'a>(&'a mut Sixteen);

    impl Stage for Exp<'_> {
        #[inline(always)]
        fn run<L: Lanes, const PIXELS: usize>(self, l: L) {
            l.store(exp(l, l.load(self.0)), self.0);
        }
    }

    #[test]
    fn exp_is_that_of_the_standard_library() {
        for set in InstructionSet::available() {
            for first in (0..8600).step_by(LANES) {
                let x: Sixteen = std::array::from_fn(|i| -0.01 * (first + i) as f32 * 1.000_1);
                let mut y = x;
                set.run(Exp(&mut y));
                for (x, y) in x.into_iter().zip(y) {
                    let expected = f64::from(x).exp();
                    let error = (f64::from(y) / expected - 1.0).abs();
                    assert!(error < 1e-6, "exp({x}) is {expected}, not {y}");
                }
            }
            let mut far = [-1e30; LANES];
            set.run(Exp(&mut far));
            assert!(far.iter().all(|y| (0.0..2e-38).contains(y)), "{far:?}");
        }
    }

    /// Every operation, on numbers of both signs; what is fused is left out where the twin cannot
    /// fuse.
    struct All<'a>([&'a Sixteen; 3], &'a mut [Sixteen; 6]);

    impl Stage for All<'_> {
        #[inline(always)]
        fn run<L: Lanes, const PIXELS: usize>(self, l: L) {
            let Self([a, b, c], to) = self;
            let [a, b, c] = [l.load(a), l.load(b), l.load(c)];
            l.store(l.add(a, b), &mut to[0]);
            l.store(l.mul(a, l.splat(1.7)), &mut to[1]);
            l.store(l.max(a, b), &mut to[2]);
            l.store(l.halves(2.5, -3.0), &mut to[3]);
            l.store(l.power_of_two(c), &mut to[4]);
            l.store(l.mul_add(a, b, l.splat(0.3)), &mut to[5]);
        }
    }

    #[test]
    fn instruction_sets_do_what_their_scalar_twin_does() {
        let a: Sixteen = std::array::from_fn(|i| (i as f32 * 1.37).sin() * 4.0);
        let b: Sixteen = std::array::from_fn(|i| (i as f32 * 2.11).cos() * 3.0);
        let c: Sixteen = std::array::from_fn(|i| ROUNDER + i as f32 * 17.0 - 126.0);
        let of = |set: InstructionSet| {
            let mut to = [[0.0; LANES]; 6];
            set.run(All([&a, &b, &c], &mut to));
            to
        };
        let twin = of(InstructionSet::Portable);
        assert_eq!(twin[3][7..9], [2.5, -3.0]);
        assert_eq!(twin[4][0], f32::MIN_POSITIVE);
        let fused: Sixteen = std::array::from_fn(|i| a[i].mul_add(b[i], 0.3));
        for set in InstructionSet::available().into_iter().rev().skip(1) {
            let results = of(set);
            assert_eq!(results[..5], twin[..5]);
            assert_eq!(results[5], fused);
        }
    }
}
