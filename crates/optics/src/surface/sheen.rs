//! Sheen: light that fibres standing up from a cloth scatter at grazing angles.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod sheen {
    use crate::constants::*;
    use crate::math::*;
    use crate::warp::*;
    use wgsl_rs::std::*;

    /// Narrower lobes than this cannot be told from none, and would need more samples than anybody has.
    pub const MIN_SHEEN_ALPHA: f32 = 0.01;

    /// Width of the distribution for a perceptual roughness in `[0, 1]`.
    pub fn sheen_alpha(roughness: f32) -> f32 {
        clamp(roughness * roughness, MIN_SHEEN_ALPHA, 1.0)
    }

    /// The density of fibres' normals: a power of the sine, so most stand at right angles to the surface's.
    /// `cos_half`: cosine of the half vector with the normal.
    ///
    /// Source: Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017 ("Charlie").
    pub fn charlie_d(cos_half: f32, alpha: f32) -> f32 {
        let inverse = 1.0 / alpha;
        let sin2 = max(1.0 - cos_half * cos_half, 0.0);
        (2.0 + inverse) * pow(sin2, 0.5 * inverse) * (0.5 * INV_PI)
    }

    /// The curve that [`charlie_lambda`] is the exponential of, on one half of its domain.
    pub fn charlie_curve(x: f32, alpha: f32) -> f32 {
        let t = (1.0 - alpha) * (1.0 - alpha);
        let a = mix(21.5473, 25.3245, t);
        let b = mix(3.82987, 3.32435, t);
        let c = mix(0.19823, 0.16801, t);
        let d = mix(-1.97760, -1.27393, t);
        let e = mix(-4.32054, -4.85967, t);
        a / (1.0 + b * pow(max(x, 0.0), c)) + d * x + e
    }

    /// Smith's Λ of the distribution, fitted by its authors. `cos_theta` in `[0, 1]`.
    pub fn charlie_lambda(cos_theta: f32, alpha: f32) -> f32 {
        if cos_theta < 0.5 {
            return exp(charlie_curve(cos_theta, alpha));
        }
        exp(2.0 * charlie_curve(0.5, alpha) - charlie_curve(1.0 - cos_theta, alpha))
    }

    /// The lobe for white fibres: value times cosine of `wi`, sr⁻¹. Both directions are above the surface.
    ///
    /// Visibility is at most 1, as in the viewer that assets of `KHR_materials_sheen` are made with.
    pub fn sheen_lobe(wo: Vec3f, wi: Vec3f, alpha: f32) -> f32 {
        let sum = wo + wi;
        let length2 = dot(sum, sum);
        if length2 < 1e-24 || wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let shadowing = 1.0 + charlie_lambda(wo.z, alpha) + charlie_lambda(wi.z, alpha);
        // 1 / (4 cos cos) and the cosine of the rendering equation are taken together: a product of two cosines near
        // 0 would underflow.
        let visibility_cos = min(1.0 / (4.0 * wo.z * shadowing), wi.z);
        charlie_d(min(sum.z / sqrt(length2), 1.0), alpha) * visibility_cos
    }

    /// A direction uniform over the hemisphere above the surface: the lobe has no simple inverse and is wide.
    pub fn sample_sheen(u: Vec2f) -> Vec3f {
        sample_cone(u, 1.0)
    }

    /// Density over solid angle of [`sample_sheen`].
    pub fn pdf_sheen() -> f32 {
        0.5 * INV_PI
    }

    /// Where a table of directional albedo holds the value for a cosine (x) and a perceptual roughness (y). The square
    /// root is dense at grazing angles, where sheen is.
    pub fn sheen_albedo_coordinates(cos_theta: f32, roughness: f32) -> Vec2f {
        vec2f(sqrt(saturate(cos_theta)), saturate(roughness))
    }

    /// Value over density of one sampled direction, for building that table, to be averaged over `u`.
    pub fn sheen_albedo_sample(cos_theta: f32, roughness: f32, u: Vec2f) -> f32 {
        let wo = vec3f(safe_sqrt(1.0 - cos_theta * cos_theta), 0.0, cos_theta);
        sheen_lobe(wo, sample_sheen(u), sheen_alpha(roughness)) / pdf_sheen()
    }
}
