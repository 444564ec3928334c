//! The GGX microfacet distribution.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod ggx {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Narrower distributions are treated as this width: below it, `f32` cannot represent the peak's shape.
    pub const MIN_ALPHA: f32 = 0.001;

    /// Whether a surface is so smooth that its lobe is a mirror's. `roughness`: perceptual, in `[0, 1]`.
    pub fn is_polished(roughness: f32) -> bool {
        roughness * roughness < MIN_ALPHA
    }

    /// Density of microfacet normals, per solid angle and projected area.
    ///
    /// - `h`: unit half vector in the shading frame. `alpha`: width in `[MIN_ALPHA, 1]`.
    ///
    /// Source: Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, eq. 33.
    pub fn ggx_d(h: Vec3f, alpha: f32) -> f32 {
        let a2 = alpha * alpha;
        // The sine comes from x and y: 1 − cos² would cancel for narrow distributions.
        let d = h.x * h.x + h.y * h.y + h.z * h.z * a2;
        a2 / (PI * d * d)
    }

    /// Smith's masking function of one direction, in `[0, 1]`; `cos_theta` is the direction's |z|.
    /// The form of glTF 2.0, Appendix B.3.2.
    pub fn ggx_g1(cos_theta: f32, alpha: f32) -> f32 {
        let c = abs(cos_theta);
        let a2 = alpha * alpha;
        2.0 * c / (c + sqrt(a2 + (1.0 - a2) * c * c) + 1e-20)
    }

    /// [`ggx_g1`] divided by 2 |cos|, which is how `wo` enters values and densities: finite at any angle.
    pub fn ggx_g1_over_2cos(cos_theta: f32, alpha: f32) -> f32 {
        let c = abs(cos_theta);
        let a2 = alpha * alpha;
        1.0 / (c + sqrt(a2 + (1.0 - a2) * c * c) + 1e-20)
    }

    /// Lower end of the sphere cap that normals are sampled from, as a fraction of the upper one: the bound of Eto and
    /// Tokuyoshi that leaves out normals which would reflect below the surface.
    pub fn cap_bound(wo: Vec3f, alpha: f32) -> f32 {
        let s = 1.0 + sqrt(wo.x * wo.x + wo.y * wo.y);
        let a2 = alpha * alpha;
        let s2 = s * s;
        (1.0 - a2) * s2 / (s2 + a2 * wo.z * wo.z)
    }

    /// Samples a half vector for reflection, visible from `wo`, leaving out most that reflect below the surface.
    ///
    /// - `wo`: unit vector in the shading frame with `wo.z > 0`. `alpha`: width in `[MIN_ALPHA, 1]`.
    /// - `u`: two uniform random numbers in `[0, 1)`.
    ///
    /// Returns a unit vector with z ≥ 0. The reflected direction's density is [`ggx_reflection_pdf`].
    /// Source: Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023, bounded after Eto and
    /// Tokuyoshi, "Bounded VNDF Sampling for Smith–GGX Reflections", SIGGRAPH Asia 2023.
    pub fn ggx_sample_reflection_half(wo: Vec3f, alpha: f32, u: Vec2f) -> Vec3f {
        let wo_std = normalize(vec3f(wo.x * alpha, wo.y * alpha, wo.z));
        let lower = cap_bound(wo, alpha) * wo_std.z;
        cap_half(wo_std, alpha, lower, u)
    }

    /// Samples a half vector from all that are visible from `wo` (for refraction, whose directions have no such bound).
    /// Its density over solid angle is [`ggx_visible_half_pdf`].
    pub fn ggx_sample_visible_half(wo: Vec3f, alpha: f32, u: Vec2f) -> Vec3f {
        let wo_std = normalize(vec3f(wo.x * alpha, wo.y * alpha, wo.z));
        cap_half(wo_std, alpha, wo_std.z, u)
    }

    /// A point of the sphere cap above −`lower`, turned into a half vector of the stretched surface and back.
    pub fn cap_half(wo_std: Vec3f, alpha: f32, lower: f32, u: Vec2f) -> Vec3f {
        // As for `sample_cone`: 1 − z does not cancel near the pole.
        let below_pole = u.y * (1.0 + lower);
        let r = safe_sqrt(below_pole * (2.0 - below_pole));
        let cs = cos_sin_turns(u.x);
        let half_std = vec3f(r * cs.x, r * cs.y, 1.0 - below_pole) + wo_std;
        normalize(vec3f(alpha * half_std.x, alpha * half_std.y, max(half_std.z, 1e-12)))
    }

    /// Density over solid angle of the direction that `wo` is reflected to about [`ggx_sample_reflection_half`].
    /// `h`: the half vector.
    pub fn ggx_reflection_pdf(wo: Vec3f, h: Vec3f, alpha: f32) -> f32 {
        let d = ggx_d(h, alpha);
        let stretched2 = alpha * alpha * (wo.x * wo.x + wo.y * wo.y);
        let t = sqrt(stretched2 + wo.z * wo.z);
        d / (2.0 * (cap_bound(wo, alpha) * wo.z + t))
    }

    /// Density over solid angle of [`ggx_sample_visible_half`] for the half vector `h`.
    pub fn ggx_visible_half_pdf(wo: Vec3f, h: Vec3f, alpha: f32) -> f32 {
        2.0 * ggx_g1_over_2cos(wo.z, alpha) * abs(dot(wo, h)) * ggx_d(h, alpha)
    }

    /// log₂ between the powers of two replaced by straight lines: monotonic, and free where a logarithm is not.
    /// `x` ≥ 1.
    pub fn piecewise_log2(x: f32) -> f32 {
        f32(bitcast_u32(x) - 0x3f800000u32) * (1.0 / 8388608.0)
    }

    /// The inverse of [`piecewise_log2`].
    pub fn piecewise_exp2(y: f32) -> f32 {
        bitcast_f32(u32(y * 8388608.0) + 0x3f800000u32)
    }

    /// Where a table of directional albedo holds the value for a cosine (x) and a width (y): both in `[0, 1]` from the
    /// centre of the first texel to the centre of the last. Ten octaves each; a table should have a texel at each.
    ///
    /// - `cos_theta` in `[0, 1]`. `alpha`: width in `[0, 1]`; less than [`MIN_ALPHA`] is treated as that.
    ///
    /// Logarithmic, because what a rough surface loses depends on cos / alpha: the narrower the lobe, the nearer to
    /// grazing it happens.
    pub fn albedo_coordinates(cos_theta: f32, alpha: f32) -> Vec2f {
        let x = piecewise_log2(1.0 + 1023.0 * saturate(cos_theta));
        let y = piecewise_log2(clamp(alpha, MIN_ALPHA, 1.0) * (1.0 / MIN_ALPHA));
        vec2f(x * 0.1, y * 0.1)
    }

    /// Where a table of a dielectric's albedo holds the value for an index of refraction: 1/3, 1 and 3 at 0, ½ and 1.
    /// Dense about 1, where little is reflected but at grazing angles.
    pub fn albedo_eta_coordinate(eta: f32) -> f32 {
        let r = (eta - 1.0) / (eta + 1.0);
        0.5 + sqrt(0.5 * abs(r)) * select(-1.0, 1.0, r >= 0.0)
    }

    /// The factor by which a rough dielectric's lobes are scaled so that no light is lost between microfacets.
    ///
    /// - `albedo`: share of light that a single scattering event keeps. At most 4: more would be needed only at
    ///   grazing angles of indices within 10 % of 1, where it would be all noise.
    pub fn dielectric_compensation(albedo: f32) -> f32 {
        1.0 / max(albedo, 0.25)
    }

    /// The same for an infinitely thin sheet, whose lobe is the reflection lobe of albedo `albedo.x + albedo.y`.
    pub fn sheet_compensation(albedo: Vec2f) -> f32 {
        1.0 / max(albedo.x + albedo.y, 0.05)
    }

    /// The inverse of [`albedo_coordinates`]: cosine (x), not zero, and width (y), which goes beyond 1 at the end of its
    /// last octave.
    pub fn albedo_parameters(coordinates: Vec2f) -> Vec2f {
        let cos_theta = (piecewise_exp2(10.0 * coordinates.x) - 1.0) * (1.0 / 1023.0);
        let alpha = piecewise_exp2(10.0 * coordinates.y) * MIN_ALPHA;
        vec2f(clamp(cos_theta, 1e-6, 1.0), alpha)
    }
}
