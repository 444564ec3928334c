//! Packets: coherent rays traverse the tree together.
//!
//! Boxes of nodes and of triangles are tested once for all rays, with intervals of origins and
//! reciprocal directions. The remaining triangles are tested with eight rays at a time, with the
//! arithmetic of [`TriangleIntersector`](super::triangle_intersector::TriangleIntersector). So a
//! ray's hit is that of a single-ray query.

use super::lane_vectors::{abs, splats};
use super::ray_setup::{LaneRays, LaneSlabs, Shears};
use super::ray_stream::{Ray8, RayStream};
use super::traversal_stack::STACK_SIZE;
use super::triangle_intersector::{Shear, TriangleHits};
use crate::bvh::Blas;
use crate::layout::{EMPTY, LEAF, NO_PRIMITIVE, Node, TriangleBlock, WIDTH, leaf_index};
use crate::ray::{Candidate, Hit, HitFilter, MISS, Ray};
use crate::simd::Simd;
use std::ops::Range;

/// Rays in a packet.
pub(crate) const PACKET: usize = 32;

const GROUPS: usize = PACKET / WIDTH;

/// Largest difference of directions, with the longest component scaled to one.
const MAX_SPREAD: f32 = 0.15;

/// Largest distance of origins, relative to the object's extent.
const MAX_DISTANCE: f32 = 0.05;

type Lanes = [[f32; WIDTH]; GROUPS];

/// A packet of rays and their hits.
pub(crate) struct Packet {
    inverse: [Lanes; 3],
    near_offset: [Lanes; 3],
    far_offset: [Lanes; 3],
    t_min: Lanes,
    /// The current end of each ray; negative for finished rays.
    t_max: Lanes,
    /// Origins and shears, see [`Shear`].
    origin: [Lanes; 3],
    shear: [Lanes; 3],
    /// The primitive that each ray hits, or [`NO_PRIMITIVE`].
    primitive: [[u32; WIDTH]; GROUPS],
    u: Lanes,
    v: Lanes,
}

/// Intervals of origins and reciprocal directions that contain all rays, rounded outwards.
struct Frustum {
    near_side: [usize; 3],
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    low_inverse: [f32; 3],
    high_inverse: [f32; 3],
    t_min: f32,
    /// The order of axes of all rays, see [`Shear`].
    axes: [usize; 3],
}

/// [`Frustum`] in all lanes.
struct Intervals<S: Simd> {
    near_side: [usize; 3],
    near_origin: [S::F; 3],
    far_origin: [S::F; 3],
    low_inverse: [S::F; 3],
    high_inverse: [S::F; 3],
    t_min: S::F,
}

impl<S: Simd> Intervals<S> {
    #[inline(always)]
    fn new(s: S, f: &Frustum) -> Self {
        Intervals {
            near_side: f.near_side,
            near_origin: splats(s, f.near_origin),
            far_origin: splats(s, f.far_origin),
            low_inverse: splats(s, f.low_inverse),
            high_inverse: splats(s, f.high_inverse),
            t_min: s.splat(f.t_min),
        }
    }

    /// Lower bounds of the entry distances for eight boxes, and the mask of boxes that a ray may
    /// hit before `limit`. `planes`: by axis, low and high.
    #[inline(always)]
    fn intersect(&self, s: S, planes: &[[S::F; 2]; 3], limit: f32) -> (S::F, S::M) {
        let (mut near, mut far) = (self.t_min, s.splat(limit));
        for a in 0..3 {
            let side = self.near_side[a] & 1;
            let n = s.sub(planes[a][side], self.near_origin[a]);
            let x = s.sub(planes[a][side ^ 1], self.far_origin[a]);
            let (low, high) = (self.low_inverse[a], self.high_inverse[a]);
            near = s.max(s.min(s.mul(n, low), s.mul(n, high)), near);
            far = s.min(s.max(s.mul(x, low), s.mul(x, high)), far);
        }
        (near, s.le(near, far))
    }

    /// Mask of the triangles that a ray may hit before `limit`.
    #[inline(always)]
    fn triangles(&self, s: S, block: &TriangleBlock, limit: f32) -> u32 {
        let [a, b, c] = &block.vertices;
        let zero = s.splat(0.0);
        let mut planes = [[zero; 2]; 3];
        for axis in 0..3 {
            let (a, b, c) = (s.load(&a[axis]), s.load(&b[axis]), s.load(&c[axis]));
            planes[axis] = [s.min(s.min(a, b), c), s.max(s.max(a, b), c)];
        }
        let (_, inside) = self.intersect(s, &planes, limit);
        // Unused triangles are NaN, which the slab test would ignore.
        s.bits(s.and(inside, s.le(planes[0][0], planes[0][0])))
    }
}

/// Whether the directions of two rays are close. A quick estimate; `load` decides.
#[inline(always)]
fn is_coherent(a: &Ray, b: &Ray) -> bool {
    let dot = |a: &[f32; 3], b: &[f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (aa, ab, bb) =
        (dot(&a.direction, &a.direction), dot(&a.direction, &b.direction), dot(&b.direction, &b.direction));
    ab > 0.0 && ab * ab > 0.97 * aa * bb
}

/// Writes `ray` to all lanes except the first `used`.
#[inline(always)]
fn fill_up(lanes: &mut Ray8, used: usize, ray: &Ray) {
    for lane in used..WIDTH {
        lanes.set(lane, ray);
    }
}

impl Packet {
    pub fn new() -> Packet {
        Packet {
            inverse: [[[0.0; WIDTH]; GROUPS]; 3],
            near_offset: [[[0.0; WIDTH]; GROUPS]; 3],
            far_offset: [[[0.0; WIDTH]; GROUPS]; 3],
            t_min: [[0.0; WIDTH]; GROUPS],
            t_max: [[-1.0; WIDTH]; GROUPS],
            origin: [[[0.0; WIDTH]; GROUPS]; 3],
            shear: [[[0.0; WIDTH]; GROUPS]; 3],
            primitive: [[NO_PRIMITIVE; WIDTH]; GROUPS],
            u: [[0.0; WIDTH]; GROUPS],
            v: [[0.0; WIDTH]; GROUPS],
        }
    }

    /// Loads up to [`PACKET`] rays, if they are coherent. Unused lanes repeat the first ray.
    #[inline(always)]
    fn load<S: Simd>(
        &mut self,
        s: S,
        blas: &Blas,
        rays: &(impl RayStream + ?Sized),
        some: Range<usize>,
    ) -> Option<Frustum> {
        let first = &rays.ray(some.start);
        // Three rays reveal most incoherent packets.
        if [some.start + some.len() / 2, some.end - 1].iter().any(|&i| !is_coherent(first, &rays.ray(i))) {
            return None;
        }
        let mut lanes = [Ray8::INACTIVE; GROUPS];
        for (group, lanes) in lanes.iter_mut().enumerate() {
            rays.load(some.start + group * WIDTH, lanes);
            fill_up(lanes, some.len().saturating_sub(group * WIDTH), first);
        }
        let d = first.direction;
        let long = if d[0].abs() > d[1].abs() { 0 } else { 1 };
        let long = if d[2].abs() > d[long].abs() { 2 } else { long };
        let zero = s.splat(0.0);
        let middle = splats(s, d.map(|x| x / d[long].abs()));
        let near_side = [usize::from(d[0] < 0.0), usize::from(d[1] < 0.0), usize::from(d[2] < 0.0)];
        let shear = Shear::new(first);
        let largest = s.splat(f32::MAX);
        let [mut low, mut high, mut low_inverse, mut high_inverse] = [[largest; 3]; 4];
        let mut t_min = s.splat(f32::INFINITY);
        for (group, lanes) in lanes.iter().enumerate() {
            let eight = LaneRays::eight(s, lanes);
            let (slabs, shears) = (LaneSlabs::new(s, &eight, &blas.extent), Shears::new(s, &eight));
            let used = some.len().saturating_sub(group * WIDTH).min(WIDTH);
            if s.bits(eight.valid) != 255 || shears.axes.bits_other_than(s, shear.third_axis(), 255) != 0 {
                return None;
            }
            let scale = s.div(s.splat(1.0), abs(s, s.load(&lanes.direction[long])));
            for a in 0..3 {
                let (o, d) = (s.load(&lanes.origin[a]), s.load(&lanes.direction[a]));
                let apart = abs(s, s.sub(s.mul(d, scale), middle[a]));
                let all_negative = if near_side[a] == 0 { 0 } else { 255 };
                // NaN is not close.
                if s.bits(s.le(apart, s.splat(MAX_SPREAD))) != 255
                    || s.bits(slabs.is_negative[a]) != all_negative
                {
                    return None;
                }
                low[a] = s.min(low[a], o);
                high[a] = s.min(high[a], s.sub(zero, o));
                low_inverse[a] = s.min(low_inverse[a], slabs.inverse[a]);
                high_inverse[a] = s.min(high_inverse[a], s.sub(zero, slabs.inverse[a]));
                s.store(slabs.inverse[a], &mut self.inverse[a][group]);
                s.store(slabs.near_offset[a], &mut self.near_offset[a][group]);
                s.store(slabs.far_offset[a], &mut self.far_offset[a][group]);
            }
            t_min = s.min(t_min, eight.t_min);
            s.store(eight.t_min, &mut self.t_min[group]);
            s.store(eight.t_max, &mut self.t_max[group]);
            self.t_max[group][used..].fill(-1.0);
            for a in 0..3 {
                s.store(shears.origin[a], &mut self.origin[a][group]);
                s.store(shears.shear[a], &mut self.shear[a][group]);
            }
        }
        self.primitive = [[NO_PRIMITIVE; WIDTH]; GROUPS];
        let mut f = Frustum {
            near_side,
            near_origin: [0.0; 3],
            far_origin: [0.0; 3],
            low_inverse: [0.0; 3],
            high_inverse: [0.0; 3],
            t_min: s.least(t_min),
            axes: shear.order(),
        };
        let extent = blas.extent[0].max(blas.extent[1]).max(blas.extent[2]);
        for a in 0..3 {
            f.low_inverse[a] = s.least(low_inverse[a]);
            f.high_inverse[a] = -s.least(high_inverse[a]);
            let (low, high) = (s.least(low[a]), -s.least(high[a]));
            if high - low > MAX_DISTANCE * extent {
                return None;
            }
            let room = (low.abs().max(high.abs()) + blas.extent[a]) * (8.0 * f32::EPSILON);
            let (low, high) = (low - room, high + room);
            (f.near_origin[a], f.far_origin[a]) = if f.near_side[a] == 0 { (high, low) } else { (low, high) };
        }
        Some(f)
    }

    /// The largest end of a ray; negative if all rays are finished.
    #[inline(always)]
    fn limit<S: Simd>(&self, s: S) -> f32 {
        let zero = s.splat(0.0);
        let mut nearest = s.splat(1.0);
        for group in &self.t_max {
            nearest = s.min(nearest, s.sub(zero, s.load(group)));
        }
        -s.least(nearest)
    }

    /// Traces the rays `some`, at least one, through `blas`, whose leaves are `blocks`. Returns
    /// false, without effect, if they are not coherent.
    ///
    /// Afterwards [`Packet::hit`] returns the closest hits, or any hits for `ANY`.
    #[inline(always)]
    pub fn trace<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        blas: &Blas,
        blocks: &[TriangleBlock],
        rays: &(impl RayStream + ?Sized),
        some: Range<usize>,
        filter: &F,
    ) -> bool {
        let Some(f) = self.load(s, blas, rays, some) else { return false };
        if blas.root & LEAF != 0 {
            return false;
        }
        let intervals = Intervals::new(s, &f);
        let mut limit = self.limit(s);
        let (mut keys, mut parents) = ([0u32; STACK_SIZE], [0u32; STACK_SIZE]);
        let mut size = 0;
        let mut at = blas.root;
        loop {
            let node = &blas.nodes[at as usize];
            let [[x0, x1], [y0, y1], [z0, z1]] = &node.planes;
            let planes = [[s.load(x0), s.load(x1)], [s.load(y0), s.load(y1)], [s.load(z0), s.load(z1)]];
            let (near, inside) = intervals.intersect(s, &planes, limit);
            let bits = s.bits(inside);
            if bits != 0 {
                let sorted = s.sorted(s.keys(near, inside));
                let room = "STACK_SIZE covers the siblings along the deepest path and one vector more";
                s.store_u(sorted, keys[size..].first_chunk_mut().expect(room));
                s.store_u(s.splat_u(at), parents[size..].first_chunk_mut().expect(room));
                size += bits.count_ones() as usize;
            }
            loop {
                if size == 0 {
                    return true;
                }
                size -= 1;
                if f32::from_bits(keys[size] & !7) >= limit {
                    continue;
                }
                let (parent, slot) = (&blas.nodes[parents[size] as usize], keys[size] as usize & 7);
                let child = parent.children[slot];
                if child & LEAF == 0 {
                    at = child;
                    break;
                }
                if child == EMPTY {
                    continue;
                }
                let block = &blocks[leaf_index(child)];
                let mut groups = 0;
                for group in 0..GROUPS {
                    groups |= u32::from(self.any_hits_box(s, parent, slot, &f.near_side, group)) << group;
                }
                let mut has_hit = false;
                let mut triangles = if groups == 0 { 0 } else { intervals.triangles(s, block, limit) };
                while triangles != 0 {
                    let lane = triangles.trailing_zeros() as usize % WIDTH;
                    triangles &= triangles - 1;
                    has_hit |= self.intersect_triangle::<S, F, ANY>(s, block, lane, &f.axes, groups, filter);
                }
                if has_hit {
                    limit = self.limit(s);
                    if limit < 0.0 {
                        return true;
                    }
                }
            }
        }
    }

    /// Whether a ray of the group hits a child's box.
    #[inline(always)]
    fn any_hits_box<S: Simd>(
        &self,
        s: S,
        node: &Node,
        slot: usize,
        near_side: &[usize; 3],
        group: usize,
    ) -> bool {
        let (mut near, mut far) = (s.load(&self.t_min[group]), s.load(&self.t_max[group]));
        for a in 0..3 {
            let side = near_side[a] & 1;
            let inverse = s.load(&self.inverse[a][group]);
            let (n, x) = (s.splat(node.planes[a][side][slot]), s.splat(node.planes[a][side ^ 1][slot]));
            near = s.max(s.mul_add(n, inverse, s.load(&self.near_offset[a][group])), near);
            far = s.min(s.mul_add(x, inverse, s.load(&self.far_offset[a][group])), far);
        }
        s.bits(s.le(near, far)) != 0
    }

    /// Intersects triangle `lane` of a block with the rays of `groups`. True if a ray has a closer
    /// hit.
    #[inline(always)]
    fn intersect_triangle<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        block: &TriangleBlock,
        lane: usize,
        axes: &[usize; 3],
        groups: u32,
        filter: &F,
    ) -> bool {
        let [x, y, z] = [axes[0] % 3, axes[1] % 3, axes[2] % 3];
        let [p, q, r] = &block.vertices;
        let a = splats(s, [p[x][lane], p[y][lane], p[z][lane]]);
        let b = splats(s, [q[x][lane], q[y][lane], q[z][lane]]);
        let c = splats(s, [r[x][lane], r[y][lane], r[z][lane]]);
        let primitive = block.ids[lane];
        let mut has_hit = false;
        for group in (0..GROUPS).filter(|group| groups >> group & 1 != 0) {
            let (hits, mask) = self.triangle_hits(s, [a, b, c], group);
            if F::OPAQUE {
                has_hit |= s.bits(mask) != 0;
                let t = if ANY { s.splat(-1.0) } else { hits.t };
                let t_max = s.select(mask, s.load(&self.t_max[group]), t);
                s.store(t_max, &mut self.t_max[group]);
                s.store(s.select(mask, s.load(&self.u[group]), hits.u), &mut self.u[group]);
                s.store(s.select(mask, s.load(&self.v[group]), hits.v), &mut self.v[group]);
                let found = s.select_u(mask, s.load_u(&self.primitive[group]), s.splat_u(primitive));
                s.store_u(found, &mut self.primitive[group]);
                continue;
            }
            let [mut t, mut u, mut v] = [[0.0; WIDTH]; 3];
            s.store(hits.t, &mut t);
            s.store(hits.u, &mut u);
            s.store(hits.v, &mut v);
            let mut rays = s.bits(mask);
            while rays != 0 {
                let ray = rays.trailing_zeros() as usize % WIDTH;
                rays &= rays - 1;
                let along = 1.0 / self.shear[2][group][ray];
                let mut direction = [0.0; 3];
                direction[x] = self.shear[0][group][ray] * along;
                direction[y] = self.shear[1][group][ray] * along;
                direction[z] = along;
                let (u_here, v_here, outward) = (u[ray], v[ray], [0.0; 3]);
                let candidate =
                    Candidate { instance: 0, primitive, u: u_here, v: v_here, direction, outward };
                if filter.accept(&candidate) {
                    has_hit = true;
                    self.t_max[group][ray] = if ANY { -1.0 } else { t[ray] };
                    (self.u[group][ray], self.v[group][ray]) = (u[ray], v[ray]);
                    self.primitive[group][ray] = primitive;
                }
            }
        }
        has_hit
    }

    /// Hits of the rays of a group with a triangle, and the mask of those inside the rays'
    /// intervals.
    #[inline(always)]
    fn triangle_hits<S: Simd>(&self, s: S, corners: [[S::F; 3]; 3], group: usize) -> (TriangleHits<S>, S::M) {
        let origin = [&self.origin[0][group], &self.origin[1][group], &self.origin[2][group]];
        let origin = [s.load(origin[0]), s.load(origin[1]), s.load(origin[2])];
        let shear = [&self.shear[0][group], &self.shear[1][group], &self.shear[2][group]];
        let shear = [s.load(shear[0]), s.load(shear[1]), s.load(shear[2])];
        let [a, b, c] = corners;
        let (a, b, c) =
            (sheared(s, a, &origin, &shear), sheared(s, b, &origin, &shear), sheared(s, c, &origin, &shear));
        let hits = TriangleHits::new(s, [a, b, c], shear[2]);
        let within =
            s.and(s.lt(s.load(&self.t_min[group]), hits.t), s.lt(hits.t, s.load(&self.t_max[group])));
        let mask = s.and(hits.inside, within);
        (hits, mask)
    }

    /// The hit of ray `i`.
    #[inline(always)]
    pub fn hit(&self, i: usize) -> Hit {
        let (group, lane) = (i / WIDTH, i % WIDTH);
        match self.primitive[group][lane] {
            NO_PRIMITIVE => MISS,
            primitive => {
                let (u, v) = (self.u[group][lane], self.v[group][lane]);
                Hit { t: self.t_max[group][lane], u, v, primitive, instance: 0 }
            }
        }
    }
}

/// A point in the sheared space of rays. Coordinates are in the order of the axes.
#[inline(always)]
fn sheared<S: Simd>(s: S, [x, y, z]: [S::F; 3], origin: &[S::F; 3], shear: &[S::F; 3]) -> [S::F; 3] {
    let (x, y, z) = (s.sub(x, origin[0]), s.sub(y, origin[1]), s.sub(z, origin[2]));
    [s.neg_mul_add(shear[0], z, x), s.neg_mul_add(shear[1], z, y), z]
}
