//! Media whose picture is known in closed form, from an integral, or from another renderer.
//!
//! Noise is judged by its own standard error; the tolerance beside it is for single precision and the finite spot that
//! is looked at unless a test says more.

mod common;

use alhazen::{
    BackendChoice, Control, DirectSettings, Environment, Integrator, Job, Light, LightKind, Limits, Renderer,
    RendererOptions, Scene, Shape,
};
use common::{assert_mean, estimate, from_above, job};
use glam::{Affine3A, Vec3};
use scene::{Fog, Interior, Material, Medium, Model, Sky};
use std::f64::consts::PI;
use testkit::scenes::{
    Build, camera, cuboid, dielectric, emitter, flipped, ground, lambert, sphere, uv_sphere,
};

const ROUNDING: f64 = 1e-3;

fn under_white_sky() -> Scene {
    Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() }
}

/// The boundary of a medium.
fn filled(medium: Medium) -> Material {
    Material { name: "medium".into(), model: Model::Boundary, medium: Some(medium), ..Material::default() }
}

fn medium(absorption: [f32; 3], scattering: [f32; 3], anisotropy: f32) -> Medium {
    Medium { absorption: absorption.into(), scattering: scattering.into(), anisotropy, emission: Vec3::ZERO }
}

/// A slab between two heights, as good as endless.
fn add_slab(scene: &mut Scene, low: f64, high: f64, material: Material) {
    let material = scene.add_material(material);
    scene.add_mesh("slab", cuboid([-40.0, low, -40.0], [40.0, high, 40.0]), material);
}

fn directional(direction: Vec3, irradiance: f32) -> Light {
    let kind = LightKind::Directional {
        direction: direction.normalize(),
        irradiance: Vec3::splat(irradiance),
        angular_diameter: 0.0,
    };
    Light { name: "light".into(), kind }
}

/// ∫ f from 0 to `end`, by the midpoint rule.
fn integral(end: f64, f: impl Fn(f64) -> f64) -> f64 {
    let n = 20_000;
    let step = end / f64::from(n);
    (0..n).map(|i| f((f64::from(i) + 0.5) * step) * step).sum()
}

// --------------------------------------------------------------------------------------- absorption and emission

/// Through media light becomes less by the law of Beer and Lambert, and what they emit is added; several in a row, an
/// object inside, and a camera inside.
#[test]
fn media_absorb_and_shine_by_their_thickness() {
    let sigma = [0.5f32, 2.0, 0.0];
    let shining = Medium { emission: Vec3::new(0.0, 1.0, 0.5), ..medium(sigma, [0.0; 3], 0.0) };
    // Two slabs with a gap, seen from above: 1.5 m in all.
    let mut scene = under_white_sky();
    add_slab(&mut scene, 0.0, 1.0, filled(shining.clone()));
    add_slab(&mut scene, 2.0, 2.5, filled(shining.clone()));
    scene.cameras.push(from_above(0.0, 0.0, 5.0, 0.5));
    let left = |d: f64| sigma.map(|s| (-f64::from(s) * d).exp());
    let shine = |d: f64| [0.0, (1.0 - (-2.0 * d).exp()) / 2.0, 0.5 * d];
    let through = |d: f64, behind: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| left(d)[c] * behind[c] + shine(d)[c])
    };
    let e = estimate(&scene, &job(&scene, 4, 4, 1), 4);
    assert_mean("two slabs", &e, through(1.5, [1.0; 3]), ROUNDING);
    // A lamp inside of the upper slab's middle.
    let lamp = scene.add_material(emitter("lamp", [3.0, 2.0, 1.0]));
    scene.add_mesh("lamp", ground(2.25, 1.0), lamp);
    let e = estimate(&scene, &job(&scene, 4, 4, 1), 4);
    assert_mean("lamp inside", &e, through(0.25, [3.0, 2.0, 1.0]), ROUNDING);
    // From inside of the lower slab, up, without the lamp; the gap is clear.
    scene.instances.last_mut().expect("the lamp").visible = false;
    scene.cameras[0] = camera([0.0, 0.25, 0.0], [0.0, 1.0, 1e-6], 0.1);
    let e = estimate(&scene, &job(&scene, 4, 4, 1), 4);
    assert_mean("from inside", &e, through(1.25, [1.0; 3]), ROUNDING);
    // From inside at a thing inside: no end of the medium is in sight.
    let lamp = scene.add_material(emitter("lamp", [1.0; 3]));
    scene.add_shape("lamp", sphere([0.0, 0.5, -10.0], 0.25), lamp, Affine3A::IDENTITY);
    scene.cameras[0] = camera([0.0, 0.5, 0.0], [0.0, 0.5, -10.0], 0.1);
    let e = estimate(&scene, &job(&scene, 4, 4, 1), 4);
    let nearly = 9.75;
    assert!((left(nearly)[0] - (-4.875f64).exp()).abs() < 1e-12);
    assert_mean("inside at inside", &e, through(nearly, [1.0; 3]), ROUNDING);
}

/// Fog is between all bodies, below its top.
#[test]
fn fog_is_everywhere_below_its_top() {
    let sigma = 0.4f64;
    for (top, way) in [(f32::INFINITY, 3.0), (1.2, 1.2), (-1.0, 0.0)] {
        let mut scene = Scene {
            fog: Some(Fog { medium: medium([sigma as f32; 3], [0.0; 3], 0.0), top }),
            ..Scene::default()
        };
        let lamp = scene.add_material(emitter("lamp", [2.0; 3]));
        scene.add_mesh("lamp", ground(0.0, 1.0), lamp);
        scene.cameras.push(from_above(0.0, 0.0, 3.0, 0.5));
        let e = estimate(&scene, &job(&scene, 4, 4, 1), 4);
        assert_mean(&format!("fog up to {top}"), &e, [2.0 * (-sigma * way).exp(); 3], ROUNDING);
    }
}

/// A floor below media is lit through all of their boundaries, by a light that only next-event estimation finds.
#[test]
fn light_is_sampled_through_boundaries_with_its_transmittance() {
    let sigmas = [0.3f32, 0.7, 1.1];
    let mut scene = Scene::default();
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", ground(0.0, 30.0), floor);
    for (i, sigma) in sigmas.iter().enumerate() {
        let low = 0.5 + i as f64;
        add_slab(&mut scene, low, low + 0.5, filled(medium([*sigma; 3], [0.0; 3], 0.0)));
    }
    // A slab within a slab counts for itself: the inner medium replaces the outer.
    add_slab(&mut scene, 2.6, 2.8, filled(medium([5.0; 3], [0.0; 3], 0.0)));
    let (tilt, irradiance) = (0.5f32, 3.0);
    scene.lights.push(directional(Vec3::new(tilt.sin(), -tilt.cos(), 0.0), irradiance));
    scene.cameras.push(from_above(0.0, 0.0, 0.4, 0.1));
    let cos = f64::from(tilt.cos());
    let depth = (0.5 * (0.3 + 0.7) + 0.3 * 1.1 + 0.2 * 5.0) / cos;
    let expected = 0.5 / PI * f64::from(irradiance) * cos * (-depth).exp();
    let e = estimate(&scene, &job(&scene, 8, 8, 2), 4);
    assert_mean("floor under slabs", &e, [expected; 3], ROUNDING);
    // A sheet that is no boundary is in the way.
    let sheet = scene.add_material(lambert("sheet", [0.5; 3]));
    scene.add_mesh("sheet", ground(4.0, 30.0), sheet);
    let dark = estimate(&scene, &job(&scene, 8, 8, 2), 4);
    assert_eq!(dark.mean_colour(), [0.0; 3]);
}

// ------------------------------------------------------------------------------------------------- scattering once

/// Light that is scattered once, against the integral along the camera ray: a beam through a slab, and a point light in
/// fog.
#[test]
fn single_scattering_is_its_integral() {
    let (absorption, scattering, g) = ([0.2f32, 0.1, 0.4], [0.3f32, 1.5, 0.8], 0.6f32);
    let m = medium(absorption, scattering, g);
    let phase = |cos: f64| {
        let g = f64::from(g);
        (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
    };
    let sigma = |c: usize| f64::from(absorption[c] + scattering[c]);
    // A beam that comes in at an angle, seen from straight above: light turns by 180° − tilt.
    let mut scene = Scene::default();
    add_slab(&mut scene, 0.0, 0.8, filled(m.clone()));
    let tilt = 0.7f32;
    scene.lights.push(directional(Vec3::new(tilt.sin(), -tilt.cos(), 0.0), 2.0));
    scene.cameras.push(from_above(0.0, 0.0, 3.0, 0.1));
    let cos = f64::from(tilt.cos());
    let expected: [f64; 3] = std::array::from_fn(|c| {
        let seen = integral(0.8, |t| (-sigma(c) * t * (1.0 + 1.0 / cos)).exp());
        2.0 * f64::from(scattering[c]) * phase(-cos) * seen
    });
    assert_mean("beam", &estimate(&scene, &job(&scene, 16, 16, 2), 1024), expected, ROUNDING);
    // A lamp in the fog, beside the ray.
    let lamp = Vec3::new(0.5, 1.0, 0.0);
    let kind = LightKind::Point { position: lamp, intensity: Vec3::splat(5.0) };
    let mut scene = Scene { fog: Some(Fog { medium: m, top: f32::INFINITY }), ..Scene::default() };
    scene.lights.push(Light { name: "lamp".into(), kind });
    scene.cameras.push(from_above(0.0, 0.0, 3.0, 0.01));
    let expected: [f64; 3] = std::array::from_fn(|c| {
        5.0 * f64::from(scattering[c])
            * integral(40.0, |t| {
                // The point is at height 3 − t below the camera; light comes from the lamp and goes up.
                let (dx, dy) = (0.5, 1.0 - (3.0 - t));
                let r2: f64 = dx * dx + dy * dy;
                (-sigma(c) * (t + r2.sqrt())).exp() * phase(-dy / r2.sqrt()) / r2
            })
    });
    assert_mean("lamp", &estimate(&scene, &job(&scene, 32, 32, 2), 1024), expected, ROUNDING);
}

// ------------------------------------------------------------------------------------------------- scattering often

/// What scatters and absorbs nothing cannot be seen in a uniform environment, whatever its shape, colour and phase function.
#[test]
fn white_media_vanish_in_a_uniform_environment() {
    for g in [-0.5f32, 0.0, 0.8] {
        let m = filled(medium([0.0; 3], [0.5, 2.0, 4.0], g));
        let mut scene = under_white_sky();
        let index = scene.add_material(m.clone());
        scene.add_shape("ball", sphere([0.0; 3], 1.0), index, Affine3A::IDENTITY);
        let index = scene.add_material(m);
        scene.add_mesh("box", cuboid([-1.2, -1.0, -2.0], [-0.4, 0.1, 0.5]), index);
        scene.cameras.push(camera([0.0, 0.7, 3.5], [0.0; 3], 40.0));
        let e = estimate(&scene, &job(&scene, 24, 24, 4096), 48);
        assert_mean(&format!("g = {g}"), &e, [1.0; 3], ROUNDING);
    }
}

/// Chandrasekhar's H-function for isotropic scattering of albedo `a`, by iterating its integral equation in the form
/// 1/H(μ) = √(1 − a) + a/2 ∫ x H(x) / (μ + x) dx ("Radiative Transfer", 1960, chapter V).
fn h_function(a: f64, mu: f64) -> f64 {
    let n = 400;
    let x: Vec<f64> = (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)).collect();
    let mut h = vec![1.0; x.len()];
    let value = |h: &[f64], mu: f64| {
        let sum: f64 = x.iter().zip(h).map(|(x, h)| x * h / (mu + x)).sum();
        1.0 / ((1.0 - a).sqrt() + 0.5 * a * sum / f64::from(n))
    };
    for _ in 0..200 {
        h = x.iter().map(|&mu| value(&h, mu)).collect();
    }
    value(&h, mu)
}

/// A half-space that scatters isotropically shows 1 − √(1 − a) H(μ) of a uniform sky (Chandrasekhar 1960; by reciprocity
/// that is its directional albedo). The three channels are three albedos and three scales at once.
#[test]
fn half_spaces_reflect_what_the_h_function_says() {
    let albedos = [0.5f32, 0.8, 0.95];
    let extinctions = [2.0f32, 5.0, 10.0];
    let scattering: [f32; 3] = std::array::from_fn(|c| albedos[c] * extinctions[c]);
    let absorption: [f32; 3] = std::array::from_fn(|c| extinctions[c] - scattering[c]);
    for mu in [1.0f64, 0.4] {
        let mut scene = under_white_sky();
        let m = scene.add_material(filled(medium(absorption, scattering, 0.0)));
        scene.add_mesh("half-space", cuboid([-60.0, -60.0, -60.0], [60.0, 0.0, 60.0]), m);
        let eye = [5.0 * (1.0 - mu * mu).sqrt(), 5.0 * mu, 1e-3];
        scene.cameras.push(camera(eye, [0.0; 3], 0.5));
        let e = estimate(&scene, &job(&scene, 24, 24, 1024), 440);
        let expected = albedos.map(|a| {
            let a = f64::from(a);
            1.0 - (1.0 - a).sqrt() * h_function(a, mu)
        });
        assert_mean(&format!("half-space seen at μ = {mu}"), &e, expected, 2.0 * ROUNDING);
    }
}

// ---------------------------------------------------------------------------------------------- overlapping bodies

fn body(name: &str, ior: f32, absorption: f32, priority: Option<i32>) -> Material {
    let interior = Interior {
        attenuation_color: Vec3::splat((-absorption).exp()),
        attenuation_distance: if absorption > 0.0 { 1.0 } else { f32::INFINITY },
    };
    Material { interior, priority, ..dielectric(name, ior, 0.0) }
}

/// Reflectance at normal incidence.
fn reflectance(n: f64) -> f64 {
    ((n - 1.0) / (n + 1.0)).powi(2)
}

/// Water over glass over a lamp, seen from straight above. The slabs overlap; the one of higher priority counts there.
#[test]
fn of_overlapping_slabs_the_one_of_higher_priority_is_there() {
    let (water, glass) = (1.33f32, 1.6f32);
    for (water_priority, glass_priority, border) in [(1, 2, 1.0f64), (2, 1, 0.6)] {
        let mut scene = Scene::default();
        add_slab(&mut scene, 0.6, 2.0, body("water", water, 0.5, Some(water_priority)));
        add_slab(&mut scene, 0.0, 1.0, body("glass", glass, 0.9, Some(glass_priority)));
        let lamp = scene.add_material(emitter("lamp", [1.0; 3]));
        scene.add_mesh("lamp", ground(-1.0, 40.0), lamp);
        scene.cameras.push(from_above(0.0, 0.0, 5.0, 0.1));
        // Three interfaces with all reflections between them, from the top; the lamp reflects nothing.
        let (n1, n2) = (f64::from(water), f64::from(glass));
        let [r1, r2, r3] = [reflectance(n1), reflectance(n2 / n1), reflectance(n2)];
        let (in_water, in_glass) = ((-0.5 * (2.0 - border)).exp(), (-0.9 * border).exp());
        let between = 1.0 / (1.0 - in_water * in_water * r1 * r2);
        let upper = (1.0 - r1) * in_water * (1.0 - r2) * between;
        let from_below = r2 + (1.0 - r2).powi(2) * in_water.powi(2) * r1 * between;
        let expected = upper * in_glass * (1.0 - r3) / (1.0 - in_glass.powi(2) * from_below * r3);
        let e = estimate(&scene, &job(&scene, 16, 16, 64), 1024);
        assert_mean(&format!("water {water_priority}, glass {glass_priority}"), &e, [expected; 3], ROUNDING);
    }
}

/// A hollow ball of glass filled with water, modelled as it is made (the water reaches into the glass, and priorities say
/// who is there) and as textbooks say (one surface between the two, whose index is the quotient): the same picture. The
/// second scene is rendered by the tracer that knows no interiors.
#[test]
fn overlapping_bodies_look_like_bodies_that_do_not_overlap() {
    let (water, glass, absorption) = (1.33f32, 1.5f32, 0.6f32);
    let build = |overlapping: bool| {
        let mut scene = Scene {
            environment: Environment::Sky(Sky {
                horizon: Vec3::new(1.0, 0.8, 0.6),
                zenith: Vec3::new(0.1, 0.3, 1.0),
                ground: Vec3::new(0.3, 0.5, 0.1),
                sun: None,
            }),
            ..Scene::default()
        };
        let floor = scene.add_material(lambert("floor", [0.6, 0.3, 0.2]));
        scene.add_mesh("floor", ground(-1.05, 3.0), floor);
        let inner = Affine3A::from_scale(Vec3::splat(0.8));
        let cavity = Shape::Triangles(flipped(uv_sphere(48, 24)));
        if overlapping {
            let shell = scene.add_material(body("glass", glass, absorption, Some(2)));
            let inside = scene.add_material(body("water", water, 0.0, Some(1)));
            scene.add_shape("shell", sphere([0.0; 3], 1.0), shell, Affine3A::IDENTITY);
            scene.add_shape("cavity", cavity, shell, inner);
            scene.add_shape("water", sphere([0.0; 3], 0.87), inside, Affine3A::IDENTITY);
        } else {
            let shell = scene.add_material(body("glass", glass, absorption, None));
            let inside = scene.add_material(body("glass to water", glass / water, absorption, None));
            scene.add_shape("shell", sphere([0.0; 3], 1.0), shell, Affine3A::IDENTITY);
            scene.add_shape("cavity", cavity, inside, inner);
        }
        scene.cameras.push(camera([0.0, 0.5, 4.0], [0.0; 3], 32.0));
        let job = job(&scene, 32, 32, 24);
        estimate(&scene, &Job { seed: u32::from(overlapping), ..job }, 128)
    };
    common::assert_same("glass of water", &build(true), &build(false));
}

/// Without priorities nothing refracts otherwise than without media.
#[test]
fn fog_does_not_change_how_bodies_refract() {
    let build = |fog: bool| {
        let mut scene = testkit::scenes::glass();
        scene.fog = fog.then(|| Fog { medium: medium([1e-9; 3], [0.0; 3], 0.0), top: f32::INFINITY });
        let job = job(&scene, 32, 32, 12);
        estimate(&scene, &Job { seed: u32::from(fog), ..job }, 128)
    };
    common::assert_same("glass in thin fog", &build(true), &build(false));
}

// ------------------------------------------------------------------------------------------------- who cannot do it

/// Nobody shows a scene with media without its media: other integrators refuse, GPUs hand over to the CPU.
#[test]
fn media_are_never_left_out_in_silence() {
    let mut scene = under_white_sky();
    let m = scene.add_material(filled(medium([1.0; 3], [1.0; 3], 0.0)));
    scene.add_shape("ball", sphere([0.0; 3], 1.0), m, Affine3A::IDENTITY);
    scene.cameras.push(camera([0.0, 0.0, 3.0], [0.0; 3], 40.0));
    let mut renderer = Renderer::cpu(Some(1)).expect("a renderer");
    renderer.load(&scene).expect("a scene");
    let limits = Limits { spp: 2, ..Limits::default() };
    let direct = Integrator::Direct(DirectSettings::default());
    let error = renderer
        .render(&Job { integrator: direct, ..job(&scene, 4, 4, 2) }, &limits, &Control::new())
        .expect_err("media");
    let text = format!("{:?}", error);
    assert!(text.contains("media") && text.contains("`direct`"), "{text}");
    // What the camera sees first is behind the medium.
    let aov = Job { integrator: Integrator::Aov, ..job(&scene, 4, 4, 2) };
    let film = {
        renderer.render(&aov, &limits, &Control::new()).expect("a picture");
        testkit::Estimate::from_film(renderer.film().expect("no device").expect("a film"))
    };
    assert_eq!(film.mean_colour(), [1.0; 3], "a boundary is no surface");
    let options = RendererOptions { backend: BackendChoice::Gpu, ..RendererOptions::default() };
    match Renderer::choose(&options) {
        Ok(mut chosen) => {
            chosen.renderer.load(&scene).expect("the CPU");
            assert_eq!(chosen.renderer.backend_name(), "cpu");
            let notices = chosen.renderer.take_notices().join("\n");
            assert!(notices.contains("media"), "{notices}");
        }
        Err(error) => testkit::skip_without_gpu("media_are_never_left_out_in_silence", &error.to_string()),
    }
}
