//! Objects of a few blocks: all triangles are tested, without a tree.

use super::closest_hit::ClosestHit;
use super::triangle_intersector::{Shear, TriangleIntersector};
use crate::layout::{TriangleBlock, WIDTH};
use crate::ray::{Hit, Ray};
use crate::simd::Simd;

/// The closest hit in a few blocks. There is no branch per block.
#[inline(always)]
pub(super) fn brute_force_closest<S: Simd>(
    s: S,
    blocks: &[TriangleBlock],
    ray: &Ray,
    instance: u32,
    best: &mut ClosestHit,
) {
    let triangles = TriangleIntersector::new(s, blocks, &Shear::new(ray));
    let mut nearest = s.splat(best.t_max);
    let (mut u, mut v) = (nearest, nearest);
    let mut at = s.splat_u(0);
    for (index, block) in blocks.iter().enumerate() {
        let h = triangles.line_hits(s, block);
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
    *best = ClosestHit { hit: Hit { t, u: us[lane], v: vs[lane], primitive, instance }, t_max: t };
}

/// Any hit in a few blocks.
#[inline(always)]
pub(super) fn brute_force_any<S: Simd>(s: S, blocks: &[TriangleBlock], ray: &Ray) -> bool {
    let triangles = TriangleIntersector::new(s, blocks, &Shear::new(ray));
    let limit = s.splat(ray.t_max);
    let mut any = 0;
    for block in blocks {
        let h = triangles.line_hits(s, block);
        any |= s.bits(s.and(h.inside, s.and(s.lt(triangles.t_min, h.t), s.lt(h.t, limit))));
    }
    any != 0
}
