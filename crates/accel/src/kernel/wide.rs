//! Traversal and intersection, eight boxes or primitives at a time, for any instruction set.
//!
//! Everything here is always inlined into the entry points at the end, which enable the instructions.

use super::answers::{NearestHits, Occlusion};
use super::leaves::{FindAny, KeepNearest, Leaf, Shear, Spheres, Triangles};
use super::packet::Packet;
use super::tree::{Visitor, walk};
use super::{Best, Slabs, stream};
use crate::behind::{AllAtOnce, Children, Climb};
use crate::blas::{Blas, Shape};
use crate::layout::{TriangleBlock, WIDTH};
use crate::ray::{Hit, HitFilter, Ray};
use crate::simd::Simd;
use crate::streams::{HitStream, RayStream};
use crate::tlas::Tlas;
use std::ops::Range;

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
        let (t_max, best) = (self.best.t_max, &mut *self.best);
        let mut found = KeepNearest { instance: self.instance, filter: self.filter, best };
        self.leaves.test(s, index, t_max, &mut found);
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
        let mut found = FindAny { instance: self.instance, filter: self.filter, any: false };
        self.leaves.test(s, index, self.t_max, &mut found);
        found.any
    }
}

/// The nearest hit in a handful of blocks: all of them are tested, without a branch.
#[inline(always)]
pub(super) fn tiny_closest<S: Simd>(
    s: S,
    blocks: &[TriangleBlock],
    ray: &Ray,
    instance: u32,
    best: &mut Best,
) {
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
pub(super) fn tiny_any<S: Simd>(s: S, blocks: &[TriangleBlock], ray: &Ray) -> bool {
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
            pub unsafe fn packet<F: HitFilter, R: RayStream + ?Sized, const ANY: bool>(
                packet: &mut Packet,
                blas: &Blas,
                blocks: &[TriangleBlock],
                rays: &R,
                some: Range<usize>,
                filter: &F,
            ) -> bool {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                packet.trace::<$simd, F, ANY>(s, blas, blocks, rays, some, filter)
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn behind_block(tree: &Climb, block: usize) -> [[Children; 2]; WIDTH] {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                tree.behind_block(AllAtOnce(s), block)
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn stream_closest<F: HitFilter>(
                tlas: &Tlas,
                rays: &(impl RayStream + ?Sized),
                hits: &mut (impl HitStream + ?Sized),
                filter: &F,
            ) {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                stream::trace::<$simd, F, false>(s, tlas, rays, filter, NearestHits(hits));
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn stream_any<F: HitFilter>(
                tlas: &Tlas,
                rays: &(impl RayStream + ?Sized),
                any: &mut [bool],
                filter: &F,
            ) {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                stream::trace::<$simd, F, true>(s, tlas, rays, filter, Occlusion(any));
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
