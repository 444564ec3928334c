//! What scatters at any surface, with layers or without: fetches texels and table entries for the optics' `layers`.

use crate::fetch::surface::Surface;
use crate::fetch::texture;
use crate::shade::material::{Shading, base_color, mixes_models, shade};
use optics::albedo::{DielectricAlbedo, GgxAlbedo, SheenAlbedo};
use optics::closure::{Closure, layered_closure, plain_closure};
use optics::layered::{LayeredAlbedos, layered_bsdf, layered_color};
use optics::layers::{
    LayerTexels, LayeredPoint, SurfaceDirections, coat_cosine, has_coat, has_interface, has_sheen,
    layered_point, no_albedos,
};
use optics::material::{SLOT_METALLIC_ROUGHNESS, SLOT_TRANSMISSION};
use optics::pattern::footprint_width;
use optics::vector::dot;
use optics::{Vec3f, vec3f};
use scene::tables::{MaterialRecord, ModelTag, SceneTables};

/// What of a path decides how it is scattered, beside its direction.
#[derive(Clone, Copy)]
pub(crate) struct Incoming {
    /// Radius of the ray's footprint, metres.
    pub footprint: f32,
    /// Index of refraction of what is behind the surface. See [`crate::shade::material::shade`].
    pub ior: f32,
    /// Throughput of the path, which decides what colour it is refracted as.
    pub throughput: Vec3f,
    /// Uniform number: which of the models that a material mixes, or which colour is refracted.
    pub u_model: f32,
}

/// Whether [`Incoming::u_model`] matters for a material.
pub(crate) fn wants_model_number(tables: &SceneTables, material: &MaterialRecord) -> bool {
    if material.model == ModelTag::Layered {
        return tables.layers[material.layers as usize].dispersion > 0.0;
    }
    mixes_models(material)
}

/// What scatters at a surface, whatever its material is.
pub(crate) fn closure_at(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    shading: &Shading,
    incoming: Incoming,
) -> Closure {
    if material.model == ModelTag::Layered {
        return layers_at(tables, material, s, shading, incoming);
    }
    let Incoming { footprint, ior, u_model, .. } = incoming;
    plain_closure(shade(tables, material, s, shading, footprint, ior, u_model), s.shading_normal)
}

/// The lobes at a surface with layers. Out of line: plain surfaces pay nothing for it.
#[inline(never)]
pub(crate) fn layers_at(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    shading: &Shading,
    incoming: Incoming,
) -> Closure {
    let point = point_at(tables, material, s, incoming);
    let (m, tint) = (point.parameters, point.refraction_tint);
    layered_closure(layered_bsdf(m, albedos(&point), point.wo, tint, shading.single_scatter), point.frame)
}

/// Colour for auxiliary layers: base colour, or that of layers.
pub(crate) fn surface_albedo(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    footprint: f32,
) -> Vec3f {
    if material.model != ModelTag::Layered {
        return base_color(tables, material, s, footprint);
    }
    let throughput = vec3f(1.0, 1.0, 1.0);
    let incoming = Incoming { footprint, ior: material.ior, throughput, u_model: 0.5 };
    let point = point_at(tables, material, s, incoming);
    layered_color(point.parameters, albedos(&point).sheen)
}

/// A material with layers at a surface.
fn point_at(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    incoming: Incoming,
) -> LayeredPoint {
    let Incoming { footprint, ior, throughput, u_model } = incoming;
    let textures = &tables.layer_textures[material.layers as usize];
    let point = || s.texture_point(footprint_width(footprint, dot(s.wo, s.normal)));
    let texel = |texture| texture::sample(tables, texture, s.coords, point);
    let texels = LayerTexels {
        layers: std::array::from_fn(|i| texel(&textures[i])),
        metallic_roughness: texel(material.texture(SLOT_METALLIC_ROUGHNESS)),
        transmission: texel(material.texture(SLOT_TRANSMISSION)),
    };
    let directions = SurfaceDirections {
        wo: s.wo,
        normal: s.normal,
        shading_normal: s.shading_normal,
        layer_frame: s.layer_frame,
    };
    let color = base_color(tables, material, s, footprint);
    let layers = tables.layers[material.layers as usize];
    layered_point(*material, layers, directions, color, texels, ior, s.front, throughput, u_model)
}

/// Directional albedos of the lobes that are there.
fn albedos(p: &LayeredPoint) -> LayeredAlbedos {
    let m = p.parameters;
    let cos_o = p.wo.z.clamp(0.0, 1.0);
    let ggx = GgxAlbedo::shared();
    let mut albedos = LayeredAlbedos { base: ggx.lookup(cos_o, m.roughness), ..no_albedos() };
    if has_coat(m) {
        albedos.coat = ggx.lookup(coat_cosine(*p), m.coat_roughness);
    }
    if has_sheen(m) {
        albedos.sheen = SheenAlbedo::shared().lookup(cos_o, m.sheen_roughness);
    }
    if has_interface(m) {
        let alpha = m.roughness * m.roughness;
        albedos.whole_interface = DielectricAlbedo::shared().lookup(cos_o, alpha, m.eta);
    }
    albedos
}
