//! What a path asks of the surface that it is on, whatever scatters there.

use optics::bsdf::{
    bsdf_eval, bsdf_has_lobes, bsdf_has_smooth_part, bsdf_is_delta, bsdf_is_sharp, bsdf_sample,
    bsdf_transmits,
};
use optics::closure::{
    Closure, closure_eta, closure_eval, closure_has_lobes, closure_has_smooth_part, closure_is_delta,
    closure_is_sharp, closure_sample, closure_transmits,
};
use optics::scatter::{Bsdf, BsdfSample, BsdfValue};
use optics::{Vec2f, Vec3f};

/// Something that scatters, prepared for a viewing direction. The functions are those of `optics::bsdf`.
pub(crate) trait Scattering: Copy {
    /// See [`bsdf_sample`].
    fn sample(self, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample;
    /// See [`bsdf_eval`].
    fn eval(self, wo: Vec3f, wi: Vec3f) -> BsdfValue;
    /// See [`bsdf_has_smooth_part`].
    fn has_smooth_part(self) -> bool;
    /// See [`bsdf_has_lobes`].
    fn has_lobes(self) -> bool;
    /// See [`bsdf_is_delta`].
    fn is_delta(self) -> bool;
    /// See [`bsdf_is_sharp`].
    fn is_sharp(self) -> bool;
    /// See [`bsdf_transmits`].
    fn transmits(self) -> bool;
    /// Index of refraction of the far side over that of the near one.
    fn eta(self) -> f32;
}

impl Scattering for Bsdf {
    #[inline(always)]
    fn sample(self, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample {
        bsdf_sample(self, wo, u_lobe, u)
    }

    #[inline(always)]
    fn eval(self, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        bsdf_eval(self, wo, wi)
    }

    #[inline(always)]
    fn has_smooth_part(self) -> bool {
        bsdf_has_smooth_part(self)
    }

    #[inline(always)]
    fn has_lobes(self) -> bool {
        bsdf_has_lobes(self)
    }

    #[inline(always)]
    fn is_delta(self) -> bool {
        bsdf_is_delta(self)
    }

    #[inline(always)]
    fn is_sharp(self) -> bool {
        bsdf_is_sharp(self)
    }

    #[inline(always)]
    fn transmits(self) -> bool {
        bsdf_transmits(self)
    }

    #[inline(always)]
    fn eta(self) -> f32 {
        self.eta
    }
}

/// Out of line: the kernels that follow paths are made for plain surfaces.
impl Scattering for Closure {
    #[inline(never)]
    fn sample(self, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample {
        closure_sample(self, wo, u_lobe, u)
    }

    #[inline(never)]
    fn eval(self, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        closure_eval(self, wo, wi)
    }

    fn has_smooth_part(self) -> bool {
        closure_has_smooth_part(self)
    }

    fn has_lobes(self) -> bool {
        closure_has_lobes(self)
    }

    fn is_delta(self) -> bool {
        closure_is_delta(self)
    }

    fn is_sharp(self) -> bool {
        closure_is_sharp(self)
    }

    fn transmits(self) -> bool {
        closure_transmits(self)
    }

    fn eta(self) -> f32 {
        closure_eta(self)
    }
}
