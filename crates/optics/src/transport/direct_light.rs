//! What the fixed-cost renderer, which knows no global illumination, counts of its light samples.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod direct_light {
    use crate::falloff::*;
    use crate::light::*;
    use wgsl_rs::std::*;

    /// What a light's sample adds if nothing is in its way.
    ///
    /// - `value_cos`: of the surface, for the sample's direction. `falloff`: see [`falloff_factor`].
    pub fn direct_contribution(value_cos: Vec3f, light: LightSample, falloff: Vec3f) -> Vec3f {
        value_cos * light.radiance * (falloff_factor(falloff, light.distance) / light.pdf)
    }

    /// What one of `count` samples of a light adds.
    pub fn share_of_samples(contribution: Vec3f, count: u32) -> Vec3f {
        contribution * (1.0 / f32(count))
    }

    /// What reflection rays count for, 0 if none are sent: Russian roulette with about what the surface reflects.
    ///
    /// - `reflected`: share of light that it reflects. `least`: least probability of sending rays, in `(0, 1]`. `u`: uniform number
    ///   in `[0, 1)`.
    pub fn reflection_roulette(reflected: f32, least: f32, u: f32) -> f32 {
        let survival = max(reflected, least);
        select(0.0, 1.0 / survival, u < survival)
    }

    /// Radiance with what reflection rays have `seen`, which counts for `weight`.
    pub fn with_reflection(radiance: Vec3f, weight: f32, seen: Vec3f) -> Vec3f {
        radiance + weight * seen
    }
}
