//! The queries as methods of [`Blas`] and [`Tlas`].

use super::dispatch;
use super::hit_sink::HitSink;
use super::ray_stream::RayStream;
use crate::bvh::{Blas, Tlas};
use crate::ray::{Hit, HitFilter, Ray};
use optics::motion::MOTION_MIDDLE;

/// Whether neighbouring rays of a stream are similar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// They have different origins or directions.
    #[default]
    Incoherent,
    /// They have similar origins and directions, as camera rays do.
    Coherent,
}

impl Blas {
    /// The closest hit of a ray in object space. Its instance is 0.
    #[inline]
    pub fn closest<F: HitFilter>(&self, ray: &Ray, filter: &F) -> Hit {
        dispatch::blas_closest(self.instruction_set(), self, ray, filter)
    }

    /// Whether a ray in object space hits anything. The filter sees instance 0.
    #[inline]
    pub fn any<F: HitFilter>(&self, ray: &Ray, filter: &F) -> bool {
        dispatch::blas_any(self.instruction_set(), self, ray, filter)
    }
}

impl Tlas {
    /// The closest hit of a ray in world space. Instances that move are where they are in the
    /// middle of their motion.
    #[inline]
    pub fn closest<F: HitFilter>(&self, ray: &Ray, filter: &F) -> Hit {
        self.closest_at(ray, MOTION_MIDDLE, filter)
    }

    /// Whether a ray in world space hits anything. Instances that move are as for
    /// [`Tlas::closest`].
    #[inline]
    pub fn any<F: HitFilter>(&self, ray: &Ray, filter: &F) -> bool {
        self.any_at(ray, MOTION_MIDDLE, filter)
    }

    /// As [`Tlas::closest`], of a ray that leaves at `time` in `[0, 1]`.
    #[inline]
    pub fn closest_at<F: HitFilter>(&self, ray: &Ray, time: f32, filter: &F) -> Hit {
        dispatch::tlas_closest(self.instruction_set(), self, ray, time, filter)
    }

    /// As [`Tlas::any`], of a ray that leaves at `time` in `[0, 1]`.
    #[inline]
    pub fn any_at<F: HitFilter>(&self, ray: &Ray, time: f32, filter: &F) -> bool {
        dispatch::tlas_any(self.instruction_set(), self, ray, time, filter)
    }

    /// The closest hit of each ray. Rays that miss an edge of a root triangle by less than the
    /// rounding error may hit it here and not in [`Tlas::closest`].
    ///
    /// # Panics
    ///
    /// If the lengths differ.
    pub fn closest_stream<F: HitFilter>(
        &self,
        rays: &(impl RayStream + ?Sized),
        hits: &mut (impl HitSink + ?Sized),
        filter: &F,
        coherence: Coherence,
    ) {
        assert_eq!(rays.len(), hits.len(), "one hit a ray");
        if coherence == Coherence::Coherent {
            return dispatch::coherent_closest(self.instruction_set(), self, rays, hits, filter);
        }
        dispatch::incoherent_closest(self.instruction_set(), self, rays, hits, filter);
    }

    /// Whether each ray hits anything.
    ///
    /// # Panics
    ///
    /// If the lengths differ.
    pub fn any_stream<F: HitFilter>(
        &self,
        rays: &(impl RayStream + ?Sized),
        hit: &mut [bool],
        filter: &F,
        coherence: Coherence,
    ) {
        assert_eq!(rays.len(), hit.len(), "one answer a ray");
        if coherence == Coherence::Coherent {
            return dispatch::coherent_any(self.instruction_set(), self, rays, hit, filter);
        }
        dispatch::incoherent_any(self.instruction_set(), self, rays, hit, filter);
    }
}
