//! Media whose picture is known in closed form, from an integral, or from another renderer.
//!
//! Noise is judged by its own standard error; the tolerance beside it is for single precision and the finite spot that
//! is looked at unless a test says more.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod bodies;
#[path = "../common/mod.rs"]
mod common;
mod scattering;

use alhazen::{
    BackendChoice, Control, DirectSettings, Environment, HybridSettings, Integrator, Job, Light, LightKind,
    Limits, PathSettings, Renderer, RendererOptions, Scene, Shape,
};
use common::{assert_mean, estimate, from_above, job};
use glam::{Affine3A, Vec3};
use scene::{DensityGrid, Fog, Interior, Material, Medium, Model, Sky, Subsurface};
use std::f64::consts::PI;
use std::sync::Arc;
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
    Medium { absorption: absorption.into(), scattering: scattering.into(), anisotropy, ..Medium::default() }
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
    Light::new("light", kind)
}

/// ∫ f from 0 to `end`, by the midpoint rule.
fn integral(end: f64, f: impl Fn(f64) -> f64) -> f64 {
    integral_of(20_000, end, f)
}

/// The same in `n` steps.
fn integral_of(n: u32, end: f64, f: impl Fn(f64) -> f64) -> f64 {
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
    scene.lights.push(Light::new("lamp", kind));
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

// ---------------------------------------------------------------------------------------------- densities on a grid

/// A grid between −1 and 1 along each axis whose density changes along y alone.
fn layered_grid(densities: &[f32]) -> Arc<DensityGrid> {
    let size = [1, densities.len() as u32, 1];
    Arc::new(DensityGrid::new(size, [Vec3::NEG_ONE, Vec3::ONE], densities.to_vec()).expect("a grid"))
}

/// The density of [`layered_grid`] at a height: linear between the centres of cells.
fn layered_density(densities: &[f32], y: f64) -> f64 {
    let n = densities.len() as f64;
    let place = ((y + 1.0) / 2.0 * n - 0.5).clamp(0.0, n - 1.0);
    let (low, high) = (place.floor() as usize, place.ceil() as usize);
    f64::from(densities[low]) + (f64::from(densities[high]) - f64::from(densities[low])) * place.fract()
}

/// Absorption, emission and single scattering of a medium whose density varies, against the integrals along the ray: what
/// delta tracking follows and what ratio tracking sees of a light from above.
#[test]
fn varying_densities_are_their_integrals() {
    let densities = [0.2f32, 3.0, 0.0, 1.0];
    let cube = || cuboid([-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]);
    let optical = |sigma: f64, from: f64| {
        sigma * integral_of(400, 1.0 - from, |t| layered_density(&densities, from + t))
    };
    let build = |m: Medium| {
        let mut scene = Scene::default();
        let material = scene.add_material(filled(Medium { density: Some(layered_grid(&densities)), ..m }));
        scene.add_mesh("box", cube(), material);
        scene.cameras.push(from_above(0.0, 0.0, 3.0, 0.5));
        scene
    };
    let (sigma_a, sigma_s, g) = ([0.3f32, 0.1, 0.6], [0.4f32, 0.9, 0.1], 0.3f32);
    // The sky shines through, and the medium by itself.
    let emission = Vec3::new(0.5, 0.0, 2.0);
    let mut scene = build(Medium { emission, ..medium(sigma_a, [0.0; 3], 0.0) });
    scene.environment = Environment::Constant(Vec3::ONE);
    let expected: [f64; 3] = std::array::from_fn(|c| {
        let sigma = f64::from(sigma_a[c]);
        let shine = integral_of(400, 2.0, |t| {
            layered_density(&densities, 1.0 - t) * (-optical(sigma, 1.0 - t)).exp()
        });
        (-optical(sigma, -1.0)).exp() + f64::from(emission[c]) * shine
    });
    let e = estimate(&scene, &job(&scene, 16, 16, 1), 512);
    assert_mean("absorption and emission", &e, expected, 2.0 * ROUNDING);
    // Light from the camera's side, scattered back once: the way there and back is the same.
    let mut scene = build(medium(sigma_a, sigma_s, g));
    scene.lights.push(directional(Vec3::NEG_Y, 2.0));
    let phase = (1.0 - f64::from(g * g)) / (4.0 * PI * (1.0 + f64::from(g)).powi(3));
    let expected: [f64; 3] = std::array::from_fn(|c| {
        let sigma = f64::from(sigma_a[c] + sigma_s[c]);
        let back = integral_of(400, 2.0, |t| {
            layered_density(&densities, 1.0 - t) * (-2.0 * optical(sigma, 1.0 - t)).exp()
        });
        2.0 * f64::from(sigma_s[c]) * phase * back
    });
    let e = estimate(&scene, &job(&scene, 24, 24, 2), 512);
    assert_mean("single scattering", &e, expected, 2.0 * ROUNDING);
}

/// A grid of one density is the medium without a grid, multiplied with it; what absorbs nothing cannot be seen.
#[test]
fn constant_densities_are_homogeneous_media() {
    let build = |grid: bool| {
        let scale = if grid { 0.5 } else { 1.0 };
        let m = medium([0.2 / scale, 0.1 / scale, 0.6 / scale], [0.5 / scale, 2.0 / scale, 4.0 / scale], 0.4);
        let density = grid.then(|| layered_grid(&[0.5, 0.5]));
        let mut scene = Scene::default();
        let material = scene.add_material(filled(Medium { density, ..m }));
        scene.add_mesh("box", cuboid([-1.0; 3], [1.0; 3]), material);
        let floor = scene.add_material(lambert("floor", [0.6; 3]));
        scene.add_mesh("floor", ground(-1.1, 4.0), floor);
        scene.lights.push(directional(Vec3::new(1.0, -1.0, -0.5), 3.0));
        scene.cameras.push(camera([0.0, 1.0, 5.0], [0.0; 3], 40.0));
        let job = job(&scene, 32, 32, 16);
        estimate(&scene, &Job { seed: u32::from(grid), ..job }, 128)
    };
    common::assert_same("a grid of one density", &build(true), &build(false));
    let mut scene = under_white_sky();
    let m =
        Medium { density: Some(layered_grid(&[0.0, 2.0, 0.5])), ..medium([0.0; 3], [0.5, 1.5, 3.0], 0.5) };
    let cloud = scene.add_material(filled(m));
    scene.add_mesh("cloud", cuboid([-1.2; 3], [1.2; 3]), cloud);
    scene.cameras.push(camera([0.0, 1.0, 4.0], [0.0; 3], 40.0));
    assert_mean("white cloud", &estimate(&scene, &job(&scene, 20, 20, 4096), 64), [1.0; 3], ROUNDING);
}

// ----------------------------------------------------------------------------------------------------- subsurface

/// Reflectance of a smooth surface of index `n` seen at cosine `c` from outside, by Fresnel's formulas.
fn fresnel(n: f64, c: f64) -> f64 {
    let t = (1.0 - (1.0 - c * c) / (n * n)).sqrt();
    let (s, p) = ((c - n * t) / (c + n * t), (n * c - t) / (n * c + t));
    0.5 * (s * s + p * p)
}

/// A half-space of subsurface scattering shows its colour in a uniform sky, whatever its radii; behind a surface that
/// reflects R, it is R + (1 − R) of it. By reciprocity that holds for the mean over all directions 2 μ dμ, taken at the two
/// points of Gauss's rule, for R as well.
///
/// Tolerance: 0.01 of reflectance for what is solved for in few directions; 0.015 with a phase function, which similarity
/// makes isotropic. Depth 64 is enough for what is reflected inside.
#[test]
fn bodies_with_subsurface_scattering_have_the_colour_that_was_asked_for() {
    let color = [0.2f32, 0.5, 0.8];
    for (ior, g, allowed) in [(1.0f32, 0.0f32, 0.01), (1.0, 0.6, 0.015), (1.4, 0.0, 0.01)] {
        let subsurface = Subsurface { radius: Vec3::new(0.3, 0.1, 0.05), anisotropy: g };
        let material = Material {
            base_color: Vec3::from(color).extend(1.0),
            subsurface: Some(subsurface),
            ..dielectric("wax", ior, 0.0)
        };
        let (mut mean, mut variance) = ([0.0; 3], [0.0f64; 3]);
        let mut surface = 0.0;
        for (mu2, weight) in [(0.2113248654, 0.5), (0.7886751346, 0.5)] {
            let mu = f64::sqrt(mu2);
            surface += weight * fresnel(f64::from(ior), mu);
            let mut scene = under_white_sky();
            let m = scene.add_material(material.clone());
            scene.add_mesh("half-space", cuboid([-60.0, -60.0, -60.0], [60.0, 0.0, 60.0]), m);
            let eye = [5.0 * (1.0 - mu * mu).sqrt(), 5.0 * mu, 1e-3];
            scene.cameras.push(camera(eye, [0.0; 3], 0.5));
            // Roulette ends what is nearly absorbed.
            let settings = PathSettings { max_depth: 64, ..PathSettings::default() };
            let job = Job { integrator: Integrator::Path(settings), ..job(&scene, 16, 16, 64) };
            let (seen, noise) = common::mean_and_error(&estimate(&scene, &job, 64));
            (0..3).for_each(|c| mean[c] += weight * seen[c]);
            (0..3).for_each(|c| variance[c] += (weight * noise[c]).powi(2));
        }
        for c in 0..3 {
            let expected = surface + (1.0 - surface) * f64::from(color[c]);
            let (apart, noise) = ((mean[c] - expected).abs(), variance[c].sqrt());
            assert!(noise < 0.007, "ior {ior}, g {g}, channel {c}: ± {noise} says nothing");
            let what = format!("ior {ior}, g {g}, channel {c}: {} ± {noise}", mean[c]);
            assert!(apart < allowed + 4.5 * noise, "{what}, not {expected}");
        }
    }
}

/// White wax loses nothing: it cannot be seen in a uniform environment, through a rough surface or none.
#[test]
fn white_bodies_with_subsurface_scattering_vanish() {
    for (ior, roughness, tolerance) in
        [(1.0f32, 0.0f32, ROUNDING), (1.4, 0.0, 2.0 * ROUNDING), (1.4, 0.5, 0.03)]
    {
        let subsurface = Subsurface { radius: Vec3::new(0.5, 0.3, 0.2), anisotropy: 0.2 };
        let mut scene = under_white_sky();
        let wax = Material { subsurface: Some(subsurface), ..dielectric("wax", ior, roughness) };
        let wax = scene.add_material(wax);
        scene.add_shape("ball", sphere([0.0; 3], 1.0), wax, Affine3A::IDENTITY);
        scene.cameras.push(camera([0.0, 0.0, 3.5], [0.0; 3], 25.0));
        let e = estimate(&scene, &job(&scene, 24, 24, 512), 100);
        assert_mean(&format!("white wax, ior {ior}, roughness {roughness}"), &e, [1.0; 3], tolerance);
    }
}

// ------------------------------------------------------------------------------------------------- who cannot do it

/// Nobody shows a scene with media without its media: other integrators refuse, on the CPU and on GPUs.
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
            let renderer = &mut chosen.renderer;
            renderer.load(&scene).expect("a scene");
            let hybrid = Integrator::Hybrid(HybridSettings::default());
            for integrator in [direct, hybrid] {
                let job = Job { integrator, ..job(&scene, 4, 4, 2) };
                let error = renderer.render(&job, &limits, &Control::new()).expect_err("media");
                assert!(format!("{error:?}").contains("media"), "{error:?}");
            }
            assert_ne!(renderer.backend_name(), "cpu", "nobody else has to do what nobody can");
        }
        Err(error) => testkit::skip_without_gpu("media_are_never_left_out_in_silence", &error.to_string()),
    }
}
