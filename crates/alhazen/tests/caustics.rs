//! Switch by photons: their energy in closed form, the same light as `path` finds by chance, the same bits however the
//! work is divided, and that nothing changes where they are off.
//!
//! Samples that share a pass of photons are no independent ones, so noise is that between pictures of several seeds.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{
    Control, Description, Environment, Film, Integrator, Job, Light, LightKind, Limits, Merger, PartJob,
    PathSettings, Renderer, Scene, Switch, Tile,
};
use common::{from_above, job, render, render_with};
use glam::{Affine3A, Vec3};
use scene::{Material, Model};
use std::f64::consts::PI;
use testkit::scenes::{Build, camera, cuboid, dielectric, emitter, ground, lambert, quads, sphere};
use testkit::{Comparison, Estimate, WHOLE_IMAGE};

const ALBEDO: f32 = 0.5;

/// A picture with caustics as said.
fn with(caustics: Switch, job: Job) -> Job {
    let Integrator::Path(path) = job.integrator else { unreachable!("`job` follows paths") };
    Job { integrator: Integrator::Path(PathSettings { caustics, ..path }), ..job }
}

/// Pictures by photons of several seeds.
fn seeds(scene: &Scene, job: &Job, spp: u32, seeds: u32) -> Estimate {
    let films: Vec<Film> = (0..seeds).map(|seed| render(scene, &Job { seed, ..job.clone() }, spp)).collect();
    Estimate::from_renders(&films)
}

fn lamp(scene: &mut Scene, position: [f32; 3], intensity: f32) {
    let kind = LightKind::Point { position: position.into(), intensity: Vec3::splat(intensity) };
    scene.lights.push(Light::new("lamp", kind));
}

fn mirror() -> Material {
    Material { model: Model::Mirror, ..lambert("mirror", [1.0; 3]) }
}

/// A floor, and a camera that looks down on a spot of it.
fn floor(y: f32) -> Scene {
    let mut scene = Scene::default();
    let floor = scene.add_material(lambert("floor", [ALBEDO; 3]));
    scene.add_mesh("floor", ground(y, 10.0), floor);
    scene
}

/// Whether the mean of a picture is `expected`, to a share of it.
#[track_caller]
fn assert_close(what: &str, e: &Estimate, expected: f64, tolerance: f64) {
    for (c, mean) in e.mean_colour().into_iter().enumerate() {
        let off = mean / expected - 1.0;
        assert!(off.abs() < tolerance, "{what}: channel {c} is {mean} instead of {expected}: {off:+.4}");
    }
}

/// Light by a mirror is that of a lamp behind it, which shines through it as through a window.
#[test]
fn a_mirror_doubles_a_lamp() {
    let mut scene = floor(0.0);
    let wall = scene.add_material(mirror());
    // Faces the lamp, at x = 1.
    let corners = [[1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [1.0, 2.0, -1.0], [1.0, 2.0, 1.0]];
    scene.add_mesh("mirror", quads(&[corners]), wall);
    lamp(&mut scene, [-0.2, 1.0, 0.0], 3.0);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.02));
    // I cos θ / d² from the lamp and from its image at x = 2.2.
    let from = |x: f64| 3.0 / (x * x + 1.0).powf(1.5);
    let expected = f64::from(ALBEDO) / PI * (from(0.2) + from(2.2));
    let on = seeds(&scene, &with(Switch::On, job(&scene, 4, 4, 4)), 64, 4);
    assert_close("mirror", &on, expected, 0.01);
    let without = seeds(&scene, &job(&scene, 4, 4, 4), 64, 2);
    assert_close("without photons", &without, f64::from(ALBEDO) / PI * from(0.2), 0.01);
}

/// Under water, seen through water. Near the axis a lamp at height h over water of depth d seems to be at d / n + h; the
/// light that leaves the water has its radiance divided by n².
#[test]
fn light_through_water_and_back_has_the_energy_of_snell_and_fresnel() {
    let (n, h, d, intensity) = (1.333f64, 1.0, 0.8, 5.0);
    let mut scene = floor(-d as f32);
    let water = scene.add_material(dielectric("water", n as f32, 0.0));
    scene.add_mesh("water", ground(0.0, 1.0), water);
    lamp(&mut scene, [0.0, h as f32, 0.0], intensity as f32);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.02));
    let passes = 1.0 - ((n - 1.0) / (n + 1.0)).powi(2);
    let irradiance = intensity * passes / (h + d / n).powi(2);
    let expected = f64::from(ALBEDO) / PI * irradiance * passes / (n * n);
    // Longer paths go between floor and surface.
    let e = seeds(&scene, &with(Switch::On, job(&scene, 4, 4, 4)), 64, 4);
    assert_close("water", &e, expected, 0.01);
}

/// The same from inside: a lamp in glass lights a floor in air, where étendue shrinks.
#[test]
fn light_that_leaves_glass_has_the_energy_of_snell_and_fresnel() {
    let (n, h, d, intensity) = (1.5f64, 0.7, 0.6, 5.0);
    let mut scene = floor(-d as f32);
    let glass = scene.add_material(dielectric("glass", n as f32, 0.0));
    scene.add_mesh("glass", cuboid([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]), glass);
    lamp(&mut scene, [0.0, h as f32, 0.0], intensity as f32);
    // Below the glass, a hand's breadth above the floor.
    scene.cameras.push(from_above(0.0, 0.0, -0.5, 0.02));
    let passes = 1.0 - ((n - 1.0) / (n + 1.0)).powi(2);
    let irradiance = intensity * passes / (h / n + d).powi(2) / (n * n);
    let expected = f64::from(ALBEDO) / PI * irradiance;
    // Three segments: none by the block's other sides.
    let e = seeds(&scene, &with(Switch::On, job(&scene, 4, 4, 3)), 64, 4);
    assert_close("from glass", &e, expected, 0.01);
}

/// A large lamp, seen through a ball of glass and in polished metal, on which paths sample it, too.
fn findable() -> Scene {
    let mut scene = floor(0.0);
    let glass = scene.add_material(dielectric("glass", 1.5, 0.0));
    scene.add_shape("ball", sphere([0.0, 0.6, 0.0], 0.5), glass, Affine3A::IDENTITY);
    let polished = scene.add_material(Material { metallic: 1.0, roughness: 0.08, ..lambert_like_metal() });
    let standing = [[0.9, 0.0, 0.6], [0.9, 0.0, -0.6], [0.9, 0.9, -0.6], [0.9, 0.9, 0.6]];
    scene.add_mesh("metal", quads(&[standing]), polished);
    let panel = scene.add_material(emitter("panel", [4.0, 3.0, 2.0]));
    let down = [[-1.0, 2.5, -1.0], [1.0, 2.5, -1.0], [1.0, 2.5, 1.0], [-1.0, 2.5, 1.0]];
    scene.add_mesh("panel", quads(&[down]), panel);
    scene.environment = Environment::Constant(Vec3::splat(0.1));
    scene.cameras.push(camera([0.2, 2.2, 3.4], [0.1, 0.2, 0.0], 40.0));
    scene
}

fn lambert_like_metal() -> Material {
    Material { model: Model::MetallicRoughness, ..lambert("metal", [0.9, 0.8, 0.7]) }
}

#[test]
fn photons_bring_the_light_that_paths_find_by_chance() {
    let scene = findable();
    let job = job(&scene, 32, 32, 6);
    let by_chance = seeds(&scene, &job, 512, 4);
    let by_photons = seeds(&scene, &with(Switch::On, job), 64, 8);
    for block in [8, WHOLE_IMAGE] {
        Comparison::new("photons", block).assert(&by_chance, &by_photons);
    }
}

#[test]
fn threads_and_parts_change_no_bit() {
    let scene = findable();
    let job = with(Switch::On, job(&scene, 24, 20, 6));
    let (one, _) = render_with(&scene, &job, 7, Some(1));
    let (three, _) = render_with(&scene, &job, 7, Some(3));
    assert!(one == three, "threads");
    let about = Description::new("caustics", &[], &scene);
    let mut renderer = Renderer::cpu(Some(2)).unwrap();
    renderer.load(&scene).unwrap();
    let mut part = |job: &Job, samples: std::ops::Range<u32>, index: u32| {
        let tile = Some(Tile { index, count: 2 });
        let part_job = PartJob { tile, samples: Some(samples), ..PartJob::whole(job, 7, &about) };
        renderer.render_part(&part_job, None, &Control::new(), None).unwrap().0
    };
    let mut merger = Merger::new();
    merger.add("first", part(&job, 0..3, 0)).unwrap();
    let off = part(&with(Switch::Off, job.clone()), 3..7, 0);
    assert!(merger.add("off", off).is_err(), "parts of other pictures");
    for (samples, tile) in [(0..3, 1), (3..7, 0), (3..7, 1)] {
        merger.add("more", part(&job, samples, tile)).unwrap();
    }
    let merged = merger.finish().unwrap();
    assert!(merged.film().pixels() == one.pixels(), "parts");
}

#[test]
fn the_error_falls_as_photons_are_added() {
    let mut scene = floor(0.0);
    let wall = scene.add_material(mirror());
    let corners = [[1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [1.0, 2.0, -1.0], [1.0, 2.0, 1.0]];
    scene.add_mesh("mirror", quads(&[corners]), wall);
    lamp(&mut scene, [-0.2, 1.0, 0.0], 3.0);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.02));
    let job = with(Switch::On, job(&scene, 2, 2, 4));
    let error = |spp| {
        let films: Vec<_> = (0..24)
            .map(|seed| Estimate::from_film(&render(&scene, &Job { seed, ..job.clone() }, spp)))
            .collect();
        let means: Vec<f64> = films.iter().map(|e| e.mean_colour()[0]).collect();
        let mean = means.iter().sum::<f64>() / 24.0;
        means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 23.0
    };
    // Eight times the passes: the variance falls as their number to the power α = 2/3, to a quarter; of 24 seeds it is
    // known to a third.
    let ratio = error(32) / error(4);
    assert!(ratio < 0.45, "{ratio}");
}

#[test]
fn where_nothing_makes_caustics_auto_is_off_and_changes_no_bit() {
    let scene = testkit::scenes::cornell();
    let mut renderer = Renderer::cpu(Some(2)).unwrap();
    renderer.load(&scene).unwrap();
    let off = job(&scene, 24, 24, 5);
    let mut auto = with(Switch::Auto, off.clone());
    let limits = Limits { spp: 5, ..Limits::default() };
    renderer.render(&auto, &limits, &Control::new()).unwrap();
    let picture = renderer.film().unwrap().unwrap().clone();
    renderer.render(&off, &limits, &Control::new()).unwrap();
    assert!(picture.pixels() == renderer.film().unwrap().unwrap().pixels());
    let told = renderer.settle_caustics(&mut auto).unwrap();
    assert!(told.starts_with("caustics: off (nothing mirrors"), "{told}");
    assert_eq!(auto, off);

    let mut small = findable();
    renderer.load(&small).unwrap();
    let told = renderer.settle_caustics(&mut with(Switch::Auto, off.clone())).unwrap();
    assert!(told.starts_with("caustics: off (no light is small"), "{told}");
    lamp(&mut small, [0.0, 2.0, 0.0], 1.0);
    renderer.load(&small).unwrap();
    let mut auto = with(Switch::Auto, off);
    assert!(renderer.settle_caustics(&mut auto).unwrap().starts_with("caustics: on"));
    assert_eq!(auto, with(Switch::On, auto.clone()));
}
