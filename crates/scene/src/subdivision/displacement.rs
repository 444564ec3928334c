//! Displacement: points of a surface are moved by the value that a texture has there.

use super::description::{Displacement, DisplacementSpace};
use super::level::Level;
use crate::texture_graph::{Program, evaluate};
use crate::{ColorSpace, Filter, Image, ImageTexture, Scene, Texture, TextureRef, Wrap};
use glam::{Affine3A, Vec2, Vec3, Vec4};
use optics::image_texture::{WRAP_CLAMP, WRAP_MIRRORED_REPEAT, WRAP_REPEAT, wrap_texel};
use optics::texture_point::{TexturePoint, texture_point_at};
use optics::tonemap::srgb_decode_channel;
use optics::{Vec3f, Vec4f, vec3f, vec4f};

/// A place on a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Both sets of texture coordinates.
    pub uvs: [Vec2; 2],
    /// Linear vertex colour.
    pub color: Vec4,
    /// Unit vector in which u grows along the surface, zero where nothing is known of it; and ±1, by the side on which v
    /// grows.
    pub tangent: (Vec3, f32),
}

/// What evaluates a displacement.
pub(super) struct Displacer<'a> {
    scene: &'a Scene,
    displacement: Displacement,
    program: Option<Program>,
    to_world: Affine3A,
    /// Units of the object per metre.
    density: f32,
}

impl<'a> Displacer<'a> {
    /// The displacement of a mesh that stands in the world at `to_world`.
    pub fn new(scene: &'a Scene, displacement: Displacement, to_world: Affine3A) -> Self {
        let to_camera = scene.cameras.first().map_or(Affine3A::IDENTITY, |camera| camera.world_to_camera());
        let program = match scene.textures.get(displacement.texture.texture as usize) {
            Some(Texture::Graph(graph)) => Program::new(graph, to_camera).ok(),
            _ => None,
        };
        let volume = to_world.matrix3.determinant().abs();
        let density = if volume > 0.0 { 1.0 / elementary::pow(volume, 1.0 / 3.0) } else { 1.0 };
        Self { scene, displacement, program, to_world, density }
    }

    /// How far a point is moved, in the space of the object. Zero where the value is not finite.
    pub fn offset(&self, point: &SurfacePoint) -> Vec3 {
        let Displacement { scale, midlevel, space, .. } = self.displacement;
        let value = (self.value(point).truncate() - midlevel) * scale;
        let offset = match space {
            DisplacementSpace::Normal => point.normal * value.x,
            DisplacementSpace::Object => value,
            DisplacementSpace::Tangent => {
                let (tangent, side) = point.tangent;
                let across = point.normal.cross(tangent) * side;
                tangent * value.x + across * value.y + point.normal * value.z
            }
        };
        if offset.is_finite() { offset } else { Vec3::ZERO }
    }

    fn value(&self, point: &SurfacePoint) -> Vec4 {
        let Some(program) = &self.program else {
            return self.image(&self.displacement.texture, point.uvs);
        };
        let ([u0, v0], [u1, v1]) = (point.uvs[0].to_array(), point.uvs[1].to_array());
        let vector = |v: Vec3| vec3f(v.x, v.y, v.z);
        let [r, g, b, a] = point.color.to_array();
        let texture_point = TexturePoint {
            position: vector(point.position),
            world: Vec3f::from_array(self.to_world.transform_point3(point.position).to_array()),
            object_density: self.density,
            normal: vector(point.normal),
            ..texture_point_at(vec4f(u0, v0, u1, v1), vec4f(r, g, b, a))
        };
        let image = |number: u32, coords: Vec4f| {
            let [u0, v0, u1, v1] = coords.to_array();
            let shown = program.images.get(number as usize);
            let uvs = [Vec2::new(u0, v0), Vec2::new(u1, v1)];
            Vec4f::from_array(shown.map_or(Vec4::ONE, |shown| self.image(shown, uvs)).to_array())
        };
        Vec4::from_array(evaluate(&program.nodes, &texture_point, image, false).to_array())
    }

    fn image(&self, shown: &TextureRef, uvs: [Vec2; 2]) -> Vec4 {
        let texture = self.scene.textures.get(shown.texture as usize).and_then(Texture::as_image);
        let Some(texture) = texture else { return Vec4::ONE };
        let Some(image) = self.scene.images.get(texture.image as usize) else { return Vec4::ONE };
        texel_mean(texture, image, shown.transform.apply(uvs[usize::from(shown.uv_set != 0)]))
    }
}

impl Level {
    /// The direction in which u grows around a vertex, on the side of a seam whose texture coordinates have a number; and
    /// whether v grows to the left of it (1) or to the right (−1).
    pub fn tangent(&self, ring: &[u32], id: u32, normal: Vec3) -> (Vec3, f32) {
        let Some(uv) = &self.uvs[0] else { return (Vec3::ZERO, 1.0) };
        let (mut along, mut across) = (Vec3::ZERO, Vec3::ZERO);
        for corner in ring.iter().filter(|c| uv.id(**c) == id) {
            let (next, before) = (self.next(*corner), self.previous(*corner));
            let [own, a, b] = [*corner, next, before].map(|c| self.position.at(c));
            let [own_uv, a_uv, b_uv] = [*corner, next, before].map(|c| uv.at(c));
            let (e, f) = (a - own, b - own);
            let (s, t) = (a_uv + own_uv * -1.0, b_uv + own_uv * -1.0);
            let area = s.perp_dot(t).signum();
            along += (e * t.y - f * s.y) * area;
            across += (f * s.x - e * t.x) * area;
        }
        let tangent = (along - normal * normal.dot(along)).normalize_or_zero();
        let side = if normal.cross(tangent).dot(across) < 0.0 { -1.0 } else { 1.0 };
        (tangent, side)
    }
}

/// The value of an image at texture coordinates, filtered as back ends do it.
fn texel_mean(texture: &ImageTexture, image: &Image, uv: Vec2) -> Vec4 {
    let size = Vec2::new(image.width as f32, image.height as f32);
    if !uv.is_finite() || image.pixels.is_empty() {
        return Vec4::ONE;
    }
    const FARTHEST: Vec2 = Vec2::splat(1e9);
    let place = (uv * size).clamp(-FARTHEST, FARTHEST);
    let mode = |wrap: Wrap| match wrap {
        Wrap::Repeat => WRAP_REPEAT,
        Wrap::MirroredRepeat => WRAP_MIRRORED_REPEAT,
        Wrap::ClampToEdge => WRAP_CLAMP,
    };
    let texel = |x: i32, y: i32| {
        let column = wrap_texel(x, image.width, mode(texture.sampler.wrap_u));
        let row = wrap_texel(y, image.height, mode(texture.sampler.wrap_v));
        let index = row as usize * image.width as usize + column as usize;
        if index >= image.pixels.len() {
            return Vec4::ONE;
        }
        let [r, g, b, a] = image.pixels.stored(index);
        if image.pixels.is_float() || texture.color_space == ColorSpace::Linear {
            return Vec4::new(r, g, b, a);
        }
        Vec3::from_array([r, g, b].map(srgb_decode_channel)).extend(a)
    };
    if texture.sampler.filter == Filter::Nearest {
        return texel(place.x.floor() as i32, place.y.floor() as i32);
    }
    let corner = (place - 0.5).floor();
    let share = place - 0.5 - corner;
    let (x, y) = (corner.x as i32, corner.y as i32);
    let above = texel(x, y).lerp(texel(x + 1, y), share.x);
    let below = texel(x, y + 1).lerp(texel(x + 1, y + 1), share.x);
    above.lerp(below, share.y)
}
