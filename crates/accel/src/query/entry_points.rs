//! The kernels for each instruction set. Everything they call is always inlined into these
//! functions, which enable the instructions.

use super::closest_hit::ClosestHit;
use super::hit_sink::HitSink;
use super::packet::Packet;
use super::ray_stream::RayStream;
use super::stream_output::{ClosestHits, Occlusion};
use super::{single, stream};
use crate::bvh::{Blas, Tlas};
use crate::layout::TriangleBlock;
use crate::ray::{HitFilter, Ray};
use std::ops::Range;

/// Defines a module with the entry points of one instruction set.
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
            pub unsafe fn stream_closest<F: HitFilter>(
                tlas: &Tlas,
                rays: &(impl RayStream + ?Sized),
                hits: &mut (impl HitSink + ?Sized),
                filter: &F,
            ) {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                stream::trace::<$simd, F, false>(s, tlas, rays, filter, ClosestHits(hits));
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
                best: &mut ClosestHit,
            ) {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                single::blas_closest(s, blas, ray, instance, filter, best);
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn blas_any<F: HitFilter>(blas: &Blas, ray: &Ray, instance: u32, filter: &F) -> bool {
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                single::blas_any(s, blas, ray, instance, filter)
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn tlas_closest<F: HitFilter>(
                tlas: &Tlas,
                ray: &Ray,
                time: f32,
                filter: &F,
                best: &mut ClosestHit,
            ) {
                if let Some(blas) = tlas.single_object(filter.ray_mask()) {
                    // SAFETY: the caller's promise.
                    return unsafe { blas_closest(blas, ray, 0, filter, best) };
                }
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                let closest = |b: &Blas, r: &Ray, i, f: &F, best: &mut ClosestHit| {
                    // SAFETY: the caller's promise.
                    unsafe { blas_closest(b, r, i, f, best) }
                };
                single::tlas_closest(s, tlas, ray, time, filter, best, closest);
            }

            /// # Safety
            ///
            /// The processor must have the instructions.
            #[target_feature(enable = $features)]
            pub unsafe fn tlas_any<F: HitFilter>(tlas: &Tlas, ray: &Ray, time: f32, filter: &F) -> bool {
                if let Some(blas) = tlas.single_object(filter.ray_mask()) {
                    // SAFETY: the caller's promise.
                    return unsafe { blas_any(blas, ray, 0, filter) };
                }
                // SAFETY: the caller's promise.
                let s = unsafe { <$simd>::new() };
                // SAFETY: the caller's promise.
                let any = |b: &Blas, r: &Ray, i, f: &F| unsafe { blas_any(b, r, i, f) };
                single::tlas_any(s, tlas, ray, time, filter, any)
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
