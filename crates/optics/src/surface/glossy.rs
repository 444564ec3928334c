//! Diffuse and GGX reflection: Lambert and the metallic-roughness model of glTF 2.0.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod glossy {
    use crate::fresnel::*;
    use crate::ggx::*;
    use crate::math::*;
    use crate::scatter::*;
    use crate::warp::*;
    use wgsl_rs::std::*;

    /// Parameters of the metallic-roughness model at one point.
    #[derive(Clone, Copy, Debug)]
    pub struct MetallicRoughness {
        /// Linear base colour in `[0, 1]`.
        pub base_color: Vec3f,
        /// Metalness in `[0, 1]`.
        pub metallic: f32,
        /// Perceptual roughness in `[0, 1]`.
        pub roughness: f32,
        /// Strength of the dielectric's reflection in `[0, 1]`.
        pub specular: f32,
        /// Index of refraction of the dielectric, ≥ 1.
        pub ior: f32,
    }

    /// Lambertian reflection of `albedo` in `[0, 1]`.
    pub fn lambert_bsdf(albedo: Vec3f) -> Bsdf {
        let mut b = black_bsdf();
        b.kind = BSDF_GLOSSY;
        b.diffuse = albedo;
        b
    }

    /// Ideal mirror of the given reflectance.
    pub fn mirror_bsdf(reflectance: Vec3f) -> Bsdf {
        let mut b = black_bsdf();
        b.kind = BSDF_MIRROR;
        b.diffuse = reflectance;
        b
    }

    /// The model of glTF 2.0, Appendix B, for light that is scattered towards a direction whose cosine with the normal
    /// belongs to `albedo`.
    ///
    /// - `albedo`: directional albedo of the GGX lobe at that cosine and roughness, for reflectance 1 at normal
    ///   incidence (x) and for the grazing part of Schlick's approximation alone (y): reflectance F₀ to F₉₀ gives
    ///   `F₀ x + F₉₀ y`. Their sum is the lobe's albedo E without Fresnel.
    /// - `single_scatter`: whether to follow Appendix B to the letter. Otherwise energy that a single reflection loses
    ///   between microfacets is given back by scaling the lobe with 1 + F₀ (1 − E) / E (Turquin, "Practical multiple
    ///   scattering compensation for microfacet models", 2019), and the diffuse lobe gets exactly what the specular
    ///   lobe leaves. A white surface then reflects all light, whatever its roughness and metalness.
    pub fn metallic_roughness_bsdf(m: MetallicRoughness, albedo: Vec2f, single_scatter: bool) -> Bsdf {
        let f0 = f0_from_ior(m.ior) * m.specular;
        let f90 = m.specular;
        let energy = max(albedo.x + albedo.y, 1e-4);
        let lost = select((1.0 - energy) / energy, 0.0, single_scatter);
        let dielectric_scale = (1.0 - m.metallic) * (1.0 + f0 * lost);
        let metal_scale = (vec3f(1.0, 1.0, 1.0) + m.base_color * lost) * m.metallic;

        let mut b = black_bsdf();
        b.kind = BSDF_GLOSSY;
        b.alpha = max(m.roughness * m.roughness, MIN_ALPHA);
        b.diffuse = m.base_color * (1.0 - m.metallic);
        let dielectric_albedo = (f0 * albedo.x + f90 * albedo.y) * (1.0 + f0 * lost);
        b.diffuse_scale = select(1.0 - dielectric_albedo, 1.0 - f0, single_scatter);
        b.diffuse_falloff = select(0.0, f90 - f0, single_scatter);
        b.specular = m.base_color * metal_scale + vec3f(1.0, 1.0, 1.0) * (f0 * dielectric_scale);
        b.specular_grazing = (vec3f(1.0, 1.0, 1.0) - m.base_color) * metal_scale
            + vec3f(1.0, 1.0, 1.0) * ((f90 - f0) * dielectric_scale);
        let specular_weight = luminance(b.specular * energy + b.specular_grazing * albedo.y);
        let diffuse_weight = luminance(b.diffuse) * b.diffuse_scale;
        let probability = specular_weight / max(specular_weight + diffuse_weight, 1e-20);
        b.specular_probability = select(clamp(probability, 0.05, 0.95), 1.0, diffuse_weight <= 0.0);
        b.specular_probability = select(b.specular_probability, 0.0, specular_weight <= 0.0);
        b
    }

    /// About which share of light the specular lobe reflects to `wo`: Fresnel's for a mirror. `cos_o`: cosine of `wo`.
    pub fn glossy_reflectance(b: Bsdf, cos_o: f32) -> Vec3f {
        b.specular + b.specular_grazing * schlick_weight(cos_o)
    }

    /// Value and density of both lobes.
    pub fn glossy_eval(b: Bsdf, wo: Vec3f, wi: Vec3f) -> BsdfValue {
        let mut out = BsdfValue { value_cos: vec3f(0.0, 0.0, 0.0), pdf: 0.0 };
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return out;
        }
        let diffuse_pdf = pdf_cosine_hemisphere(wi.z);
        if b.specular_probability <= 0.0 {
            // Without a specular lobe `diffuse_falloff` has nothing to make room for.
            out.value_cos = b.diffuse * (diffuse_pdf * b.diffuse_scale);
            out.pdf = diffuse_pdf;
            return out;
        }
        let sum = wo + wi;
        let length2 = dot(sum, sum);
        if length2 < 1e-24 {
            return out;
        }
        let h = sum * (1.0 / sqrt(length2));
        let grazing = schlick_weight(dot(wo, h));
        let lobe = 0.5 * ggx_d(h, b.alpha) * ggx_g1_over_2cos(wo.z, b.alpha) * ggx_g1(wi.z, b.alpha);
        let diffuse = b.diffuse * ((b.diffuse_scale - b.diffuse_falloff * grazing) * diffuse_pdf);
        out.value_cos = diffuse + (b.specular + b.specular_grazing * grazing) * lobe;
        out.pdf = mix(diffuse_pdf, ggx_reflection_pdf(wo, h, b.alpha), b.specular_probability);
        out
    }

    /// Samples one of the lobes.
    pub fn glossy_sample(b: Bsdf, wo: Vec3f, u_lobe: f32, u: Vec2f) -> BsdfSample {
        if wo.z <= 0.0 {
            return no_sample();
        }
        let mut wi = sample_cosine_hemisphere(u);
        if u_lobe < b.specular_probability {
            let h = ggx_sample_reflection_half(wo, b.alpha, u);
            wi = h * (2.0 * dot(wo, h)) - wo;
        }
        if b.specular_probability <= 0.0 {
            let weight = b.diffuse * b.diffuse_scale;
            return BsdfSample {
                wi: wi,
                weight: weight,
                pdf: pdf_cosine_hemisphere(wi.z),
                delta: false,
                transmitted: false,
            };
        }
        let v = glossy_eval(b, wo, wi);
        if v.pdf <= 0.0 || !is_finite(v.pdf) {
            return no_sample();
        }
        BsdfSample {
            wi: wi,
            weight: v.value_cos * (1.0 / v.pdf),
            pdf: v.pdf,
            delta: false,
            transmitted: false,
        }
    }

    /// The product ∫ D G / (4 cos) of one sampled direction with its Fresnel weights, for building tables of
    /// directional albedo: x and y as `metallic_roughness_bsdf` takes them, to be averaged over `u`.
    pub fn ggx_albedo_sample(cos_o: f32, roughness: f32, u: Vec2f) -> Vec2f {
        let wo = vec3f(safe_sqrt(1.0 - cos_o * cos_o), 0.0, cos_o);
        let alpha = max(roughness * roughness, MIN_ALPHA);
        let h = ggx_sample_reflection_half(wo, alpha, u);
        let wi = h * (2.0 * dot(wo, h)) - wo;
        if wi.z <= 0.0 {
            return vec2f(0.0, 0.0);
        }
        let lobe = 0.5 * ggx_d(h, alpha) * ggx_g1_over_2cos(wo.z, alpha) * ggx_g1(wi.z, alpha);
        let weight = lobe / ggx_reflection_pdf(wo, h, alpha);
        let grazing = schlick_weight(dot(wo, h));
        vec2f(weight * (1.0 - grazing), weight * grazing)
    }
}
