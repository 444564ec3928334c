//! What happens to light between surfaces.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod medium {
    use wgsl_rs::std::*;

    /// Share of light that is left after a way through a medium that absorbs: the law of Beer and Lambert.
    ///
    /// - `absorption`: coefficient, m⁻¹, ≥ 0. `distance`: metres, ≥ 0.
    pub fn transmittance(absorption: Vec3f, distance: f32) -> Vec3f {
        vec3f(exp(-absorption.x * distance), exp(-absorption.y * distance), exp(-absorption.z * distance))
    }
}
