//! What lights show that have no surface: the emission of a material that no surface has.

use super::light::strongest;
use super::{LightRecord, SceneTables};
use crate::{Image, LightKind, Material, Pixels, Scene, TextureId, TextureRef};
use glam::Vec3;
use optics::material::SLOT_EMISSION;
use optics::texture_point::texture_point_at;
use optics::vec3f;
use optics::vec4f;

/// Sides of the grid on which the mean of a texture graph is taken.
const MEAN_GRID: u32 = 16;

/// Places on a picture by which its texture is looked up: corners of the unit square at both sets
/// of texture coordinates, and the same as positions in object space; see
/// [`LightRecord::texture_places`].
const UNIT_SQUARE: [f32; 21] = [
    0.0, 0.0, 1.0, 0.0, 0.0, 1.0, //
    0.0, 0.0, 1.0, 0.0, 0.0, 1.0, //
    0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0,
];

impl SceneTables {
    /// The record of a light without a surface, showing its picture if it has one. `scene_radius`:
    /// turns irradiance into power.
    pub(super) fn light_record(&mut self, scene: &Scene, kind: LightKind, scene_radius: f32) -> LightRecord {
        match kind.picture() {
            None => LightRecord::of(kind, scene_radius, 1.0),
            Some(picture) => {
                let aspect = aspect_of_picture(scene, picture.texture);
                self.with_picture(scene, LightRecord::of(kind, scene_radius, aspect), picture)
            }
        }
    }

    /// A light whose samples say where in the unit square they are, showing a texture there.
    /// Textures that are not there show white.
    fn with_picture(&mut self, scene: &Scene, record: LightRecord, picture: TextureRef) -> LightRecord {
        if scene.textures.get(picture.texture as usize).is_none() {
            return record;
        }
        let emission = Vec3::from(record.light.emission.to_array());
        let material = Material { emission, emission_texture: Some(picture), ..Material::default() };
        let textured_material = self.materials.len() as u32;
        self.add_material(&material, &scene.defaults);
        let mean = self.mean_of_picture(scene, picture.texture, textured_material);
        LightRecord {
            textured_material,
            texture_places: UNIT_SQUARE,
            strength: record.strength * mean,
            power: record.power * mean,
            ..record
        }
    }

    /// Mean of the strongest channel. Images in a graph count as white.
    fn mean_of_picture(&self, scene: &Scene, picture: TextureId, material: u32) -> f32 {
        let texture = &scene.textures[picture as usize];
        if let Some(image) = texture.as_image().and_then(|t| scene.images.get(t.image as usize)) {
            return mean_of_image(image);
        }
        let emission = self.materials[material as usize].texture(SLOT_EMISSION);
        let white = vec4f(1.0, 1.0, 1.0, 1.0);
        let at = |i: u32| (i as f32 + 0.5) / MEAN_GRID as f32;
        let value = |i: u32| {
            let (u, v) = (at(i % MEAN_GRID), at(i / MEAN_GRID));
            let mut point = texture_point_at(vec4f(u, v, u, v), white);
            point.position = vec3f(u, v, 0.0);
            let value = self.evaluate_graph(emission, &point, |_, _| white);
            value.x.max(value.y).max(value.z)
        };
        let count = MEAN_GRID * MEAN_GRID;
        ((0..count).map(value).sum::<f32>() / count as f32).max(1e-3)
    }
}

/// Width over height of a picture; a graph is square.
fn aspect_of_picture(scene: &Scene, picture: TextureId) -> f32 {
    let texture = scene.textures.get(picture as usize).and_then(|t| t.as_image());
    let image = texture.and_then(|t| scene.images.get(t.image as usize));
    image.map_or(1.0, |image| image.width.max(1) as f32 / image.height.max(1) as f32)
}

/// Mean of the strongest channel; never zero: a dim texture must still be found.
pub(super) fn mean_of_image(image: &Image) -> f32 {
    let decode = |b: u8| optics::tonemap::srgb_decode_channel(f32::from(b) / 255.0);
    let sum: f64 = match &image.pixels {
        Pixels::Rgba8(pixels) => {
            let color = |p: &[u8; 4]| vec3f(decode(p[0]), decode(p[1]), decode(p[2]));
            pixels.iter().map(|p| f64::from(strongest(color(p)))).sum()
        }
        floats => {
            let color = |[r, g, b, _]: [f32; 4]| strongest(vec3f(r, g, b));
            (0..floats.len()).map(|i| f64::from(color(floats.stored(i)))).sum()
        }
    };
    ((sum / (f64::from(image.width) * f64::from(image.height))) as f32).max(1e-3)
}
