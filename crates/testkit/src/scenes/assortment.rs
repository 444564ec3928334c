//! A small scene with one of everything that back ends treat in a way of its own.

use super::{
    Build, camera, cuboid, dielectric, emitter, ground, lambert, metallic_roughness, quads, sphere, uv_sphere,
};
use glam::{Affine3A, Quat, Vec2, Vec3, Vec4};
use scene::{
    AlphaMode, Checkerboard, ColorSpace, Environment, Filter, Image, Instance, Light, LightKind, Material,
    Mesh, Model, Part, Pixels, Sampler, Scene, Shape, Texture, TextureRef, TriangleMesh, UvTransform, Wrap,
};

/// Textures with every wrap and filter, an environment image, masks and coverage, normal maps with and without
/// tangents, vertex colours, mixed materials, mirrored and stretched instances, spheres, and every kind of light.
#[must_use]
pub fn assortment() -> Scene {
    let mut scene = Scene { name: "assortment".into(), ..Scene::default() };
    let textures = add_textures(&mut scene);
    add_floor(&mut scene);
    add_panels(&mut scene, &textures);
    add_objects(&mut scene, &textures);
    add_instances(&mut scene);
    add_lights(&mut scene);
    scene.cameras.push(camera([0.0, 2.2, 6.5], [0.0, 0.9, 0.0], 42.0));
    scene
}

/// The colour of a pixel by its column and row.
type Texel = fn(u32, u32) -> [u8; 4];

/// Numbers of textures.
struct Textures {
    stripes: u32,
    holes: u32,
    data: u32,
    bumps: u32,
    radiance: u32,
}

fn add_textures(scene: &mut Scene) -> Textures {
    let images: [(&str, Texel); 4] = [
        ("stripes", |x, y| [(40 * x) as u8, 255 - (20 * y) as u8, ((x ^ y) * 30) as u8, 255]),
        ("holes", |x, y| [200, 220, 90, if (x / 2 + y / 2) % 2 == 0 { 255 } else { (16 * x) as u8 }]),
        ("data", |x, y| [(x * 31) as u8, 60 + (y * 20) as u8, ((x + y) * 15) as u8, 255]),
        ("bumps", |x, y| [(96 + 8 * x) as u8, (160 - 8 * y) as u8, 230, 255]),
    ];
    let environment = (0..16 * 8).map(|i| {
        let (x, y) = (i % 16, i / 16);
        let sky = 0.25 + 0.05 * y as f32;
        if (x, y) == (11, 2) { [60.0, 50.0, 30.0] } else { [sky, sky, 0.6] }
    });
    let environment = Pixels::Rgb32F(environment.collect());
    for (name, texel) in images {
        let pixels = (0..64).map(|i| texel(i % 8, i / 8)).collect();
        scene.images.push(Image { name: name.into(), width: 8, height: 8, pixels: Pixels::Rgba8(pixels) });
    }
    scene.images.push(Image { name: "sky".into(), width: 16, height: 8, pixels: environment });
    let radiance = |i: u32| {
        let (x, y) = ((i % 8) as f32, (i / 8) as f32);
        [0.4 * x, 0.05 * y * y, if i == 27 { 6.0 } else { 0.3 }, 0.1 * x]
    };
    let pixels = Pixels::Rgba32F((0..64).map(radiance).collect());
    scene.images.push(Image { name: "radiance".into(), width: 8, height: 8, pixels });
    scene.environment = Environment::Image { image: 4, rotation: 0.7, intensity: 1.3 };
    let mut add = |image: u32, wrap_u: Wrap, wrap_v: Wrap, filter: Filter, color_space: ColorSpace| {
        scene.textures.push(Texture::image(image, Sampler { wrap_u, wrap_v, filter }, color_space));
        scene.textures.len() as u32 - 1
    };
    Textures {
        stripes: add(0, Wrap::Repeat, Wrap::MirroredRepeat, Filter::Linear, ColorSpace::Srgb),
        holes: add(1, Wrap::ClampToEdge, Wrap::Repeat, Filter::Nearest, ColorSpace::Srgb),
        data: add(2, Wrap::MirroredRepeat, Wrap::ClampToEdge, Filter::Linear, ColorSpace::Linear),
        bumps: add(3, Wrap::Repeat, Wrap::Repeat, Filter::Linear, ColorSpace::Linear),
        radiance: add(5, Wrap::Repeat, Wrap::ClampToEdge, Filter::Linear, ColorSpace::Srgb),
    }
}

fn add_floor(scene: &mut Scene) {
    let checkerboard = Checkerboard {
        colors: [Vec3::splat(0.1), Vec3::new(0.8, 0.75, 0.7)],
        size: 0.5,
        fade: Some(Vec2::new(4.0, 9.0)),
    };
    let floor =
        Material { checkerboard: Some(checkerboard), ..metallic_roughness("floor", [0.5; 3], 0.0, 0.4) };
    let floor = scene.add_material(floor);
    scene.add_mesh("floor", ground(0.0, 10.0), floor);
}

/// A panel in the plane z = `z` with texture coordinates from −1 to 2, so that every wrap mode shows.
fn panel(x: f32, y: f32, z: f32) -> TriangleMesh {
    let at = |dx: f32, dy: f32| Vec3::new(x + 0.5 * dx, y + 0.5 * dy, z);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    TriangleMesh {
        positions: corners.map(|(dx, dy)| at(dx, dy)).into(),
        uv0: corners.map(|(dx, dy)| Vec2::new(0.5 + 1.5 * dx, 0.5 - 1.5 * dy)).into(),
        uv1: corners.map(|(dx, dy)| Vec2::new(0.5 * dx, 0.3 + 0.5 * dy)).into(),
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    }
}

fn add_panels(scene: &mut Scene, textures: &Textures) {
    let textured = |texture: u32, uv_set: u32| {
        let transform =
            UvTransform { rows: [Vec2::new(0.9, 0.2), Vec2::new(-0.1, 1.1)], offset: Vec2::new(0.1, 0.05) };
        Some(TextureRef { texture, uv_set, transform })
    };
    let stripes = Material {
        base_color_texture: textured(textures.stripes, 0),
        metallic_roughness_texture: textured(textures.data, 1),
        metallic: 1.0,
        roughness: 1.0,
        ..metallic_roughness("stripes", [0.9; 3], 1.0, 1.0)
    };
    let masked = Material {
        base_color_texture: textured(textures.holes, 0),
        alpha_mode: AlphaMode::Mask(0.4),
        ..lambert("masked", [0.9; 3])
    };
    let covered = Material {
        base_color_texture: textured(textures.holes, 1),
        alpha_mode: AlphaMode::Blend,
        ..lambert("covered", [0.4, 0.9, 0.8])
    };
    let glowing = Material {
        emission: Vec3::new(2.0, 1.5, 0.8),
        emission_texture: textured(textures.radiance, 0),
        emission_two_sided: true,
        ..lambert("glowing", [0.2; 3])
    };
    for (i, material) in [stripes, masked, covered, glowing].into_iter().enumerate() {
        let material = scene.add_material(material);
        let mut mesh = panel(-1.8 + 1.2 * i as f32, 2.0, -1.0);
        if i == 2 {
            let alpha = |i: usize| Vec4::new(1.0, 0.5 + 0.1 * i as f32, 0.8, 0.4 + 0.2 * i as f32);
            mesh.colors = (0..4).map(alpha).collect();
        }
        scene.add_mesh("panel", mesh, material);
    }
}

fn add_objects(scene: &mut Scene, textures: &Textures) {
    let bumpy = Material {
        normal_texture: Some(TextureRef::new(textures.bumps)),
        normal_scale: 0.8,
        ..metallic_roughness("bumpy", [0.8, 0.5, 0.3], 0.6, 0.25)
    };
    let bumpy = scene.add_material(bumpy);
    scene.add_shape("bumpy ball", sphere([-2.0, 0.5, 0.5], 0.5), bumpy, Affine3A::IDENTITY);
    let mut flat = panel(2.4, 0.6, 0.8);
    flat.tangents = vec![Vec4::new(0.8, 0.6, 0.0, -1.0); 4];
    scene.add_mesh("bumpy panel", flat, bumpy);
    let mixed = Material {
        transmission: 0.7,
        transmission_texture: Some(TextureRef::new(textures.data)),
        ior: 1.4,
        ..metallic_roughness("mixed", [0.9, 0.95, 1.0], 0.1, 0.3)
    };
    let materials = [
        mixed,
        dielectric("glass", 1.5, 0.0),
        dielectric("frosted", 1.5, 0.3),
        Material { thin_walled: true, ..dielectric("sheet", 1.5, 0.2) },
        Material { model: Model::Mirror, ..lambert("mirror", [0.9, 0.85, 0.8]) },
        Material {
            model: Model::Unlit,
            base_color_texture: Some(TextureRef::new(textures.radiance)),
            ..lambert("unlit", [0.3, 0.1, 0.4])
        },
    ];
    for (i, material) in materials.into_iter().enumerate() {
        let material = scene.add_material(material);
        let x = -1.2 + 0.55 * i as f32;
        scene.add_shape("ball", sphere([x, 0.25, 1.4], 0.25), material, Affine3A::IDENTITY);
    }
}

/// A mesh of two materials and both kinds of shape, four times: as it is, turned, mirrored and stretched.
fn add_instances(scene: &mut Scene) {
    let smooth = scene.add_material(metallic_roughness("smooth", [0.2, 0.4, 0.8], 0.0, 0.5));
    let matte = scene.add_material(lambert("matte", [0.7, 0.3, 0.2]));
    let parts = vec![
        Part { shape: Shape::Triangles(uv_sphere(12, 6)), material: smooth },
        Part { shape: Shape::Triangles(cuboid([-1.4, -0.2, -0.2], [-1.0, 0.2, 0.2])), material: matte },
        Part { shape: sphere([1.3, 0.0, 0.0], 0.3), material: smooth },
    ];
    scene.meshes.push(Mesh { name: "group".into(), parts });
    let mesh = scene.meshes.len() as u32 - 1;
    let turn = Quat::from_rotation_y(0.6);
    for (x, scale) in
        [(-1.6, Vec3::splat(0.3)), (0.0, Vec3::new(-0.3, 0.3, 0.3)), (1.4, Vec3::new(0.25, 0.4, 0.2))]
    {
        let place = Affine3A::from_scale_rotation_translation(scale, turn, Vec3::new(x, 0.9, -0.2));
        scene.instances.push(Instance::new("group", mesh, place));
    }
    let mut other = Instance::new("recoloured", mesh, Affine3A::from_translation(Vec3::new(0.0, 3.6, -1.5)));
    other.materials = Some(vec![matte, smooth, matte]);
    scene.instances.push(other);
}

fn add_lights(scene: &mut Scene) {
    let lamp = scene.add_material(emitter("lamp", [9.0, 8.0, 6.0]));
    let s = 0.4;
    let down = quads(&[[[-s, 4.0, s], [-s, 4.0, -s], [s, 4.0, -s], [s, 4.0, s]]]);
    scene.add_mesh("lamp", down, lamp);
    scene.add_shape("bulb", sphere([2.6, 1.8, -0.6], 0.15), lamp, Affine3A::IDENTITY);
    let down = Vec3::new(-0.3, -1.0, -0.4).normalize();
    let kinds = [
        LightKind::Point { position: Vec3::new(-2.5, 2.5, 1.5), intensity: Vec3::new(1.0, 1.5, 2.0) },
        LightKind::Spot {
            position: Vec3::new(2.0, 3.0, 2.5),
            direction: Vec3::new(-0.4, -1.0, -0.7).normalize(),
            intensity: Vec3::new(6.0, 3.0, 3.0),
            inner_angle: 0.2,
            outer_angle: 0.45,
        },
        LightKind::Directional { direction: down, irradiance: Vec3::splat(0.6), angular_diameter: 0.05 },
        LightKind::Projector {
            position: Vec3::new(0.0, 3.0, 4.0),
            direction: Vec3::new(0.1, -0.6, -1.0).normalize(),
            up: Vec3::Y,
            intensity: Vec3::new(4.0, 5.0, 6.0),
            field_of_view: 0.6,
            picture: TextureRef::new(0),
        },
    ];
    scene.lights.extend(kinds.map(|kind| Light::new("light", kind)));
}
