//! Whether an object is moved into world space when tables are built, or stays an instance, must not be visible.

use super::common::on_gpus::differing_share;
use super::common::{job, render};
use super::parts::{
    add_floor, data, holes, leaning, light, masked, mesh_sphere, stripes, texture, textured_box, unlit,
};
use alhazen::{Camera, Film, Material, Scene, Shape};
use glam::{Affine3A, Mat3, Quat, Vec2, Vec3};
use scene::texture_graph::{Placement, Space, kind_named};
use scene::{Anisotropy, Checkerboard, Layers, Projection, Texture, TextureGraph, TextureRef};
use testkit::scenes::{Build, emitter, lambert, metallic_roughness, sphere};

/// One of each thing that may lie in the space of the object, or along its texture coordinates. No coverage is partial: the last bits
/// of a hit decide about that, and those differ.
fn materials(scene: &mut Scene) -> Vec<Material> {
    let image = texture(scene, [8, 4], stripes);
    let bumps = data(scene, [8, 4], leaning);
    let cut = texture(scene, [8, 4], holes);
    let wave = scene::TextureGraphNode {
        placement: Placement { space: Space::Object, map: Affine3A::from_scale(Vec3::splat(3.0)) },
        ..scene::TextureGraphNode::new(kind_named("wave").expect("a kind"))
    };
    scene.textures.push(Texture::Graph(TextureGraph { nodes: vec![wave] }));
    let wave = TextureRef::new(scene.textures.len() as u32 - 1);
    let checkers = |fade: Option<Vec2>| {
        let colors = [Vec3::new(0.9, 0.1, 0.1), Vec3::new(0.1, 0.8, 0.2)];
        Some(Checkerboard { colors, size: 0.3, fade })
    };
    let anisotropy = Anisotropy { strength: 0.9, rotation: 0.4, texture: None };
    vec![
        Material { base_color_texture: Some(image), ..lambert("textured", [0.9; 3]) },
        Material { checkerboard: checkers(None), ..unlit([1.0; 3]) },
        Material { checkerboard: checkers(Some(Vec2::new(0.4, 0.4001))), ..lambert("fading", [1.0; 3]) },
        Material { normal_texture: Some(bumps), ..metallic_roughness("bumpy", [0.7, 0.6, 0.5], 0.5, 0.4) },
        Material {
            layers: Layers { anisotropy, ..Layers::default() },
            ..metallic_roughness("brushed", [0.8; 3], 1.0, 0.3)
        },
        masked(Material { base_color_texture: Some(cut), ..lambert("holed", [0.8; 3]) }),
        Material { emission_texture: Some(image), ..emitter("lamp", [2.0; 3]) },
        Material { base_color_texture: Some(wave), ..lambert("waves", [1.0; 3]) },
        Material { base_color_texture: Some(wave), ..unlit([1.0; 3]) },
    ]
}

fn placements() -> [(&'static str, Affine3A); 5] {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.5, 1.1, -0.4);
    let shear = Mat3::from_cols(Vec3::X, Vec3::new(0.4, 1.0, 0.2), Vec3::new(0.0, -0.3, 0.9));
    let turned = Affine3A::from_quat(turn);
    [
        ("turned", turned),
        ("scaled alike", turned * Affine3A::from_scale(Vec3::splat(0.8))),
        ("mirrored", turned * Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0))),
        ("stretched", turned * Affine3A::from_scale(Vec3::new(1.1, 0.7, -0.9))),
        ("sheared", turned * Affine3A::from_mat3(shear)),
    ]
}

const OBJECTS: u32 = 9;
/// Columns and rows of an object's part of the picture.
const SIZE: u32 = 24;

/// Share of the pixels around an object that differ by more than rounding.
fn differing_pixels(a: &Film, b: &Film, object: u32) -> f64 {
    let width = (OBJECTS * SIZE) as usize;
    let columns = (object * SIZE) as usize..((object + 1) * SIZE) as usize;
    let differs = |i: &usize| {
        let pairs = a.pixels()[*i].mean().into_iter().zip(b.pixels()[*i].mean());
        pairs.into_iter().any(|(a, b)| (a - b).abs() > 5e-3 * (a + b) + 1e-3)
    };
    let own = (0..a.pixels().len()).filter(|i| columns.contains(&(i % width)));
    let count = (SIZE * SIZE) as f64;
    own.filter(differs).count() as f64 / count
}

/// Each material on a shape of its own, in a row.
fn row(shape: &dyn Fn() -> Shape, place: Affine3A, dynamic: bool) -> Film {
    let mut scene = Scene::default();
    light(&mut scene, 0.4, Vec3::new(0.4, 1.0, 0.6));
    add_floor(&mut scene, -0.9);
    let materials = materials(&mut scene);
    assert_eq!(materials.len() as u32, OBJECTS);
    let middle = (OBJECTS - 1) as f32 * 0.7;
    for (i, material) in materials.into_iter().enumerate() {
        let material = scene.add_material(material);
        let at = Affine3A::from_translation(Vec3::new(1.4 * i as f32 - middle, 0.0, 0.0));
        scene.add_shape("object", shape(), material, at * place);
    }
    scene.instances.iter_mut().skip(1).for_each(|i| i.dynamic = dynamic);
    let mut camera = Camera::perspective("front", Vec3::new(0.0, 0.6, 6.0), Vec3::ZERO, 1.0);
    camera.projection = Projection::Orthographic { height: 1.4 };
    scene.cameras.push(camera);
    render(&scene, &job(&scene, OBJECTS * SIZE, SIZE, 3), 4)
}

#[test]
fn objects_that_may_move_look_like_those_that_do_not() {
    let shapes: [(&str, &dyn Fn() -> Shape); 3] = [
        ("exact sphere", &|| sphere([0.0; 3], 0.55)),
        ("mesh sphere", &|| Shape::Triangles(mesh_sphere(0.55, 24, true))),
        ("box", &|| Shape::Triangles(textured_box())),
    ];
    for (shape_name, shape) in shapes {
        for (place_name, place) in placements() {
            let (moved, placed) = (row(shape, place, false), row(shape, place, true));
            for object in 0..OBJECTS {
                let share = differing_pixels(&moved, &placed, object);
                assert!(
                    share < 0.08,
                    "{shape_name}, {place_name}, object {object}: {:.1} % of its pixels differ",
                    100.0 * share
                );
            }
        }
    }
}

/// And turning an object turns what lies on it: pictures of two turns differ.
#[test]
fn turning_a_sphere_turns_its_texture() {
    let turned = |angle: f32| row(&|| sphere([0.0; 3], 0.55), Affine3A::from_rotation_y(angle), false);
    let share = differing_share(&turned(0.0), &turned(std::f32::consts::FRAC_PI_2));
    assert!(share > 0.1, "{:.1} % of the pixels differ", 100.0 * share);
}
