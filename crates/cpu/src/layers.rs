//! From a layered material and a surface to lobes that are ready for its viewing direction.

use crate::material::{Shading, base_color};
use crate::scene::vec3;
use crate::surface::Surface;
use crate::texture;
use optics::albedo::{DielectricAlbedo, GgxAlbedo, SheenAlbedo};
use optics::frame::{Frame, bend_normal, frame_from_tangent, map_normal, to_local};
use optics::layered::{
    Layered, LayeredAlbedos, LayeredParameters, anisotropy_axis, choose_dispersed, layered_bsdf,
};
use optics::{Vec3f, vec2f, vec3f};
use scene::tables::{
    LAYERS_GLOSSINESS, LayerSlot, LayersRecord, MATERIAL_THIN, MaterialRecord, NONE, SceneTables,
};

/// A layered surface, prepared for its viewing direction.
pub(crate) struct LayeredSurface {
    /// The lobes, in `frame`.
    pub bsdf: Layered,
    /// The shading frame; its X is the direction of anisotropy.
    pub frame: Frame,
}

/// The lobes at a surface.
///
/// - `footprint`: radius of the ray's footprint, metres. `throughput`: of the path, which decides what colour it is
///   refracted as. `u_dispersion`: uniform number for that choice.
///
/// Out of line: plain surfaces pay nothing for it.
#[inline(never)]
pub(crate) fn shade_layered(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    shading: &Shading,
    footprint: f32,
    throughput: Vec3f,
    u_dispersion: f32,
) -> LayeredSurface {
    let layers = &tables.layers[material.layers as usize];
    let texel = |slot: LayerSlot| sample(tables, layers.slot(slot), s);
    let color = |factor: [f32; 3], t: [f32; 4]| vec3(factor) * vec3f(t[0], t[1], t[2]);

    let metallic_roughness = sample(tables, material.metallic_roughness_slot, s);
    let specular_color = texel(LayerSlot::SpecularColor);
    let roughness = if layers.flags & LAYERS_GLOSSINESS != 0 {
        1.0 - (1.0 - material.roughness) * specular_color[3]
    } else {
        material.roughness * metallic_roughness[1]
    };
    let thin = material.flags & MATERIAL_THIN != 0;
    let transmission = material.transmission * sample(tables, material.transmission_slot, s)[0];
    let inside = !s.front && !thin && transmission > 0.0;
    let dispersed = choose_dispersed(layers.dispersion, material.ior, throughput, u_dispersion);

    let grain = match layers.slot(LayerSlot::Anisotropy) {
        NONE => [1.0, 0.5, 1.0, 1.0],
        slot => texture::sample(tables, slot, &s.coords),
    };
    let [cos, sin] = layers.anisotropy_direction;
    let axis = anisotropy_axis(s.layer_frame, vec2f(cos, sin), vec2f(grain[0], grain[1]));
    let frame = frame_from_tangent(s.shading_normal, axis);
    let wo = to_local(frame, s.wo);
    let coat_normal = coat_normal(tables, layers, s);
    let thickness = texel(LayerSlot::FilmThickness)[1];
    let [least, most] = layers.film_thickness;

    let m = LayeredParameters {
        base_color: base_color(tables, material, s, footprint),
        metallic: (material.metallic * metallic_roughness[2]).clamp(0.0, 1.0),
        roughness: roughness.clamp(0.0, 1.0),
        specular: material.specular * texel(LayerSlot::Specular)[3],
        specular_color: color(layers.specular_color, specular_color),
        ior: layers.reflectance_ior,
        anisotropy: layers.anisotropy * grain[2],
        transmission,
        diffuse_transmission: layers.diffuse_transmission * texel(LayerSlot::DiffuseTransmission)[3],
        diffuse_transmission_color: color(
            layers.diffuse_transmission_color,
            texel(LayerSlot::DiffuseTransmissionColor),
        ),
        sheen_color: color(layers.sheen_color, texel(LayerSlot::SheenColor)),
        sheen_roughness: layers.sheen_roughness * texel(LayerSlot::SheenRoughness)[3],
        coat: layers.coat * texel(LayerSlot::Coat)[0],
        coat_roughness: (layers.coat_roughness * texel(LayerSlot::CoatRoughness)[1]).clamp(0.0, 1.0),
        coat_normal: to_local(frame, coat_normal),
        iridescence: layers.iridescence * texel(LayerSlot::Iridescence)[0],
        film_ior: layers.film_ior,
        film_thickness: least + (most - least) * thickness,
        eta: if inside { 1.0 / dispersed.ior } else { dispersed.ior },
        thin,
        inside,
    };
    let e = albedos(&m, wo);
    LayeredSurface { bsdf: layered_bsdf(m, e, wo, dispersed.tint, shading.single_scatter), frame }
}

fn sample(tables: &SceneTables, slot: u32, s: &Surface) -> [f32; 4] {
    if slot == NONE { [1.0; 4] } else { texture::sample(tables, slot, &s.coords) }
}

/// The coat's unit normal: of its own map, or without one.
fn coat_normal(tables: &SceneTables, layers: &LayersRecord, s: &Surface) -> Vec3f {
    let slot = layers.slot(LayerSlot::CoatNormal);
    if slot == NONE {
        return s.layer_frame.normal;
    }
    let t = texture::sample(tables, slot, &s.coords);
    let mapped = map_normal(s.layer_frame, vec3f(t[0], t[1], t[2]), layers.coat_normal_scale);
    bend_normal(s.wo, s.normal, mapped)
}

/// Directional albedos of the lobes that are there.
fn albedos(m: &LayeredParameters, wo: Vec3f) -> LayeredAlbedos {
    let cos_o = wo.z.clamp(0.0, 1.0);
    let cos_coat = optics::vector::dot(m.coat_normal, wo).clamp(0.0, 1.0);
    let ggx = GgxAlbedo::shared();
    let has_sheen = m.sheen_color.x + m.sheen_color.y + m.sheen_color.z > 0.0;
    let refracts = m.transmission > 0.0 && !m.thin;
    let alpha = m.roughness * m.roughness;
    LayeredAlbedos {
        base: ggx.lookup(cos_o, m.roughness),
        coat: if m.coat > 0.0 { ggx.lookup(cos_coat, m.coat_roughness) } else { vec2f(1.0, 0.0) },
        sheen: if has_sheen { SheenAlbedo::shared().lookup(cos_o, m.sheen_roughness) } else { 0.0 },
        whole_interface: if refracts { DielectricAlbedo::shared().lookup(cos_o, alpha, m.eta) } else { 1.0 },
    }
}
