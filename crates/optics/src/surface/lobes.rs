//! The lobes of a layered surface: their sum, its density, and sampling one of them.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod lobes {
    use crate::anisotropic::*;
    use crate::dielectric::*;
    use crate::frame::*;
    use crate::fresnel::*;
    use crate::ggx::*;
    use crate::layered::*;
    use crate::math::*;
    use crate::oren_nayar::*;
    use crate::scatter::*;
    use crate::sheen::*;
    use crate::warp::*;
    use wgsl_rs::std::*;

    /// Whether light can arrive from below the surface.
    pub fn layered_transmits(b: Layered) -> bool {
        b.p_diffuse_below > 0.0 || b.p_refracted > 0.0
    }

    /// About which share of the scattered light the lobes have that are not diffuse, in `[0, 1]`.
    pub fn layered_reflected_share(b: Layered) -> f32 {
        b.p_specular + b.p_refracted + b.p_sheen + b.p_coat
    }

    /// Whether there are lobes that are not diffuse.
    pub fn layered_reflects(b: Layered) -> bool {
        layered_reflected_share(b) > 0.0
    }

    /// See [`bsdf_is_sharp`](crate::bsdf::bsdf_is_sharp).
    pub fn layered_is_sharp(b: Layered) -> bool {
        let spread = b.p_diffuse + b.p_diffuse_below + b.p_sheen;
        let coat_is_sharp = b.p_coat <= 0.0 || b.coat_alpha <= SHARP_WIDTH;
        spread <= 0.0 && layered_reflects(b) && coat_is_sharp && max(b.widths.x, b.widths.y) <= SHARP_WIDTH
    }

    /// All lobes but the diffuse ones: values of the others stay as they are, and one of them is sampled always.
    pub fn layered_without_diffuse(b: Layered) -> Layered {
        let share = layered_reflected_share(b);
        let scale = select(0.0, 1.0 / max(share, 1e-30), share > 1e-20);
        let mut others = b;
        others.diffuse = vec3f(0.0, 0.0, 0.0);
        others.diffuse_lobe = scaled_rough_diffuse(b.diffuse_lobe, 0.0);
        others.diffuse_below = vec3f(0.0, 0.0, 0.0);
        others.p_diffuse = 0.0;
        others.p_diffuse_below = 0.0;
        others.p_specular = b.p_specular * scale;
        others.p_refracted = b.p_refracted * scale;
        others.p_sheen = b.p_sheen * scale;
        others.p_coat = b.p_coat * scale;
        others
    }

    /// Value times cosine and density, for `wi` on either side of the surface.
    ///
    /// - `wo`: as it was prepared for. `wi`: unit vector in the shading frame.
    pub fn layered_eval(b: Layered, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        if wo.z <= 0.0 || wi.z == 0.0 {
            return BsdfValue { value_cos: vec3f(0.0, 0.0, 0.0), pdf: 0.0 };
        }
        if wi.z > 0.0 {
            return lobes_above(b, wo, wi);
        }
        lobes_below(b, wo, wi)
    }

    /// The lobes that reflect: diffuse, specular, sheen and coat.
    pub fn lobes_above(b: Layered, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        let diffuse = rough_diffuse_factor(b.diffuse_lobe, wo, wi) * pdf_cosine_hemisphere(wi.z);
        let diffuse_pdf = pdf_rough_diffuse(b.diffuse_lobe.roughness, wi.z);
        let sheen = sheen_lobe(wo, wi, b.sheen_alpha);
        let mut value = diffuse + b.sheen * sheen;
        let mut pdf = b.p_diffuse * diffuse_pdf + b.p_sheen * pdf_sheen();
        let sum = wo + wi;
        let length2 = dot(sum, sum);
        if length2 > 1e-24 {
            let h = sum * (1.0 / sqrt(length2));
            let color = b.specular + b.specular_grazing * refraction_schlick(dot(wo, h), b.eta);
            value = value + color * anisotropic_lobe(wo, wi, h, b.widths);
            pdf = pdf + b.p_specular * anisotropic_reflection_pdf(wo, h, b.widths);
            let coat = coat_lobe(b, wo, wi, h);
            value = value + coat.value_cos;
            pdf = pdf + coat.pdf;
        }
        BsdfValue { value_cos: value, pdf: pdf }
    }

    /// GGX reflection without Fresnel: D G / (4 cos), sr⁻¹. `h`: unit half vector; both directions on one side.
    pub fn anisotropic_lobe(wo: Vec3f, wi: Vec3f, h: Vec3f, widths: Vec2f) -> f32 {
        let masking = 2.0 * abs(wi.z) * anisotropic_g1_over_2cos(wi, widths);
        0.5 * anisotropic_d(h, widths) * anisotropic_g1_over_2cos(wo, widths) * masking
    }

    /// The coat's lobe, whose normal is its own; the density with the probability of choosing it.
    pub fn coat_lobe(b: Layered, wo: Vec3f, wi: Vec3f, h: Vec3f) -> BsdfValue {
        let frame = frame_from_normal(b.coat_normal);
        let coat_wo = to_local(frame, wo);
        let coat_wi = to_local(frame, wi);
        if b.p_coat <= 0.0 || coat_wo.z <= 0.0 || coat_wi.z <= 0.0 {
            return BsdfValue { value_cos: vec3f(0.0, 0.0, 0.0), pdf: 0.0 };
        }
        let coat_h = to_local(frame, h);
        let reflectance = b.coat + b.coat_grazing * schlick_weight(dot(wo, h));
        let shape = ggx_d(coat_h, b.coat_alpha) * ggx_g1_over_2cos(coat_wo.z, b.coat_alpha);
        let value = 0.5 * reflectance * shape * ggx_g1(coat_wi.z, b.coat_alpha);
        let pdf = b.p_coat * ggx_reflection_pdf(coat_wo, coat_h, b.coat_alpha);
        BsdfValue { value_cos: vec3f(value, value, value), pdf: pdf }
    }

    /// The lobes that let light through: diffuse transmission and refraction.
    pub fn lobes_below(b: Layered, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        let diffuse_pdf = pdf_cosine_hemisphere(-wi.z);
        let mut out =
            BsdfValue { value_cos: b.diffuse_below * diffuse_pdf, pdf: b.p_diffuse_below * diffuse_pdf };
        if b.p_refracted <= 0.0 {
            return out;
        }
        let refracted = refracted_lobe(b, wo, wi);
        out.value_cos = out.value_cos + b.refracted * refracted.value_cos;
        out.pdf = out.pdf + b.p_refracted * refracted.pdf;
        out
    }

    /// Share of light that the interface lets through at a microfacet.
    pub fn passing_share(b: Layered, cos_theta: f32) -> f32 {
        1.0 - saturate(mix(b.refracted_f0, b.refracted_f90, refraction_schlick(cos_theta, b.eta)))
    }

    /// Refraction of white light, with the density of its own sampling: a rough interface, or, where nothing is bent,
    /// the mirror image of the reflection lobe. Source: Walter et al. 2007, eq. 21, for two widths.
    pub fn refracted_lobe(b: Layered, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        let mut out = BsdfValue { value_cos: vec3f(0.0, 0.0, 0.0), pdf: 0.0 };
        let straight = b.eta == 1.0;
        let above = vec3f(wi.x, wi.y, -wi.z);
        let sum = select(wo + wi * b.eta, wo + above, straight);
        let length2 = dot(sum, sum);
        if length2 < 1e-12 {
            return out;
        }
        let upright = select(-1.0, 1.0, sum.z > 0.0);
        let h = sum * (upright / sqrt(length2));
        let cos_o = dot(wo, h);
        if straight {
            let value = passing_share(b, cos_o) * anisotropic_lobe(wo, above, h, b.widths);
            out.value_cos = vec3f(value, value, value);
            out.pdf = anisotropic_reflection_pdf(wo, h, b.widths);
            return out;
        }
        let cos_i = dot(wi, h);
        let denominator = cos_o + b.eta * cos_i;
        // Directions that see the microfacet from different sides than they see the surface do not exist.
        if cos_o <= 0.0 || cos_i >= 0.0 || abs(denominator) < 1e-7 {
            return out;
        }
        let jacobian = -cos_i / (denominator * denominator);
        let masking = 2.0 * abs(wi.z) * anisotropic_g1_over_2cos(wi, b.widths);
        let shape = anisotropic_d(h, b.widths) * anisotropic_g1_over_2cos(wo, b.widths) * masking;
        let value = 2.0 * passing_share(b, cos_o) * shape * cos_o * jacobian;
        out.value_cos = vec3f(value, value, value);
        out.pdf = anisotropic_visible_half_pdf(wo, h, b.widths) * jacobian * b.eta * b.eta;
        out
    }

    /// Samples one of the lobes. `u_lobe`: uniform number that chooses; `u`: two more for the direction.
    pub fn layered_sample(b: Layered, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample {
        if wo.z <= 0.0 {
            return no_sample();
        }
        let wi = sample_lobe(b, wo, u_lobe, u);
        let v = layered_eval(b, wo, wi);
        // Where lobes are next to impossible, their density has no reciprocal.
        if v.pdf < 1e-30 || !is_finite(v.pdf) {
            return no_sample();
        }
        BsdfSample {
            wi: wi,
            weight: v.value_cos * (1.0 / v.pdf),
            pdf: v.pdf,
            delta: false,
            transmitted: wi.z < 0.0,
        }
    }

    /// A direction from one of the lobes; in the surface's plane where there is none.
    pub fn sample_lobe(b: Layered, wo: Vec3f, u_lobe: f32, u: Vec2f) -> Vec3f {
        let nowhere = vec3f(1.0, 0.0, 0.0);
        let mut end = b.p_specular;
        if u_lobe < end {
            let h = anisotropic_sample_reflection_half(wo, b.widths, u);
            let wi = h * (2.0 * dot(wo, h)) - wo;
            return select(nowhere, wi, wi.z > 0.0);
        }
        end = end + b.p_diffuse;
        if u_lobe < end {
            return sample_rough_diffuse(b.diffuse_lobe.roughness, u);
        }
        end = end + b.p_refracted;
        if u_lobe < end {
            return sample_refracted(b, wo, u);
        }
        end = end + b.p_coat;
        if u_lobe < end {
            let frame = frame_from_normal(b.coat_normal);
            let coat_wo = to_local(frame, wo);
            if coat_wo.z <= 0.0 {
                return nowhere;
            }
            let h = ggx_sample_reflection_half(coat_wo, b.coat_alpha, u);
            let coat_wi = h * (2.0 * dot(coat_wo, h)) - coat_wo;
            let wi = to_world(frame, coat_wi);
            return select(nowhere, wi, coat_wi.z > 0.0 && wi.z > 0.0);
        }
        end = end + b.p_sheen;
        if u_lobe < end {
            return sample_sheen(u);
        }
        let below = sample_cosine_hemisphere(u);
        vec3f(below.x, below.y, -below.z)
    }

    /// A refracted direction, in the surface's plane where the microfacet reflects everything.
    pub fn sample_refracted(b: Layered, wo: Vec3f, u: Vec2f) -> Vec3f {
        let nowhere = vec3f(1.0, 0.0, 0.0);
        if b.eta == 1.0 {
            let mirror_half = anisotropic_sample_reflection_half(wo, b.widths, u);
            let above = mirror_half * (2.0 * dot(wo, mirror_half)) - wo;
            return select(nowhere, vec3f(above.x, above.y, -above.z), above.z > 0.0);
        }
        let h = anisotropic_sample_visible_half(wo, b.widths, u);
        let cos_o = dot(wo, h);
        let f = fresnel_dielectric(clamp(cos_o, 0.0, 1.0), b.eta);
        if cos_o <= 0.0 || f.cos_transmitted <= 0.0 {
            return nowhere;
        }
        let wi = refract_at(wo, h, b.eta, f.cos_transmitted);
        select(nowhere, wi, wi.z < 0.0)
    }
}
