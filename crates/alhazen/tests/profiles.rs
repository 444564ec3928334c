//! Lamps whose intensity depends on direction: against closed forms, and GPUs against the CPU.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{Light, LightKind, LightProfile, Photometry, Scene};
use common::on_gpus::compare_on;
use common::{assert_mean, estimate, from_above, gpu_renderers, job, render};
use glam::Vec3;
use std::f64::consts::PI;
use std::sync::Arc;
use testkit::scenes::{Build, camera, ground, lambert};

/// Offsets of ray origins and the finite spot that is looked at.
const TOLERANCE: f64 = 3e-3;

/// A profile of steps of one degree, and of 15 around the axis; `of`: the intensity at a vertical and a horizontal angle, radians.
fn profile(of: impl Fn(f32, f32) -> f32) -> Arc<LightProfile> {
    let angles = |i: u32| ((i / 24) as f32).to_radians().min(std::f32::consts::PI);
    let values = (0..181 * 24).map(|i| of(angles(i), ((i % 24) as f32 * 15.0).to_radians())).collect();
    Arc::new(LightProfile::new(181, 24, values, 1.0).expect("a profile"))
}

fn lamp(position: Vec3, intensity: f32, photometry: Photometry) -> Light {
    let kind = LightKind::Point { position, intensity: Vec3::splat(intensity) };
    Light { profile: Some(photometry), ..Light::new("lamp", kind) }
}

/// A floor of reflectance 0.5 and a camera that looks straight down on a small spot at its origin.
fn floor_spot(lights: Vec<Light>) -> Scene {
    let mut scene = Scene { lights, ..Scene::default() };
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", ground(0.0, 10.0), floor);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.01));
    scene
}

/// Asserts what irradiance the floor's spot gets.
#[track_caller]
fn assert_irradiance(what: &str, lights: Vec<Light>, expected: f64) {
    let scene = floor_spot(lights);
    let e = estimate(&scene, &job(&scene, 8, 8, 2), 16);
    assert_mean(what, &e, [0.5 * expected / PI; 3], TOLERANCE);
}

#[test]
fn a_profile_that_is_the_same_everywhere_changes_no_bit() {
    let kinds = [
        LightKind::Point { position: Vec3::new(0.3, 1.0, 0.2), intensity: Vec3::new(3.0, 2.0, 1.0) },
        LightKind::Spot {
            position: Vec3::new(-0.5, 1.0, 0.0),
            direction: Vec3::new(0.5, -1.0, 0.0).normalize(),
            intensity: Vec3::ONE,
            inner_angle: 0.2,
            outer_angle: 0.9,
        },
    ];
    for kind in kinds {
        let even = Photometry::aimed(profile(|_, _| 1.0), Vec3::new(0.6, 0.0, 0.8), 0.3);
        let scenes =
            [None, Some(even)].map(|profile| floor_spot(vec![Light { profile, ..Light::new("lamp", kind) }]));
        let [plain, even] = scenes.map(|scene| render(&scene, &job(&scene, 8, 8, 3), 8).to_image());
        assert!(plain.mean()[0] > 0.0 && plain.data() == even.data(), "{kind:?}");
    }
}

/// I cos α, α from the lamp's own axis: hanging straight, and aimed aside.
#[test]
fn a_lamp_that_shines_by_the_cosine() {
    let cosine = profile(|vertical, _| vertical.cos().max(0.0));
    for (at, axis) in [
        (Vec3::new(0.0, 1.5, 0.0), Vec3::NEG_Y),
        (Vec3::new(0.8, 1.0, -0.4), Vec3::NEG_Y),
        (Vec3::new(0.8, 1.0, -0.4), Vec3::new(-0.2, -1.0, 0.9).normalize()),
    ] {
        let to_spot = -at.normalize();
        let along = f64::from(to_spot.dot(axis));
        let expected = 4.0 * along * f64::from(at.y) / f64::from(at.length()).powi(3);
        let light = lamp(at, 4.0, Photometry::aimed(cosine.clone(), axis, 0.0));
        assert_irradiance(&format!("{at} aimed along {axis}"), vec![light], expected);
    }
}

/// Horizontal angles grow anticlockwise from +X, seen from above; `turn` turns the lamp the same way.
#[test]
fn lamps_know_their_sides() {
    // Brightest at 90°, dark at 270°.
    let sided = profile(|_, horizontal| 0.5 + 0.5 * horizontal.sin());
    let aside = |x: f32, z: f32| Vec3::new(x, 1.0, z);
    for (at, turn, share) in [
        // The spot is seen from the lamp towards −Z, +Z, +X.
        (aside(0.0, 1.0), 0.0, 1.0),
        (aside(0.0, -1.0), 0.0, 0.0),
        (aside(-1.0, 0.0), 0.0, 0.5),
        (aside(-1.0, 0.0), -std::f32::consts::FRAC_PI_2, 1.0),
    ] {
        let light = lamp(at, 4.0, Photometry::aimed(sided.clone(), Vec3::NEG_Y, turn));
        let expected = share * 4.0 / f64::from(at.length()).powi(3);
        if share == 0.0 {
            let scene = floor_spot(vec![light]);
            let mean = render(&scene, &job(&scene, 8, 8, 2), 4).to_image().mean()[0];
            assert!(mean < 1e-3, "{at}: {mean}");
        } else {
            assert_irradiance(&format!("{at} turned by {turn}"), vec![light], expected);
        }
    }
}

/// A spot's cone and its profile multiply.
#[test]
fn spots_have_profiles_within_their_cones() {
    let (inner_angle, outer_angle) = (0.5, 1.0);
    let position = Vec3::new(0.7, 1.0, 0.0);
    let kind =
        LightKind::Spot { position, direction: Vec3::NEG_Y, intensity: Vec3::ONE, inner_angle, outer_angle };
    let cosine = Photometry::aimed(profile(|vertical, _| vertical.cos().max(0.0)), Vec3::NEG_Y, 0.0);
    let light = Light { profile: Some(cosine), ..Light::new("spot", kind) };
    let cos = f64::from(position.y / position.length());
    let (inner, outer) = (f64::from(inner_angle).cos(), f64::from(outer_angle).cos());
    let falloff = ((cos - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2);
    let expected = falloff * cos * cos / f64::from(position.length()).powi(2);
    assert_irradiance("spot", vec![light], expected);
}

/// A row of lamps that share a profile, each turned otherwise.
fn row() -> Vec<Light> {
    let shared = profile(|vertical, horizontal| {
        0.5 * (1.0 + (2.0 * horizontal).cos()) * vertical.cos().powi(2) * f32::from(vertical < 1.6)
    });
    let one = |i: usize| {
        let axis = Vec3::new(0.3 * (i as f32).sin(), -1.0, 0.3 * (i as f32).cos()).normalize();
        let photometry = Photometry::aimed(shared.clone(), axis, 0.5 * i as f32);
        lamp(Vec3::new(0.4 * i as f32 - 2.2, 1.0 + 0.1 * i as f32, -0.5), 1.0, photometry)
    };
    (0..12).map(one).collect()
}

/// Twelve lamps are chosen by a tree: together they give what each gives by itself.
#[test]
fn chosen_lamps_add_up() {
    let mean = |lights: Vec<Light>| {
        let scene = floor_spot(lights);
        estimate(&scene, &job(&scene, 8, 8, 2), 32).mean_colour()[0]
    };
    let alone: f64 = row().into_iter().map(|light| mean(vec![light])).sum();
    let scene = floor_spot(row());
    let together = estimate(&scene, &job(&scene, 16, 16, 2), 1024);
    assert_mean("together", &together, [alone; 3], TOLERANCE);
}

/// One tracer is enough: profiles ask none, and are the same text for all.
#[test]
fn gpus_know_profiles() {
    // So few that they are chosen by power: software drivers take long to compile the tree's walk, and it knows no profiles.
    let lamps = row().into_iter().step_by(3).collect();
    let mut scene = floor_spot(lamps);
    scene.cameras = vec![camera([0.0, 2.5, 3.0], [0.0, 0.0, 0.0], 50.0)];
    let mut renderers = gpu_renderers("gpus_know_profiles");
    renderers.truncate(1);
    compare_on(&mut renderers, "profiles path", &scene, &job(&scene, 48, 48, 2), 0.02);
}
