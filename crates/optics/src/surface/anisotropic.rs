//! The GGX distribution with different widths along two directions of the surface.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod anisotropic {
    use crate::constants::*;
    use crate::ggx::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Widths along the shading frame's X (the direction of anisotropy) and Y, each in `[MIN_ALPHA, 1]`.
    ///
    /// - `roughness`: perceptual, in `[0, 1]`. `strength`: of the anisotropy, in `[0, 1]`.
    ///
    /// Source: `KHR_materials_anisotropy`: highlights are stretched along X.
    pub fn anisotropic_widths(roughness: f32, strength: f32) -> Vec2f {
        let alpha = clamp(roughness * roughness, MIN_ALPHA, 1.0);
        vec2f(mix(alpha, 1.0, strength * strength), alpha)
    }

    /// [`ggx_d`] for two widths.
    /// Source: Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", JCGT 2014, eq. 85.
    pub fn anisotropic_d(h: Vec3f, widths: Vec2f) -> f32 {
        let x = h.x / widths.x;
        let y = h.y / widths.y;
        let d = x * x + y * y + h.z * h.z;
        1.0 / (PI * widths.x * widths.y * d * d)
    }

    /// Length of a direction in the space where the surface's microfacets are those of width 1.
    pub fn stretched_length(w: Vec3f, widths: Vec2f) -> f32 {
        sqrt(sqr(widths.x * w.x) + sqr(widths.y * w.y) + w.z * w.z)
    }

    /// Smith's masking function of the unit vector `w`, divided by 2 |cos|: finite at any angle.
    /// Source: Heitz 2014, eq. 86.
    pub fn anisotropic_g1_over_2cos(w: Vec3f, widths: Vec2f) -> f32 {
        1.0 / (abs(w.z) + stretched_length(w, widths) + 1e-20)
    }

    /// A half vector for reflection, as [`ggx_sample_reflection_half`]. Its density is [`anisotropic_reflection_pdf`].
    pub fn anisotropic_sample_reflection_half(wo: Vec3f, widths: Vec2f, u: Vec2f) -> Vec3f {
        let wo_std = normalize(vec3f(wo.x * widths.x, wo.y * widths.y, wo.z));
        // The bound of Eto and Tokuyoshi holds for the narrower width.
        let lower = cap_bound(wo, min(widths.x, widths.y)) * wo_std.z;
        anisotropic_cap_half(wo_std, widths, lower, u)
    }

    /// A half vector from all that are visible from `wo`, as [`ggx_sample_visible_half`]. Its density is
    /// [`anisotropic_visible_half_pdf`].
    pub fn anisotropic_sample_visible_half(wo: Vec3f, widths: Vec2f, u: Vec2f) -> Vec3f {
        let wo_std = normalize(vec3f(wo.x * widths.x, wo.y * widths.y, wo.z));
        anisotropic_cap_half(wo_std, widths, wo_std.z, u)
    }

    /// As [`cap_half`], for two widths.
    pub fn anisotropic_cap_half(wo_std: Vec3f, widths: Vec2f, lower: f32, u: Vec2f) -> Vec3f {
        let half_std = cap_half(wo_std, 1.0, lower, u);
        normalize(vec3f(widths.x * half_std.x, widths.y * half_std.y, half_std.z))
    }

    /// Density over solid angle of the direction that `wo` is reflected to about
    /// [`anisotropic_sample_reflection_half`]. `h`: the half vector.
    pub fn anisotropic_reflection_pdf(wo: Vec3f, h: Vec3f, widths: Vec2f) -> f32 {
        let bound = cap_bound(wo, min(widths.x, widths.y));
        anisotropic_d(h, widths) / (2.0 * (bound * wo.z + stretched_length(wo, widths)))
    }

    /// Density over solid angle of [`anisotropic_sample_visible_half`] for the half vector `h`.
    pub fn anisotropic_visible_half_pdf(wo: Vec3f, h: Vec3f, widths: Vec2f) -> f32 {
        2.0 * anisotropic_g1_over_2cos(wo, widths) * abs(dot(wo, h)) * anisotropic_d(h, widths)
    }
}

#[cfg(test)]
mod tests {
    use super::anisotropic::*;
    use crate::ggx::*;
    use crate::{vec2f, vec3f, vector::normalize};

    /// With equal widths everything is the isotropic distribution.
    #[test]
    fn equal_widths_are_isotropic() {
        let mut compared = 0;
        for alpha in [0.01f32, 0.2, 0.7, 1.0] {
            let widths = vec2f(alpha, alpha);
            for i in 0..200 {
                let at = |k: i32| ((i * 7 + k) as f32 * 0.618_034).fract();
                let wo = normalize(vec3f(at(1) - 0.5, at(2) - 0.5, at(3) + 0.01));
                let u = vec2f(at(4), at(5));
                let near = |a: f32, b: f32| (a - b).abs() <= 2e-4 * a.abs().max(b.abs()) + 1e-6;
                let (h, expected) = (
                    anisotropic_sample_reflection_half(wo, widths, u),
                    ggx_sample_reflection_half(wo, alpha, u),
                );
                assert!(near(h.x, expected.x) && near(h.y, expected.y) && near(h.z, expected.z), "{h:?}");
                assert!(near(anisotropic_d(h, widths), ggx_d(h, alpha)));
                assert!(near(anisotropic_g1_over_2cos(wo, widths), ggx_g1_over_2cos(wo.z, alpha)));
                assert!(near(anisotropic_reflection_pdf(wo, h, widths), ggx_reflection_pdf(wo, h, alpha)));
                assert!(near(
                    anisotropic_visible_half_pdf(wo, h, widths),
                    ggx_visible_half_pdf(wo, h, alpha)
                ));
                compared += 1;
            }
        }
        assert_eq!(compared, 800);
    }
}
