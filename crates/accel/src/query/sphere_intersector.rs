//! The ray-sphere test in SIMD lanes. `optics::intersect::intersect_sphere` is the scalar version.

use super::lane_vectors::{dot, splats};
use super::leaf_intersector::{Candidates, HitHandler, LeafIntersector};
use crate::layout::SphereBlock;
use crate::ray::Ray;
use crate::simd::Simd;

/// Intersects a ray with blocks of eight spheres.
pub(super) struct SphereIntersector<'a, S: Simd> {
    blocks: &'a [SphereBlock],
    origin: [S::F; 3],
    direction: [S::F; 3],
    /// The direction's squared length.
    a: S::F,
    t_min: S::F,
}

impl<'a, S: Simd> SphereIntersector<'a, S> {
    #[inline(always)]
    pub fn new(s: S, blocks: &'a [SphereBlock], ray: &Ray) -> Self {
        let d = ray.direction;
        SphereIntersector {
            blocks,
            origin: splats(s, ray.origin),
            direction: splats(s, d),
            a: s.splat(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]),
            t_min: s.splat(ray.t_min.max(0.0)),
        }
    }
}

impl<S: Simd> LeafIntersector<S> for SphereIntersector<'_, S> {
    #[inline(always)]
    fn intersect<H: HitHandler<S>>(&self, s: S, index: usize, t_max: f32, handler: &mut H) {
        debug_assert!(index < self.blocks.len());
        // SAFETY: leaf references are made by the builder and index the blocks of this slice
        // (`validate` checks them in debug builds).
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
        // Both crossings are candidates, because a filter may reject one of them. The far crossing
        // of a sphere only counts if its near one was rejected, so all near crossings come first.
        for (mask, bits, t) in [(near_counts, near_bits, near), (far_counts, far_bits, far)] {
            if bits != 0 {
                let (mut outward, mut direction) = ([zero; 3], [zero; 3]);
                if H::FILTERS {
                    direction = self.direction;
                    for axis in 0..3 {
                        outward[axis] = s.div(s.mul_add(direction[axis], t, f[axis]), radius);
                    }
                }
                let candidates = Candidates { mask, bits, t, u: zero, v: zero, outward, direction };
                handler.handle(s, &candidates, &block.ids);
            }
        }
    }
}
