//! Eight lanes as two times four, with Arm's Advanced SIMD.

use super::pair::Pair;
use super::{Arithmetic, Outlined, SET_BITS, Simd};
use crate::layout::WIDTH;
use std::arch::aarch64::*;

/// Proof that the processor has Advanced SIMD.
#[derive(Clone, Copy)]
pub(crate) struct Neon(());

impl Neon {
    /// # Safety
    ///
    /// The processor must have Advanced SIMD.
    #[inline(always)]
    pub unsafe fn new() -> Self {
        Neon(())
    }
}

/// Applies an intrinsic to both halves.
macro_rules! halves {
    ($f:ident, $a:expr) => {
        // SAFETY: a `Neon` exists only where the processor has the instructions.
        unsafe { [$f($a[0]), $f($a[1])] }
    };
    ($f:ident, $a:expr, $b:expr) => {
        // SAFETY: a `Neon` exists only where the processor has the instructions.
        unsafe { [$f($a[0], $b[0]), $f($a[1], $b[1])] }
    };
    ($f:ident, $a:expr, $b:expr, $c:expr) => {
        // SAFETY: a `Neon` exists only where the processor has the instructions.
        unsafe { [$f($a[0], $b[0], $c[0]), $f($a[1], $b[1], $c[1])] }
    };
}

impl Arithmetic for Neon {
    type F = [float32x4_t; 2];
    type U = [uint32x4_t; 2];
    type M = [uint32x4_t; 2];

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        halves!(vdupq_n_f32, [x, x])
    }

    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        halves!(vaddq_f32, a, b)
    }

    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        halves!(vsubq_f32, a, b)
    }

    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        halves!(vmulq_f32, a, b)
    }

    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        halves!(vdivq_f32, a, b)
    }

    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        self.select(self.lt(a, b), b, a)
    }

    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        self.select(self.lt(b, a), b, a)
    }

    #[inline(always)]
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        halves!(vfmaq_f32, c, a, b)
    }

    #[inline(always)]
    fn neg_mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        halves!(vfmsq_f32, c, a, b)
    }

    #[inline(always)]
    fn flip_sign(self, a: Self::F, b: Self::F) -> Self::F {
        let (a, b, sign) =
            (halves!(vreinterpretq_u32_f32, a), halves!(vreinterpretq_u32_f32, b), self.splat_u(1 << 31));
        let sign = halves!(vandq_u32, b, sign);
        let flipped = halves!(veorq_u32, a, sign);
        halves!(vreinterpretq_f32_u32, flipped)
    }

    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> Self::M {
        halves!(vcltq_f32, a, b)
    }

    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> Self::M {
        halves!(vcleq_f32, a, b)
    }

    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        halves!(vandq_u32, a, b)
    }

    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        halves!(vorrq_u32, a, b)
    }

    #[inline(always)]
    fn bits(self, m: Self::M) -> u32 {
        let weights = self.load_u(&[1, 2, 4, 8, 16, 32, 64, 128]);
        let set = halves!(vandq_u32, m, weights);
        // SAFETY: `self` proves that the instruction exists.
        unsafe { vaddvq_u32(vorrq_u32(set[0], set[1])) }
    }

    #[inline(always)]
    fn select(self, m: Self::M, a: Self::F, b: Self::F) -> Self::F {
        halves!(vbslq_f32, m, b, a)
    }

    #[inline(always)]
    fn bits_as_f(self, x: Self::U) -> Self::F {
        halves!(vreinterpretq_f32_u32, x)
    }

    #[inline(always)]
    fn splat_u(self, x: u32) -> Self::U {
        halves!(vdupq_n_u32, [x, x])
    }

    #[inline(always)]
    fn select_u(self, m: Self::M, a: Self::U, b: Self::U) -> Self::U {
        halves!(vbslq_u32, m, b, a)
    }
}

impl Simd for Neon {
    type Sixteen = Pair<Neon>;

    #[inline(always)]
    fn sixteen(self) -> Self::Sixteen {
        Pair(self)
    }

    #[inline(always)]
    fn transposed(self, rows: [Self::F; WIDTH]) -> [Self::F; WIDTH] {
        let mut numbers = [[0.0; WIDTH]; WIDTH];
        for (row, numbers) in rows.into_iter().zip(&mut numbers) {
            self.store(row, numbers);
        }
        std::array::from_fn(|i| {
            let column = std::array::from_fn(|j| numbers[j][i]);
            self.load(&column)
        })
    }

    #[inline(always)]
    fn load(self, x: &[f32; WIDTH]) -> Self::F {
        // SAFETY: `self` proves that the instruction exists; `x` is eight lanes long.
        unsafe { [vld1q_f32(x.as_ptr()), vld1q_f32(x.as_ptr().add(4))] }
    }

    #[inline(always)]
    fn store(self, x: Self::F, to: &mut [f32; WIDTH]) {
        // SAFETY: `self` proves that the instruction exists; `to` is eight lanes long.
        unsafe {
            vst1q_f32(to.as_mut_ptr(), x[0]);
            vst1q_f32(to.as_mut_ptr().add(4), x[1]);
        }
    }

    #[inline(always)]
    fn sqrt(self, a: Self::F) -> Self::F {
        halves!(vsqrtq_f32, a)
    }

    #[inline(always)]
    fn least(self, a: Self::F) -> f32 {
        // SAFETY: `self` proves that the instruction exists.
        unsafe { vminvq_f32(vminq_f32(a[0], a[1])) }
    }

    #[inline(always)]
    fn load_u(self, x: &[u32; WIDTH]) -> Self::U {
        // SAFETY: `self` proves that the instruction exists; `x` is eight lanes long.
        unsafe { [vld1q_u32(x.as_ptr()), vld1q_u32(x.as_ptr().add(4))] }
    }

    #[inline(always)]
    fn store_u(self, x: Self::U, to: &mut [u32; WIDTH]) {
        // SAFETY: `self` proves that the instruction exists; `to` is eight lanes long.
        unsafe {
            vst1q_u32(to.as_mut_ptr(), x[0]);
            vst1q_u32(to.as_mut_ptr().add(4), x[1]);
        }
    }

    #[inline(always)]
    fn permute(self, table: Self::U, index: Self::U) -> Self::U {
        let (mut from, mut at, mut to) = ([0; WIDTH], [0; WIDTH], [0; WIDTH]);
        self.store_u(table, &mut from);
        self.store_u(index, &mut at);
        for lane in 0..WIDTH {
            to[lane] = from[at[lane] as usize & 7];
        }
        self.load_u(&to)
    }

    #[inline(always)]
    fn keys(self, distance: Self::F, m: Self::M) -> Self::U {
        let lanes = self.load_u(&[0, 1, 2, 3, 4, 5, 6, 7]);
        let (bits, mask) = (halves!(vreinterpretq_u32_f32, distance), self.splat_u(!7));
        let bits = halves!(vandq_u32, bits, mask);
        let keys = halves!(vorrq_u32, bits, lanes);
        self.select_u(m, self.splat_u(u32::MAX), keys)
    }

    #[inline(always)]
    fn least_key(self, keys: Self::U) -> u32 {
        // SAFETY: `self` proves that the instructions exist.
        unsafe { vminvq_u32(vminq_u32(keys[0], keys[1])) }
    }

    #[inline(always)]
    fn sorted(self, keys: Self::U) -> Self::U {
        let mut x = [0; WIDTH];
        self.store_u(keys, &mut x);
        // Batcher's network, larger keys first, as signed numbers.
        const PAIRS: [(usize, usize); 19] = [
            (0, 1),
            (2, 3),
            (4, 5),
            (6, 7),
            (0, 2),
            (1, 3),
            (4, 6),
            (5, 7),
            (1, 2),
            (5, 6),
            (0, 4),
            (1, 5),
            (2, 6),
            (3, 7),
            (2, 4),
            (3, 5),
            (1, 2),
            (3, 4),
            (5, 6),
        ];
        for (i, j) in PAIRS {
            let (a, b) = (x[i] as i32, x[j] as i32);
            (x[i], x[j]) = (a.max(b) as u32, a.min(b) as u32);
        }
        self.load_u(&x)
    }

    #[inline(always)]
    fn compress(self, x: Self::U, _: Self::M, bits: u32) -> Self::U {
        self.permute(x, self.load_u(&SET_BITS[(bits & 255) as usize]))
    }

    #[inline(always)]
    fn call(self, outlined: impl Outlined<Self>) {
        #[target_feature(enable = "neon")]
        #[inline(never)]
        fn compiled(s: Neon, outlined: impl Outlined<Neon>) {
            outlined.run(s);
        }
        // SAFETY: `self` proves that the instructions exist.
        unsafe { compiled(self, outlined) };
    }
}
