//! The lobes of a layered surface: fetches texels and table entries for the optics' `layers`.

use crate::fetch::surface::Surface;
use crate::fetch::texture;
use crate::shade::material::{Shading, base_color};
use optics::Vec3f;
use optics::albedo::{DielectricAlbedo, GgxAlbedo, SheenAlbedo};
use optics::frame::Frame;
use optics::layered::{Layered, LayeredAlbedos, layered_bsdf};
use optics::layers::{
    LayerTexels, LayeredPoint, SurfaceDirections, coat_cosine, has_coat, has_interface, has_sheen,
    layered_point, no_albedos,
};
use optics::material::{SLOT_METALLIC_ROUGHNESS, SLOT_TRANSMISSION};
use optics::pattern::footprint_width;
use optics::vector::dot;
use scene::tables::{MaterialRecord, SceneTables};

/// A layered surface, prepared for its viewing direction.
pub(crate) struct LayeredSurface {
    /// The lobes, in `frame`.
    pub bsdf: Layered,
    /// The shading frame; its X is the direction of anisotropy.
    pub frame: Frame,
}

/// The lobes at a surface.
///
/// - `footprint`: radius of the ray's footprint, metres. `ior`: see [`crate::shade::material::shade`].
/// - `throughput`: of the path, which decides what colour it is refracted as. `u_dispersion`: uniform number for that
///   choice.
///
/// Out of line: plain surfaces pay nothing for it.
#[inline(never)]
#[expect(
    clippy::too_many_arguments,
    reason = "the inputs of one evaluation; a struct would only rename them"
)]
pub(crate) fn shade_layered(
    tables: &SceneTables,
    material: &MaterialRecord,
    s: &Surface,
    shading: &Shading,
    footprint: f32,
    ior: f32,
    throughput: Vec3f,
    u_dispersion: f32,
) -> LayeredSurface {
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
    let point = layered_point(
        *material,
        tables.layers[material.layers as usize],
        directions,
        base_color(tables, material, s, footprint),
        texels,
        ior,
        s.front,
        throughput,
        u_dispersion,
    );
    let (m, tint) = (point.parameters, point.refraction_tint);
    let bsdf = layered_bsdf(m, albedos(&point), point.wo, tint, shading.single_scatter);
    LayeredSurface { bsdf, frame: point.frame }
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
