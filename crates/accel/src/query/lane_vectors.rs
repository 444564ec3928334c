//! Vectors of three coordinates in SIMD lanes.

use crate::simd::{Arithmetic, Simd};

/// A vector in all lanes.
#[inline(always)]
pub(super) fn splats<A: Arithmetic>(a: A, x: [f32; 3]) -> [A::F; 3] {
    [a.splat(x[0]), a.splat(x[1]), a.splat(x[2])]
}

/// The dot product in each lane.
#[inline(always)]
pub(super) fn dot<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.mul_add(a[0], b[0], s.mul_add(a[1], b[1], s.mul(a[2], b[2])))
}

/// The magnitude of each lane.
#[inline(always)]
pub(super) fn abs<A: Arithmetic>(a: A, x: A::F) -> A::F {
    a.max(x, a.sub(a.splat(0.0), x))
}
