//! A scene that changed gives the same picture as the new one loaded from scratch, on every back end.

mod common;

use alhazen::{Control, Film, Job, Limits, Renderer, Scene};
use common::on_gpus::compare_on;
use common::{gpu_renderers, job};
use glam::{Affine3A, Vec3};
use gpu::tracer::TracerKind;
use gpu::{Gpu, GpuBackend, GpuOptions, has_hardware};
use scene::tables::{Changes, SceneTables};
use scene::{Environment, Image, Instance, Light, LightKind, Material, Mesh, Pixels};
use testkit::{Exclusive, scenes};

const SPP: u32 = 4;

/// The Cornell box under a sky, with a second, movable copy of each of its meshes.
fn before() -> Scene {
    let mut scene = scenes::cornell();
    let copies: Vec<Instance> = scene
        .instances
        .iter()
        .map(|i| {
            let smaller = Affine3A::from_scale(Vec3::splat(0.3)) * i.transform;
            Instance { dynamic: true, ..Instance::new("copy", i.mesh, smaller) }
        })
        .collect();
    scene.instances.iter_mut().for_each(|i| i.dynamic = true);
    scene.instances.extend(copies);
    scene
}

/// The names of the changes, each with a scene that `before` was changed into.
fn versions() -> Vec<(&'static str, Scene, Changes)> {
    let mut painted = before();
    let matte = painted.materials.iter().position(|m| m.emission == Vec3::ZERO).expect("a matte material");
    painted.materials[matte] = Material { emission: Vec3::ZERO, ..scenes::dielectric("new", 1.5, 0.0) };

    let mut moved = before();
    for instance in &mut moved.instances {
        instance.transform = Affine3A::from_rotation_y(0.3) * instance.transform;
    }

    let mut lit = before();
    for material in lit.materials.iter_mut().filter(|m| m.emission != Vec3::ZERO) {
        material.emission *= Vec3::new(0.2, 0.5, 2.0);
    }

    let mut sky = before();
    let blue = Vec3::new(0.1, 0.2, 0.9);
    sky.environment = Environment::Constant(blue);

    let changes = Changes::default();
    vec![
        ("materials", painted, Changes { materials: true, ..changes }),
        ("transforms", moved, Changes { transforms: true, ..changes }),
        ("lights", lit, Changes { materials: true, lights: true, ..changes }),
        ("environment", sky, Changes { environment: true, ..changes }),
    ]
}

fn picture(renderer: &mut Renderer, job: &Job) -> Film {
    let limits = Limits { spp: SPP, ..Limits::default() };
    renderer.render(job, &limits, &Control::new()).expect("render");
    renderer.film().expect("film").expect("rendered").clone()
}

#[track_caller]
fn assert_equal(what: &str, a: &Film, b: &Film) {
    let differs = |(a, b): (&film::PixelStats, &film::PixelStats)| {
        a.mean().iter().zip(b.mean()).any(|(a, b)| (a - b).abs() > 1e-4 * (a.abs() + b.abs()))
    };
    let differing = a.pixels().iter().zip(b.pixels()).filter(|&p| differs(p)).count();
    assert!(differing * 200 <= a.pixels().len(), "{what}: {differing} of {} pixels differ", a.pixels().len());
}

/// Walks through all versions and back, one update after the other.
fn check(renderer: &mut Renderer) {
    let old = before();
    let job = job(&old, 16, 16, 4);
    renderer.load(&old).expect("load");
    let first = picture(renderer, &job);
    for (what, new, _) in versions() {
        let name = format!("{what} on {}", renderer.backend_name());
        renderer.update(&new).expect("update");
        let updated = picture(renderer, &job);
        renderer.load(&new).expect("load");
        assert_equal(&name, &updated, &picture(renderer, &job));
        let unlike =
            first.pixels().iter().zip(updated.pixels()).filter(|(a, b)| a.mean() != b.mean()).count();
        assert!(unlike * 20 > first.pixels().len(), "{name}: the change is not to be seen");
        renderer.load(&new).expect("load");
        renderer.update(&old).expect("update");
        assert_equal(&format!("{name}, and back"), &picture(renderer, &job), &first);
    }
}

#[test]
fn changes_are_recognised() {
    let old = SceneTables::build(&before());
    for (what, new, expected) in versions() {
        let changes = Changes::between(&old, &SceneTables::build(&new)).expect(what);
        // What shines may move or change with something else: more may have changed, but nothing else.
        assert!(!changes.is_empty(), "{what}");
        assert!(changes.materials || !expected.materials, "{what}: {changes:?}");
        assert!(changes.transforms == expected.transforms, "{what}: {changes:?}");
        assert!(changes.lights || !expected.lights, "{what}: {changes:?}");
        assert!(changes.environment == expected.environment, "{what}: {changes:?}");
    }
    assert!(Changes::between(&old, &old).is_some_and(|c| c.is_empty()));
}

#[test]
fn other_geometry_textures_or_holes_are_more_than_a_change() {
    let old = SceneTables::build(&before());
    let mut grown = before();
    grown.meshes.push(Mesh::default());
    let copy = grown.instances[0].clone();
    grown.instances.push(copy);
    let mut holed = before();
    holed.materials[0] = scenes::covering(holed.materials[0].clone(), 0.5);
    let mut textured = before();
    let pixels = Pixels::Rgba8(vec![[9; 4]]);
    textured.images.push(Image { name: "texel".into(), width: 1, height: 1, pixels });
    let (sampler, color_space) = (scene::Sampler::default(), scene::ColorSpace::Srgb);
    textured.textures.push(scene::Texture::image(0, sampler, color_space));
    for (what, new) in [("instance", grown), ("holes", holed), ("texture", textured)] {
        assert_eq!(Changes::between(&old, &SceneTables::build(&new)), None, "{what}");
    }
}

#[test]
fn updates_on_the_cpu() {
    check(&mut Renderer::cpu(None).expect("threads"));
}

#[test]
fn updates_on_gpus() {
    for renderer in gpu_renderers("updates_on_gpus").iter_mut() {
        check(renderer);
    }
}

/// Instances that share a mesh and do not say that they will be moved are made one structure where that is faster. They can be moved
/// all the same, more than once.
#[test]
fn instances_move_that_did_not_say_so() {
    let test = "instances_move_that_did_not_say_so";
    let mut old = before();
    old.instances.iter_mut().for_each(|i| i.dynamic = false);
    assert!(!SceneTables::build(&old).has_dynamic_instances);
    let job = job(&old, 16, 16, 4);
    let turned = |by: f32| {
        let mut scene = old.clone();
        scene.instances.iter_mut().for_each(|i| i.transform = Affine3A::from_rotation_y(by) * i.transform);
        scene
    };
    for renderer in gpu_renderers(test).iter_mut() {
        renderer.load(&old).expect("load");
        let first = picture(renderer, &job);
        for by in [0.2, 0.4] {
            let new = turned(by);
            renderer.update(&new).expect("update");
            let updated = picture(renderer, &job);
            let unlike = first.pixels().iter().zip(updated.pixels()).filter(|(a, b)| a.mean() != b.mean());
            assert!(unlike.count() * 20 > first.pixels().len(), "{by}: nothing has moved");
            let mut fresh = Renderer::cpu(None).expect("threads");
            fresh.load(&new).expect("load");
            assert_equal(
                &format!("{by} on {}", renderer.backend_name()),
                &updated,
                &picture(&mut fresh, &job),
            );
        }
    }
}

/// A renderer whose shaders know what is in the scene (`knows`), or leave that open.
fn specialised(test: &str, knows: bool) -> Option<Renderer> {
    let opened = Gpu::open(&GpuOptions::default()).and_then(|gpu| GpuBackend::new(gpu, TracerKind::Bvh));
    let mut backend = opened.map_err(|e| testkit::skip_without_gpu(test, &e.to_string())).ok()?;
    backend.set_specialisation(knows);
    Some(Renderer::new(Box::new(backend)))
}

/// Shaders that know no material and no light but those of the scene are not kept when the scene becomes another.
#[test]
fn shaders_know_what_is_in_the_scene() {
    let plain = scenes::cornell();
    let mut two_lamps = plain.clone();
    let kind = LightKind::Point { position: Vec3::new(1.0, 4.0, 1.5), intensity: Vec3::splat(20.0) };
    two_lamps.lights.push(Light::new("bulb", kind));
    let mut glass = two_lamps.clone();
    let matte = glass.materials.iter().position(|m| m.emission == Vec3::ZERO).expect("a matte material");
    glass.materials[matte] = scenes::dielectric("new", 1.5, 0.0);
    let renderers = || {
        let test = "shaders_know_what_is_in_the_scene";
        Some([specialised(test, false)?, specialised(test, true)?])
    };
    let mut renderers = Exclusive::new(has_hardware(), renderers);
    let Some([general, special]) = &mut *renderers else { return };
    let job = job(&plain, 16, 16, 4);
    special.load(&plain).expect("load");
    for (what, scene) in [("one lamp", &plain), ("two lamps", &two_lamps), ("glass", &glass)] {
        general.load(scene).expect("load");
        special.update(scene).expect("update");
        assert_equal(what, &picture(general, &job), &picture(special, &job));
    }
}

/// Shaders that know what is in a scene show all of it: images of every kind, and graphs.
#[test]
fn shaders_that_know_their_scene_leave_out_nothing_of_it() {
    let test = "shaders_that_know_their_scene_leave_out_nothing_of_it";
    let graphs = alhazen::Source::parse("textures").load(&Default::default()).expect("built in").scene;
    let mut renderers = Exclusive::new(has_hardware(), || specialised(test, true));
    let Some(special) = &mut *renderers else { return };
    for (what, scene, share) in [("assortment", &scenes::assortment(), 0.35), ("graphs", &graphs, 0.2)] {
        let name = format!("{what} by shaders that know it");
        compare_on(std::slice::from_mut(special), &name, scene, &job(scene, 48, 48, 8), share);
    }
}

/// Shaders that need not sample lamps that are near are not kept when something comes near one.
#[test]
fn something_may_come_near_a_lamp() {
    let test = "something_may_come_near_a_lamp";
    let mut far = scenes::cornell();
    far.instances.iter_mut().for_each(|i| i.dynamic = true);
    let mut near = far.clone();
    let short = near.instances.iter_mut().find(|i| i.name == "short").expect("a box");
    short.transform = Affine3A::from_translation(Vec3::Y * 3.0) * short.transform;
    let may_be_near = |scene| SceneTables::build(scene).surfaces_may_be_near_flat_lights();
    assert!(!may_be_near(&far) && may_be_near(&near));
    let job = job(&far, 16, 16, 4);
    let mut renderers =
        Exclusive::new(has_hardware(), || Some([specialised(test, false)?, specialised(test, true)?]));
    let Some([general, special]) = &mut *renderers else { return };
    general.load(&far).expect("load");
    special.load(&far).expect("load");
    assert_equal("far", &picture(general, &job), &picture(special, &job));
    for (what, scene) in [("near", &near), ("far again", &far)] {
        general.load(scene).expect("load");
        special.update(scene).expect("update");
        assert_equal(what, &picture(general, &job), &picture(special, &job));
    }
}
