//! Interfaces between transparent media: smooth, rough, and infinitely thin.
//!
//! Weights are those of radiance, which is compressed by the square of the index of refraction where it enters a
//! denser medium (Veach 1997, section 5.2): the factor 1 / eta² of transmitted light cancels when it leaves again.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod dielectric {
    use crate::fresnel::*;
    use crate::ggx::*;
    use crate::math::*;
    use crate::scatter::*;
    use wgsl_rs::std::*;

    /// A dielectric interface.
    ///
    /// - `tint`: multiplies transmitted light, in `[0, 1]`. `alpha`: GGX width; 0 is smooth.
    /// - `eta`: index of refraction of the far side over that of the side of `wo`.
    /// - `thin`: an infinitely thin sheet instead of a boundary.
    /// - `compensation`: see [`Bsdf::compensation`].
    pub fn dielectric_bsdf(tint: Vec3f, alpha: f32, eta: f32, thin: bool, compensation: f32) -> Bsdf {
        let mut b = black_bsdf();
        let polished = alpha < MIN_ALPHA;
        b.kind = select(
            select(BSDF_ROUGH_DIELECTRIC, BSDF_SMOOTH_DIELECTRIC, polished),
            BSDF_THIN_DIELECTRIC,
            thin,
        );
        // An index of 1 bends nothing, so roughness has nothing to blur.
        if abs(eta - 1.0) < 1e-4 && !thin {
            b.kind = BSDF_SMOOTH_DIELECTRIC;
        }
        b.alpha = select(alpha, 0.0, polished);
        b.diffuse = tint;
        b.eta = eta;
        b.compensation = compensation;
        b
    }

    /// Refracts `wo` at a microfacet of normal `h`; `eta` as in [`Bsdf`]. The caller has excluded total reflection:
    /// `cos_transmitted` comes from [`fresnel_dielectric`].
    pub fn refract_at(wo: Vec3f, h: Vec3f, eta: f32, cos_transmitted: f32) -> Vec3f {
        let c = dot(wo, h);
        normalize(h * (c / eta - cos_transmitted) - wo * (1.0 / eta))
    }

    /// Chooses between reflection and refraction with Fresnel's probabilities.
    pub fn smooth_dielectric_sample(b: Bsdf, wo: Vec3f, u_lobe: f32) -> BsdfSample {
        let f = fresnel_dielectric(min(wo.z, 1.0), b.eta);
        if u_lobe < f.reflectance {
            let mirrored = vec3f(-wo.x, -wo.y, wo.z);
            return BsdfSample {
                wi: mirrored,
                weight: vec3f(1.0, 1.0, 1.0),
                pdf: 1.0,
                delta: true,
                transmitted: false,
            };
        }
        let wi = refract_at(wo, vec3f(0.0, 0.0, 1.0), b.eta, f.cos_transmitted);
        BsdfSample {
            wi: wi,
            weight: b.diffuse * (1.0 / (b.eta * b.eta)),
            pdf: 1.0,
            delta: true,
            transmitted: true,
        }
    }

    /// Value and density of a rough interface.
    /// Source: Walter et al. 2007, with both lobes scaled by `compensation` (Turquin 2019, section 4.3).
    pub fn rough_dielectric_eval(b: Bsdf, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        let mut out = BsdfValue { value_cos: vec3f(0.0, 0.0, 0.0), pdf: 0.0 };
        if wo.z <= 0.0 || wi.z == 0.0 {
            return out;
        }
        let reflected = wi.z > 0.0;
        let sum = select(wo + wi * b.eta, wo + wi, reflected);
        let length2 = dot(sum, sum);
        if length2 < 1e-12 {
            return out;
        }
        let upright = select(-1.0, 1.0, sum.z > 0.0);
        let h = sum * (upright / sqrt(length2));
        let cos_o = dot(wo, h);
        let cos_i = dot(wi, h);
        // Directions that see the microfacet from different sides than they see the surface do not exist.
        if cos_o <= 0.0 || cos_i * wi.z <= 0.0 {
            return out;
        }
        let f = fresnel_dielectric(min(cos_o, 1.0), b.eta);
        let d = ggx_d(h, b.alpha);
        let half_g = ggx_g1_over_2cos(wo.z, b.alpha) * ggx_g1(wi.z, b.alpha);
        let pdf_h = ggx_visible_half_pdf(wo, h, b.alpha);
        if reflected {
            let value = 0.5 * f.reflectance * d * half_g * b.compensation;
            out.value_cos = vec3f(value, value, value);
            out.pdf = f.reflectance * pdf_h / (4.0 * cos_o);
            return out;
        }
        let denominator = cos_o + b.eta * cos_i;
        if abs(denominator) < 1e-7 {
            return out;
        }
        let jacobian = abs(cos_i) / (denominator * denominator);
        out.value_cos =
            b.diffuse * (2.0 * (1.0 - f.reflectance) * d * half_g * cos_o * jacobian * b.compensation);
        out.pdf = (1.0 - f.reflectance) * pdf_h * jacobian * b.eta * b.eta;
        out
    }

    /// Samples a microfacet, then reflection or refraction at it.
    pub fn rough_dielectric_sample(b: Bsdf, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample {
        if wo.z <= 0.0 {
            return no_sample();
        }
        let h = ggx_sample_visible_half(wo, b.alpha, u);
        let cos_o = dot(wo, h);
        let f = fresnel_dielectric(clamp(cos_o, 0.0, 1.0), b.eta);
        let reflect_it = u_lobe < f.reflectance;
        let wi = select(refract_at(wo, h, b.eta, f.cos_transmitted), h * (2.0 * cos_o) - wo, reflect_it);
        if cos_o <= 0.0 || (wi.z > 0.0) != reflect_it {
            return no_sample();
        }
        let v = rough_dielectric_eval(b, wo, wi);
        // D, Fresnel and half of G cancel: what is left of value over density is the masking of the new direction.
        let weight = ggx_g1(wi.z, b.alpha) * b.compensation;
        if v.pdf <= 0.0 || !is_finite(v.pdf) {
            return no_sample();
        }
        let transmitted = b.diffuse * (weight / (b.eta * b.eta));
        BsdfSample {
            wi: wi,
            weight: select(transmitted, vec3f(weight, weight, weight), reflect_it),
            pdf: v.pdf,
            delta: false,
            transmitted: !reflect_it,
        }
    }

    /// Reflectance of the sheet for light at the given cosine with its (micro)normal.
    pub fn sheet_reflectance(b: Bsdf, cos_theta: f32) -> f32 {
        thin_sheet_reflectance(fresnel_dielectric(clamp(cos_theta, 0.0, 1.0), b.eta).reflectance)
    }

    /// Value and density of a rough thin sheet: the reflection lobe, and its mirror image below for transmission.
    pub fn thin_dielectric_eval(b: Bsdf, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        let mut out = BsdfValue { value_cos: vec3f(0.0, 0.0, 0.0), pdf: 0.0 };
        if b.alpha <= 0.0 || wo.z <= 0.0 || wi.z == 0.0 {
            return out;
        }
        let above = vec3f(wi.x, wi.y, abs(wi.z));
        let sum = wo + above;
        let length2 = dot(sum, sum);
        if length2 < 1e-24 {
            return out;
        }
        let h = sum * (1.0 / sqrt(length2));
        let r = sheet_reflectance(b, dot(wo, h));
        let share = select(b.diffuse * (1.0 - r), vec3f(r, r, r), wi.z > 0.0);
        let probability = select(1.0 - r, r, wi.z > 0.0);
        let half_g = ggx_g1_over_2cos(wo.z, b.alpha) * ggx_g1(above.z, b.alpha);
        out.value_cos = share * (0.5 * ggx_d(h, b.alpha) * half_g * b.compensation);
        out.pdf = probability * ggx_reflection_pdf(wo, h, b.alpha);
        out
    }

    /// Samples reflection or straight transmission of a thin sheet.
    pub fn thin_dielectric_sample(b: Bsdf, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample {
        if b.alpha <= 0.0 {
            let r = sheet_reflectance(b, wo.z);
            let reflect_it = u_lobe < r;
            let weight = select(b.diffuse, vec3f(1.0, 1.0, 1.0), reflect_it);
            let wi = select(-wo, vec3f(-wo.x, -wo.y, wo.z), reflect_it);
            return BsdfSample { wi: wi, weight: weight, pdf: 1.0, delta: true, transmitted: !reflect_it };
        }
        if wo.z <= 0.0 {
            return no_sample();
        }
        let h = ggx_sample_reflection_half(wo, b.alpha, u);
        let above = h * (2.0 * dot(wo, h)) - wo;
        if above.z <= 0.0 {
            return no_sample();
        }
        let reflect_it = u_lobe < sheet_reflectance(b, dot(wo, h));
        let wi = vec3f(above.x, above.y, select(-above.z, above.z, reflect_it));
        let v = thin_dielectric_eval(b, wo, wi);
        if v.pdf <= 0.0 || !is_finite(v.pdf) {
            return no_sample();
        }
        BsdfSample {
            wi: wi,
            weight: v.value_cos * (1.0 / v.pdf),
            pdf: v.pdf,
            delta: false,
            transmitted: !reflect_it,
        }
    }

    /// What goes on behind a dielectric of a narrow beam from `wo`: its direction, and the weight as of a sample.
    ///
    /// - `acceptance`: the largest angle, radians, by which a rough surface may turn light that still counts as the beam.
    ///
    /// Smooth interfaces let all through that they do not reflect. Of rough ones the share of microfacets counts that are
    /// tilted little enough; a thin sheet turns light by twice the tilt, an interface by |1 − 1/η| times the tilt.
    pub fn transmitted_beam(b: Bsdf, wo: Vec3f, acceptance: f32) -> BsdfSample {
        let thin = b.kind == BSDF_THIN_DIELECTRIC;
        let polished = b.kind == BSDF_SMOOTH_DIELECTRIC;
        if wo.z <= 0.0 || !(thin || polished || b.kind == BSDF_ROUGH_DIELECTRIC) {
            return no_sample();
        }
        let f = fresnel_dielectric(min(wo.z, 1.0), b.eta);
        if f.reflectance >= 1.0 {
            return no_sample();
        }
        let turn_per_tilt = max(select(abs(1.0 - 1.0 / b.eta), 2.0, thin), 1e-3);
        let slope = acceptance / turn_per_tilt;
        let alpha = select(b.alpha, 0.0, polished);
        // Of GGX microfacets, seen along the normal, this share has a smaller slope.
        let share = slope * slope / max(slope * slope + alpha * alpha, 1e-30);
        let passed = select(1.0 - f.reflectance, 1.0 - thin_sheet_reflectance(f.reflectance), thin);
        let compression = select(1.0 / (b.eta * b.eta), 1.0, thin);
        let refracted = refract_at(wo, vec3f(0.0, 0.0, 1.0), b.eta, f.cos_transmitted);
        BsdfSample {
            wi: select(refracted, -wo, thin),
            weight: b.diffuse * (share * passed * compression),
            pdf: 1.0,
            delta: true,
            transmitted: true,
        }
    }

    /// The albedo of a rough interface without tint or compensation for one sampled microfacet, both lobes weighted
    /// with their probabilities; for building tables, to be averaged over `u`. Radiance compression is left out, so
    /// that a lossless interface gives 1.
    pub fn rough_dielectric_albedo_sample(cos_theta: f32, alpha: f32, eta: f32, u: Vec2f) -> f32 {
        let wo = vec3f(safe_sqrt(1.0 - cos_theta * cos_theta), 0.0, cos_theta);
        let h = ggx_sample_visible_half(wo, alpha, u);
        let cos_o = clamp(dot(wo, h), 0.0, 1.0);
        let f = fresnel_dielectric(cos_o, eta);
        let mirrored = 2.0 * cos_o * h.z - wo.z;
        let refracted = refract_at(wo, h, eta, f.cos_transmitted).z;
        let reflection = select(0.0, ggx_g1(mirrored, alpha), mirrored > 0.0);
        let transmission = select(0.0, ggx_g1(refracted, alpha), refracted < 0.0);
        mix(transmission, reflection, f.reflectance)
    }
}
