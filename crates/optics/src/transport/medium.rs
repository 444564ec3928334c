//! What happens to light between surfaces.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod medium {
    use wgsl_rs::std::*;

    /// Share of light that is left after a way through a medium: the law of Beer and Lambert.
    ///
    /// - `extinction`: coefficient of absorption, or of absorption and scattering, m⁻¹, ≥ 0. `distance`: metres, ≥ 0.
    pub fn transmittance(extinction: Vec3f, distance: f32) -> Vec3f {
        vec3f(exp(-extinction.x * distance), exp(-extinction.y * distance), exp(-extinction.z * distance))
    }

    /// Radiance that is left after such a way.
    pub fn transmitted_radiance(radiance: Vec3f, extinction: Vec3f, distance: f32) -> Vec3f {
        radiance * transmittance(extinction, distance)
    }
}
