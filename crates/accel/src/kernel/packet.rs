//! Packets: rays that go almost the same way walk the tree together.
//!
//! Boxes of nodes are tested once for all rays, with intervals of origins and reciprocal directions. Only leaves are
//! tested ray by ray, first their boxes and then their primitives with the code for single rays.

use super::leaves::{Candidates, Leaf, Triangles, splats};
use super::setup::{EightRays, Setup, abs};
use super::{Best, STACK};
use crate::blas::Blas;
use crate::layout::{EMPTY, LEAF, Node, TriangleBlock, WIDTH, leaf_index};
use crate::ray::{Hit, HitFilter, MISS, Ray};
use crate::simd::Simd;
use crate::streams::{RayLanes, RayStream};
use std::ops::Range;

/// Rays in a packet.
pub(crate) const PACKET: usize = 32;

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
    setups: [[Setup; WIDTH]; GROUPS],
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

/// Whether the directions of two rays are close. Not exact: `load` looks closer.
#[inline(always)]
fn is_alike(a: &Ray, b: &Ray) -> bool {
    let dot = |a: &[f32; 3], b: &[f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (aa, ab, bb) =
        (dot(&a.direction, &a.direction), dot(&a.direction, &b.direction), dot(&b.direction, &b.direction));
    ab > 0.0 && ab * ab > 0.97 * aa * bb
}

/// Puts `ray` in all lanes but the first `used`.
#[inline(always)]
fn fill_up(lanes: &mut RayLanes, used: usize, ray: &Ray) {
    for lane in used..WIDTH {
        for axis in 0..3 {
            lanes.origin[axis][lane] = ray.origin[axis];
            lanes.direction[axis][lane] = ray.direction[axis];
        }
        (lanes.t_min[lane], lanes.t_max[lane]) = (ray.t_min, ray.t_max);
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
            setups: [[Setup::nothing(); WIDTH]; GROUPS],
            hits: [MISS; PACKET],
        }
    }

    /// Takes up to [`PACKET`] of the rays, if they are alike enough. Unused lanes are filled with the first ray.
    #[inline(always)]
    fn load<S: Simd>(
        &mut self,
        s: S,
        blas: &Blas,
        rays: &(impl RayStream + ?Sized),
        some: Range<usize>,
    ) -> Option<Frustum> {
        let first = &rays.ray(some.start);
        // Most packets that will not do are found out by a look at three rays.
        if [some.start + some.len() / 2, some.end - 1].iter().any(|&i| !is_alike(first, &rays.ray(i))) {
            return None;
        }
        let mut lanes = [RayLanes::NOTHING; GROUPS];
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
        let largest = s.splat(f32::MAX);
        let [mut low, mut high, mut low_inverse, mut high_inverse] = [[largest; 3]; 4];
        let mut t_min = s.splat(f32::INFINITY);
        for (group, lanes) in lanes.iter().enumerate() {
            let eight = EightRays::new(s, lanes, &blas.extent);
            let used = some.len().saturating_sub(group * WIDTH).min(WIDTH);
            if eight.valid != 255 {
                return None;
            }
            let scale = s.div(s.splat(1.0), abs(s, s.load(&lanes.direction[long])));
            for a in 0..3 {
                let (o, d) = (s.load(&lanes.origin[a]), s.load(&lanes.direction[a]));
                let apart = abs(s, s.sub(s.mul(d, scale), middle[a]));
                let all_negative = if near_side[a] == 0 { 0 } else { 255 };
                // NaN is apart, too.
                if s.bits(s.le(apart, s.splat(MAX_SPREAD))) != 255 || s.bits(eight.down[a]) != all_negative {
                    return None;
                }
                low[a] = s.min(low[a], o);
                high[a] = s.min(high[a], s.sub(zero, o));
                low_inverse[a] = s.min(low_inverse[a], eight.inverse[a]);
                high_inverse[a] = s.min(high_inverse[a], s.sub(zero, eight.inverse[a]));
                s.store(eight.inverse[a], &mut self.inverse[a][group]);
                s.store(eight.near_offset[a], &mut self.near_offset[a][group]);
                s.store(eight.far_offset[a], &mut self.far_offset[a][group]);
            }
            t_min = s.min(t_min, eight.t_min);
            s.store(eight.t_min, &mut self.t_min[group]);
            s.store(eight.t_max, &mut self.t_max[group]);
            self.t_max[group][used..].fill(-1.0);
            eight.write(s, &mut self.setups[group]);
        }
        self.hits = [MISS; PACKET];
        let mut f = Frustum {
            near_side,
            near_origin: [0.0; 3],
            far_origin: [0.0; 3],
            low_inverse: [0.0; 3],
            high_inverse: [0.0; 3],
            t_min: s.least(t_min),
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

    /// The farthest distance at which any ray still looks for hits; negative if all searches are over.
    #[inline(always)]
    fn limit<S: Simd>(&self, s: S) -> f32 {
        let zero = s.splat(0.0);
        let mut nearest = s.splat(1.0);
        for group in &self.t_max {
            nearest = s.min(nearest, s.sub(zero, s.load(group)));
        }
        -s.least(nearest)
    }

    /// Traces some of the rays, at least one, through `blas`, whose leaves are `blocks`. False, and nothing done, if they are too
    /// different.
    ///
    /// Any hit of a ray, if `ANY`, the nearest otherwise, is found in `hits`.
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
        let near_origin = splats(s, f.near_origin);
        let far_origin = splats(s, f.far_origin);
        let low_inverse = splats(s, f.low_inverse);
        let high_inverse = splats(s, f.high_inverse);
        let t_min = s.splat(f.t_min);
        let mut limit = self.limit(s);
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
                if child == EMPTY {
                    continue;
                }
                let index = leaf_index(child);
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
                    limit = self.limit(s);
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
        Triangles::new(s, blocks, &self.setups[group][lane].shear).test(s, index, before, |c: &Candidates<S>, ids| {
            if !ANY {
                c.keep_nearest(s, ids, 0, filter, &mut best);
            } else if c.any(s, ids, 0, filter) {
                best.hit.primitive = 0;
                best.t_max = -1.0;
            }
        });
        self.hits[i] = best.hit;
        self.t_max[group][lane] = best.t_max;
        best.t_max < before
    }
}
