//! Lights do not starve: the noise of each one's own contribution is that of the light alone with its share of the samples, or
//! little more, however large the scene is, and however strong and of whatever colour the others are.
//!
//! A light's contribution is measured by itself where no other light shines in the same channel. Colours do not matter to the choice
//! of a light but by their strongest channel, so the choice stays that of white lights.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{
    Control, Environment, Film, Job, Light, LightKind, Limits, Renderer, SamplerKind, Scene, SceneImage, Sky,
};
use common::{from_above, gpu_renderers, job, render};
use glam::{Affine3A, Vec3};
use scene::load::LoadOptions;
use scene::tables::SceneTables;
use scene::{Fog, Medium, Pixels, Portal, Sun};
use std::path::PathBuf;
use testkit::scenes::{Build, cuboid, emitter, ground, lambert, quads, sphere};

const SIZE: u32 = 16;
const SPP: u32 = 64;

/// Uniform numbers in `[0, 1)`, other ones for each seed.
struct Numbers(u32);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = optics::random::pcg_hash(self.0);
        optics::random::unit_float(self.0)
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next()
    }
}

/// Kinds of lights, of [`add_light`].
const BALL: u32 = 3;
const PANEL: u32 = 4;

/// Adds a light over the camera's square, which gives it an irradiance of about `color`.
fn add_light(scene: &mut Scene, kind: u32, color: Vec3, numbers: &mut Numbers) {
    let place = Vec3::new(numbers.between(-0.6, 0.6), numbers.between(0.5, 0.9), numbers.between(-0.6, 0.6));
    let intensity = color * place.y * place.y;
    let mut add = |kind| scene.lights.push(Light::new("light", kind));
    match kind {
        0 => add(LightKind::Point { position: place, intensity }),
        1 => add(LightKind::Spot {
            position: place,
            direction: Vec3::new(0.2, -1.0, 0.1).normalize(),
            intensity,
            inner_angle: 0.3,
            outer_angle: 0.6,
        }),
        2 => add(LightKind::Directional {
            direction: Vec3::new(0.3, -1.0, place.z).normalize(),
            irradiance: color,
            angular_diameter: 0.0,
        }),
        BALL => {
            let material = scene.add_material(emitter("ball", (intensity / 0.0314).to_array()));
            scene.add_shape("ball", sphere(place.to_array(), 0.1), material, Affine3A::IDENTITY);
        }
        PANEL => {
            let material = scene.add_material(emitter("panel", (intensity / 0.04).to_array()));
            let [x, y, z] = place.to_array().map(f64::from);
            let corners = [[x, y, z], [x + 0.2, y, z], [x + 0.2, y, z + 0.2], [x, y, z + 0.2]];
            scene.add_mesh("panel", quads(&[corners]), material);
        }
        5 => {
            let black = Vec3::ZERO;
            let sun = Sun {
                direction: Vec3::new(0.5, 1.0, 0.3).normalize(),
                irradiance: color,
                angular_radius: 0.02,
            };
            scene.environment =
                Environment::Sky(Sky { horizon: black, zenith: black, ground: black, sun: Some(sun) });
        }
        _ => {
            let pixels = Pixels::Rgb32F(vec![(color / 3.1).to_array(); 8 * 4]);
            scene.images.push(SceneImage { name: "sky".into(), width: 8, height: 4, pixels });
            scene.environment = Environment::Image { image: 0, rotation: 0.0, intensity: 1.0 };
        }
    }
}

/// A floor of half the side `half`, a roof over a part of it, and lights of these kinds and colours.
fn floor(half: f32, lights: &[(u32, Vec3)], seed: u32) -> Scene {
    let mut scene = Scene { name: format!("floor of {half} m"), ..Scene::default() };
    let material = scene.add_material(lambert("floor", [0.7; 3]));
    scene.add_mesh("floor", ground(0.0, half), material);
    // Only some lights come from above it: the others are hidden from where they seem to be bright.
    scene.add_mesh("roof", cuboid([-0.9, 0.35, -0.9], [-0.3, 0.36, 0.9]), material);
    let mut numbers = Numbers(seed);
    for &(kind, color) in lights {
        add_light(&mut scene, kind, color, &mut numbers);
    }
    scene.cameras.push(from_above(0.2, 0.0, 0.3, 1.4));
    scene
}

/// The same in a room whose ceiling has a window with a portal.
fn room(half: f32, lights: &[(u32, Vec3)], seed: u32) -> Scene {
    let mut scene = floor(half, lights, seed);
    scene.name = "room with a window".into();
    let (a, h, w) = (2.0, 1.0, 0.4);
    let wall = |x0, z0, x1, z1| [[x0, 0.0, z0], [x1, 0.0, z1], [x1, h, z1], [x0, h, z0]];
    let ceiling = |x0, z0, x1, z1| [[x0, h, z0], [x1, h, z0], [x1, h, z1], [x0, h, z1]];
    let walls = [wall(-a, -a, a, -a), wall(a, -a, a, a), wall(a, a, -a, a), wall(-a, a, -a, -a)];
    let strips = [ceiling(-a, -a, a, -w), ceiling(-a, w, a, a), ceiling(-a, -w, -w, w), ceiling(w, -w, a, w)];
    scene.add_mesh("walls", quads(&[walls, strips].concat()), 0);
    let window = ceiling(-w, -w, w, w).map(|corner| glam::DVec3::from_array(corner).as_vec3());
    scene.portals.push(Portal::new(window).expect("a rectangle"));
    scene
}

/// The same in fog that scatters about half of the light.
fn fog(half: f32, lights: &[(u32, Vec3)], seed: u32) -> Scene {
    let scattering = Vec3::splat(1.5);
    let medium =
        Medium { absorption: Vec3::ZERO, scattering, emission: Vec3::ZERO, anisotropy: 0.0, density: None };
    Scene { fog: Some(Fog { medium, top: 1.0 }), ..floor(half, lights, seed) }
}

/// Kinds and strengths of the lights of a scene: of those that are infinitely far away at most one of a kind.
fn lamps(count: u32, seed: u32) -> Vec<(u32, f32)> {
    let mut numbers = Numbers(0x51ed ^ seed);
    let kind = |i: u32| match (i + seed) % 7 {
        // A scene has one environment, with a sun or an image.
        5 if i >= 7 => 0,
        6 if i >= 7 || (0..i).any(|before| (before + seed) % 7 == 5) => 3,
        5 if (0..i).any(|before| (before + seed) % 7 == 6) => 1,
        kind => kind,
    };
    (0..count).map(|i| (kind(i), 10.0_f32.powf(numbers.between(-3.0, 3.0)))).collect()
}

/// The unit vector of a channel.
fn channel(c: usize) -> Vec3 {
    Vec3::from_array(std::array::from_fn(|i| f32::from(u8::from(i == c))))
}

/// Sums over pixels, relative to each pixel's brightness: the variance of a sample of one light
/// among others, and what is right.
struct Noise {
    among_others: f64,
    with_its_share: f64,
}

impl Noise {
    fn ratio(&self) -> f64 {
        self.among_others / self.with_its_share
    }
}

/// Compares pictures of a light alone and among others, of `count` lights in all, in a channel that only this one shines in.
///
/// A sample that is made with probability 1/n and then counts n times has the variance n E[f²] − E[f]².
fn noise(alone: &Film, among: &Film, c: usize, count: u32) -> Noise {
    let brightest = alone.pixels().iter().map(|p| p.mean()[c]).fold(0.0, f64::max);
    let mut noise = Noise { among_others: 0.0, with_its_share: 0.0 };
    for (alone, among) in alone.pixels().iter().zip(among.pixels()) {
        let (mean, variance) = (alone.mean()[c], alone.variance().expect("many samples")[c]);
        // At edges of shadows few samples say how bright a pixel is: they must not count more than
        // all others.
        let brightness = mean * mean + (0.5 * brightest).powi(2);
        let right = f64::from(count) * (variance + mean * mean) - mean * mean;
        noise.among_others += among.variance().expect("many samples")[c] / brightness;
        noise.with_its_share += right / brightness;
    }
    noise
}

/// Asserts that two pictures have the same mean in a channel, apart from noise.
#[track_caller]
fn assert_same_mean(what: &str, alone: &Film, among: &Film, c: usize) {
    let mean = |film: &Film| film.pixels().iter().map(|p| p.mean()[c]).sum::<f64>();
    let variance = |film: &Film| {
        film.pixels().iter().map(|p| p.variance_of_mean().expect("many samples")[c]).sum::<f64>()
    };
    let (expected, found) = (mean(alone), mean(among));
    let error = (variance(alone) + variance(among)).sqrt();
    assert!(
        (found - expected).abs() <= 4.5 * error + 1e-4 * expected,
        "{what}: {found} ± {error} among the others, {expected} alone"
    );
}

/// Samples of a pixel for the variance of a light to be known well, by a picture of it: the more,
/// the fewer pixels it reaches.
fn samples_wanted(alone: &Film, c: usize) -> u32 {
    let means = || alone.pixels().iter().map(|p| p.mean()[c]);
    let brightest = means().fold(0.0, f64::max);
    let lit = means().filter(|mean| *mean > 0.3 * brightest).count();
    SPP * 32_u32.div_ceil(lit.max(4) as u32).next_power_of_two()
}

/// Makes a scene with lights of these kinds and colours: half the side of its floor, the lights, a
/// seed for their places.
type Place = fn(f32, &[(u32, Vec3)], u32) -> Scene;

/// The weakest lights of a scene, `measured` in number, alone and among the others. Returns the
/// largest ratio of variances.
fn worst_noise(place: Place, half: f32, count: u32, measured: usize, seed: u32) -> f64 {
    let lamps = lamps(count, seed);
    let picture = |color: &dyn Fn(usize) -> Vec3, sample_seed, spp| {
        let lights: Vec<_> =
            lamps.iter().enumerate().map(|(i, &(kind, strength))| (kind, color(i) * strength)).collect();
        let scene = place(half, &lights, seed);
        // Of points that are evenly spread a few tell the variance of single samples, and each
        // light is chosen as often as it should.
        let sampler = SamplerKind::Sobol;
        render(&scene, &Job { seed: sample_seed, sampler, ..job(&scene, SIZE, SIZE, 2) }, spp)
    };
    let mut by_strength: Vec<usize> = (0..lamps.len()).collect();
    by_strength.sort_by(|&a, &b| lamps[a].1.total_cmp(&lamps[b].1));
    by_strength.truncate(measured);
    let mut worst = 0.0_f64;
    // Two lights have a channel each in one picture, and the others the third.
    for two in by_strength.chunks(2) {
        let alone = |c: usize, spp| picture(&|i| if i == two[c] { channel(c) } else { Vec3::ZERO }, 1, spp);
        let at_first: Vec<Film> = (0..two.len()).map(|c| alone(c, SPP)).collect();
        let wanted = at_first.iter().enumerate().map(|(c, film)| samples_wanted(film, c));
        let spp = wanted.fold(SPP, u32::max);
        let among = picture(&|i| channel(two.iter().position(|&j| j == i).unwrap_or(2)), 2, spp);
        for (c, at_first) in at_first.into_iter().enumerate() {
            let alone = if spp > SPP { alone(c, spp) } else { at_first };
            let (kind, strength) = lamps[two[c]];
            let what = format!("light {} (kind {kind}, {strength:.1e}) of {count} over {half} m", two[c]);
            assert_same_mean(&what, &alone, &among, c);
            let ratio = noise(&alone, &among, c, count).ratio();
            println!("{what}: {ratio:.2}");
            worst = worst.max(ratio);
        }
    }
    worst
}

/// How many times the variance of its share of the samples a light's contribution may have.
const MOST_NOISE: f64 = 2.0;

/// Asserts the noise of each light of some scenes: how they are made, half the side of the floor,
/// the number of lights, a seed.
#[track_caller]
fn assert_noise(scenes: impl IntoIterator<Item = (Place, f32, u32, u32)>) {
    let noises: Vec<_> = scenes
        .into_iter()
        .map(|(place, half, count, seed)| {
            // Strong lights are chosen more often than their share. Where there are most lights all
            // are looked at.
            let measured = if count == 8 { 8 } else { 2 };
            (worst_noise(place, half, count, measured, seed), half, count)
        })
        .collect();
    for (noise, half, count) in &noises {
        println!("{count} lights over {half} m: at most {noise:.2} times the variance");
    }
    let worst = noises.iter().fold(0.0, |worst, (noise, ..)| noise.max(worst));
    assert!(worst < MOST_NOISE, "{worst:.2} times the variance");
}

#[test]
fn the_noise_of_each_light_is_that_of_its_share_of_the_samples() {
    let halves = (0_u32..).zip([1.0, 30.0, 400.0, 1e4]);
    assert_noise(
        halves.flat_map(|(seed, half)| (1..=8).map(move |n| (floor as Place, half, n, 11 * seed + n))),
    );
}

/// Lamps beside a sky behind a portal, and lights that shine into fog.
#[test]
fn the_noise_of_each_light_is_that_of_its_share_in_rooms_and_fog() {
    let scenes = |(seed, half): (u32, f32)| {
        // The first light of a room is the sky.
        [2, 5].into_iter().flat_map(move |count| {
            [(room as Place, half, count, 6 + 7 * seed), (fog as Place, half, count, 3 + seed)]
        })
    };
    assert_noise((0_u32..).zip([2.0, 400.0]).flat_map(scenes));
}

/// A lamp lights a large floor as it lights a small one: rays begin the farther from a surface the
/// larger that is, and still have to reach what they were sampled for, without meeting the lamp
/// earlier.
#[test]
fn lamps_light_floors_of_all_sizes_alike() {
    for kind in [BALL, PANEL] {
        let brightness = |half| {
            let scene = floor(half, &[(kind, Vec3::ONE)], 2);
            let film = render(&scene, &job(&scene, SIZE, SIZE, 2), SPP);
            film.pixels().iter().map(|p| p.mean()[1]).sum::<f64>()
        };
        let expected = brightness(1.0);
        for half in [30.0, 400.0, 2000.0] {
            let found = brightness(half);
            println!("kind {kind} over {half} m: {:.4} of the light", found / expected);
            assert!((found / expected - 1.0).abs() < 3e-3, "kind {kind} over {half} m: {found}, {expected}");
        }
    }
}

/// The measure must notice a light that starves.
#[test]
#[should_panic(expected = "starves")]
fn a_light_beside_a_sun_starves_if_power_chooses() {
    let lights = |on: [f32; 2]| [(1, channel(2) * on[0]), (2, channel(0) * on[1])];
    let picture = |on| {
        let scene = floor(1e4, &lights(on), 3);
        let mut renderer = Renderer::cpu(None).expect("threads");
        renderer.load_tables(SceneTables::build(&scene).with_lights_by_power()).expect("tables");
        let limits = Limits { spp: SPP, ..Limits::default() };
        renderer.render(&job(&scene, SIZE, SIZE, 2), &limits, &Control::new()).expect("a picture");
        renderer.film().expect("film").expect("rendered").clone()
    };
    let ratio = noise(&picture([1.0, 0.0]), &picture([1.0, 1.0]), 2, 2).ratio();
    assert!(ratio > 0.0 && ratio < 2.1, "starves: {ratio}");
}

/// A picture of `shared/wild/few-lights`. `None` where it is missing.
fn shared_scene(test: &str, name: &str) -> Option<Scene> {
    let path: PathBuf = testkit::require_shared(test)?.join("wild/few-lights").join(name);
    Some(scene::load::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene)
}

fn render_on(renderer: &mut Renderer, scene: &Scene, spp: u32) -> Film {
    renderer.load(scene).unwrap_or_else(|e| panic!("{}: {e}", renderer.backend_name()));
    let limits = Limits { spp, ..Limits::default() };
    let job = job(scene, 160, 100, 2);
    renderer
        .render(&job, &limits, &Control::new())
        .unwrap_or_else(|e| panic!("{}: {e}", renderer.backend_name()));
    renderer.film().expect("film").expect("rendered").clone()
}

/// Mean of the blue channel over some pixels, and the relative standard error of one of them.
fn blue(film: &Film, pixels: &[usize]) -> (f64, f64) {
    let count = pixels.len() as f64;
    let mean = |i: usize| film.pixels()[i].mean()[2];
    let square = |i: usize| film.pixels()[i].variance_of_mean().expect("many samples")[2] / mean(i).powi(2);
    let error = pixels.iter().map(|&i| square(i)).sum::<f64>() / count;
    (pixels.iter().map(|&i| mean(i)).sum::<f64>() / count, error.sqrt())
}

/// A blue spot beside a sun over a floor of 400 m: the disc that it lights is there, on every back end.
#[test]
fn a_spot_beside_a_sun_is_seen() {
    const TEST: &str = "a_spot_beside_a_sun_is_seen";
    let Some(scene) = shared_scene(TEST, "sun-and-spot.toml") else { return };
    let is_spot = |light: &Light| matches!(light.kind, LightKind::Spot { .. });
    let mut alone = scene.clone();
    alone.lights.retain(is_spot);
    let mut cpu = Renderer::cpu(None).expect("threads");
    let alone = render_on(&mut cpu, &alone, 64);
    let brightest = alone.pixels().iter().map(|p| p.mean()[2]).fold(0.0, f64::max);
    let in_disc = |&i: &usize| alone.pixels()[i].mean()[2] > 0.55 * brightest;
    let disc: Vec<usize> = (0..alone.pixels().len()).filter(in_disc).collect();
    assert!(disc.len() > 100, "{} pixels", disc.len());
    let check = |renderer: &mut Renderer| {
        let (mean, error) = blue(&render_on(renderer, &scene, 64), &disc);
        let name = renderer.backend_name();
        println!("{name}: {mean:.4}, a pixel is off by {:.1} %", 100.0 * error);
        assert!((mean / 0.2044 - 1.0).abs() < 0.02, "{name}: {mean} instead of 0.2044");
        assert!(error < 0.08, "{name}: a pixel of the disc is off by {:.1} %", 100.0 * error);
    };
    check(&mut cpu);
    gpu_renderers(TEST).iter_mut().for_each(check);
}

/// A lamp under a sky: its light has no more noise than without the sky.
#[test]
fn a_lamp_under_a_sky_is_seen() {
    let Some(scene) = shared_scene("a_lamp_under_a_sky_is_seen", "sky-and-lamp.toml") else { return };
    let mut cpu = Renderer::cpu(None).expect("threads");
    let both = render_on(&mut cpu, &scene, 64);
    let lamp = render_on(&mut cpu, &Scene { environment: Environment::Black, ..scene.clone() }, 64);
    let sky = render_on(&mut cpu, &Scene { lights: Vec::new(), ..scene }, 64);
    let sum = |film: &Film| {
        let variance =
            film.pixels().iter().map(|p| p.variance_of_mean().expect("many samples")[1]).sum::<f64>();
        (film.mean()[1] * film.pixels().len() as f64, variance)
    };
    let [both, lamp, sky] = [&both, &lamp, &sky].map(sum);
    let error = (both.1 + lamp.1 + sky.1).sqrt();
    assert!((both.0 - lamp.0 - sky.0).abs() < 4.5 * error, "{both:?}, {lamp:?}, {sky:?}");
    assert!(both.1 < 1.2 * (lamp.1 + sky.1), "{both:?}, {lamp:?}, {sky:?}");
}
