//! Traversal and intersection, eight boxes or primitives at a time, for any instruction set.
//!
//! Everything here is always inlined into the entry points at the end, which enable the instructions.

use super::packet::Packet;
use super::{Best, STACK, Slabs};
use crate::blas::{Blas, Shape};
use crate::layout::{ChildRef, EMPTY, LEAF, Node, SphereBlock, TriangleBlock, WIDTH};
use crate::ray::{Hit, HitFilter, Ray};
use crate::simd::Simd;
use crate::tlas::Tlas;
use std::mem::MaybeUninit;

#[inline(always)]
pub(super) fn splats<S: Simd>(s: S, x: [f32; 3]) -> [S::F; 3] {
    [s.splat(x[0]), s.splat(x[1]), s.splat(x[2])]
}

#[inline(always)]
pub(super) fn dot<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.mul_add(a[0], b[0], s.mul_add(a[1], b[1], s.mul(a[2], b[2])))
}

/// What happens at leaves.
pub(super) trait Visitor<S: Simd> {
    /// Whether children are visited in order of distance.
    const ORDERED: bool;

    /// Where the search ends by now.
    fn t_max(&self) -> f32;

    /// Looks into leaf `index`. True ends the traversal.
    fn leaf(&mut self, s: S, index: usize) -> bool;
}

/// Children to be visited later, nearest on top, with the distances at which they were seen.
struct Stack {
    distance: MaybeUninit<[u32; STACK]>,
    child: MaybeUninit<[ChildRef; STACK]>,
}

/// Visits the leaves that the ray meets, until a visit says that it is enough.
#[inline(always)]
fn walk<S: Simd, V: Visitor<S>>(
    s: S,
    nodes: &[Node],
    root: ChildRef,
    slabs: &Slabs,
    visitor: &mut V,
) -> bool {
    let mut stack = Stack { distance: MaybeUninit::uninit(), child: MaybeUninit::uninit() };
    let distances: *mut u32 = stack.distance.as_mut_ptr().cast();
    let children: *mut ChildRef = stack.child.as_mut_ptr().cast();
    let mut size = 0usize;

    let inverse = splats(s, slabs.inverse);
    let near_offset = splats(s, slabs.near_offset);
    let far_offset = splats(s, slabs.far_offset);
    let [near_x, near_y, near_z] = slabs.near_side;
    let t_min = s.splat(slabs.t_min);
    let mut t_max = s.splat(visitor.t_max());
    let mut child = root;
    loop {
        if child & LEAF == 0 {
            debug_assert!((child as usize) < nodes.len());
            // SAFETY: references to nodes are made by the builder, which numbers the nodes of this very slice
            // (`validate` checks them in debug builds).
            let node = unsafe { nodes.get_unchecked(child as usize) };
            let x0 = s.mul_add(s.load(&node.planes[0][near_x & 1]), inverse[0], near_offset[0]);
            let y0 = s.mul_add(s.load(&node.planes[1][near_y & 1]), inverse[1], near_offset[1]);
            let z0 = s.mul_add(s.load(&node.planes[2][near_z & 1]), inverse[2], near_offset[2]);
            let x1 = s.mul_add(s.load(&node.planes[0][(near_x & 1) ^ 1]), inverse[0], far_offset[0]);
            let y1 = s.mul_add(s.load(&node.planes[1][(near_y & 1) ^ 1]), inverse[1], far_offset[1]);
            let z1 = s.mul_add(s.load(&node.planes[2][(near_z & 1) ^ 1]), inverse[2], far_offset[2]);
            // An axis that gives NaN (overflow) drops out, because `max` and `min` return the second operand then.
            let near = s.max(s.max(x0, y0), s.max(z0, t_min));
            let far = s.min(s.min(x1, y1), s.min(z1, t_max));
            let inside = s.le(near, far);
            let bits = s.bits(inside);
            if bits != 0 {
                if bits & (bits - 1) == 0 {
                    child = node.children[bits.trailing_zeros() as usize & 7];
                    continue;
                }
                debug_assert!(size + WIDTH <= STACK);
                // SAFETY: a path of at most MAX_DEPTH nodes leaves at most seven siblings each on the stack, and STACK
                // has room for one vector beyond (`validate` checks the depth in debug builds).
                let (distances, children) = unsafe {
                    (
                        &mut *distances.add(size).cast::<[u32; WIDTH]>(),
                        &mut *children.add(size).cast::<[u32; WIDTH]>(),
                    )
                };
                size += bits.count_ones() as usize - 1;
                if V::ORDERED {
                    let keys = s.keys(near, inside);
                    // The nearest child is known long before the others are sorted.
                    child = node.children[s.least_key(keys) as usize & 7];
                    let sorted = s.sorted(keys);
                    s.store_u(sorted, distances);
                    s.store_u(s.permute(s.load_u(&node.children), sorted), children);
                } else {
                    child = node.children[(31 - bits.leading_zeros()) as usize & 7];
                    s.store_u(s.compress(s.load_u(&node.children), inside, bits), children);
                }
                continue;
            }
        } else if child != EMPTY {
            // Coordinates near the end of the range of floats may let a ray into unused boxes.
            if visitor.leaf(s, (child & !LEAF) as usize) {
                return true;
            }
            if V::ORDERED {
                t_max = s.splat(visitor.t_max());
            }
        }
        let limit = visitor.t_max();
        loop {
            if size == 0 {
                return false;
            }
            size -= 1;
            // SAFETY: the entries below `size` have been written.
            unsafe {
                child = *children.add(size);
                // The lane in the key's low bits makes the distance at most eight units in the last place larger.
                if !V::ORDERED || f32::from_bits(*distances.add(size) & !7) < limit {
                    break;
                }
            }
        }
    }
}

/// Eight hits with the lines of triangles or spheres, of which those in `bits` count.
pub(super) struct Candidates {
    bits: u32,
    t: [f32; WIDTH],
    u: [f32; WIDTH],
    v: [f32; WIDTH],
}

impl Candidates {
    /// Keeps the nearest candidate that the filter accepts.
    #[inline(always)]
    pub fn keep_nearest<F: HitFilter>(&self, ids: &[u32; WIDTH], instance: u32, filter: &F, best: &mut Best) {
        let mut bits = self.bits;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let t = self.t[lane];
            if t < best.t_max && (F::OPAQUE || filter.accept(instance, ids[lane], self.u[lane], self.v[lane]))
            {
                best.t_max = t;
                best.hit = Hit { t, u: self.u[lane], v: self.v[lane], primitive: ids[lane], instance };
            }
        }
    }

    /// Whether the filter accepts any candidate.
    #[inline(always)]
    pub fn any<F: HitFilter>(&self, ids: &[u32; WIDTH], instance: u32, filter: &F) -> bool {
        let mut bits = self.bits;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            if F::OPAQUE || filter.accept(instance, ids[lane], self.u[lane], self.v[lane]) {
                return true;
            }
        }
        false
    }
}

/// A kind of leaf: its blocks, and how a ray meets one.
pub(super) trait Leaf<S: Simd> {
    /// Calls `found` with the hits between the ray's start and `t_max`, if there are any.
    fn test(&self, s: S, index: usize, t_max: f32, found: impl FnMut(&Candidates, &[u32; WIDTH]));
}

/// What the triangle test needs of a ray.
#[derive(Clone, Copy)]
pub(super) struct Shear {
    /// The axes of object space in the order (u, v, w).
    axes: [usize; 3],
    /// The ray's origin in that order.
    origin: [f32; 3],
    shear: [f32; 3],
    t_min: f32,
}

impl Shear {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Shear {
        const AXES: [[usize; 3]; 8] =
            [[1, 2, 0], [2, 0, 1], [0, 1, 2], [2, 0, 1], [1, 2, 0], [1, 2, 0], [0, 1, 2], [0, 1, 2]];
        // By reference: a copy is written in pieces and read back in others, which stalls.
        let d = &ray.direction;
        let (x, y, z) = (d[0].abs(), d[1].abs(), d[2].abs());
        // By table: which axis is longest is anyone's guess, and so would be a branch.
        let axes = AXES[usize::from(y > x) | usize::from(z > x) << 1 | usize::from(z > y) << 2];
        let inverse = 1.0 / d[axes[2]];
        Shear {
            axes,
            origin: [ray.origin[axes[0]], ray.origin[axes[1]], ray.origin[axes[2]]],
            shear: [d[axes[0]] * inverse, d[axes[1]] * inverse, inverse],
            t_min: ray.t_min.max(0.0),
        }
    }
}

/// Triangles: `optics::intersect::intersect_triangle` in eight lanes.
pub(super) struct Triangles<'a, S: Simd> {
    blocks: &'a [TriangleBlock],
    axes: [usize; 3],
    origin: [S::F; 3],
    shear: [S::F; 3],
    t_min: S::F,
}

// No closures around vector operations, here and below: a closure is compiled without the entry point's instructions,
// and what it calls would then not be inlined.
impl<'a, S: Simd> Triangles<'a, S> {
    /// Vertex `i` of each triangle relative to the ray's origin, sheared so that the ray runs along the third axis.
    #[inline(always)]
    fn corner(&self, s: S, block: &TriangleBlock, i: usize) -> (S::F, S::F, S::F) {
        let [u, v, w] = self.axes;
        let p = &block.vertices[i];
        let z = s.sub(s.load(&p[w]), self.origin[2]);
        let x = s.neg_mul_add(self.shear[0], z, s.sub(s.load(&p[u]), self.origin[0]));
        let y = s.neg_mul_add(self.shear[1], z, s.sub(s.load(&p[v]), self.origin[1]));
        (x, y, z)
    }

    /// The edge functions, the determinant and the scaled distance, and for which lanes the ray's line passes inside.
    #[inline(always)]
    fn edges(&self, s: S, block: &TriangleBlock) -> ([S::F; 4], S::M) {
        let (ax, ay, az) = self.corner(s, block, 0);
        let (bx, by, bz) = self.corner(s, block, 1);
        let (cx, cy, cz) = self.corner(s, block, 2);
        // Not fused: see the scalar function.
        let e0 = s.sub(s.mul(cx, by), s.mul(cy, bx));
        let e1 = s.sub(s.mul(ax, cy), s.mul(ay, cx));
        let e2 = s.sub(s.mul(bx, ay), s.mul(by, ax));
        let det = s.add(s.add(e0, e1), e2);
        // All three edges on the determinant's side. Where that is zero or NaN, the distance is infinite or NaN, and
        // is not between the ray's ends.
        let side = s.min(s.min(s.flip_sign(e0, det), s.flip_sign(e1, det)), s.flip_sign(e2, det));
        let inside = s.le(s.splat(0.0), side);
        let scaled = s.mul(self.shear[2], s.mul_add(e0, az, s.mul_add(e1, bz, s.mul(e2, cz))));
        ([e1, e2, det, scaled], inside)
    }

    #[inline(always)]
    fn divide(&self, s: S, [e1, e2, det, scaled]: [S::F; 4], inside: S::M) -> Met<S> {
        let inverse = s.div(s.splat(1.0), det);
        Met { inside, t: s.div(scaled, det), u: s.mul(e1, inverse), v: s.mul(e2, inverse) }
    }

    /// Where the ray's line meets each triangle.
    #[inline(always)]
    fn meet(&self, s: S, block: &TriangleBlock) -> Met<S> {
        let (edges, inside) = self.edges(s, block);
        self.divide(s, edges, inside)
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

/// Where a line meets eight triangles, where `inside` is set.
struct Met<S: Simd> {
    inside: S::M,
    t: S::F,
    u: S::F,
    v: S::F,
}

impl<S: Simd> Leaf<S> for Triangles<'_, S> {
    #[inline(always)]
    fn test(&self, s: S, index: usize, t_max: f32, mut found: impl FnMut(&Candidates, &[u32; WIDTH])) {
        debug_assert!(index < self.blocks.len());
        // SAFETY: references to leaves are made by the builder, which numbers the blocks of this very slice (`validate`
        // checks them in debug builds).
        let block = unsafe { self.blocks.get_unchecked(index) };
        let (edges, inside) = self.edges(s, block);
        if s.bits(inside) == 0 {
            return;
        }
        let h = self.divide(s, edges, inside);
        let bits = s.bits(s.and(inside, s.and(s.lt(self.t_min, h.t), s.lt(h.t, s.splat(t_max)))));
        if bits == 0 {
            return;
        }
        let mut c = Candidates { bits, t: [0.0; WIDTH], u: [0.0; WIDTH], v: [0.0; WIDTH] };
        s.store(h.t, &mut c.t);
        s.store(h.u, &mut c.u);
        s.store(h.v, &mut c.v);
        found(&c, &block.ids);
    }
}

/// Spheres: `optics::intersect::intersect_sphere` in eight lanes.
struct Spheres<'a, S: Simd> {
    blocks: &'a [SphereBlock],
    origin: [S::F; 3],
    direction: [S::F; 3],
    /// The direction's squared length.
    a: S::F,
    t_min: S::F,
}

impl<'a, S: Simd> Spheres<'a, S> {
    #[inline(always)]
    fn new(s: S, blocks: &'a [SphereBlock], ray: &Ray) -> Self {
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
    fn test(&self, s: S, index: usize, t_max: f32, mut found: impl FnMut(&Candidates, &[u32; WIDTH])) {
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
        let mut c = Candidates { bits: near_bits, t: [0.0; WIDTH], u: [0.0; WIDTH], v: [0.0; WIDTH] };
        s.store(near, &mut c.t);
        if near_bits != 0 {
            found(&c, &block.ids);
        }
        if far_bits != 0 {
            c.bits = far_bits;
            s.store(far, &mut c.t);
            found(&c, &block.ids);
        }
    }
}

/// Searches leaves for the nearest hit.
pub(super) struct Nearest<'a, L, F> {
    leaves: L,
    instance: u32,
    filter: &'a F,
    best: &'a mut Best,
}

impl<S: Simd, L: Leaf<S>, F: HitFilter> Visitor<S> for Nearest<'_, L, F> {
    const ORDERED: bool = true;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.best.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, index: usize) -> bool {
        let (instance, filter) = (self.instance, self.filter);
        let best = &mut *self.best;
        self.leaves.test(s, index, best.t_max, |c, ids| c.keep_nearest(ids, instance, filter, best));
        false
    }
}

/// Searches leaves for any hit.
pub(super) struct First<'a, L, F> {
    leaves: L,
    instance: u32,
    filter: &'a F,
    t_max: f32,
}

impl<S: Simd, L: Leaf<S>, F: HitFilter> Visitor<S> for First<'_, L, F> {
    const ORDERED: bool = false;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, index: usize) -> bool {
        let mut hit = false;
        self.leaves.test(s, index, self.t_max, |c, ids| hit |= c.any(ids, self.instance, self.filter));
        hit
    }
}

/// The nearest hit in a handful of blocks: all of them are tested, without a branch.
#[inline(always)]
fn tiny_closest<S: Simd>(s: S, blocks: &[TriangleBlock], ray: &Ray, instance: u32, best: &mut Best) {
    let triangles = Triangles::new(s, blocks, &Shear::new(ray));
    let mut nearest = s.splat(best.t_max);
    let (mut u, mut v) = (nearest, nearest);
    let mut at = s.splat_u(0);
    for (index, block) in blocks.iter().enumerate() {
        let h = triangles.meet(s, block);
        let closer = s.and(h.inside, s.and(s.lt(triangles.t_min, h.t), s.lt(h.t, nearest)));
        nearest = s.select(closer, nearest, h.t);
        u = s.select(closer, u, h.u);
        v = s.select(closer, v, h.v);
        at = s.select_u(closer, at, s.splat_u(index as u32));
    }
    let hit = s.bits(s.lt(nearest, s.splat(best.t_max)));
    if hit == 0 {
        return;
    }
    let t = s.least(nearest);
    let lane = s.bits(s.le(nearest, s.splat(t))).trailing_zeros() as usize & 7;
    let (mut us, mut vs, mut ats) = ([0.0; WIDTH], [0.0; WIDTH], [0; WIDTH]);
    s.store(u, &mut us);
    s.store(v, &mut vs);
    s.store_u(at, &mut ats);
    let primitive = blocks[ats[lane] as usize].ids[lane];
    *best = Best { hit: Hit { t, u: us[lane], v: vs[lane], primitive, instance }, t_max: t };
}

/// Whether there is a hit in a handful of blocks.
#[inline(always)]
fn tiny_any<S: Simd>(s: S, blocks: &[TriangleBlock], ray: &Ray) -> bool {
    let triangles = Triangles::new(s, blocks, &Shear::new(ray));
    let limit = s.splat(ray.t_max);
    let mut any = 0;
    for block in blocks {
        let h = triangles.meet(s, block);
        any |= s.bits(s.and(h.inside, s.and(s.lt(triangles.t_min, h.t), s.lt(h.t, limit))));
    }
    any != 0
}

#[inline(always)]
fn blas_closest<S: Simd, F: HitFilter>(
    s: S,
    blas: &Blas,
    ray: &Ray,
    instance: u32,
    filter: &F,
    best: &mut Best,
) {
    if F::OPAQUE
        && let Some(blocks) = blas.tiny()
    {
        return tiny_closest(s, blocks, ray, instance, best);
    }
    let slabs = Slabs::new(ray, &blas.extent);
    match &blas.shape {
        Shape::Triangles(blocks) => {
            let mut visitor =
                Nearest { leaves: Triangles::new(s, blocks, &Shear::new(ray)), instance, filter, best };
            walk(s, &blas.nodes, blas.root, &slabs, &mut visitor);
        }
        Shape::Spheres(blocks) => {
            let mut visitor = Nearest { leaves: Spheres::new(s, blocks, ray), instance, filter, best };
            walk(s, &blas.nodes, blas.root, &slabs, &mut visitor);
        }
    }
}

#[inline(always)]
fn blas_any<S: Simd, F: HitFilter>(s: S, blas: &Blas, ray: &Ray, instance: u32, filter: &F) -> bool {
    if F::OPAQUE
        && let Some(blocks) = blas.tiny()
    {
        return tiny_any(s, blocks, ray);
    }
    let slabs = Slabs::new(ray, &blas.extent);
    let t_max = ray.t_max;
    match &blas.shape {
        Shape::Triangles(blocks) => {
            let mut visitor =
                First { leaves: Triangles::new(s, blocks, &Shear::new(ray)), instance, filter, t_max };
            walk(s, &blas.nodes, blas.root, &slabs, &mut visitor)
        }
        Shape::Spheres(blocks) => {
            let mut visitor = First { leaves: Spheres::new(s, blocks, ray), instance, filter, t_max };
            walk(s, &blas.nodes, blas.root, &slabs, &mut visitor)
        }
    }
}

/// Looks into the instances at the leaves of the top level, with `closest` as the entry point for one object.
pub(super) struct NearestInstance<'a, F, C> {
    tlas: &'a Tlas,
    ray: &'a Ray,
    filter: &'a F,
    best: &'a mut Best,
    closest: C,
}

impl<S: Simd, F: HitFilter, C: Fn(&Blas, &Ray, u32, &F, &mut Best)> Visitor<S> for NearestInstance<'_, F, C> {
    const ORDERED: bool = true;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.best.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, _: S, index: usize) -> bool {
        if let Some((blas, instance, ray)) = self.tlas.enter(index, self.ray, self.filter.ray_mask()) {
            (self.closest)(blas, &ray, instance, self.filter, self.best);
        }
        false
    }
}

/// As [`NearestInstance`], for any hit.
struct AnyInstance<'a, F, C> {
    tlas: &'a Tlas,
    ray: &'a Ray,
    filter: &'a F,
    any: C,
}

impl<S: Simd, F: HitFilter, C: Fn(&Blas, &Ray, u32, &F) -> bool> Visitor<S> for AnyInstance<'_, F, C> {
    const ORDERED: bool = false;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.ray.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, _: S, index: usize) -> bool {
        match self.tlas.enter(index, self.ray, self.filter.ray_mask()) {
            Some((blas, instance, ray)) => (self.any)(blas, &ray, instance, self.filter),
            None => false,
        }
    }
}

#[inline(always)]
fn tlas_walk<S: Simd, V: Visitor<S>>(s: S, tlas: &Tlas, ray: &Ray, visitor: &mut V) -> bool {
    walk(s, &tlas.nodes, tlas.root, &Slabs::new(ray, &tlas.extent), visitor)
}

/// The entry points of one instruction set.
macro_rules! entry_points {
    ($module:ident, $simd:path, $features:literal) => {
        pub(super) mod $module {
            use super::*;

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn packet<F: HitFilter, const ANY: bool>(
                packet: &mut Packet,
                blas: &Blas,
                blocks: &[TriangleBlock],
                rays: &[Ray],
                filter: &F,
            ) -> bool {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                packet.trace::<$simd, F, ANY>(s, blas, blocks, rays, filter)
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn blas_closest<F: HitFilter>(
                blas: &Blas,
                ray: &Ray,
                instance: u32,
                filter: &F,
                best: &mut Best,
            ) {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                super::blas_closest(s, blas, ray, instance, filter, best);
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn blas_any<F: HitFilter>(blas: &Blas, ray: &Ray, instance: u32, filter: &F) -> bool {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                super::blas_any(s, blas, ray, instance, filter)
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn tlas_closest<F: HitFilter>(tlas: &Tlas, ray: &Ray, filter: &F, best: &mut Best) {
                if let Some(blas) = tlas.only(filter.ray_mask()) {
                    // SAFETY: the caller's promise.
                    return unsafe { blas_closest(blas, ray, 0, filter, best) };
                }
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                let closest = |b: &Blas, r: &Ray, i, f: &F, best: &mut Best| {
                    // SAFETY: the caller's promise.
                    unsafe { blas_closest(b, r, i, f, best) }
                };
                super::tlas_walk(s, tlas, ray, &mut NearestInstance { tlas, ray, filter, best, closest });
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn tlas_any<F: HitFilter>(tlas: &Tlas, ray: &Ray, filter: &F) -> bool {
                if let Some(blas) = tlas.only(filter.ray_mask()) {
                    // SAFETY: the caller's promise.
                    return unsafe { blas_any(blas, ray, 0, filter) };
                }
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                // SAFETY: the caller's promise.
                let any = |b: &Blas, r: &Ray, i, f: &F| unsafe { blas_any(b, r, i, f) };
                super::tlas_walk(s, tlas, ray, &mut AnyInstance { tlas, ray, filter, any })
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
entry_points!(avx2, crate::simd::avx2::Avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
#[cfg(target_arch = "x86_64")]
entry_points!(
    avx512,
    crate::simd::avx512::Avx512,
    "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
);
#[cfg(target_arch = "aarch64")]
entry_points!(neon, crate::simd::neon::Neon, "neon");
