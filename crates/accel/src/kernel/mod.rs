//! Queries: which instruction set runs them, and what all of them share.

mod answers;
mod leaves;
mod packet;
mod scalar;
mod setup;
mod stack;
mod stream;
mod top;
mod tree;
mod waiting;
mod wide;

use crate::behind::{Children, Climb};
use crate::blas::{Blas, Shape};
use crate::handful::Handful;
use crate::layout::{ChildRef, EMPTY, Plane, TriangleBlock, WIDTH};
use crate::ray::{Hit, HitFilter, MISS, Ray};
use crate::streams::{HitStream, RayStream};
use crate::tlas::Tlas;
use packet::{PACKET, Packet};

/// The instruction sets that have a traversal kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Portable code, one lane at a time.
    Scalar,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 F, VL, DQ and BW.
    Avx512,
    /// Arm with Advanced SIMD.
    Neon,
}

impl Kernel {
    /// Those that this processor can run, slowest first. Never empty.
    pub fn available() -> Vec<Kernel> {
        [Kernel::Scalar, Kernel::Neon, Kernel::Avx2, Kernel::Avx512]
            .into_iter()
            .filter(|k| k.is_available())
            .collect()
    }

    /// The fastest that this processor can run.
    pub fn best() -> Kernel {
        if cfg!(miri) {
            return Kernel::Scalar;
        }
        *Kernel::available().last().unwrap_or(&Kernel::Scalar)
    }

    /// Whether this processor can run it.
    pub fn is_available(self) -> bool {
        match self {
            Kernel::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
            }
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx512 => {
                Kernel::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
            }
            #[cfg(target_arch = "aarch64")]
            Kernel::Neon => true,
            #[allow(unreachable_patterns, reason = "which kernels exist depends on the target")]
            _ => false,
        }
    }
}

/// The deepest tree that may be built: queries keep a stack of fixed size.
pub(crate) const MAX_DEPTH: usize = 64;

/// Room for the siblings along the deepest path, and for one full vector beyond.
const STACK: usize = MAX_DEPTH * 7 + 16;

/// What a traversal needs of a ray: along axis `a`, a plane at `x` is crossed at `x * inverse[a] - offset`, rounded
/// outwards by the offsets.
///
/// A fused multiply-add is exact up to the rounding of the offset and of the reciprocal. Both errors are below a few
/// units in the last place of the largest coordinate; the offsets are moved apart by that, so that no box that
/// the ray touches is missed (in the spirit of Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013, with no cost per node).
#[derive(Clone, Copy)]
#[repr(C)]
struct Slabs {
    inverse: [f32; 3],
    near_offset: [f32; 3],
    far_offset: [f32; 3],
    /// The face of boxes that is nearer along each axis.
    near_plane: [Plane; 3],
    t_min: f32,
}

impl Slabs {
    /// `extent`: the largest magnitude of a coordinate in the tree, by axis.
    #[inline(always)]
    fn new(ray: &Ray, extent: &[f32; 3]) -> Slabs {
        let d = &ray.direction;
        // Zero would give infinity, and infinity NaN. This is small enough to be parallel at any distance.
        let tiny = (d[0].abs().max(d[1].abs()).max(d[2].abs()) * 1e-24).max(1e-37);
        let mut s = Slabs {
            inverse: [0.0; 3],
            near_offset: [0.0; 3],
            far_offset: [0.0; 3],
            near_plane: [Plane::new(0, 0); 3],
            t_min: ray.t_min.max(0.0),
        };
        for a in 0..3 {
            let inverse = 1.0 / if d[a].abs() < tiny { tiny.copysign(d[a]) } else { d[a] };
            let error = (ray.origin[a].abs() + extent[a]) * inverse.abs() * (4.0 * f32::EPSILON);
            s.inverse[a] = inverse;
            s.near_offset[a] = -(ray.origin[a] * inverse) - error;
            s.far_offset[a] = -(ray.origin[a] * inverse) + error;
            s.near_plane[a] = Plane::new(a, usize::from(inverse < 0.0));
        }
        s
    }
}

/// The best hit so far while a query runs.
#[derive(Clone, Copy)]
pub(crate) struct Best {
    pub hit: Hit,
    /// The hit's distance, or the ray's end.
    pub t_max: f32,
}

impl Best {
    #[inline(always)]
    fn new(ray: &Ray) -> Best {
        Best { hit: MISS, t_max: ray.t_max }
    }
}

/// Calls one of `wide`'s or `scalar`'s functions in the instruction set of `$kernel`.
macro_rules! dispatch {
    ($kernel:expr, $function:ident $(::<$f:ty, _, $any:literal>)? ($($argument:expr),*)) => {
        match $kernel {
            // SAFETY: a structure's kernel is available on this processor: `Blas` and `Tlas` check when it is set.
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx512 => unsafe { wide::avx512::$function$(::<$f, _, $any>)?($($argument),*) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2 => unsafe { wide::avx2::$function$(::<$f, _, $any>)?($($argument),*) },
            // SAFETY: as above.
            #[cfg(target_arch = "aarch64")]
            Kernel::Neon => unsafe { wide::neon::$function$(::<$f, _, $any>)?($($argument),*) },
            _ => scalar::$function$(::<$f, _, $any>)?($($argument),*),
        }
    };
}

/// Nearest hit with one object, as instance 0.
#[inline]
pub(crate) fn blas_closest<F: HitFilter>(kernel: Kernel, blas: &Blas, ray: &Ray, filter: &F) -> Hit {
    if !is_worth_it(blas.root, ray) {
        return MISS;
    }
    let mut best = Best::new(ray);
    dispatch!(kernel, blas_closest(blas, ray, 0, filter, &mut best));
    best.hit
}

/// Whether there is any hit with one object, as instance 0.
#[inline]
pub(crate) fn blas_any<F: HitFilter>(kernel: Kernel, blas: &Blas, ray: &Ray, filter: &F) -> bool {
    is_worth_it(blas.root, ray) && dispatch!(kernel, blas_any(blas, ray, 0, filter))
}

/// Nearest hit with all instances.
#[inline]
pub(crate) fn tlas_closest<F: HitFilter>(kernel: Kernel, tlas: &Tlas, ray: &Ray, filter: &F) -> Hit {
    if !is_worth_it(tlas.root, ray) {
        return MISS;
    }
    let mut best = Best::new(ray);
    dispatch!(kernel, tlas_closest(tlas, ray, filter, &mut best));
    best.hit
}

/// Whether there is any hit with the instances.
#[inline]
pub(crate) fn tlas_any<F: HitFilter>(kernel: Kernel, tlas: &Tlas, ray: &Ray, filter: &F) -> bool {
    is_worth_it(tlas.root, ray) && dispatch!(kernel, tlas_any(tlas, ray, filter))
}

/// What lies behind both sides of each triangle of a block.
pub(crate) fn behind_block(kernel: Kernel, tree: &Climb, block: usize) -> [[Children; 2]; WIDTH] {
    dispatch!(kernel, behind_block(tree, block))
}

/// Nearest hit of each ray.
pub(crate) fn incoherent_closest<F: HitFilter>(
    kernel: Kernel,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    hits: &mut (impl HitStream + ?Sized),
    filter: &F,
) {
    hits.clear();
    dispatch!(kernel, stream_closest(tlas, rays, hits, filter));
}

/// Whether each ray hits anything.
pub(crate) fn incoherent_any<F: HitFilter>(
    kernel: Kernel,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    any: &mut [bool],
    filter: &F,
) {
    any.fill(false);
    dispatch!(kernel, stream_any(tlas, rays, any, filter));
}

/// The object and its leaves, if packets are of use: one object as it is, of triangles, and not just a few.
fn for_packets<'a, F: HitFilter>(tlas: &'a Tlas, filter: &F) -> Option<(&'a Blas, &'a [TriangleBlock])> {
    let blas = tlas.only(filter.ray_mask())?;
    match &blas.shape {
        Shape::Triangles(blocks) if !blas.handful().is_some_and(Handful::is_all) => Some((blas, blocks)),
        _ => None,
    }
}

/// Nearest hit of each ray, neighbours together.
pub(crate) fn coherent_closest<F: HitFilter>(
    kernel: Kernel,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    hits: &mut (impl HitStream + ?Sized),
    filter: &F,
) {
    let Some((blas, blocks)) = for_packets(tlas, filter) else {
        return incoherent_closest(kernel, tlas, rays, hits, filter);
    };
    let mut packet = Packet::new();
    for first in (0..rays.len()).step_by(PACKET) {
        let some = first..(first + PACKET).min(rays.len());
        let done =
            dispatch!(kernel, packet::<F, _, false>(&mut packet, blas, blocks, rays, some.clone(), filter));
        for (place, i) in some.enumerate() {
            let alone = || tlas_closest(kernel, tlas, &rays.ray(i), filter);
            hits.set(i, &if done { packet.hit(place) } else { alone() });
        }
    }
}

/// Whether each ray hits anything, neighbours together.
pub(crate) fn coherent_any<F: HitFilter>(
    kernel: Kernel,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    any: &mut [bool],
    filter: &F,
) {
    let Some((blas, blocks)) = for_packets(tlas, filter) else {
        return incoherent_any(kernel, tlas, rays, any, filter);
    };
    let mut packet = Packet::new();
    for first in (0..rays.len()).step_by(PACKET) {
        let some = first..(first + PACKET).min(rays.len());
        let done =
            dispatch!(kernel, packet::<F, _, true>(&mut packet, blas, blocks, rays, some.clone(), filter));
        for (place, i) in some.enumerate() {
            let alone = || tlas_any(kernel, tlas, &rays.ray(i), filter);
            any[i] = if done { !packet.hit(place).is_miss() } else { alone() };
        }
    }
}

#[inline(always)]
fn is_worth_it(root: ChildRef, ray: &Ray) -> bool {
    root != EMPTY && ray.is_valid()
}
