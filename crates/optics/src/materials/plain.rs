//! A material without layers at one point: from its record and texels to a BSDF.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod plain {
    use crate::dielectric::*;
    use crate::ggx::*;
    use crate::glossy::*;
    use crate::material::*;
    use crate::scatter::*;
    use wgsl_rs::std::*;

    /// No table is looked up for the point.
    pub const ALBEDO_NONE: u32 = 0u32;
    /// The directional albedo of GGX reflection is looked up at the point's roughness.
    pub const ALBEDO_GGX: u32 = 1u32;
    /// The directional albedo of a rough dielectric is looked up at the point's roughness and `eta`.
    pub const ALBEDO_DIELECTRIC: u32 = 2u32;

    /// A material without layers at one point, textures applied.
    #[derive(Clone, Copy, Debug)]
    pub struct PlainPoint {
        /// The scattering model; of those that a material mixes, the one that was chosen.
        pub model: ModelTag,
        /// Linear base colour.
        pub base_color: Vec3f,
        /// Metalness in `[0, 1]`.
        pub metallic: f32,
        /// Perceptual roughness in `[0, 1]`.
        pub roughness: f32,
        /// Strength of the dielectric's reflection in `[0, 1]`.
        pub specular: f32,
        /// Index of refraction of the dielectric.
        pub ior: f32,
        /// Index of refraction of the far side over that of the near one.
        pub eta: f32,
        /// Whether a dielectric has no thickness.
        pub thin: bool,
        /// Which table is to be looked up for [`plain_bsdf`]: `ALBEDO_…`.
        pub albedo_table: u32,
    }

    /// Whether [`plain_point`] chooses between models, so that `u_model` matters.
    pub fn material_mixes_models(m: MaterialRecord) -> bool {
        m.transmission > 0.0
    }

    /// Whether light may come through the material.
    pub fn material_may_refract(m: MaterialRecord) -> bool {
        m.model == ModelTag::Dielectric || m.transmission > 0.0
    }

    /// A material at a point.
    ///
    /// - `base_color`: see [`material_base_color`]. `metallic_roughness`, `transmission`: texels of these textures, ones
    ///   without one.
    /// - `ior`, `front`: see [`material_eta`].
    /// - `u_model`: uniform number that chooses between refraction and reflection where a material mixes them.
    /// - `single_scatter`: leave out what is scattered several times between microfacets.
    pub fn plain_point(
        m: MaterialRecord,
        base_color: Vec3f,
        metallic_roughness: Vec4f,
        transmission: Vec4f,
        ior: f32,
        front: bool,
        u_model: f32,
        single_scatter: bool,
    ) -> PlainPoint {
        let mut p = PlainPoint {
            model: m.model,
            base_color: base_color,
            metallic: m.metallic * metallic_roughness.z,
            roughness: m.roughness * metallic_roughness.y,
            specular: m.specular,
            ior: ior,
            eta: material_eta(m, ior, front),
            thin: (m.flags & MATERIAL_THIN) != 0u32,
            albedo_table: ALBEDO_NONE,
        };
        // Beams of sensors ask for no layers: to them a material is what lies below.
        if m.model == ModelTag::MetallicRoughness || m.model == ModelTag::Layered {
            let refracted = m.transmission * transmission.x * (1.0 - p.metallic);
            if m.transmission > 0.0 && u_model < refracted {
                p.model = ModelTag::Dielectric;
            } else {
                p.model = ModelTag::MetallicRoughness;
                // What is not refracted: the metal, and the rest of the dielectric.
                p.metallic = saturate(p.metallic / max(1.0 - refracted, 1e-6));
                p.roughness = saturate(p.roughness);
                p.albedo_table = ALBEDO_GGX;
            }
        }
        if p.model == ModelTag::Dielectric && p.roughness * p.roughness >= MIN_ALPHA && !single_scatter {
            p.albedo_table = select(ALBEDO_DIELECTRIC, ALBEDO_GGX, p.thin);
        }
        p
    }

    /// The BSDF of a point.
    ///
    /// - `albedo`: what the table that the point names says at the cosine of `wo`: both numbers of [`ALBEDO_GGX`], or that
    ///   of [`ALBEDO_DIELECTRIC`] in x.
    pub fn plain_bsdf(p: PlainPoint, albedo: Vec2f, single_scatter: bool) -> Bsdf {
        if p.model == ModelTag::Lambert {
            return lambert_bsdf(p.base_color);
        }
        if p.model == ModelTag::Mirror {
            return mirror_bsdf(p.base_color);
        }
        if p.model == ModelTag::Dielectric {
            let mut compensation = 1.0;
            if p.albedo_table == ALBEDO_GGX {
                compensation = sheet_compensation(albedo);
            }
            if p.albedo_table == ALBEDO_DIELECTRIC {
                compensation = dielectric_compensation(albedo.x);
            }
            return dielectric_bsdf(p.base_color, p.roughness * p.roughness, p.eta, p.thin, compensation);
        }
        if p.model == ModelTag::MetallicRoughness {
            let m = MetallicRoughness {
                base_color: p.base_color,
                metallic: p.metallic,
                roughness: p.roughness,
                specular: p.specular,
                ior: p.ior,
            };
            return metallic_roughness_bsdf(m, albedo, single_scatter);
        }
        black_bsdf()
    }
}
