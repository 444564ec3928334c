//! Calls the kernels of the instruction set that a structure uses.

use super::closest_hit::{ClosestHit, can_hit};
use super::hit_sink::HitSink;
use super::packet::{PACKET, Packet};
use super::ray_stream::RayStream;
use super::{entry_points, scalar};
use crate::bvh::{Blas, LeafBlocks, RootTriangles, Tlas};
use crate::layout::TriangleBlock;
use crate::ray::{Hit, HitFilter, MISS, Ray};
use crate::simd::InstructionSet;

/// Calls a function of [`entry_points`] or [`scalar`] for the instruction set `$isa`.
macro_rules! dispatch {
    ($isa:expr, $function:ident $(::<$f:ty, _, $any:literal>)? ($($argument:expr),*)) => {
        match $isa {
            // SAFETY: `Blas` and `Tlas` check that the processor has their instruction set.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => unsafe { entry_points::avx512::$function$(::<$f, _, $any>)?($($argument),*) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => unsafe { entry_points::avx2::$function$(::<$f, _, $any>)?($($argument),*) },
            // SAFETY: as above.
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => unsafe { entry_points::neon::$function$(::<$f, _, $any>)?($($argument),*) },
            _ => scalar::$function$(::<$f, _, $any>)?($($argument),*),
        }
    };
}

/// The closest hit with one object, as instance 0.
#[inline]
pub(super) fn blas_closest<F: HitFilter>(isa: InstructionSet, blas: &Blas, ray: &Ray, filter: &F) -> Hit {
    if !can_hit(blas.root, ray) {
        return MISS;
    }
    let mut best = ClosestHit::new(ray);
    dispatch!(isa, blas_closest(blas, ray, 0, filter, &mut best));
    best.hit
}

/// Any hit with one object, as instance 0.
#[inline]
pub(super) fn blas_any<F: HitFilter>(isa: InstructionSet, blas: &Blas, ray: &Ray, filter: &F) -> bool {
    can_hit(blas.root, ray) && dispatch!(isa, blas_any(blas, ray, 0, filter))
}

/// The closest hit with all instances.
#[inline]
pub(super) fn tlas_closest<F: HitFilter>(
    isa: InstructionSet,
    tlas: &Tlas,
    ray: &Ray,
    time: f32,
    filter: &F,
) -> Hit {
    if !can_hit(tlas.root, ray) {
        return MISS;
    }
    let mut best = ClosestHit::new(ray);
    dispatch!(isa, tlas_closest(tlas, ray, time, filter, &mut best));
    best.hit
}

/// Any hit with all instances.
#[inline]
pub(super) fn tlas_any<F: HitFilter>(
    isa: InstructionSet,
    tlas: &Tlas,
    ray: &Ray,
    time: f32,
    filter: &F,
) -> bool {
    can_hit(tlas.root, ray) && dispatch!(isa, tlas_any(tlas, ray, time, filter))
}

/// The closest hit of each ray.
pub(super) fn incoherent_closest<F: HitFilter>(
    isa: InstructionSet,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    hits: &mut (impl HitSink + ?Sized),
    filter: &F,
) {
    hits.clear();
    dispatch!(isa, stream_closest(tlas, rays, hits, filter));
}

/// Any hit of each ray.
pub(super) fn incoherent_any<F: HitFilter>(
    isa: InstructionSet,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    any: &mut [bool],
    filter: &F,
) {
    any.fill(false);
    dispatch!(isa, stream_any(tlas, rays, any, filter));
}

/// The object and its blocks, if packets are faster: a single object of triangles that has a tree.
fn for_packets<'a, F: HitFilter>(tlas: &'a Tlas, filter: &F) -> Option<(&'a Blas, &'a [TriangleBlock])> {
    let blas = tlas.single_object(filter.ray_mask())?;
    match &blas.leaves {
        LeafBlocks::Triangles(blocks)
            if !blas.root_triangles().is_some_and(RootTriangles::is_whole_object) =>
        {
            Some((blas, blocks))
        }
        _ => None,
    }
}

/// The closest hit of each ray, in packets of coherent rays.
pub(super) fn coherent_closest<F: HitFilter>(
    isa: InstructionSet,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    hits: &mut (impl HitSink + ?Sized),
    filter: &F,
) {
    let Some((blas, blocks)) = for_packets(tlas, filter) else {
        return incoherent_closest(isa, tlas, rays, hits, filter);
    };
    let mut packet = Packet::new();
    for first in (0..rays.len()).step_by(PACKET) {
        let some = first..(first + PACKET).min(rays.len());
        let is_traced =
            dispatch!(isa, packet::<F, _, false>(&mut packet, blas, blocks, rays, some.clone(), filter));
        for (place, i) in some.enumerate() {
            let alone = || tlas_closest(isa, tlas, &rays.ray(i), rays.time(i), filter);
            hits.set(i, &if is_traced { packet.hit(place) } else { alone() });
        }
    }
}

/// Any hit of each ray, in packets of coherent rays.
pub(super) fn coherent_any<F: HitFilter>(
    isa: InstructionSet,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    any: &mut [bool],
    filter: &F,
) {
    let Some((blas, blocks)) = for_packets(tlas, filter) else {
        return incoherent_any(isa, tlas, rays, any, filter);
    };
    let mut packet = Packet::new();
    for first in (0..rays.len()).step_by(PACKET) {
        let some = first..(first + PACKET).min(rays.len());
        let is_traced =
            dispatch!(isa, packet::<F, _, true>(&mut packet, blas, blocks, rays, some.clone(), filter));
        for (place, i) in some.enumerate() {
            let alone = || tlas_any(isa, tlas, &rays.ray(i), rays.time(i), filter);
            any[i] = if is_traced { !packet.hit(place).is_miss() } else { alone() };
        }
    }
}
