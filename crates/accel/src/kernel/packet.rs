//! Packets: rays that go almost the same way walk the tree together.
//!
//! Boxes of nodes are tested once for all rays, with intervals of origins and reciprocal directions. Only leaves are
//! tested ray by ray, first their boxes and then their primitives with the code for single rays.

use super::wide::{Candidates, Leaf, Shear, Triangles, splats};
use super::{Best, STACK, Slabs};
use crate::blas::Blas;
use crate::layout::{LEAF, Node, TriangleBlock, WIDTH};
use crate::ray::{Hit, HitFilter, MISS, Ray};
use crate::simd::Simd;

/// Rays in a packet.
pub(crate) const PACKET: usize = 16;

const GROUPS: usize = PACKET / WIDTH;

/// How far directions may be apart, with the longest component scaled to one.
const MAX_SPREAD: f32 = 0.15;

/// How far origins may be apart, as a part of the object's extent.
const MAX_DISTANCE: f32 = 0.05;

type Lanes = [[f32; WIDTH]; GROUPS];

/// A packet of rays and what they have found.
pub(crate) struct Packet {
    inverse: [Lanes; 3],
    near_offset: [Lanes; 3],
    far_offset: [Lanes; 3],
    t_min: Lanes,
    /// Where each ray's search ends by now: negative when it is over.
    t_max: Lanes,
    shear: [Shear; PACKET],
    /// What each ray has hit.
    pub hits: [Hit; PACKET],
}

/// Intervals that contain all rays, rounded outwards.
struct Frustum {
    near_side: [usize; 3],
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    low_inverse: [f32; 3],
    high_inverse: [f32; 3],
    t_min: f32,
}

impl Packet {
    pub fn new() -> Packet {
        let none = Shear::new(&Ray::new([0.0; 3], [0.0, 0.0, 1.0]));
        Packet {
            inverse: [[[0.0; WIDTH]; GROUPS]; 3],
            near_offset: [[[0.0; WIDTH]; GROUPS]; 3],
            far_offset: [[[0.0; WIDTH]; GROUPS]; 3],
            t_min: [[0.0; WIDTH]; GROUPS],
            t_max: [[-1.0; WIDTH]; GROUPS],
            shear: [none; PACKET],
            hits: [MISS; PACKET],
        }
    }

    /// Takes up to [`PACKET`] rays, if they are alike enough.
    #[inline(always)]
    fn load(&mut self, blas: &Blas, rays: &[Ray]) -> Option<Frustum> {
        let first = rays.first()?;
        let mut f = Frustum {
            near_side: [0; 3],
            near_origin: [0.0; 3],
            far_origin: [0.0; 3],
            low_inverse: [f32::INFINITY; 3],
            high_inverse: [f32::NEG_INFINITY; 3],
            t_min: f32::INFINITY,
        };
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let axis =
            (0..3).fold(0, |w, a| if first.direction[a].abs() > first.direction[w].abs() { a } else { w });
        let unit = |d: [f32; 3]| [d[0] / d[axis].abs(), d[1] / d[axis].abs(), d[2] / d[axis].abs()];
        let middle = unit(rays[rays.len() / 2].direction);
        let extent = blas.extent[0].max(blas.extent[1]).max(blas.extent[2]);
        self.t_max = [[-1.0; WIDTH]; GROUPS];
        for (i, ray) in rays.iter().enumerate() {
            if !ray.is_valid() {
                return None;
            }
            let slabs = Slabs::new(ray, &blas.extent);
            if i == 0 {
                f.near_side = slabs.near_side;
            }
            let u = unit(ray.direction);
            let (group, lane) = (i / WIDTH, i % WIDTH);
            for a in 0..3 {
                let is_apart = !((u[a] - middle[a]).abs() <= MAX_SPREAD)
                    || (ray.origin[a] - first.origin[a]).abs() > MAX_DISTANCE * extent;
                if is_apart || slabs.near_side[a] != f.near_side[a] {
                    return None;
                }
                self.inverse[a][group][lane] = slabs.inverse[a];
                self.near_offset[a][group][lane] = slabs.near_offset[a];
                self.far_offset[a][group][lane] = slabs.far_offset[a];
                low[a] = low[a].min(ray.origin[a]);
                high[a] = high[a].max(ray.origin[a]);
                f.low_inverse[a] = f.low_inverse[a].min(slabs.inverse[a]);
                f.high_inverse[a] = f.high_inverse[a].max(slabs.inverse[a]);
            }
            self.t_min[group][lane] = slabs.t_min;
            self.t_max[group][lane] = ray.t_max;
            f.t_min = f.t_min.min(slabs.t_min);
            self.shear[i] = Shear::new(ray);
            self.hits[i] = MISS;
        }
        for a in 0..3 {
            let room = (low[a].abs().max(high[a].abs()) + blas.extent[a]) * (8.0 * f32::EPSILON);
            let (low, high) = (low[a] - room, high[a] + room);
            (f.near_origin[a], f.far_origin[a]) = if f.near_side[a] == 0 { (high, low) } else { (low, high) };
        }
        Some(f)
    }

    /// The farthest distance at which any ray still looks for hits; negative if all searches are over.
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.t_max.as_flattened().iter().fold(-1.0f32, |m, &t| if t > m { t } else { m })
    }

    /// Traces `rays` through `blas`, whose leaves are `blocks`. False, and nothing done, if they are too different.
    ///
    /// Any hit of a ray, if `ANY`, the nearest otherwise, is found in `hits`.
    #[inline(always)]
    pub fn trace<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        blas: &Blas,
        blocks: &[TriangleBlock],
        rays: &[Ray],
        filter: &F,
    ) -> bool {
        let Some(f) = self.load(blas, rays) else { return false };
        if blas.root & LEAF != 0 {
            return false;
        }
        let near_origin = splats(s, f.near_origin);
        let far_origin = splats(s, f.far_origin);
        let low_inverse = splats(s, f.low_inverse);
        let high_inverse = splats(s, f.high_inverse);
        let t_min = s.splat(f.t_min);
        let mut limit = self.limit();
        let (mut keys, mut parents) = ([0u32; STACK], [0u32; STACK]);
        let mut size = 0;
        let mut at = blas.root;
        loop {
            let node = &blas.nodes[at as usize];
            let (mut near, mut far) = (t_min, s.splat(limit));
            for a in 0..3 {
                let side = f.near_side[a] & 1;
                let n = s.sub(s.load(&node.planes[a][side]), near_origin[a]);
                let x = s.sub(s.load(&node.planes[a][side ^ 1]), far_origin[a]);
                near = s.max(s.min(s.mul(n, low_inverse[a]), s.mul(n, high_inverse[a])), near);
                far = s.min(s.max(s.mul(x, low_inverse[a]), s.mul(x, high_inverse[a])), far);
            }
            let inside = s.le(near, far);
            let bits = s.bits(inside);
            if bits != 0 {
                let sorted = s.sorted(s.keys(near, inside));
                let room = "STACK has room for the siblings along the deepest path and one vector more";
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
                let index = (child & !LEAF) as usize;
                let mut has_hit = false;
                for group in 0..GROUPS {
                    let mut active = self.touch(s, parent, slot, &f.near_side, group);
                    while active != 0 {
                        let lane = active.trailing_zeros() as usize & 7;
                        active &= active - 1;
                        let i = group * WIDTH + lane;
                        has_hit |= self.test::<S, F, ANY>(s, blocks, index, i, filter);
                    }
                }
                if has_hit {
                    limit = self.limit();
                    if limit < 0.0 {
                        return true;
                    }
                }
            }
        }
    }

    /// Which rays of a group touch a child's box.
    #[inline(always)]
    fn touch<S: Simd>(&self, s: S, node: &Node, slot: usize, near_side: &[usize; 3], group: usize) -> u32 {
        let (mut near, mut far) = (s.load(&self.t_min[group]), s.load(&self.t_max[group]));
        for a in 0..3 {
            let side = near_side[a] & 1;
            let inverse = s.load(&self.inverse[a][group]);
            let (n, x) = (s.splat(node.planes[a][side][slot]), s.splat(node.planes[a][side ^ 1][slot]));
            near = s.max(s.mul_add(n, inverse, s.load(&self.near_offset[a][group])), near);
            far = s.min(s.mul_add(x, inverse, s.load(&self.far_offset[a][group])), far);
        }
        s.bits(s.le(near, far))
    }

    /// Tests ray `i` against a leaf. True if its search got shorter.
    #[inline(always)]
    fn test<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        blocks: &[TriangleBlock],
        index: usize,
        i: usize,
        filter: &F,
    ) -> bool {
        let (group, lane) = (i / WIDTH, i % WIDTH);
        let mut best = Best { hit: self.hits[i], t_max: self.t_max[group][lane] };
        let before = best.t_max;
        Triangles::new(s, blocks, &self.shear[i]).test(s, index, before, |c: &Candidates, ids| {
            if !ANY {
                c.keep_nearest(ids, 0, filter, &mut best);
            } else if c.any(ids, 0, filter) {
                best.hit.primitive = 0;
                best.t_max = -1.0;
            }
        });
        self.hits[i] = best.hit;
        self.t_max[group][lane] = best.t_max;
        best.t_max < before
    }
}
