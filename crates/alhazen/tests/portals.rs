//! Portals of the environment change noise and nothing else, and every back end samples them alike.

mod common;

use alhazen::{Environment, Job, Pixels, Portal, Scene, SceneImage, Sky};
use common::on_gpus::compare_on;
use common::{assert_same_coarse, estimate, gpu_renderers, job};
use glam::{Vec3, vec3};
use scene::{Fog, Medium};
use testkit::Estimate;
use testkit::scenes::{Build, camera, lambert, quads};

/// What a room's window lets in.
const WINDOW: [[f32; 3]; 4] = [[2.0, 0.9, -0.5], [2.0, 2.1, -0.5], [2.0, 2.1, 0.5], [2.0, 0.9, 0.5]];

fn portal(corners: [[f32; 3]; 4]) -> Portal {
    Portal::new(corners.map(Vec3::from)).expect("a rectangle")
}

/// A room of 4 × 2.5 × 4 m that light comes into by a window in the wall at x = 2, and by nothing else.
fn room(environment: Environment) -> Scene {
    let mut scene = Scene { name: "room".into(), environment, ..Scene::default() };
    let wall = scene.add_material(lambert("wall", [0.7, 0.65, 0.6]));
    let [x, y, z] = [[-2.0, 2.0], [0.0, 2.5], [-2.0, 2.0]];
    let beside = |y: [f64; 2], z: [f64; 2]| {
        [[x[1], y[0], z[0]], [x[1], y[1], z[0]], [x[1], y[1], z[1]], [x[1], y[0], z[1]]]
    };
    let sides = [
        [[x[0], y[0], z[0]], [x[0], y[0], z[1]], [x[1], y[0], z[1]], [x[1], y[0], z[0]]],
        [[x[0], y[1], z[0]], [x[1], y[1], z[0]], [x[1], y[1], z[1]], [x[0], y[1], z[1]]],
        [[x[0], y[0], z[0]], [x[0], y[1], z[0]], [x[0], y[1], z[1]], [x[0], y[0], z[1]]],
        [[x[0], y[0], z[0]], [x[1], y[0], z[0]], [x[1], y[1], z[0]], [x[0], y[1], z[0]]],
        [[x[0], y[0], z[1]], [x[0], y[1], z[1]], [x[1], y[1], z[1]], [x[1], y[0], z[1]]],
        beside([y[0], 0.9], z),
        beside([2.1, y[1]], z),
        beside([0.9, 2.1], [z[0], -0.5]),
        beside([0.9, 2.1], [0.5, z[1]]),
    ];
    scene.add_mesh("walls", quads(&sides), wall);
    scene.cameras.push(camera([-1.8, 1.4, -1.6], [1.0, 0.7, 0.8], 70.0));
    scene
}

fn gradient() -> Environment {
    let [horizon, zenith, ground] = [vec3(1.0, 0.9, 0.8), vec3(0.3, 0.5, 1.0), Vec3::splat(0.2)];
    Environment::Sky(Sky { horizon, zenith, ground, sun: None })
}

/// A room under a picture of a sky that is brighter on one side.
fn room_under_a_picture() -> Scene {
    let mut scene = room(Environment::Image { image: 0, rotation: 0.0, intensity: 1.0 });
    let pixels = (0..16 * 8).map(|i| [0.4 + 4.0 * f32::from(u8::from(i == 43)), 0.5, 0.6]).collect();
    scene.images.push(SceneImage {
        name: "sky".into(),
        width: 16,
        height: 8,
        pixels: Pixels::Rgb32F(pixels),
    });
    scene
}

/// Variance of a sample relative to the pixel's squared mean, of the pixel in the middle: those at the window's edge see it or not,
/// whatever is sampled.
fn noise(e: &Estimate, spp: u32) -> f64 {
    let relative = |(variance, mean): (&[f64; 3], &[f64; 3])| variance[1] / (mean[1] * mean[1]);
    let mut of_pixels: Vec<f64> = e.variance.iter().zip(&e.mean).map(relative).collect();
    of_pixels.sort_by(f64::total_cmp);
    of_pixels[of_pixels.len() / 2] * f64::from(spp)
}

const WITHOUT: u32 = 256;
const WITH: u32 = 64;

/// Renders without portals and with them; how much less noise the portals leave.
fn gain(what: &str, scene: &Scene, portals: Vec<Portal>) -> f64 {
    let base = Job { seed: 1, ..job(scene, 40, 30, 4) };
    let without = estimate(scene, &base, WITHOUT);
    let with = Scene { portals, ..scene.clone() };
    let with = estimate(&with, &Job { seed: 2, ..base }, WITH);
    assert_same_coarse(&format!("portals-{what}"), &with, &without);
    let gain = noise(&without, WITHOUT) / noise(&with, WITH);
    println!("{what}: {gain:.2} times less variance");
    gain
}

#[test]
fn a_window_lets_the_same_light_in_with_less_noise() {
    let constant = room(Environment::Constant(Vec3::ONE));
    assert!(gain("constant", &constant, vec![portal(WINDOW)]) > 50.0);
    assert!(gain("gradient", &room(gradient()), vec![portal(WINDOW)]) > 50.0);
    assert!(gain("picture", &room_under_a_picture(), vec![portal(WINDOW)]) > 8.0);
}

/// Wherever portals are, the picture has the same light: one that covers half of the window, one in a wall, one behind another.
#[test]
fn portals_beside_the_window_take_no_light_away() {
    let scene = room(gradient());
    let half = WINDOW.map(|[x, y, z]| [x, y, z.min(0.0)]);
    gain("half", &scene, vec![portal(half)]);
    let aside = WINDOW.map(|[x, y, z]| [-x, y, z]);
    let behind = WINDOW.map(|[x, y, z]| [x + 0.5, y + 0.3, z]);
    gain("three", &scene, vec![portal(aside), portal(WINDOW), portal(behind)]);
}

/// In fog, light is scattered by what is between the walls.
#[test]
fn portals_light_fog() {
    let mut scene = room(gradient());
    let scattering = Vec3::splat(0.3);
    let none = Vec3::ZERO;
    let medium = Medium { absorption: none, scattering, emission: none, anisotropy: 0.0, density: None };
    scene.fog = Some(Fog { medium, top: 3.0 });
    gain("fog", &scene, vec![portal(WINDOW)]);
}

/// One tracer is enough: portals ask none, and are the same text for all.
#[test]
fn gpus_sample_portals() {
    let mut renderers = gpu_renderers("gpus_sample_portals");
    renderers.truncate(1);
    let mut scene = room_under_a_picture();
    let behind = WINDOW.map(|[x, y, z]| [x + 0.5, y + 0.3, z]);
    scene.portals = vec![portal(WINDOW), portal(behind)];
    compare_on(&mut renderers, "gpus_sample_portals", &scene, &job(&scene, 40, 30, 4), 0.03);
}
