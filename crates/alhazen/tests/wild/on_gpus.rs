//! All of it on GPUs: one scene, compared with the CPU's pictures, which the other tests know to be right.

use super::common::on_gpus::{compare_on, render};
use super::common::{assert_same_coarse, gpu_renderers, in_turn, job};
use super::gaps::clear;
use super::parts::{
    add_floor, data, holes, leaning, light, masked, mesh_sphere, stripes, texture, textured_box, unlit,
};
use alhazen::{
    AmbientOcclusion, DirectSettings, HybridSettings, Integrator, Job, Material, Renderer, Scene, Shape,
};
use glam::{Affine3A, Quat, Vec2, Vec3};
use scene::{Checkerboard, Instance, TextureRef, UvTransform};
use testkit::Estimate;
use testkit::scenes::{
    Build, camera, covering, emitter, flipped, ground, lambert, metallic_roughness, sphere,
};

fn turned(x: f32, y: f32, z: f32, scale: Vec3) -> Affine3A {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.5, 1.1, -0.4);
    Affine3A::from_scale_rotation_translation(scale, turn, Vec3::new(x, y, z))
}

/// Textured and holed spheres, lamps among them, turned, mirrored and moving; a turned checkerboard; backs that are culled;
/// a coarse smooth sphere in grazing light; lamps close below panes.
fn everything() -> Scene {
    let mut scene = Scene::default();
    scene.defaults.cull_backs = Some(true);
    light(&mut scene, 0.2, Vec3::new(1.0, 0.35, 0.1));
    add_floor(&mut scene, 0.0);
    let image = texture(&mut scene, [8, 4], stripes);
    let cut = texture(&mut scene, [8, 4], holes);
    let transform = UvTransform::new(Vec2::ZERO, 1.1, Vec2::new(2.0, -1.0));
    let bumps = TextureRef { transform, ..data(&mut scene, [8, 4], leaning) };
    let mirror = Vec3::new(1.0, 1.0, -1.0);
    let colors = [Vec3::new(0.9, 0.1, 0.1), Vec3::new(0.1, 0.8, 0.2)];
    let textured = Material { base_color_texture: Some(image), ..lambert("textured", [0.9; 3]) };
    let holed = Material { base_color_texture: Some(cut), ..lambert("holed", [0.8; 3]) };
    let bumpy =
        Material { normal_texture: Some(bumps), ..metallic_roughness("bumpy", [0.7, 0.6, 0.5], 0.5, 0.4) };
    let lamp = Material { emission_texture: Some(image), ..emitter("lamp", [12.0; 3]) };
    let checkers = Material {
        checkerboard: Some(Checkerboard { colors, size: 0.3, fade: None }),
        ..lambert("checkers", [1.0; 3])
    };
    let smooth = lambert("smooth", [0.9, 0.8, 0.7]);
    let back = Material { double_sided: false, ..unlit([0.1, 0.2, 0.6]) };
    let ball = || sphere([0.0; 3], 0.45);
    let objects = [
        (ball(), textured, turned(-2.0, 0.5, 0.0, Vec3::ONE)),
        (ball(), masked(holed.clone()), turned(-1.0, 0.5, 0.0, mirror)),
        (ball(), bumpy, turned(0.0, 0.5, 0.0, mirror)),
        (ball(), covering(lambert("thin", [0.9, 0.2, 0.2]), 0.4), turned(1.0, 0.5, 0.0, Vec3::ONE)),
        (
            ball(),
            masked(Material { base_color_texture: Some(cut), ..lamp }),
            turned(0.3, 2.2, 0.5, Vec3::splat(0.6)),
        ),
        (Shape::Triangles(textured_box()), checkers, turned(2.0, 0.6, 0.0, Vec3::splat(0.7))),
        (Shape::Triangles(mesh_sphere(0.45, 12, false)), smooth, turned(-1.5, 1.5, -0.6, Vec3::ONE)),
        (Shape::Triangles(flipped(ground(3.0, 0.8))), back, Affine3A::IDENTITY),
    ];
    for (shape, material, place) in objects {
        let material = scene.add_material(material);
        scene.add_shape("object", shape, material, place);
    }
    // The same ones as instances: the mesh of the second, and the smooth sphere.
    for (object, x) in [(2, 0.9), (7, 1.9)] {
        let mesh = scene.instances[object].mesh;
        let place = turned(x, 1.4, -0.6, Vec3::new(0.8, 0.8, -0.8));
        scene.instances.push(Instance { dynamic: true, ..Instance::new("again", mesh, place) });
    }
    // What shines 10 µm below clear panes, one that stands and one that moves.
    for (x, dynamic) in [(-0.6, false), (0.6, true)] {
        let place = turned(x, 0.9, 1.6, Vec3::splat(0.25));
        let below = place * Affine3A::from_translation(Vec3::new(0.0, -4e-5, 0.0));
        for (material, place) in [(clear(), place), (emitter("below", [2.0, 1.0, 0.5]), below)] {
            let material = scene.add_material(material);
            scene.add_shape("gap", Shape::Triangles(ground(0.0, 1.0)), material, place);
        }
        let pane = scene.instances.len() - 2;
        scene.instances[pane].dynamic = dynamic;
    }
    scene.cameras.push(camera([0.0, 1.6, 6.0], [0.0, 0.9, 0.0], 45.0));
    scene
}

#[test]
fn tracers_show_it_as_the_cpu_does() {
    let scene = everything();
    let mut renderers = gpu_renderers("tracers_show_it_as_the_cpu_does");
    let renderers = in_turn(&mut renderers, 2);
    compare_on(renderers, "wild path", &scene, &job(&scene, 64, 40, 4), 0.2);
}

/// The rasteriser draws spheres by itself. Without a cutoff of lights its expected picture is that of `direct`. On hardware
/// only: software drivers compile the passes of this scene for more than ten minutes.
#[test]
fn the_rasteriser_shows_what_rays_see() {
    if !gpu::has_hardware() {
        println!("the_rasteriser_shows_what_rays_see: skipped, there is no hardware");
        return;
    }
    let scene = everything();
    let mut renderers = gpu_renderers("the_rasteriser_shows_what_rays_see");
    let ambient = AmbientOcclusion { samples: 0, ..AmbientOcclusion::default() };
    let rays = DirectSettings { reflection_samples: 0, ambient, ..DirectSettings::default() };
    let frames =
        HybridSettings { rays, light_cutoff: 0.0, reflection_survival: 1.0, ..HybridSettings::default() };
    let of = |integrator| Job { integrator, ..job(&scene, 64, 40, 4) };
    let mut cpu = Renderer::cpu(None).expect("threads");
    let (expected, _) = render(&mut cpu, &scene, &of(Integrator::Direct(rays)), 64);
    for renderer in in_turn(&mut renderers, 1) {
        let (film, _) = render(renderer, &scene, &of(Integrator::Hybrid(frames)), 64);
        let (seen, expected) = (Estimate::from_film(&film), Estimate::from_film(&expected));
        assert_same_coarse("wild hybrid", &seen, &expected);
    }
}
