//! Intersection with eight triangles or spheres at a time, for any instruction set.

use super::Best;
use crate::layout::{SphereBlock, TriangleBlock, WIDTH};
use crate::ray::{Hit, HitFilter, Ray};
use crate::simd::{Arithmetic, Simd};

#[inline(always)]
pub(super) fn splats<A: Arithmetic>(a: A, x: [f32; 3]) -> [A::F; 3] {
    [a.splat(x[0]), a.splat(x[1]), a.splat(x[2])]
}

#[inline(always)]
pub(super) fn dot<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.mul_add(a[0], b[0], s.mul_add(a[1], b[1], s.mul(a[2], b[2])))
}

/// Eight hits with the lines of triangles or spheres, of which those in `mask` count.
pub(super) struct Candidates<S: Simd> {
    mask: S::M,
    /// The mask as bits, not zero.
    bits: u32,
    t: S::F,
    u: S::F,
    v: S::F,
}

impl<S: Simd> Candidates<S> {
    /// Keeps the nearest candidate that the filter accepts.
    #[inline(always)]
    pub fn keep_nearest<F: HitFilter>(
        &self,
        s: S,
        ids: &[u32; WIDTH],
        instance: u32,
        filter: &F,
        best: &mut Best,
    ) {
        let (mut us, mut vs) = ([0.0; WIDTH], [0.0; WIDTH]);
        s.store(self.u, &mut us);
        s.store(self.v, &mut vs);
        if F::OPAQUE {
            let t = s.least(s.select(self.mask, s.splat(f32::INFINITY), self.t));
            let lane = s.bits(s.and(self.mask, s.le(self.t, s.splat(t)))).trailing_zeros() as usize & 7;
            if t < best.t_max {
                best.t_max = t;
                best.hit = Hit { t, u: us[lane], v: vs[lane], primitive: ids[lane], instance };
            }
            return;
        }
        let mut ts = [0.0; WIDTH];
        s.store(self.t, &mut ts);
        let mut bits = self.bits;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let (t, u, v) = (ts[lane], us[lane], vs[lane]);
            if t < best.t_max && filter.accept(instance, ids[lane], u, v) {
                best.t_max = t;
                best.hit = Hit { t, u, v, primitive: ids[lane], instance };
            }
        }
    }

    /// Whether the filter accepts any candidate.
    #[inline(always)]
    pub fn any<F: HitFilter>(&self, s: S, ids: &[u32; WIDTH], instance: u32, filter: &F) -> bool {
        if F::OPAQUE {
            return true;
        }
        let (mut us, mut vs) = ([0.0; WIDTH], [0.0; WIDTH]);
        s.store(self.u, &mut us);
        s.store(self.v, &mut vs);
        let mut bits = self.bits;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            if filter.accept(instance, ids[lane], us[lane], vs[lane]) {
                return true;
            }
        }
        false
    }
}

/// A kind of leaf: its blocks, and how a ray meets one.
pub(super) trait Leaf<S: Simd> {
    /// Tells `found` of the hits between the ray's start and `t_max`, if there are any.
    fn test(&self, s: S, index: usize, t_max: f32, found: &mut impl Found<S>);
}

/// What is to be done with hits. A type, not a closure: those are compiled without the kernel's instructions where they are not inlined.
pub(super) trait Found<S: Simd> {
    /// Gets hits of a leaf, whose triangles or spheres have the numbers `ids`.
    fn found(&mut self, s: S, candidates: &Candidates<S>, ids: &[u32; WIDTH]);
}

/// Keeps the nearest hit.
pub(super) struct KeepNearest<'a, F> {
    pub instance: u32,
    pub filter: &'a F,
    pub best: &'a mut Best,
}

impl<S: Simd, F: HitFilter> Found<S> for KeepNearest<'_, F> {
    #[inline(always)]
    fn found(&mut self, s: S, candidates: &Candidates<S>, ids: &[u32; WIDTH]) {
        candidates.keep_nearest(s, ids, self.instance, self.filter, self.best);
    }
}

/// Finds out whether there is any hit.
pub(super) struct FindAny<'a, F> {
    pub instance: u32,
    pub filter: &'a F,
    pub any: bool,
}

impl<S: Simd, F: HitFilter> Found<S> for FindAny<'_, F> {
    #[inline(always)]
    fn found(&mut self, s: S, candidates: &Candidates<S>, ids: &[u32; WIDTH]) {
        self.any |= candidates.any(s, ids, self.instance, self.filter);
    }
}

/// What the triangle test needs of a ray.
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
        // By reference: a copy is written in pieces and read back in others, which stalls.
        let d = &ray.direction;
        let (x, y, z) = (d[0].abs(), d[1].abs(), d[2].abs());
        // By table: which axis is longest is anyone's guess, and so would be a branch.
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

    /// All others.
    #[cfg(all(test, target_arch = "x86_64"))]
    pub fn numbers(&self) -> [f32; 7] {
        let ([a, b, c], [d, e, f]) = (self.origin, self.shear);
        [a, b, c, d, e, f, self.t_min]
    }
}

/// Triangles: `optics::intersect::intersect_triangle` in eight lanes.
pub(super) struct Triangles<'a, S: Simd> {
    blocks: &'a [TriangleBlock],
    axes: [u32; 3],
    origin: [S::F; 3],
    shear: [S::F; 3],
    pub t_min: S::F,
}

// No closures around vector operations, here and below: a closure is compiled without the entry point's instructions,
// and what it calls would then not be inlined.
impl<'a, S: Simd> Triangles<'a, S> {
    /// Vertex `i` of each triangle relative to the ray's origin, sheared so that the ray runs along the third axis.
    #[inline(always)]
    fn corner(&self, s: S, block: &TriangleBlock, i: usize) -> [S::F; 3] {
        let [u, v, w] = self.axes;
        let p = &block.vertices[i];
        // SAFETY: the axes are those of a `Shear`, which takes them from its table: 0, 1 and 2 in some order.
        let [x, y, z] = unsafe {
            [p.get_unchecked(u as usize), p.get_unchecked(v as usize), p.get_unchecked(w as usize)]
        };
        let z = s.sub(s.load(z), self.origin[2]);
        let x = s.neg_mul_add(self.shear[0], z, s.sub(s.load(x), self.origin[0]));
        let y = s.neg_mul_add(self.shear[1], z, s.sub(s.load(y), self.origin[1]));
        [x, y, z]
    }

    /// Where the ray's line meets each triangle.
    #[inline(always)]
    pub fn meet(&self, s: S, block: &TriangleBlock) -> Met<S> {
        let corners = [self.corner(s, block, 0), self.corner(s, block, 1), self.corner(s, block, 2)];
        Met::new(s, corners, self.shear[2])
    }

    /// Where the ray's line meets the triangles of a leaf, and for which of them that is between the ray's start and `t_max`.
    #[inline(always)]
    pub fn meet_leaf(&self, s: S, index: usize, t_max: f32) -> (Met<S>, S::M) {
        debug_assert!(index < self.blocks.len());
        // SAFETY: references to leaves are made by the builder, which numbers the blocks of this very slice (`validate`
        // checks them in debug builds).
        let met = self.meet(s, unsafe { self.blocks.get_unchecked(index) });
        let mask = s.and(met.inside, s.and(s.lt(self.t_min, met.t), s.lt(met.t, s.splat(t_max))));
        (met, mask)
    }

    #[inline(always)]
    pub fn new(s: S, blocks: &'a [TriangleBlock], ray: &Shear) -> Self {
        Triangles {
            blocks,
            axes: ray.axes,
            origin: splats(s, ray.origin),
            shear: splats(s, ray.shear),
            t_min: s.splat(ray.t_min),
        }
    }
}

/// Where a line meets eight triangles, or eight lines meet one, where `inside` is set.
pub(super) struct Met<S: Simd> {
    pub inside: S::M,
    pub t: S::F,
    pub u: S::F,
    pub v: S::F,
}

impl<S: Simd> Met<S> {
    /// Of triangles whose corners are sheared so that the line runs along the third axis; `shear_z`: what distances along that are to be
    /// multiplied by.
    #[inline(always)]
    pub fn new(s: S, [[ax, ay, az], [bx, by, bz], [cx, cy, cz]]: [[S::F; 3]; 3], shear_z: S::F) -> Self {
        // Not fused: see the scalar function.
        let e0 = s.sub(s.mul(cx, by), s.mul(cy, bx));
        let e1 = s.sub(s.mul(ax, cy), s.mul(ay, cx));
        let e2 = s.sub(s.mul(bx, ay), s.mul(by, ax));
        let det = s.add(s.add(e0, e1), e2);
        // All three edges on the determinant's side. Where that is zero or NaN, the distance is infinite or NaN, and
        // is not between the ray's ends.
        let side = s.min(s.min(s.flip_sign(e0, det), s.flip_sign(e1, det)), s.flip_sign(e2, det));
        let inside = s.le(s.splat(0.0), side);
        let scaled = s.mul(shear_z, s.mul_add(e0, az, s.mul_add(e1, bz, s.mul(e2, cz))));
        // Finite, so that a triangle that looks as small as denormal numbers has weights that are numbers, too.
        let largest = f32::MAX;
        let inverse = s.max(s.min(s.div(s.splat(1.0), det), s.splat(largest)), s.splat(-largest));
        Met { inside, t: s.div(scaled, det), u: s.mul(e1, inverse), v: s.mul(e2, inverse) }
    }
}

impl<S: Simd> Leaf<S> for Triangles<'_, S> {
    #[inline(always)]
    fn test(&self, s: S, index: usize, t_max: f32, found: &mut impl Found<S>) {
        // Without a look at who passes inside: a second branch that cannot be foreseen costs more than the division.
        let (h, mask) = self.meet_leaf(s, index, t_max);
        let bits = s.bits(mask);
        if bits != 0 {
            let candidates = Candidates { mask, bits, t: h.t, u: h.u, v: h.v };
            found.found(s, &candidates, &self.blocks[index].ids);
        }
    }
}

/// Spheres: `optics::intersect::intersect_sphere` in eight lanes.
pub(super) struct Spheres<'a, S: Simd> {
    blocks: &'a [SphereBlock],
    origin: [S::F; 3],
    direction: [S::F; 3],
    /// The direction's squared length.
    a: S::F,
    t_min: S::F,
}

impl<'a, S: Simd> Spheres<'a, S> {
    #[inline(always)]
    pub fn new(s: S, blocks: &'a [SphereBlock], ray: &Ray) -> Self {
        let d = ray.direction;
        Spheres {
            blocks,
            origin: splats(s, ray.origin),
            direction: splats(s, d),
            a: s.splat(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]),
            t_min: s.splat(ray.t_min.max(0.0)),
        }
    }
}

impl<S: Simd> Leaf<S> for Spheres<'_, S> {
    #[inline(always)]
    fn test(&self, s: S, index: usize, t_max: f32, found: &mut impl Found<S>) {
        debug_assert!(index < self.blocks.len());
        // SAFETY: as for triangles.
        let block = unsafe { self.blocks.get_unchecked(index) };
        let zero = s.splat(0.0);
        let [x, y, z] = self.origin;
        let f = [
            s.sub(x, s.load(&block.spheres[0])),
            s.sub(y, s.load(&block.spheres[1])),
            s.sub(z, s.load(&block.spheres[2])),
        ];
        let radius = s.load(&block.spheres[3]);
        let squared = s.mul(radius, radius);
        let b = s.sub(zero, dot(s, f, self.direction));
        let closest = s.div(b, self.a);
        let [x, y, z] = self.direction;
        let l = [s.mul_add(x, closest, f[0]), s.mul_add(y, closest, f[1]), s.mul_add(z, closest, f[2])];
        let d = s.sub(squared, dot(s, l, l));
        let crosses = s.and(s.lt(zero, d), s.lt(zero, radius));
        if s.bits(crosses) == 0 {
            return;
        }
        let root = s.sqrt(s.mul(self.a, d));
        let q = s.add(b, s.select(s.le(zero, b), s.sub(zero, root), root));
        let t0 = s.div(s.sub(dot(s, f, f), squared), q);
        let t1 = s.div(q, self.a);
        let (near, far) = (s.min(t0, t1), s.max(t0, t1));
        let limit = s.splat(t_max);
        let near_counts = s.and(crosses, s.and(s.lt(self.t_min, near), s.lt(near, limit)));
        let far_counts = s.and(crosses, s.and(s.lt(self.t_min, far), s.lt(far, limit)));
        let (near_bits, far_bits) = (s.bits(near_counts), s.bits(far_counts));
        if near_bits | far_bits == 0 {
            return;
        }
        // Both crossings are candidates: a filter may see through one of them. The far side may stand in for the near
        // side of one sphere, so every far side is looked at after all near sides.
        if near_bits != 0 {
            let candidates = Candidates { mask: near_counts, bits: near_bits, t: near, u: zero, v: zero };
            found.found(s, &candidates, &block.ids);
        }
        if far_bits != 0 {
            let candidates = Candidates { mask: far_counts, bits: far_bits, t: far, u: zero, v: zero };
            found.found(s, &candidates, &block.ids);
        }
    }
}
