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
}
