//! Vectors of sixteen lanes as pairs of vectors of eight.

use super::{Arithmetic, Sixteen};

/// Applies every operation to both halves.
#[derive(Clone, Copy)]
pub(crate) struct Pair<S>(pub S);

// No closures around vector operations: they are compiled without the caller's instruction set.
impl<S: Arithmetic> Arithmetic for Pair<S> {
    type F = [S::F; 2];
    type U = [S::U; 2];
    type M = [S::M; 2];

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F {
        [self.0.splat(x); 2]
    }

    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.add(a[0], b[0]), self.0.add(a[1], b[1])]
    }

    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.sub(a[0], b[0]), self.0.sub(a[1], b[1])]
    }

    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.mul(a[0], b[0]), self.0.mul(a[1], b[1])]
    }

    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.div(a[0], b[0]), self.0.div(a[1], b[1])]
    }

    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.min(a[0], b[0]), self.0.min(a[1], b[1])]
    }

    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.max(a[0], b[0]), self.0.max(a[1], b[1])]
    }

    #[inline(always)]
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        [self.0.mul_add(a[0], b[0], c[0]), self.0.mul_add(a[1], b[1], c[1])]
    }

    #[inline(always)]
    fn neg_mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        [self.0.neg_mul_add(a[0], b[0], c[0]), self.0.neg_mul_add(a[1], b[1], c[1])]
    }

    #[inline(always)]
    fn flip_sign(self, a: Self::F, b: Self::F) -> Self::F {
        [self.0.flip_sign(a[0], b[0]), self.0.flip_sign(a[1], b[1])]
    }

    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> Self::M {
        [self.0.lt(a[0], b[0]), self.0.lt(a[1], b[1])]
    }

    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> Self::M {
        [self.0.le(a[0], b[0]), self.0.le(a[1], b[1])]
    }

    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        [self.0.and(a[0], b[0]), self.0.and(a[1], b[1])]
    }

    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        [self.0.or(a[0], b[0]), self.0.or(a[1], b[1])]
    }

    #[inline(always)]
    fn bits(self, m: Self::M) -> u32 {
        self.0.bits(m[0]) | self.0.bits(m[1]) << 8
    }

    #[inline(always)]
    fn select(self, m: Self::M, a: Self::F, b: Self::F) -> Self::F {
        [self.0.select(m[0], a[0], b[0]), self.0.select(m[1], a[1], b[1])]
    }

    #[inline(always)]
    fn bits_as_f(self, x: Self::U) -> Self::F {
        [self.0.bits_as_f(x[0]), self.0.bits_as_f(x[1])]
    }

    #[inline(always)]
    fn splat_u(self, x: u32) -> Self::U {
        [self.0.splat_u(x); 2]
    }

    #[inline(always)]
    fn select_u(self, m: Self::M, a: Self::U, b: Self::U) -> Self::U {
        [self.0.select_u(m[0], a[0], b[0]), self.0.select_u(m[1], a[1], b[1])]
    }
}

impl<S: Arithmetic> Sixteen<S> for Pair<S> {
    #[inline(always)]
    fn join(self, halves: [S::F; 2]) -> Self::F {
        halves
    }

    #[inline(always)]
    fn halves(self, x: Self::F) -> [S::F; 2] {
        x
    }

    #[inline(always)]
    fn halves_u(self, x: Self::U) -> [S::U; 2] {
        x
    }
}
