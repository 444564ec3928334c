//! From a material record and a surface to emission and a prepared BSDF.

use crate::scene::vec3;
use crate::surface::Surface;
use crate::texture;
use optics::albedo::{DielectricAlbedo, GgxAlbedo};
use optics::dielectric::dielectric_bsdf;
use optics::ggx::{MIN_ALPHA, sheet_compensation};
use optics::glossy::{MetallicRoughness, lambert_bsdf, metallic_roughness_bsdf, mirror_bsdf};
use optics::pattern::{checkerboard, distance_fade, footprint_width};
use optics::scatter::{Bsdf, black_bsdf};
use optics::vector::dot;
use optics::{Vec3f, vec2f, vec3f};
use scene::tables::{
    MATERIAL_ALPHA_BLEND, MATERIAL_ALPHA_MASK, MATERIAL_CHECKERBOARD, MATERIAL_CHECKERBOARD_FADES,
    MATERIAL_EMISSION_TWO_SIDED, MATERIAL_THIN, MaterialRecord, ModelTag, NONE, SceneTables,
};

/// Decides how [`shade`] reads materials: the same for the whole picture.
#[derive(Clone, Copy)]
pub(crate) struct Shading {
    /// See `View::single_scatter`.
    pub single_scatter: bool,
    /// Radius of a pixel's footprint per metre of distance.
    pub pixel_spread: f32,
}

/// Linear base colour at a surface: factor × texture × vertex colour, or the pattern's.
/// `footprint`: radius of the ray's footprint, metres.
#[inline]
pub(crate) fn base_color(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    footprint: f32,
) -> Vec3f {
    let mut color = vec3f(
        material.base_color[0] * s.color[0],
        material.base_color[1] * s.color[1],
        material.base_color[2] * s.color[2],
    );
    if material.flags & MATERIAL_CHECKERBOARD != 0 {
        let p = s.pattern_position.map(|x| x * material.checkerboard_scale);
        let width = footprint_width(footprint, dot(s.wo, s.normal)) * material.checkerboard_scale;
        let [even, odd] = material.checkerboard_colors.map(vec3);
        return even + (odd - even) * checkerboard(vec2f(p[0], p[1]), width);
    }
    if material.base_color_slot != NONE {
        let t = texture::sample(tables, material.base_color_slot, &s.coords);
        color = vec3f(color.x * t[0], color.y * t[1], color.z * t[2]);
    }
    color
}

/// Coverage in `[0, 1]` at a candidate hit, before the mask's cutoff.
pub(crate) fn coverage(
    tables: &SceneTables,
    material: &MaterialRecord,
    (coords, color, position): (crate::surface::TexCoords, [f32; 4], [f32; 2]),
) -> f32 {
    let mut alpha = 1.0;
    if material.flags & (MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND) != 0 {
        alpha = material.base_color[3] * color[3];
        if material.base_color_slot != NONE {
            alpha *= texture::sample(tables, material.base_color_slot, &coords)[3];
        }
    }
    if material.flags & MATERIAL_ALPHA_MASK != 0 {
        alpha = if alpha >= material.alpha_cutoff { 1.0 } else { 0.0 };
    }
    if material.flags & MATERIAL_CHECKERBOARD_FADES != 0 {
        let [near, far] = material.checkerboard_fade;
        alpha *= distance_fade(position[0].hypot(position[1]), near, far);
    }
    alpha
}

/// Radiance that the surface emits towards the viewer.
#[inline]
pub(crate) fn emission(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    footprint: f32,
) -> Vec3f {
    if material.model == ModelTag::Unlit {
        return base_color(tables, material, s, footprint);
    }
    if !material.is_emissive() || !(s.front || material.flags & MATERIAL_EMISSION_TWO_SIDED != 0) {
        return vec3f(0.0, 0.0, 0.0);
    }
    emission_at(tables, material, &s.coords)
}

/// Radiance that an emissive material emits where the texture coordinates are `coords`.
pub(crate) fn emission_at(
    tables: &SceneTables,
    material: &MaterialRecord,
    coords: &crate::surface::TexCoords,
) -> Vec3f {
    let e = vec3(material.emission);
    if material.emission_slot == NONE {
        return e;
    }
    let t = texture::sample(tables, material.emission_slot, coords);
    vec3f(e.x * t[0], e.y * t[1], e.z * t[2])
}

/// Whether [`shade`] needs `u_mix`.
#[inline]
pub(crate) fn mixes_models(material: &MaterialRecord) -> bool {
    material.transmission > 0.0
}

/// The BSDF at a surface, prepared for its viewing direction.
///
/// `u_mix`: uniform number that chooses between refraction and diffuse reflection where a material mixes them.
#[inline(always)]
pub(crate) fn shade(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    shading: &Shading,
    footprint: f32,
    u_mix: f32,
) -> Bsdf {
    let color = base_color(tables, material, s, footprint);
    match material.model {
        ModelTag::Lambert => lambert_bsdf(color),
        ModelTag::Mirror => mirror_bsdf(color),
        ModelTag::Unlit | ModelTag::Boundary => black_bsdf(),
        ModelTag::Dielectric => {
            let mut roughness = material.roughness;
            if material.metallic_roughness_slot != NONE {
                roughness *= texture::sample(tables, material.metallic_roughness_slot, &s.coords)[1];
            }
            dielectric(material, s, shading, color, roughness)
        }
        // Integrators that do not follow paths show layered surfaces without their layers.
        ModelTag::MetallicRoughness | ModelTag::Layered => {
            let (mut metallic, mut roughness) = (material.metallic, material.roughness);
            if material.metallic_roughness_slot != NONE {
                let t = texture::sample(tables, material.metallic_roughness_slot, &s.coords);
                roughness *= t[1];
                metallic *= t[2];
            }
            let mut transmission = material.transmission;
            if material.transmission_slot != NONE {
                transmission *= texture::sample(tables, material.transmission_slot, &s.coords)[0];
            }
            if u_mix < transmission * (1.0 - metallic) {
                return dielectric(material, s, shading, color, roughness);
            }
            // What is not refracted: the metal, and the rest of the dielectric.
            let metallic = metallic / (1.0 - transmission * (1.0 - metallic)).max(1e-6);
            let cos_o = dot(s.wo, s.shading_normal).clamp(0.0, 1.0);
            let m = MetallicRoughness {
                base_color: color,
                metallic: metallic.clamp(0.0, 1.0),
                roughness: roughness.clamp(0.0, 1.0),
                specular: material.specular,
                ior: material.ior,
            };
            let albedo = GgxAlbedo::shared().lookup(cos_o, m.roughness);
            metallic_roughness_bsdf(m, albedo, shading.single_scatter)
        }
    }
}

fn dielectric(
    material: &MaterialRecord,
    s: &Surface,
    shading: &Shading,
    tint: Vec3f,
    roughness: f32,
) -> Bsdf {
    let thin = material.flags & MATERIAL_THIN != 0;
    let eta = if s.front || thin { material.ior } else { 1.0 / material.ior };
    let alpha = roughness * roughness;
    let mut compensation = 1.0;
    if alpha >= MIN_ALPHA && !shading.single_scatter {
        let cos_o = dot(s.wo, s.shading_normal).clamp(0.0, 1.0);
        compensation = if thin {
            sheet_compensation(GgxAlbedo::shared().lookup(cos_o, roughness))
        } else {
            DielectricAlbedo::shared().compensation(cos_o, alpha, eta)
        };
    }
    dielectric_bsdf(tint, alpha, eta, thin, compensation)
}
