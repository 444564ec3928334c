//! Scenes in one file: nothing is lost, and what is damaged is an error.

use glam::{Affine3A, Vec2, Vec3, Vec4};
use scene::load::packed::{pack, unpack};
use scene::{
    Camera, DensityGrid, Distortion, Environment, Fog, Image, Instance, Light, LightKind, LoadOptions,
    Material, Medium, Mesh, Model, Pixels, Portal, Scene, Shape, Sphere, Texture, TextureRef, TriangleMesh,
};
use std::path::Path;
use std::sync::Arc;

fn scene() -> Scene {
    let mut scene = Scene { name: "all of it".into(), ..Scene::default() };
    scene.images.push(Image {
        name: "i".into(),
        width: 2,
        height: 1,
        pixels: Pixels::Rgba8(vec![[1, 2, 3, 4]; 2]),
    });
    scene.textures.push(Texture::image(0, Default::default(), Default::default()));
    scene.materials.push(Material { base_color_texture: Some(TextureRef::new(0)), ..Material::default() });
    let grid = DensityGrid::new([1, 1, 2], [Vec3::ZERO, Vec3::ONE], vec![0.25, f32::MIN_POSITIVE]);
    let medium = Medium { scattering: Vec3::ONE, density: grid.map(Arc::new), ..Medium::default() };
    scene.materials.push(Material { model: Model::Boundary, medium: Some(medium), ..Material::default() });
    let triangle = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.1, 1.0 / 3.0, -0.0)],
        uv0: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
        colors: vec![Vec4::ONE; 3],
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    scene.meshes.push(Mesh::single("t", Shape::Triangles(triangle), 0));
    scene.meshes.push(Mesh::single("s", Shape::Spheres(vec![Sphere { center: Vec3::Y, radius: 0.5 }]), 1));
    let turn = Affine3A::from_rotation_x(0.3);
    scene.instances.push(Instance { materials: Some(vec![1]), ..Instance::new("a", 0, turn) });
    scene.instances.push(Instance::new("b", 1, Affine3A::IDENTITY));
    scene.lights.push(Light::new("l", LightKind::Point { position: Vec3::X, intensity: Vec3::ONE }));
    let mut camera = Camera::perspective("c", Vec3::Z, Vec3::ZERO, 0.7);
    camera.distortion = Some(Distortion::Fisheye { k: [0.1, 0.2, 0.3, 0.4] });
    scene.cameras.push(camera);
    scene.environment = Environment::Image { image: 0, rotation: 0.5, intensity: 2.0 };
    scene
        .portals
        .push(Portal::new([Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]).expect("a square"));
    scene.fog = Some(Fog {
        medium: Medium { absorption: Vec3::splat(0.1), ..Medium::default() },
        top: f32::INFINITY,
    });
    scene
}

#[test]
fn nothing_is_lost() {
    let scene = scene();
    let back = unpack(Path::new("a.alhazen"), &pack(&scene).expect("packed")).expect("unpacked");
    assert_eq!(format!("{back:?}"), format!("{scene:?}"));
}

#[test]
fn files_are_loaded_by_their_ending() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.alhazen");
    std::fs::write(&path, pack(&scene()).expect("packed")).expect("written");
    let loaded = scene::load::load(&path, &LoadOptions::default()).expect("loaded");
    assert_eq!((loaded.scene.name.as_str(), loaded.scene.instances.len()), ("all of it", 2));
    let options = LoadOptions { max_memory: 100, ..LoadOptions::default() };
    assert!(scene::load::load(&path, &options).is_err(), "it takes more than 100 bytes");
}

#[test]
fn what_is_damaged_is_an_error() {
    let error = |scene: &Scene| {
        let error = unpack(Path::new("a.alhazen"), &pack(scene).expect("packed")).map(drop);
        error.expect_err("damaged").to_string()
    };
    type Damage = fn(&mut Scene);
    let damages: [(Damage, &str); 8] = [
        (|s| s.instances[0].mesh = 7, "instance 0: its mesh 7"),
        (|s| s.instances[0].materials = Some(vec![]), "0 materials for 1 parts"),
        (|s| s.instances[1].transform.translation.x = f32::NAN, "instance 1: its transform"),
        (|s| s.meshes[1].parts[0].material = 2, "mesh 1: its material 2"),
        (
            |s| {
                s.meshes[1].parts[0].shape = Shape::Spheres(vec![Sphere { center: Vec3::ZERO, radius: -1.0 }])
            },
            "sphere 0",
        ),
        (|s| s.images[0].width = 3, "image 0: 2 pixels for 3×1"),
        (|s| s.textures[0].shift_references(1, 0), "texture 0"),
        (|s| s.environment = Environment::Image { image: 9, rotation: 0.0, intensity: 1.0 }, "environment"),
    ];
    for (damage, reason) in damages {
        let mut damaged = scene();
        damage(&mut damaged);
        let message = error(&damaged);
        assert!(message.starts_with("a.alhazen: ") && message.contains(reason), "{message}");
    }
    let mut mesh = scene();
    if let Shape::Triangles(triangles) = &mut mesh.meshes[0].parts[0].shape {
        triangles.indices[0][2] = 3;
    }
    assert!(error(&mesh).contains("triangle 0"));
    let bytes = pack(&scene()).expect("packed");
    for end in 0..bytes.len() {
        assert!(unpack(Path::new("a.alhazen"), &bytes[..end]).is_err(), "cut off at {end}");
    }
    assert!(unpack(Path::new("a.alhazen"), b"v 1 2 3").is_err());
}
