//! The watertight ray-triangle test, in SIMD lanes: a ray and eight triangles, or eight rays and
//! one.
//!
//! `optics::intersect::intersect_triangle` is the scalar version and names the source.

use super::lane_vectors::splats;
use super::leaf_intersector::{Candidates, HitHandler, LeafIntersector};
use crate::layout::TriangleBlock;
use crate::ray::Ray;
use crate::simd::Simd;

/// A ray's constants for the triangle test: the order of axes, the origin, and the shear that maps
/// the ray to the third axis.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Shear {
    /// The axes of object space in the order (u, v, w).
    axes: [u32; 3],
    /// The ray's origin in that order.
    origin: [f32; 3],
    shear: [f32; 3],
    t_min: f32,
}

impl Shear {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Shear {
        const AXES: [[u32; 3]; 8] =
            [[1, 2, 0], [2, 0, 1], [0, 1, 2], [2, 0, 1], [1, 2, 0], [1, 2, 0], [0, 1, 2], [0, 1, 2]];
        // By reference: a copy would be written and read back in different sizes, which stalls.
        let d = &ray.direction;
        let (x, y, z) = (d[0].abs(), d[1].abs(), d[2].abs());
        // A table, because branches on the longest axis would be mispredicted.
        let axes = AXES[usize::from(y > x) | usize::from(z > x) << 1 | usize::from(z > y) << 2];
        let [u, v, w] = axes.map(|a| a as usize);
        let inverse = 1.0 / d[w];
        Shear {
            axes,
            origin: [ray.origin[u], ray.origin[v], ray.origin[w]],
            shear: [d[u] * inverse, d[v] * inverse, inverse],
            t_min: ray.t_min.max(0.0),
        }
    }

    /// The order of the axes.
    #[inline(always)]
    pub fn order(&self) -> [usize; 3] {
        self.axes.map(|axis| axis as usize % 3)
    }

    /// The axis along which the ray runs most.
    #[inline(always)]
    pub fn third_axis(&self) -> usize {
        self.axes[2] as usize
    }

    #[cfg(all(test, target_arch = "x86_64"))]
    pub fn axes(&self) -> [u32; 3] {
        self.axes
    }

    /// All floats.
    #[cfg(all(test, target_arch = "x86_64"))]
    pub fn numbers(&self) -> [f32; 7] {
        let ([a, b, c], [d, e, f]) = (self.origin, self.shear);
        [a, b, c, d, e, f, self.t_min]
    }
}

/// Intersects a ray with blocks of eight triangles.
pub(super) struct TriangleIntersector<'a, S: Simd> {
    blocks: &'a [TriangleBlock],
    axes: [u32; 3],
    origin: [S::F; 3],
    shear: [S::F; 3],
    pub t_min: S::F,
}

// No closures around vector operations: a closure is compiled without the instruction set of the
// entry point, and what it calls would not be inlined.
impl<'a, S: Simd> TriangleIntersector<'a, S> {
    /// Vertex `i` of each triangle in the sheared space of the ray.
    #[inline(always)]
    fn corner(&self, s: S, block: &TriangleBlock, i: usize) -> [S::F; 3] {
        let [u, v, w] = self.axes;
        let p = &block.vertices[i];
        // SAFETY: the axes are those of a `Shear`, which takes them from its table: 0, 1 and 2 in
        // some order.
        let [x, y, z] = unsafe {
            [p.get_unchecked(u as usize), p.get_unchecked(v as usize), p.get_unchecked(w as usize)]
        };
        let z = s.sub(s.load(z), self.origin[2]);
        let x = s.neg_mul_add(self.shear[0], z, s.sub(s.load(x), self.origin[0]));
        let y = s.neg_mul_add(self.shear[1], z, s.sub(s.load(y), self.origin[1]));
        [x, y, z]
    }

    /// The ray's direction, up to rounding.
    #[inline(always)]
    fn direction(&self, s: S) -> [S::F; 3] {
        let along = s.div(s.splat(1.0), self.shear[2]);
        let sheared = [s.mul(self.shear[0], along), s.mul(self.shear[1], along), along];
        let mut direction = sheared;
        for (axis, component) in self.axes.into_iter().zip(sheared) {
            direction[axis as usize % 3] = component;
        }
        direction
    }

    /// Hits of the ray's line with each triangle.
    #[inline(always)]
    pub fn line_hits(&self, s: S, block: &TriangleBlock) -> TriangleHits<S> {
        let corners = [self.corner(s, block, 0), self.corner(s, block, 1), self.corner(s, block, 2)];
        TriangleHits::new(s, corners, self.shear[2])
    }

    /// Hits with the triangles of a leaf, and the mask of those between the ray's start and
    /// `t_max`.
    #[inline(always)]
    pub fn leaf_hits(&self, s: S, index: usize, t_max: f32) -> (TriangleHits<S>, S::M) {
        debug_assert!(index < self.blocks.len());
        // SAFETY: leaf references are made by the builder and index the blocks of this slice
        // (`validate` checks them in debug builds).
        let hits = self.line_hits(s, unsafe { self.blocks.get_unchecked(index) });
        let mask = s.and(hits.inside, s.and(s.lt(self.t_min, hits.t), s.lt(hits.t, s.splat(t_max))));
        (hits, mask)
    }

    #[inline(always)]
    pub fn new(s: S, blocks: &'a [TriangleBlock], ray: &Shear) -> Self {
        TriangleIntersector {
            blocks,
            axes: ray.axes,
            origin: splats(s, ray.origin),
            shear: splats(s, ray.shear),
            t_min: s.splat(ray.t_min),
        }
    }
}

/// Hits of a line with eight triangles, or of eight lines with one; valid in the lanes of `inside`.
pub(super) struct TriangleHits<S: Simd> {
    pub inside: S::M,
    pub t: S::F,
    pub u: S::F,
    pub v: S::F,
}

impl<S: Simd> TriangleHits<S> {
    /// Corners are in sheared space, where the line is the third axis. `shear_z` scales distances
    /// along that axis to distances along the ray.
    #[inline(always)]
    pub fn new(s: S, [[ax, ay, az], [bx, by, bz], [cx, cy, cz]]: [[S::F; 3]; 3], shear_z: S::F) -> Self {
        // Not fused, see the scalar function.
        let e0 = s.sub(s.mul(cx, by), s.mul(cy, bx));
        let e1 = s.sub(s.mul(ax, cy), s.mul(ay, cx));
        let e2 = s.sub(s.mul(bx, ay), s.mul(by, ax));
        let det = s.add(s.add(e0, e1), e2);
        // All edge functions have the sign of the determinant. If that is zero or NaN, the distance
        // is infinite or NaN, which is outside every interval.
        let side = s.min(s.min(s.flip_sign(e0, det), s.flip_sign(e1, det)), s.flip_sign(e2, det));
        let inside = s.le(s.splat(0.0), side);
        let scaled = s.mul(shear_z, s.mul_add(e0, az, s.mul_add(e1, bz, s.mul(e2, cz))));
        // Finite, so that the weights of a triangle of denormal size are not NaN.
        let largest = f32::MAX;
        let inverse = s.max(s.min(s.div(s.splat(1.0), det), s.splat(largest)), s.splat(-largest));
        TriangleHits { inside, t: s.div(scaled, det), u: s.mul(e1, inverse), v: s.mul(e2, inverse) }
    }
}

impl<S: Simd> LeafIntersector<S> for TriangleIntersector<'_, S> {
    #[inline(always)]
    fn intersect<H: HitHandler<S>>(&self, s: S, index: usize, t_max: f32, handler: &mut H) {
        // No early exit on `inside`: a second unpredictable branch costs more than the division.
        let (h, mask) = self.leaf_hits(s, index, t_max);
        let bits = s.bits(mask);
        if bits != 0 {
            let zero = s.splat(0.0);
            let direction = if H::FILTERS { self.direction(s) } else { [zero; 3] };
            let candidates = Candidates { mask, bits, t: h.t, u: h.u, v: h.v, outward: [zero; 3], direction };
            handler.handle(s, &candidates, &self.blocks[index].ids);
        }
    }
}
