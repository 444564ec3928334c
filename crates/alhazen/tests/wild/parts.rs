//! Pieces that these scenes are built from.

use alhazen::{AlphaMode, Environment, Material, Model, Pixels, Scene, SceneImage};
use glam::Vec3;
use scene::{ColorSpace, Sampler, Texture, TextureRef, TriangleMesh, tangents};
use testkit::scenes::{Build, lambert};

/// An image of `width` × `height` pixels as a texture.
pub fn texture(scene: &mut Scene, [width, height]: [u32; 2], texel: fn(u32, u32) -> [u8; 4]) -> TextureRef {
    let pixels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    let image = scene.images.len() as u32;
    let name = format!("image {image}");
    scene.images.push(SceneImage { name, width, height, pixels: Pixels::Rgba8(pixels) });
    scene.textures.push(Texture::image(image, Sampler::default(), ColorSpace::Srgb));
    TextureRef::new(scene.textures.len() as u32 - 1)
}

/// As [`texture`], of numbers that are no colours.
pub fn data(scene: &mut Scene, size: [u32; 2], texel: fn(u32, u32) -> [u8; 4]) -> TextureRef {
    let reference = texture(scene, size, texel);
    let image = scene.textures[reference.texture as usize].as_image_mut();
    image.expect("an image").color_space = ColorSpace::Linear;
    reference
}

/// Eight columns and four rows, of which no two are alike.
pub fn stripes(x: u32, y: u32) -> [u8; 4] {
    [30 * x as u8 + 20, 250 - 60 * y as u8, if (x + y).is_multiple_of(2) { 40 } else { 220 }, 255]
}

/// Holes in some places, partial alpha in others.
pub fn holes(x: u32, y: u32) -> [u8; 4] {
    [255, 255, 255, if (x + y).is_multiple_of(2) { 255 } else { 25 * x as u8 }]
}

/// Normals that lean to the right and to the upper side of the image.
pub fn leaning(x: u32, _: u32) -> [u8; 4] {
    [150 + 8 * x as u8, 170, 210, 255]
}

pub fn unlit(color: [f32; 3]) -> Material {
    Material { model: Model::Unlit, ..lambert("unlit", color) }
}

pub fn masked(material: Material) -> Material {
    Material { alpha_mode: AlphaMode::Mask(0.5), ..material }
}

/// A sphere of longitude and latitude with texture coordinates, and tangents where `has_tangents`.
pub fn mesh_sphere(radius: f32, segments: u32, has_tangents: bool) -> TriangleMesh {
    let mut mesh = scene::shapes::uv_sphere(radius, segments, segments / 2);
    if has_tangents {
        tangents::generate(&mut mesh, 0);
    }
    mesh
}

/// A box of side 1 whose sides each show the whole image.
pub fn textured_box() -> TriangleMesh {
    let mut mesh = testkit::scenes::cuboid([-0.5; 3], [0.5; 3]);
    let corners = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    mesh.uv0 = (0..mesh.positions.len()).map(|i| corners[i % 4].into()).collect();
    tangents::generate(&mut mesh, 0);
    mesh
}

/// Light from everywhere, and a sun.
pub fn light(scene: &mut Scene, sky: f32, sun: Vec3) {
    scene.environment = Environment::Constant(Vec3::splat(sky));
    let kind = alhazen::LightKind::Directional {
        direction: -sun.normalize(),
        irradiance: Vec3::splat(3.0),
        angular_diameter: 0.0,
    };
    scene.lights.push(alhazen::Light::new("sun", kind));
}

/// A floor of reflectance 0.5 at height `y`.
pub fn add_floor(scene: &mut Scene, y: f32) {
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", testkit::scenes::ground(y, 20.0), floor);
}
