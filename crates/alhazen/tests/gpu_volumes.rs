//! Media on every GPU back end against the CPU's: the same scenes, the same random numbers. Pictures that are known are in
//! `volumes.rs`; these are the same decisions.

mod common;

use alhazen::gpu::has_hardware;
use alhazen::{
    Aov, BackendError, Control, Film, HybridSettings, Integrator, Job, Limits, Mis, PathSettings, Renderer,
    SamplerKind, Scene, Shape, Switch,
};
use common::on_gpus::{compare_on, differing_share, render};
use common::{gpu_renderers, job};
use film::AovData;
use glam::{Affine3A, Vec3};
use scene::{DensityGrid, Fog, Interior, Material, Medium, Model, Subsurface};
use std::sync::Arc;
use testkit::Exclusive;
use testkit::scenes::{
    Build, camera, cuboid, dielectric, emitter, flipped, ground, lambert, sphere, uv_sphere,
};

const SIZE: u32 = 32;

fn filled(name: &str, medium: Medium) -> Material {
    Material { name: name.into(), model: Model::Boundary, medium: Some(medium), ..Material::default() }
}

fn medium(absorption: [f32; 3], scattering: [f32; 3], anisotropy: f32) -> Medium {
    Medium { absorption: absorption.into(), scattering: scattering.into(), anisotropy, ..Medium::default() }
}

/// A cloud that is dense on one side and shines a little.
fn cloud(low: Vec3, high: Vec3) -> Medium {
    let size = [4u32, 3, 5];
    let cells = size.iter().product::<u32>();
    let values = (0..cells).map(|i| (i * 37 % 11) as f32 / 11.0 * (1.0 + (i % size[0]) as f32)).collect();
    let density = DensityGrid::new(size, [low, high], values).map(Arc::new);
    assert!(density.is_some(), "a grid");
    Medium { density, emission: Vec3::new(0.3, 0.1, 0.02), ..medium([0.3, 0.5, 0.9], [2.0, 2.5, 3.0], 0.3) }
}

fn body(name: &str, ior: f32, priority: i32) -> Material {
    let interior = Interior { attenuation_color: Vec3::new(0.5, 0.8, 0.7), attenuation_distance: 0.5 };
    Material { interior, priority: Some(priority), ..dielectric(name, ior, 0.0) }
}

/// All that can be between surfaces: fog, a box of mist with a ball in it, a cloud, a glass ball with water that reaches into
/// its wall, a body of wax; with a lamp and a sun.
fn everything() -> Scene {
    let mut scene = Scene { name: "media".into(), ..Scene::default() };
    scene.fog = Some(Fog { medium: medium([0.01; 3], [0.05, 0.06, 0.08], 0.5), top: 2.6 });
    let floor = scene.add_material(lambert("floor", [0.5, 0.45, 0.4]));
    scene.add_mesh("floor", ground(0.0, 8.0), floor);
    let lamp = scene.add_material(emitter("lamp", [9.0, 8.0, 7.0]));
    let above = Affine3A::from_translation(Vec3::new(0.3, 2.4, 0.5));
    scene.add_shape("lamp", Shape::Triangles(flipped(ground(0.0, 0.7))), lamp, above);
    let mist = scene.add_material(filled("mist", medium([0.1, 0.3, 1.0], [0.9, 1.6, 2.0], 0.6)));
    scene.add_mesh("mist", cuboid([-1.9, 0.1, -0.6], [-0.7, 1.3, 0.6]), mist);
    let ball = scene.add_material(lambert("ball", [0.8; 3]));
    scene.add_shape("ball", sphere([-1.3, 0.6, 0.0], 0.25), ball, Affine3A::IDENTITY);
    let (low, high) = (Vec3::new(-0.5, 0.9, -0.4), Vec3::new(0.5, 1.7, 0.4));
    let smoke = scene.add_material(filled("smoke", cloud(low, high)));
    scene.add_shape("smoke", sphere([0.0, 1.3, 0.0], 0.6), smoke, Affine3A::IDENTITY);
    let glass = scene.add_material(body("glass", 1.5, 2));
    let water = scene.add_material(body("water", 1.33, 1));
    let at = Affine3A::from_translation(Vec3::new(1.2, 0.5, 0.3));
    let inner = at * Affine3A::from_scale(Vec3::splat(0.36));
    scene.add_shape("glass", sphere([0.0; 3], 0.45), glass, at);
    scene.add_shape("cavity", Shape::Triangles(flipped(uv_sphere(24, 12))), glass, inner);
    scene.add_shape("water", sphere([0.0; 3], 0.4), water, at);
    let wax = scene.add_material(Material {
        base_color: Vec3::new(0.8, 0.5, 0.3).extend(1.0),
        subsurface: Some(Subsurface { radius: Vec3::new(0.1, 0.05, 0.03), anisotropy: 0.2 }),
        ..dielectric("wax", 1.4, 0.4)
    });
    scene.add_mesh("wax", cuboid([-0.4, 0.02, 0.5], [0.3, 0.5, 1.1]), wax);
    scene.cameras.push(camera([0.2, 1.2, 5.0], [0.0, 0.8, 0.0], 42.0));
    scene
}

/// Everything that changes the kernel's text at once.
fn settings(scene: &Scene) -> Job {
    let settings = PathSettings {
        max_depth: 12,
        roulette_start: 5,
        roulette_min_survival: 0.1,
        splitting: 2,
        mis: Mis::Balance,
        clamp_indirect: Some(1.0),
        caustics: Switch::Off,
        guiding: Switch::Off,
    };
    Job {
        integrator: Integrator::Path(settings),
        sampler: SamplerKind::Sobol,
        aovs: vec![Aov::Depth, Aov::InstanceId],
        ..job(scene, SIZE, SIZE, 12)
    }
}

/// Renderers for every tracer where that is quick. Software drivers compile the kernel for most of a minute; there one is
/// enough, because all tracers have the same kernel.
fn renderers(test: &str) -> Exclusive<Vec<Renderer>> {
    let mut found = gpu_renderers(test);
    if !has_hardware() {
        found.truncate(1);
    }
    found
}

/// Share of the pixels in which a layer of numbers differs by more than rounding.
fn differing_layer(a: &Film, b: &Film, aov: Aov) -> f64 {
    let numbers = |film: &Film| match film.aov(aov).expect("asked for") {
        AovData::Float(image) => image.data().to_vec(),
        AovData::Integer(ids) => ids.iter().map(|&id| id as f32).collect(),
        AovData::Shares(_) => panic!("{aov} is no layer of a GPU"),
    };
    let (a, b) = (numbers(a), numbers(b));
    assert!(b.iter().any(|v| *v != b[0]), "{aov} says nothing here");
    let differing = a.iter().zip(&b).filter(|(a, b)| (*a - *b).abs() > 1e-3 * (1.0 + b.abs())).count();
    differing as f64 / a.len() as f64
}

/// Paths through media; then the same kernel from within: what a camera stands in is found on the device.
#[test]
fn media_path() {
    let mut scene = everything();
    let mut renderers = renderers("media_path");
    // Refraction of refraction magnifies rounding.
    compare_on(&mut renderers, "media", &scene, &settings(&scene), 0.1);
    let (expected, _) = render(&mut Renderer::cpu(None).expect("threads"), &scene, &settings(&scene), 2);
    for renderer in renderers.iter_mut() {
        let (film, _) = render(renderer, &scene, &settings(&scene), 2);
        for aov in settings(&scene).aovs {
            let share = differing_layer(&film, &expected, aov);
            assert!(share <= 0.01, "{}: {aov} differs in {share} of the pixels", renderer.backend_name());
        }
    }
    for (what, eye) in [("mist", [-1.75, 0.8, 0.5]), ("water", [1.2, 0.6, 0.5])] {
        scene.cameras[0] = camera(eye, [-1.2, 0.5, -0.1], 60.0);
        compare_on(&mut renderers, &format!("media from within {what}"), &scene, &settings(&scene), 0.1);
    }
    renderers.iter_mut().for_each(check_updates);
}

/// Media on the device follow changes of the scene, those that need another upload included.
fn check_updates(renderer: &mut Renderer) {
    let old = everything();
    let named = |name: &str| old.materials.iter().position(|m| m.name == name).expect("it is there");
    let mut thinner = old.clone();
    thinner.materials[named("mist")].medium = Some(medium([0.0; 3], [0.4, 0.2, 0.1], -0.3));
    thinner.materials[named("glass")].priority = Some(0);
    thinner.fog = None;
    let mut denser = thinner.clone();
    let smoke = denser.materials[named("smoke")].medium.as_mut().expect("a medium");
    let bounds = [Vec3::new(-0.4, 0.9, -0.4), Vec3::new(0.5, 1.6, 0.4)];
    smoke.density = DensityGrid::new([2, 1, 1], bounds, vec![0.5, 4.0]).map(Arc::new);
    renderer.load(&old).expect("a scene");
    let limits = Limits { spp: 2, ..Limits::default() };
    for (what, new) in [("thinner", &thinner), ("denser", &denser), ("as before", &old)] {
        renderer.update(new).expect("an update");
        renderer.render(&settings(new), &limits, &Control::new()).expect("a picture");
        let film = renderer.film().expect("film").expect("rendered").clone();
        let (expected, _) = render(&mut Renderer::cpu(None).expect("threads"), new, &settings(new), 2);
        let share = differing_share(&film, &expected);
        assert!(share <= 0.1, "{}, {what}: {share} of the pixels differ", renderer.backend_name());
    }
}

/// Frames begin with a rasteriser, which would draw boundaries; who does not is asked instead.
#[test]
fn frames_leave_scenes_with_boundaries_to_others() {
    let mut scene = testkit::scenes::cornell();
    let nothing = Material { name: "nothing".into(), model: Model::Boundary, ..Material::default() };
    let nothing = scene.add_material(nothing);
    scene.add_shape("nothing", sphere([0.0; 3], 1.0), nothing, Affine3A::IDENTITY);
    let hybrid = Integrator::Hybrid(HybridSettings::default());
    let job = Job { integrator: hybrid, ..job(&scene, 4, 4, 2) };
    let limits = Limits { spp: 1, ..Limits::default() };
    for renderer in gpu_renderers("frames_leave_scenes_with_boundaries_to_others").iter_mut() {
        renderer.load(&scene).expect("a scene");
        let error = renderer.render(&job, &limits, &Control::new()).expect_err("a boundary");
        assert!(matches!(error, BackendError::Device { .. }), "the next one would be asked: {error:?}");
        assert!(format!("{error:?}").contains("boundaries"), "{error:?}");
    }
}

/// To everybody else boundaries are no surfaces, those of spheres neither.
#[test]
fn others_see_through_boundaries() {
    let scene = everything();
    let job = Job { integrator: Integrator::Aov, ..settings(&scene) };
    let (expected, _) = render(&mut Renderer::cpu(None).expect("threads"), &scene, &job, 2);
    for renderer in gpu_renderers("others_see_through_boundaries").iter_mut() {
        let (film, _) = render(renderer, &scene, &job, 2);
        for &aov in &job.aovs {
            let share = differing_layer(&film, &expected, aov);
            assert!(share <= 0.01, "{}: {aov} differs in {share} of the pixels", renderer.backend_name());
        }
    }
}
