//! Random inputs with edge cases: what a function's arguments are drawn from. `list.rs` names these functions.

use optics::bsdf::*;
use optics::camera::CameraFrame;
use optics::constants::NONE;
use optics::dielectric::dielectric_bsdf;
use optics::distortion::Distortion;
use optics::estimator::Moments;
use optics::frame::{Frame, frame_from_normal};
use optics::ggx::MIN_ALPHA;
use optics::glossy::{MetallicRoughness, lambert_bsdf, metallic_roughness_bsdf, mirror_bsdf};
use optics::image_texture::{TexelFootprint, TextureUse};
use optics::interiors::{Interiors, Surroundings, interiors_enter, interiors_nothing};
use optics::intersect::{RayShear, ray_shear};
use optics::layered::{Layered, LayeredAlbedos, LayeredParameters, layered_bsdf};
use optics::layers::{LayerTexels, LayeredPoint, LayersRecord, SurfaceDirections};
use optics::light::{LIGHT_RECTANGLE, Light};
use optics::light_profile::ProfileCell;
use optics::light_tree::{
    ALL_SIDES, ChildChoice, INFINITELY_FAR, LightGroup, NodeImportance, octahedral_encode,
};
use optics::material::{MaterialRecord, ModelTag};
use optics::path::PathState;
use optics::plain::PlainPoint;
use optics::random::PixelSampler;
use optics::reservoir::Reservoir;
use optics::scatter::{Bsdf, BsdfSample, BsdfValue, black_bsdf};
use optics::sheen::MIN_SHEEN_ALPHA;
use optics::spherical_rectangle::{SphericalRectangle, spherical_rectangle_new};
use optics::spherical_triangle::{SphericalTriangle, spherical_triangle_new};
use optics::vector::cross;
use optics::volume::Medium;
use optics::{Vec2f, Vec3f, Vec4f, vec2f, vec3f, vec4f};
use testkit::Random;

/// One in so many numbers is an edge case.
const EDGE_SHARE: u64 = 4;

/// Where inputs come from: the same ones in every run.
pub struct Inputs(Random);

impl Inputs {
    /// Inputs for the function called `name`.
    pub fn new(name: &str) -> Self {
        let seed = name
            .bytes()
            .fold(1469598103934665603, |h: u64, b| (h ^ u64::from(b)).wrapping_mul(1099511628211));
        Self(Random::new(seed))
    }

    fn uniform(&mut self) -> f32 {
        self.0.uniform_f32()
    }

    fn below(&mut self, n: u64) -> u64 {
        self.0.bits() % n
    }

    fn edge<T: Copy>(&mut self, edges: &[T]) -> Option<T> {
        let is_edge = self.below(EDGE_SHARE) == 0;
        is_edge.then(|| edges[self.below(edges.len() as u64) as usize])
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.uniform()
    }
}

/// A uniform random number in `[0, 1)`.
pub fn unit(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 0.25, 0.5, 0.75, 1e-10, 0.999_999_94]).unwrap_or_else(|| i.uniform())
}

pub fn unit2(i: &mut Inputs) -> Vec2f {
    vec2f(unit(i), unit(i))
}

/// In `[0, 1]`.
pub fn share(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1.0, 0.5, 1e-6]).unwrap_or_else(|| i.uniform())
}

pub fn share2(i: &mut Inputs) -> Vec2f {
    vec2f(share(i), share(i))
}

/// Any sign and magnitude that a picture has.
pub fn real(i: &mut Inputs) -> f32 {
    let sign = if i.below(2) == 0 { 1.0 } else { -1.0 };
    i.edge(&[0.0, -0.0, 1.0, -1.0, 0.5, 1e4]).unwrap_or_else(|| sign * 10.0_f32.powf(i.between(-5.0, 4.0)))
}

/// As [`real`], and what is no number.
pub fn anything(i: &mut Inputs) -> f32 {
    i.edge(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE])
        .unwrap_or_else(|| real(i))
}

pub fn anything3(i: &mut Inputs) -> Vec3f {
    vec3f(anything(i), anything(i), anything(i))
}

pub fn positive(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1.0, 1e-5, 1e4]).unwrap_or_else(|| 10.0_f32.powf(i.between(-5.0, 4.0)))
}

/// Below zero.
pub fn negative(i: &mut Inputs) -> f32 {
    -size(i)
}

/// Distances and sizes, not zero.
pub fn size(i: &mut Inputs) -> f32 {
    i.edge(&[1.0, 1e-2, 1e2]).unwrap_or_else(|| 10.0_f32.powf(i.between(-2.0, 2.0)))
}

/// A number of turns.
pub fn turns(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 0.25, 0.5, 0.75, 1.0, -0.5]).unwrap_or_else(|| i.between(-2.0, 2.0))
}

/// A cosine of an angle to a surface's normal, in `[0, 1]`.
pub fn cosine(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1.0, 1e-4, 0.5]).unwrap_or_else(|| i.uniform())
}

/// A cosine in `[−1, 1]`.
pub fn signed_cosine(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1.0, -1.0, 1e-4, -1e-4]).unwrap_or_else(|| i.between(-1.0, 1.0))
}

/// 1 − cosine of a cone's half angle.
pub fn one_minus_cos(i: &mut Inputs) -> f32 {
    i.edge(&[1.0, 2.0, 1e-5]).unwrap_or_else(|| 10.0_f32.powf(i.between(-5.0, 0.3)))
}

/// A GGX width.
pub fn alpha(i: &mut Inputs) -> f32 {
    i.edge(&[MIN_ALPHA, 1.0, 0.5, 0.01]).unwrap_or_else(|| i.between(MIN_ALPHA, 1.0))
}

/// Index of refraction of one side relative to the other.
pub fn eta(i: &mut Inputs) -> f32 {
    i.edge(&[1.5, 1.0 / 1.5, 1.01, 2.4]).unwrap_or_else(|| i.between(0.4, 2.5))
}

/// An index of refraction that a material has.
pub fn ior(i: &mut Inputs) -> f32 {
    i.edge(&[1.0, 1.5, 2.4]).unwrap_or_else(|| i.between(1.0, 2.5))
}

pub fn bits(i: &mut Inputs) -> u32 {
    i.edge(&[0, 1, u32::MAX, 0x8000_0000]).unwrap_or_else(|| i.0.bits() as u32)
}

/// A number of entries.
pub fn count(i: &mut Inputs) -> u32 {
    i.edge(&[1, 2, 4096]).unwrap_or_else(|| 1 + i.below(1000) as u32)
}

/// An index that is small.
pub fn index(i: &mut Inputs) -> u32 {
    i.below(64) as u32
}

pub fn axis(i: &mut Inputs) -> u32 {
    i.below(3) as u32
}

pub fn sampler_kind(i: &mut Inputs) -> u32 {
    i.below(3) as u32
}

pub fn tone_mapper(i: &mut Inputs) -> u32 {
    i.below(6) as u32
}

pub fn flag(i: &mut Inputs) -> bool {
    i.below(2) == 0
}

/// A unit vector.
pub fn direction(i: &mut Inputs) -> Vec3f {
    let axes = [
        vec3f(0.0, 0.0, 1.0),
        vec3f(0.0, 0.0, -1.0),
        vec3f(1.0, 0.0, 0.0),
        vec3f(0.0, 1.0, 0.0),
        vec3f(0.0, -1.0, 0.0),
        vec3f(0.6, 0.0, 0.8),
    ];
    i.edge(&axes).unwrap_or_else(|| optics::warp::sample_sphere(vec2f(i.uniform(), i.uniform())))
}

/// A unit vector that has an azimuth around the y axis: at the poles any number will do for it.
pub fn off_pole(i: &mut Inputs) -> Vec3f {
    let d = direction(i);
    if d.y.abs() > 0.9999 { vec3f(0.6, 0.8, 0.0) } else { d }
}

/// A unit vector above the surface of its frame.
pub fn upper(i: &mut Inputs) -> Vec3f {
    let d = direction(i);
    if d.z.abs() < 1e-3 { vec3f(0.0, 0.0, 1.0) } else { vec3f(d.x, d.y, d.z.abs()) }
}

/// 1 or −1: which side of a surface is seen.
pub fn side(i: &mut Inputs) -> f32 {
    if i.below(2) == 0 { 1.0 } else { -1.0 }
}

/// Barycentric weights of a point of a triangle.
pub fn weights(i: &mut Inputs) -> Vec3f {
    let (u, v) = (share(i), share(i));
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    vec3f(1.0 - u - v, u, v)
}

/// A point near the origin.
pub fn point(i: &mut Inputs) -> Vec3f {
    i.edge(&[vec3f(0.0, 0.0, 0.0), vec3f(1.0, 0.0, 0.0), vec3f(-0.5, 0.5, 0.5)])
        .unwrap_or_else(|| vec3f(i.between(-1.0, 1.0), i.between(-1.0, 1.0), i.between(-1.0, 1.0)))
}

/// A point far from the others.
pub fn far_point(i: &mut Inputs) -> Vec3f {
    point(i) + vec3f(3.0, 1.0, -2.0)
}

/// A point on a plane.
pub fn point2(i: &mut Inputs) -> Vec2f {
    vec2f(i.between(-4.0, 4.0), i.between(-4.0, 4.0))
}

/// A reflectance.
pub fn albedo(i: &mut Inputs) -> Vec3f {
    vec3f(share(i), share(i), share(i))
}

/// Radiance.
pub fn radiance(i: &mut Inputs) -> Vec3f {
    vec3f(positive(i), positive(i), positive(i))
}

/// Radiance and what rounding makes of it.
pub fn signed_color(i: &mut Inputs) -> Vec3f {
    vec3f(real(i), real(i), real(i))
}

/// A texel of a normal map, in `[0, 1]`.
pub fn texel(i: &mut Inputs) -> Vec3f {
    i.edge(&[vec3f(0.5, 0.5, 1.0), vec3f(0.0, 0.0, 0.5)])
        .unwrap_or_else(|| vec3f(i.uniform(), i.uniform(), i.uniform()))
}

/// A density over solid angle.
pub fn density(i: &mut Inputs) -> f32 {
    positive(i)
}

pub fn exposure(i: &mut Inputs) -> f32 {
    i.edge(&[1.0, 0.0]).unwrap_or_else(|| i.between(0.1, 4.0))
}

pub fn frame(i: &mut Inputs) -> Frame {
    frame_from_normal(direction(i))
}

pub fn camera(i: &mut Inputs) -> CameraFrame {
    let f = frame(i);
    let lens_radius = i.edge(&[0.0]).unwrap_or_else(|| i.uniform() * 0.1);
    CameraFrame {
        kind: i.below(3) as u32,
        origin: point(i),
        right: f.tangent,
        up: f.bitangent,
        forward: f.normal,
        half_size: vec2f(i.between(0.1, 2.0), i.between(0.1, 2.0)),
        lens_radius,
        focus_distance: size(i),
        distortion: optics::distortion::no_distortion(),
    }
}

/// A lens without folds where it is looked at, of either model.
pub fn distortion(i: &mut Inputs) -> Distortion {
    let skew = i.between(-0.05, 0.05);
    let mut k = || i.between(-0.02, 0.05);
    let k: [f32; 6] = std::array::from_fn(|_| k());
    if i.below(2) == 0 {
        return Distortion::fisheye([k[0], k[1], k[2], k[3]], skew);
    }
    Distortion::brown_conrady(k, [i.between(-0.01, 0.01), i.between(-0.01, 0.01)], skew)
}

/// A place of the film near the axis, in focal lengths.
pub fn film_point(i: &mut Inputs) -> Vec2f {
    vec2f(i.between(-0.5, 0.5), i.between(-0.5, 0.5))
}

/// A direction in front of a camera.
pub fn ahead(i: &mut Inputs) -> Vec3f {
    vec3f(i.between(-0.7, 0.7), i.between(-0.7, 0.7), i.between(0.5, 1.5))
}

/// The shear of a ray's direction.
pub fn shear(i: &mut Inputs) -> RayShear {
    ray_shear(direction(i))
}

pub fn light(i: &mut Inputs) -> Light {
    let (kind, position, edge1, edge2) = (i.below(7) as u32, far_point(i), point(i), point(i));
    Light {
        kind,
        position,
        edge1,
        edge2: if kind == LIGHT_RECTANGLE { cross(edge1, edge2) } else { edge2 },
        emission: radiance(i),
        size: i.between(0.01, 0.5),
        two_sided: flag(i),
    }
}

/// Edges at right angles, the longer one first.
fn edges_of_rectangle(i: &mut Inputs) -> [Vec3f; 2] {
    let (there, a, b) = (frame(i), size(i), size(i));
    [there.tangent * a.max(b), there.bitangent * a.min(b)]
}

/// A light that is a rectangle.
pub fn rectangle(i: &mut Inputs) -> Light {
    let [edge1, edge2] = edges_of_rectangle(i);
    Light { kind: LIGHT_RECTANGLE, edge1, edge2, ..light(i) }
}

/// A triangle that can be sampled by solid angle.
pub fn spherical_triangle(i: &mut Inputs) -> SphericalTriangle {
    loop {
        let seen = spherical_triangle_new(point(i) - point(i), point(i), point(i));
        if seen.solid_angle > 0.0 {
            return seen;
        }
    }
}

/// A rectangle that can be sampled by solid angle.
pub fn spherical_rectangle(i: &mut Inputs) -> SphericalRectangle {
    loop {
        let [edge1, edge2] = edges_of_rectangle(i);
        let seen = spherical_rectangle_new(point(i) - point(i), edge1, edge2);
        if seen.solid_angle > 0.0 {
            return seen;
        }
    }
}

/// Rows of a table of directions.
pub fn rows(i: &mut Inputs) -> u32 {
    2 + i.below(180) as u32
}

/// Columns of a table of directions.
pub fn columns(i: &mut Inputs) -> u32 {
    1 + i.below(72) as u32
}

pub fn profile_cell(i: &mut Inputs) -> ProfileCell {
    let [first, second, third, fourth] = [0; 4].map(|_: u32| i.below(100) as u32);
    ProfileCell { first, second, third, fourth, down: unit(i), across: unit(i) }
}

/// Coefficients of a falloff with distance.
pub fn falloff(i: &mut Inputs) -> Vec3f {
    let physics = vec3f(0.0, 0.0, 1.0);
    let edges = [physics, vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(1.0, 0.09, 0.032)];
    i.edge(&edges).unwrap_or_else(|| vec3f(size(i), size(i), size(i)))
}

/// Candidates, of which there may be none so far.
pub fn reservoir(i: &mut Inputs) -> Reservoir {
    let (chosen, weight, remainder) = (i.below(32) as u32, positive(i), unit(i));
    Reservoir { chosen, weight, sum: weight + positive(i), remainder }
}

pub fn light_group(i: &mut Inputs) -> LightGroup {
    let (center, radius, cos_spread) = (point(i), share(i), signed_cosine(i));
    LightGroup {
        center,
        radius,
        intensity: positive(i),
        axis: direction(i),
        cos_spread,
        sin_spread: (1.0 - cos_spread * cos_spread).max(0.0).sqrt(),
        cos_emission: signed_cosine(i),
        back: [-1.0, 1.0, INFINITELY_FAR][i.below(3) as usize],
    }
}

/// What some children promise together, or none.
pub fn node_importance(i: &mut Inputs) -> NodeImportance {
    let count = i.below(9) as f32;
    NodeImportance { sum: if count > 0.0 { positive(i) } else { 0.0 }, count }
}

pub fn child_choice(i: &mut Inputs) -> ChildChoice {
    let (child, weight, before) = (i.below(8) as u32, positive(i), share(i));
    ChildChoice { child, weight, before, end: before + weight }
}

/// A unit vector, or zero.
pub fn receiver(i: &mut Inputs) -> Vec3f {
    if flag(i) { direction(i) } else { vec3f(0.0, 0.0, 0.0) }
}

/// What a unit vector is encoded as, or nothing.
pub fn octahedral(i: &mut Inputs) -> u32 {
    if flag(i) { octahedral_encode(direction(i)) } else { ALL_SIDES }
}

/// A light infinitely far away: its position is a unit direction, its size 1 − cosine of its half angle.
pub fn sun(i: &mut Inputs) -> Light {
    let size = i.edge(&[0.0, 1.0]).unwrap_or_else(|| 10.0_f32.powf(i.between(-5.0, 0.0)));
    Light { position: direction(i), size, ..light(i) }
}

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
        flags: i.below(8) as u32,
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

pub fn bsdf_value(i: &mut Inputs) -> BsdfValue {
    BsdfValue { value_cos: albedo(i), pdf: density(i) }
}

pub fn scattered(i: &mut Inputs) -> BsdfSample {
    bsdf_sample(bsdf(i), upper(i), i.uniform(), vec2f(i.uniform(), i.uniform()))
}

/// Mean cosines of phase functions.
pub fn anisotropy(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1e-4, -1e-4, 0.5, 0.9, -0.9]).unwrap_or_else(|| i.between(-0.95, 0.95))
}

/// Coefficients of each channel, m⁻¹.
pub fn coefficients(i: &mut Inputs) -> Vec3f {
    vec3f(size(i), size(i), size(i))
}

pub fn medium(i: &mut Inputs) -> Medium {
    Medium {
        absorption: coefficients(i),
        scattering: coefficients(i),
        emission: radiance(i),
        anisotropy: anisotropy(i),
    }
}

/// A material of a body.
pub fn body(i: &mut Inputs) -> u32 {
    i.below(6) as u32
}

pub fn body_or_none(i: &mut Inputs) -> u32 {
    i.edge(&[NONE]).unwrap_or_else(|| body(i))
}

pub fn priority(i: &mut Inputs) -> i32 {
    i.below(5) as i32 - 2
}

/// None to five bodies that were entered, of which four are remembered.
pub fn interiors(i: &mut Inputs) -> Interiors {
    (0..i.below(6)).fold(interiors_nothing(), |inside, _| interiors_enter(inside, body(i), priority(i)))
}

pub fn surroundings(i: &mut Inputs) -> Surroundings {
    Surroundings { around: interiors(i), passed: interiors(i), forgotten: i.below(2) as u32 }
}

pub fn path(i: &mut Inputs) -> PathState {
    PathState {
        throughput: albedo(i),
        radiance: radiance(i),
        pdf: density(i),
        specular: flag(i),
        eta_scale: i.between(0.5, 2.0),
        depth: 1 + i.below(12) as u32,
    }
}

pub fn depth(i: &mut Inputs) -> u32 {
    1 + i.below(12) as u32
}

pub fn moments(i: &mut Inputs) -> Moments {
    let count = i.edge(&[0.0, 1.0, 2.0]).unwrap_or_else(|| (1.0 + i.uniform() * 100.0).floor());
    if count == 0.0 {
        Moments { count, mean: 0.0, m2: 0.0 }
    } else {
        Moments { count, mean: positive(i), m2: positive(i) }
    }
}

pub fn sampler(i: &mut Inputs) -> PixelSampler {
    PixelSampler { kind: sampler_kind(i), scramble: bits(i), index: i.below(1 << 20) as u32 }
}
