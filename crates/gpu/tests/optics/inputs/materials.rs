//! Materials, their textures and layers, and what they become at a point.

use super::*;
use optics::bsdf::bsdf_sample;
use optics::closure::{Closure, layered_closure, plain_closure};
use optics::constants::NONE;
use optics::dielectric::dielectric_bsdf;
use optics::frame::frame_from_normal;
use optics::glossy::{MetallicRoughness, lambert_bsdf, metallic_roughness_bsdf, mirror_bsdf};
use optics::image_texture::{TexelFootprint, TextureUse};
use optics::layered::{Layered, LayeredAlbedos, LayeredParameters, layered_bsdf};
use optics::layers::{LayerTexels, LayeredPoint, LayersRecord, SurfaceDirections};
use optics::material::{MaterialRecord, ModelTag};
use optics::oren_nayar::RoughDiffuse;
use optics::plain::PlainPoint;
use optics::scatter::{Bsdf, BsdfSample, BsdfValue, black_bsdf};
use optics::sheen::MIN_SHEEN_ALPHA;
use optics::{Vec2f, Vec3f, Vec4f, vec2f, vec3f, vec4f};

pub fn material(i: &mut Inputs) -> MetallicRoughness {
    MetallicRoughness {
        base_color: albedo(i),
        metallic: share(i),
        roughness: share(i),
        specular: share(i),
        ior: ior(i),
    }
}

/// GGX widths along two directions.
pub fn widths(i: &mut Inputs) -> Vec2f {
    vec2f(alpha(i), alpha(i))
}

/// Width of a sheen.
pub fn sheen_width(i: &mut Inputs) -> f32 {
    i.edge(&[MIN_SHEEN_ALPHA, 1.0]).unwrap_or_else(|| i.between(0.05, 1.0))
}

/// Nanometres.
pub fn path_difference(i: &mut Inputs) -> f32 {
    i.edge(&[0.0]).unwrap_or_else(|| i.between(0.0, 4000.0))
}

/// Half turns.
pub fn phases(i: &mut Inputs) -> Vec3f {
    let mut phase = || i.below(3) as f32;
    vec3f(phase(), phase(), phase())
}

/// Nanometres.
pub fn film_thickness(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 0.01, 400.0]).unwrap_or_else(|| i.between(0.0, 1000.0))
}

/// A unit vector below the surface of its frame.
pub fn lower(i: &mut Inputs) -> Vec3f {
    let d = upper(i);
    vec3f(d.x, d.y, -d.z)
}

/// A layered material at a point; roughnesses are wide enough for half vectors to be exact.
pub fn layers(i: &mut Inputs) -> LayeredParameters {
    LayeredParameters {
        base_color: albedo(i),
        metallic: share(i),
        roughness: i.between(0.2, 1.0),
        diffuse_roughness: share(i),
        specular: share(i),
        specular_color: albedo(i),
        ior: i.edge(&[0.0]).unwrap_or_else(|| i.between(1.0, 2.5)),
        anisotropy: share(i),
        transmission: share(i),
        diffuse_transmission: share(i),
        diffuse_transmission_color: albedo(i),
        sheen_color: albedo(i),
        sheen_roughness: i.between(0.2, 1.0),
        coat: share(i),
        coat_roughness: i.between(0.2, 1.0),
        coat_normal: i.edge(&[vec3f(0.0, 0.0, 1.0)]).unwrap_or_else(|| vec3f(0.28, 0.0, 0.96)),
        iridescence: share(i),
        film_ior: ior(i),
        film_thickness: film_thickness(i),
        eta: eta(i),
        thin: flag(i),
        inside: flag(i),
    }
}

/// An RGBA texel or vertex colour.
pub fn texel4(i: &mut Inputs) -> Vec4f {
    let edges = [vec4f(1.0, 1.0, 1.0, 1.0), vec4f(0.0, 0.0, 0.0, 0.0)];
    i.edge(&edges).unwrap_or_else(|| vec4f(i.uniform(), i.uniform(), i.uniform(), i.uniform()))
}

/// The bytes of two half floats as fractions of 255; none is infinite, no number, or too small to be normal.
pub fn half_bytes(i: &mut Inputs) -> Vec4f {
    let mut half = || {
        let (low, high) = (i.below(256) as f32, (4 + i.below(0x78)) as f32);
        (low / 255.0, high / 255.0)
    };
    let ((a, b), (c, d)) = (half(), half());
    vec4f(a, b, c, d)
}

/// Two pairs of texture coordinates.
pub fn coordinates(i: &mut Inputs) -> Vec4f {
    let edges = [vec4f(0.0, 0.0, 1.0, 1.0), vec4f(f32::NAN, 0.0, 1e20, 0.5)];
    let mut coordinate = || i.between(-3.0, 3.0);
    let any = vec4f(coordinate(), coordinate(), coordinate(), coordinate());
    i.edge(&edges).unwrap_or(any)
}

/// A texel's number before wrapping.
pub fn texel_index(i: &mut Inputs) -> i32 {
    i.below(400) as i32 - 200
}

pub fn texture_use(i: &mut Inputs) -> TextureUse {
    // Every wrap mode, filter, encoding and set of coordinates.
    let modes = (i.below(3) << 4) as u32 | (i.below(3) << 6) as u32;
    let flags = i.below(16) as u32 | modes | (i.below(2) << 8) as u32;
    let mut row = || vec3f(i.between(-2.0, 2.0), i.between(-2.0, 2.0), i.between(-1.0, 1.0));
    let (row_u, row_v) = (row(), row());
    let first_texel = i.edge(&[NONE, 0]).unwrap_or_else(|| index(i));
    let (width, height) = (1 + i.below(64) as u32, 1 + i.below(64) as u32);
    TextureUse { row_u, first_texel, row_v, flags, width, height, image: index(i), padding: 0 }
}

/// A use of an image: only its texels have places.
pub fn placed_texture(i: &mut Inputs) -> TextureUse {
    TextureUse { first_texel: index(i), ..texture_use(i) }
}

pub fn texel_footprint(i: &mut Inputs) -> TexelFootprint {
    let (x, y) = (texel_index(i), texel_index(i));
    TexelFootprint { x, y, right: i.uniform(), below: i.uniform(), bilinear: flag(i) }
}

pub fn model(i: &mut Inputs) -> ModelTag {
    let models = [
        ModelTag::MetallicRoughness,
        ModelTag::Lambert,
        ModelTag::Dielectric,
        ModelTag::Mirror,
        ModelTag::Unlit,
        ModelTag::Layered,
        ModelTag::Boundary,
    ];
    models[i.below(models.len() as u64) as usize]
}

pub fn material_record(i: &mut Inputs) -> MaterialRecord {
    MaterialRecord {
        base_color: texel4(i),
        emission: radiance(i),
        model: model(i),
        metallic: share(i),
        roughness: share(i),
        specular: share(i),
        ior: ior(i),
        transmission: share(i),
        normal_scale: share(i),
        alpha_cutoff: share(i),
        flags: i.below(4096) as u32,
        checkerboard_even: albedo(i),
        checkerboard_scale: size(i),
        checkerboard_odd: albedo(i),
        tangent_turn: i.between(-1.0, 1.0),
        checkerboard_fade: vec2f(size(i), size(i)),
        medium: body_or_none(i),
        priority: priority(i),
        absorption: coefficients(i),
        layers: body_or_none(i),
        textures: [0; 5].map(|_: u32| texture_use(i)),
    }
}

pub fn plain_point(i: &mut Inputs) -> PlainPoint {
    PlainPoint {
        model: model(i),
        base_color: albedo(i),
        metallic: share(i),
        roughness: share(i),
        specular: share(i),
        ior: ior(i),
        eta: eta(i),
        thin: flag(i),
        albedo_table: axis(i),
    }
}

pub fn layers_record(i: &mut Inputs) -> LayersRecord {
    let turn = i.between(0.0, 6.0);
    LayersRecord {
        specular_color: albedo(i),
        reflectance_ior: i.edge(&[0.0]).unwrap_or_else(|| ior(i)),
        sheen_color: albedo(i),
        sheen_roughness: share(i),
        diffuse_transmission_color: albedo(i),
        diffuse_transmission: share(i),
        film_thickness: vec2f(film_thickness(i), film_thickness(i)),
        anisotropy_direction: vec2f(turn.cos(), turn.sin()),
        anisotropy: share(i),
        coat: share(i),
        coat_roughness: share(i),
        coat_normal_scale: share(i),
        dispersion: size(i),
        iridescence: share(i),
        film_ior: ior(i),
        diffuse_roughness: share(i),
        flags: i.below(8) as u32,
        padding0: 0,
        padding1: 0,
        padding2: 0,
    }
}

pub fn layer_texels(i: &mut Inputs) -> LayerTexels {
    LayerTexels {
        layers: [0; 12].map(|_: u32| texel4(i)),
        metallic_roughness: texel4(i),
        transmission: texel4(i),
    }
}

/// Directions at a point whose normals are on the viewer's side.
pub fn surface_directions(i: &mut Inputs) -> SurfaceDirections {
    let normal = direction(i);
    let local = frame_from_normal(normal);
    let mut above = || {
        let d = upper(i);
        local.tangent * d.x + local.bitangent * d.y + local.normal * d.z
    };
    let (wo, shading_normal, smooth_normal) = (above(), above(), above());
    SurfaceDirections { wo, normal, shading_normal, layer_frame: frame_from_normal(smooth_normal) }
}

pub fn layered_point(i: &mut Inputs) -> LayeredPoint {
    LayeredPoint { frame: frame(i), wo: upper(i), parameters: layers(i), refraction_tint: albedo(i) }
}

pub fn rough_diffuse(i: &mut Inputs) -> RoughDiffuse {
    optics::oren_nayar::rough_diffuse(albedo(i), share(i), cosine(i))
}

pub fn layer_albedos(i: &mut Inputs) -> LayeredAlbedos {
    LayeredAlbedos {
        base: ggx_albedo(i),
        coat: ggx_albedo(i),
        sheen: i.between(0.0, 1.1),
        whole_interface: i.between(0.5, 1.0),
    }
}

/// A prepared surface with layers.
pub fn layered(i: &mut Inputs) -> Layered {
    layered_bsdf(layers(i), layer_albedos(i), upper(i), albedo(i), flag(i))
}

/// A pair as the albedo table holds them.
pub fn ggx_albedo(i: &mut Inputs) -> Vec2f {
    vec2f(i.between(0.3, 0.95), i.between(0.01, 0.2))
}

pub fn glossy(i: &mut Inputs) -> Bsdf {
    metallic_roughness_bsdf(material(i), ggx_albedo(i), flag(i))
}

pub fn smooth_dielectric(i: &mut Inputs) -> Bsdf {
    dielectric_bsdf(albedo(i), 0.0, eta(i), false, 1.0)
}

pub fn rough_dielectric(i: &mut Inputs) -> Bsdf {
    dielectric_bsdf(albedo(i), i.between(0.05, 1.0), eta(i), false, i.between(1.0, 1.3))
}

pub fn thin_dielectric(i: &mut Inputs) -> Bsdf {
    dielectric_bsdf(albedo(i), i.between(0.05, 1.0), ior(i), true, i.between(1.0, 1.3))
}

/// Any BSDF.
pub fn bsdf(i: &mut Inputs) -> Bsdf {
    match i.below(7) {
        0 => lambert_bsdf(albedo(i)),
        1 => mirror_bsdf(albedo(i)),
        2 => smooth_dielectric(i),
        3 => rough_dielectric(i),
        4 => thin_dielectric(i),
        5 => black_bsdf(),
        _ => glossy(i),
    }
}

/// Any surface, with layers or without.
pub fn closure(i: &mut Inputs) -> Closure {
    if flag(i) { layered_closure(layered(i), frame(i)) } else { plain_closure(bsdf(i), direction(i)) }
}

pub fn bsdf_value(i: &mut Inputs) -> BsdfValue {
    BsdfValue { value_cos: albedo(i), pdf: density(i) }
}

pub fn scattered(i: &mut Inputs) -> BsdfSample {
    bsdf_sample(bsdf(i), upper(i), i.uniform(), vec2f(i.uniform(), i.uniform()))
}
