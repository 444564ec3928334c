//! What a material is at a surface: fetches texels and table entries for the optics' `material` and `plain`.

use crate::fetch::surface::Surface;
use crate::fetch::texture;
use optics::albedo::{DielectricAlbedo, GgxAlbedo};
use optics::material::{
    SLOT_BASE_COLOR, SLOT_EMISSION, SLOT_METALLIC_ROUGHNESS, SLOT_TRANSMISSION, material_base_color,
    material_coverage, material_emission, material_emits, material_reads_alpha,
};
use optics::pattern::footprint_width;
use optics::plain::{ALBEDO_DIELECTRIC, ALBEDO_GGX, material_mixes_models, plain_bsdf, plain_point};
use optics::scatter::Bsdf;
use optics::texture_point::TexturePoint;
use optics::vector::dot;
use optics::{Vec3f, vec2f, vec3f};
use scene::tables::{MaterialRecord, ModelTag, SceneTables};

/// Decides how [`shade`] reads materials: the same for the whole picture.
#[derive(Clone, Copy)]
pub(crate) struct Shading {
    /// See `View::single_scatter`.
    pub single_scatter: bool,
    /// Radius of a pixel's footprint per metre of distance.
    pub pixel_spread: f32,
}

/// Linear base colour at a surface. `footprint`: radius of the ray's footprint, metres.
#[inline]
pub(crate) fn base_color(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    footprint: f32,
) -> Vec3f {
    let width = footprint_width(footprint, dot(s.wo, s.normal));
    let texel =
        texture::sample(tables, material.texture(SLOT_BASE_COLOR), s.coords, || s.texture_point(width));
    let pattern_position = vec2f(s.object_position.x, s.object_position.z);
    material_base_color(*material, s.color, texel, pattern_position, width)
}

/// Coverage in `[0, 1]` at a candidate hit. Inlined: most of the point is not asked for.
#[inline(always)]
pub(crate) fn coverage(tables: &SceneTables, material: &MaterialRecord, point: &TexturePoint) -> f32 {
    let mut texel_alpha = 1.0;
    if material_reads_alpha(*material) {
        texel_alpha = texture::sample(tables, material.texture(SLOT_BASE_COLOR), point.coords, || *point).w;
    }
    material_coverage(*material, point.color.w, texel_alpha, vec2f(point.position.x, point.position.z))
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
    if !material_emits(*material, s.front) {
        return vec3f(0.0, 0.0, 0.0);
    }
    // A light's samples have no footprint either.
    emission_at(tables, material, &s.texture_point(0.0))
}

/// Radiance that an emissive material emits at a point.
pub(crate) fn emission_at(tables: &SceneTables, material: &MaterialRecord, point: &TexturePoint) -> Vec3f {
    let texel = texture::sample(tables, material.texture(SLOT_EMISSION), point.coords, || *point);
    material_emission(*material, texel)
}

/// Whether [`shade`] needs `u_model`.
#[inline]
pub(crate) fn mixes_models(material: &MaterialRecord) -> bool {
    material_mixes_models(*material)
}

/// The BSDF at a surface, prepared for its viewing direction; without layers.
///
/// - `ior`: of what is behind the surface over what is around it: the material's own but between nested bodies.
/// - `u_model`: uniform number that chooses between refraction and reflection where a material mixes them.
#[inline(always)]
pub(crate) fn shade(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    shading: &Shading,
    footprint: f32,
    ior: f32,
    u_model: f32,
) -> Bsdf {
    let width = || footprint_width(footprint, dot(s.wo, s.normal));
    let point = || s.texture_point(width());
    let texel = |slot| texture::sample(tables, material.texture(slot), s.coords, point);
    let point = plain_point(
        *material,
        base_color(tables, material, s, footprint),
        texel(SLOT_METALLIC_ROUGHNESS),
        texel(SLOT_TRANSMISSION),
        ior,
        s.front,
        u_model,
        shading.single_scatter,
    );
    let cos_o = || dot(s.wo, s.shading_normal).clamp(0.0, 1.0);
    let albedo = match point.albedo_table {
        ALBEDO_GGX => GgxAlbedo::shared().lookup(cos_o(), point.roughness),
        ALBEDO_DIELECTRIC => {
            let alpha = point.roughness * point.roughness;
            vec2f(DielectricAlbedo::shared().lookup(cos_o(), alpha, point.eta), 0.0)
        }
        _ => vec2f(1.0, 0.0),
    };
    plain_bsdf(point, albedo, shading.single_scatter)
}
