//! The parts of layered materials, each alone, against its formula.
//!
//! A distant light of irradiance `E` from one direction, seen from straight above by parallel rays: the picture is `E` times the scattering function
//! times the light's cosine, without noise. The formulas stand here a second time, in double precision and as the glTF extensions or their
//! sources have them, with `cos θo = 1`, at which nothing masks the viewer.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{Aov, AovData, DirectSettings, Environment, Integrator, Job, Light, LightKind, Scene};
use common::{assert_mean, assert_same, assert_same_coarse, estimate, from_above, job, render};
use glam::{Affine3A, Vec3};
use scene::{Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Layers, Material, Sheen, Sky};
use std::f64::consts::PI;
use testkit::Estimate;
use testkit::scenes::{Build, camera, dielectric, emitter, ground, lambert, metallic_roughness, sphere};

const ROUNDING: f64 = 1e-3;
const IRRADIANCE: f64 = 3.0;
/// Angles of the light with the normal, in radians.
const TILTS: [f32; 4] = [0.0, 0.3, 0.9, 1.4];

/// A surface that reflects nothing unless layers do.
fn black(layers: Layers) -> Material {
    Material { specular: 0.0, layers, ..metallic_roughness("black", [0.0; 3], 0.0, 0.5) }
}

/// A floor lit from `tilt` radians off the vertical, towards `azimuth` (0: +X, the direction of the tangent; a quarter turn: +Z).
fn lit(material: Material, tilt: f32, azimuth: f32) -> Scene {
    let mut scene = Scene::default();
    let index = scene.add_material(material);
    scene.add_mesh("floor", ground(0.0, 1.0), index);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.1));
    let direction = -Vec3::new(tilt.sin() * azimuth.cos(), tilt.cos(), tilt.sin() * azimuth.sin());
    let irradiance = Vec3::splat(IRRADIANCE as f32);
    let kind = LightKind::Directional { direction, irradiance, angular_diameter: 0.0 };
    scene.lights.push(Light::new("sun", kind));
    scene
}

/// Asserts the value of the scattering function times the light's cosine.
#[track_caller]
fn assert_scattered(what: &str, scene: &Scene, expected: [f64; 3], tolerance: f64) {
    let job = Job { single_scatter: true, ..job(scene, 4, 4, 2) };
    assert_mean(what, &estimate(scene, &job, 16), expected.map(|v| v * IRRADIANCE), tolerance);
}

/// D G / (4 cos θo) of GGX with two widths for the light at `tilt`, towards the first axis or the second.
/// Source: Heitz 2014, eq. 72, 85 and 86.
fn ggx([along, across]: [f64; 2], tilt: f64) -> f64 {
    let (sin_half, cos_half) = (0.5 * tilt).sin_cos();
    let slope2 = (sin_half / along).powi(2) + cos_half * cos_half;
    let d = 1.0 / (PI * along * across * slope2 * slope2);
    let lambda = 0.5 * ((1.0 + (along * tilt.tan()).powi(2)).sqrt() - 1.0);
    d / (1.0 + lambda) / 4.0
}

/// Schlick's approximation for the half vector of light at `tilt`.
fn schlick(f0: f64, f90: f64, tilt: f64) -> f64 {
    f0 + (f90 - f0) * (1.0 - (0.5 * tilt).cos()).powi(5)
}

#[test]
fn coats_reflect_four_per_cent() {
    for (strength, roughness) in [(1.0f32, 0.3f32), (0.5, 0.7)] {
        for tilt in TILTS {
            let clearcoat = Clearcoat { strength, roughness, ..Clearcoat::default() };
            let scene = lit(black(Layers { clearcoat, ..Layers::default() }), tilt, 0.4);
            let (tilt, alpha) = (f64::from(tilt), f64::from(roughness).powi(2));
            let value = f64::from(strength) * schlick(0.04, 1.0, tilt) * ggx([alpha; 2], tilt);
            assert_scattered(&format!("coat {strength} at {tilt}"), &scene, [value; 3], ROUNDING);
        }
    }
}

/// `KHR_materials_specular` and `KHR_materials_ior`: F0 = min(((n − 1) / (n + 1))² · colour, 1) · strength, F90 = strength.
#[test]
fn highlights_have_their_strength_colour_and_index() {
    for (strength, color, ior) in [(1.0f32, [1.0f32, 0.5, 0.2], 1.5f32), (0.3, [1.0; 3], 2.0)] {
        for tilt in TILTS {
            let layers = Layers { specular_color: Vec3::from(color), ..Layers::default() };
            let scene = lit(Material { specular: strength, ior, ..black(layers) }, tilt, 0.0);
            let (tilt, strength) = (f64::from(tilt), f64::from(strength));
            let reflectance = f64::from((ior - 1.0) / (ior + 1.0)).powi(2);
            let lobe = ggx([0.25; 2], tilt);
            let value = color
                .map(|c| schlick((reflectance * f64::from(c)).min(1.0) * strength, strength, tilt) * lobe);
            assert_scattered(&format!("index {ior} at {tilt}"), &scene, value, ROUNDING);
        }
    }
}

/// `KHR_materials_anisotropy`: widths mix(α, 1, strength²) along the direction and α across.
#[test]
fn brushed_metals_have_two_widths() {
    let (strength, alpha) = (0.8f64, 0.4f64 * 0.4);
    let wide = alpha + (1.0 - alpha) * strength * strength;
    for tilt in TILTS {
        for (rotation, azimuth) in [(0.0f32, 0.0f32), (0.0, 0.25), (0.25, 0.0), (0.25, 0.25)] {
            let [rotation_angle, azimuth_angle] = [rotation, azimuth].map(|t| t * std::f32::consts::TAU);
            let anisotropy =
                Anisotropy { strength: strength as f32, rotation: rotation_angle, ..Anisotropy::default() };
            let layers = Layers { anisotropy, ..Layers::default() };
            let metal = Material { layers, ..metallic_roughness("metal", [1.0; 3], 1.0, 0.4) };
            let scene = lit(metal, tilt, azimuth_angle);
            let widths = if rotation == azimuth { [wide, alpha] } else { [alpha, wide] };
            let value = ggx(widths, f64::from(tilt));
            let what = format!("light at {tilt}, {azimuth} turns, brushed along {rotation}");
            assert_scattered(&what, &scene, [value; 3], ROUNDING);
        }
    }
}

/// Estevez and Kulla 2017: the distribution, and the fit of its Λ.
#[test]
fn cloth_has_its_fibres() {
    for roughness in [0.3f32, 0.8] {
        let alpha = f64::from(roughness).powi(2);
        let curve = |x: f64| {
            let t = (1.0 - alpha).powi(2);
            let mix = |a: f64, b: f64| a + (b - a) * t;
            let [a, b, c, d, e] = [
                mix(21.5473, 25.3245),
                mix(3.82987, 3.32435),
                mix(0.19823, 0.16801),
                mix(-1.9776, -1.27393),
                mix(-4.32054, -4.85967),
            ];
            a / (1.0 + b * x.powf(c)) + d * x + e
        };
        let lambda = |cos: f64| {
            if cos < 0.5 { curve(cos).exp() } else { (2.0 * curve(0.5) - curve(1.0 - cos)).exp() }
        };
        for tilt in TILTS {
            let color = Vec3::new(0.9, 0.5, 0.1);
            let sheen = Sheen { color, roughness, ..Sheen::default() };
            let scene = lit(black(Layers { sheen, ..Layers::default() }), tilt, 1.0);
            let tilt = f64::from(tilt);
            let density = (2.0 + 1.0 / alpha) * (0.5 * tilt).sin().powf(1.0 / alpha) / (2.0 * PI);
            let value = density / (4.0 * (1.0 + lambda(1.0) + lambda(tilt.cos())));
            let value = color.to_array().map(|c| f64::from(c) * value);
            assert_scattered(&format!("sheen of roughness {roughness} at {tilt}"), &scene, value, ROUNDING);
        }
    }
}

/// A share of the diffuse light leaves on the other side, in its own colour.
#[test]
fn paper_shines_through() {
    let color = Vec3::new(0.8, 0.4, 0.2);
    let diffuse_transmission = DiffuseTransmission { strength: 0.3, color, ..Default::default() };
    let layers = Layers { diffuse_transmission, ..Layers::default() };
    let paper =
        Material { base_color: Vec3::new(0.5, 0.6, 0.7).extend(1.0), double_sided: true, ..black(layers) };
    let cos = f64::from(0.5f32.cos());
    let above = lit(paper.clone(), 0.5, 0.0);
    assert_scattered("lit paper", &above, [0.5, 0.6, 0.7].map(|c| 0.7 * c * cos / PI), ROUNDING);
    let below = lit(paper, std::f32::consts::PI - 0.5, 0.0);
    assert_scattered("paper lit from below", &below, [0.8, 0.4, 0.2].map(|c| 0.3 * c * cos / PI), ROUNDING);
}

/// Light that a film reflects, wavelength by wavelength (Airy's formula), seen by the CIE's observer.
///
/// Tolerance: the renderer's observer is made of four Gaussians, and it adds two orders of interference.
#[test]
fn films_have_the_colours_of_interference() {
    for (ior, thickness) in [(1.3f32, 250.0f32), (1.3, 400.0), (2.0, 350.0)] {
        let iridescence =
            Iridescence { strength: 1.0, ior, thickness: [0.0, thickness], ..Iridescence::default() };
        let layers = Layers { iridescence, ..Layers::default() };
        let scene = lit(Material { specular: 1.0, ..black(layers) }, 0.0, 0.0);
        let reflectance = film_reflectance(f64::from(ior), f64::from(thickness), 1.5);
        let lobe = ggx([0.25; 2], 0.0);
        let what = format!("film of {thickness} nm and index {ior}");
        assert_scattered(&what, &scene, reflectance.map(|f| f * lobe), 0.06);
    }
}

/// Linear Rec. 709 reflectance at normal incidence of a film of index `film` on a body of index `body`.
///
/// As in the model, what does not depend on the wavelength is white, and the rest is turned from XYZ without adaptation.
fn film_reflectance(film: f64, thickness: f64, body: f64) -> [f64; 3] {
    let (r12, r23) = ((1.0 - film) / (1.0 + film), (film - body) / (film + body));
    let of_phase = |cos: f64| {
        let twice = 2.0 * r12 * r23 * cos;
        (r12 * r12 + r23 * r23 + twice) / (1.0 + (r12 * r23).powi(2) + twice)
    };
    let phases = 1000;
    let mean =
        (0..phases).map(|i| of_phase((2.0 * PI * f64::from(i) / f64::from(phases)).cos())).sum::<f64>()
            / f64::from(phases);
    let (mut xyz, mut whole) = ([0.0; 3], [0.0; 3]);
    for nanometres in 360..=830 {
        let phase = 4.0 * PI * film * thickness / f64::from(nanometres);
        let seen = observer(f64::from(nanometres));
        for c in 0..3 {
            xyz[c] += (of_phase(phase.cos()) - mean) * seen[c];
            whole[c] += seen[c];
        }
    }
    let [x, y, z] = std::array::from_fn(|c| xyz[c] / whole[c]);
    [
        mean + 3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
        mean - 0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
        mean + 0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
    ]
}

/// The CIE 1931 colour matching functions.
/// Source: Wyman, Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013.
fn observer(nanometres: f64) -> [f64; 3] {
    let lobe = |height: f64, middle: f64, below: f64, above: f64| {
        let t = (nanometres - middle) * if nanometres < middle { below } else { above };
        height * (-0.5 * t * t).exp()
    };
    [
        lobe(0.362, 442.0, 0.0624, 0.0374)
            + lobe(1.056, 599.8, 0.0264, 0.0323)
            + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    ]
}

/// `KHR_materials_dispersion`: indices n − s, n, n + s with s = (n − 1) · 0.025 · dispersion, seen in where each channel is totally reflected.
#[test]
fn colours_have_their_own_critical_angles() {
    let sky = Sky { horizon: Vec3::ONE, zenith: Vec3::ONE, ground: Vec3::ZERO, sun: None };
    let mut scene = Scene { environment: Environment::Sky(sky), ..Scene::default() };
    let layers = Layers { dispersion: 8.0, ..Layers::default() };
    let water = scene.add_material(Material { layers, ..dielectric("water", 1.33, 0.0) });
    let black = scene.add_material(lambert("ground", [0.0; 3]));
    scene.add_mesh("surface", ground(0.0, 1000.0), water);
    scene.add_mesh("ground", ground(-2.0, 1000.0), black);
    let spread = 0.33 * 0.025 * 8.0;
    let critical = [1.33 - spread, 1.33, 1.33 + spread].map(|n: f64| (1.0 / n).asin());
    let between = |a: usize, b: usize| 0.5 * (critical[a] + critical[b]);
    let angles = [critical[2] - 0.02, between(1, 2), between(0, 1), critical[0] + 0.02];
    for (angle, bright) in angles.into_iter().zip([3, 2, 1, 0]) {
        scene.cameras = vec![camera([0.0, -1.0, 0.0], [angle.sin(), angle.cos() - 1.0, 0.0], 0.5)];
        scene.cameras[0].up = Vec3::Z;
        let mean = estimate(&scene, &job(&scene, 16, 16, 8), 64).mean_colour();
        for (channel, mean) in mean.into_iter().enumerate() {
            // Where the boundary is matters here, not how bright it is.
            assert!((mean > 0.5) == (channel < bright), "channel {channel} at {angle} rad: {mean}");
        }
    }
}

/// One material in two panes, under a sky, a lamp above and one below, and a sun.
fn panes(material: Material) -> Scene {
    let sky = Sky {
        horizon: Vec3::new(0.3, 0.4, 0.5),
        zenith: Vec3::new(0.5, 0.6, 1.0),
        ground: Vec3::splat(0.2),
        sun: None,
    };
    let mut scene = Scene { environment: Environment::Sky(sky), ..Scene::default() };
    let index = scene.add_material(Material { double_sided: true, ..material });
    scene.add_mesh("pane", ground(0.0, 1.0), index);
    for (height, radiance) in [(0.9, [9.0, 7.0, 5.0]), (-0.7, [4.0, 6.0, 9.0])] {
        let lamp = scene.add_material(emitter("lamp", radiance));
        scene.add_shape("lamp", sphere([0.3, height, -0.2], 0.2), lamp, Affine3A::IDENTITY);
    }
    let direction = Vec3::new(0.3, -0.9, 0.2).normalize();
    let kind = LightKind::Directional { direction, irradiance: Vec3::splat(0.7), angular_diameter: 0.2 };
    scene.lights.push(Light::new("sun", kind));
    scene.cameras.push(camera([0.0, 0.8, 1.6], [0.0, 0.0, 0.1], 35.0));
    scene
}

/// What `direct` shows without anything to reflect but lights and sky is what `path` shows with two segments.
#[test]
fn direct_has_all_layers() {
    let gloss = || metallic_roughness("gloss", [0.7, 0.3, 0.2], 0.3, 0.4);
    let clearcoat = Clearcoat { strength: 0.8, roughness: 0.3, ..Clearcoat::default() };
    let sheen = Sheen { color: Vec3::new(0.2, 0.9, 0.4), roughness: 0.6, ..Sheen::default() };
    let iridescence =
        Iridescence { strength: 1.0, ior: 1.4, thickness: [400.0; 2], ..Iridescence::default() };
    let anisotropy = Anisotropy { strength: 0.7, rotation: 0.6, ..Anisotropy::default() };
    let diffuse_transmission =
        DiffuseTransmission { strength: 0.6, color: Vec3::new(0.2, 0.8, 0.3), ..Default::default() };
    let layers = [
        ("coat", Layers { clearcoat: clearcoat.clone(), ..Layers::default() }, 0.0),
        ("sheen", Layers { sheen: sheen.clone(), ..Layers::default() }, 0.0),
        ("film", Layers { iridescence: iridescence.clone(), ..Layers::default() }, 0.0),
        ("brushed", Layers { anisotropy: anisotropy.clone(), ..Layers::default() }, 0.0),
        ("paper", Layers { diffuse_transmission: diffuse_transmission.clone(), ..Layers::default() }, 0.0),
        ("coated pane", Layers { clearcoat: clearcoat.clone(), ..Layers::default() }, 0.7),
        (
            "all",
            Layers { clearcoat, sheen, iridescence, anisotropy, diffuse_transmission, ..Layers::default() },
            0.4,
        ),
    ];
    for (name, layers, transmission) in layers {
        let scene = panes(Material { layers, transmission, ..gloss() });
        let settings = DirectSettings { max_depth: 2, reflection_samples: 2, ..DirectSettings::default() };
        let direct = Job { seed: 1, integrator: Integrator::Direct(settings), ..job(&scene, 24, 16, 2) };
        let (a, b) = (estimate(&scene, &direct, 512), estimate(&scene, &job(&scene, 24, 16, 2), 1024));
        assert_same(&format!("direct {name}"), &a, &b);
        // And layers are seen at all.
        let mut plain = scene.clone();
        plain.materials[0].layers = Layers::default();
        let c = estimate(&plain, &direct, 512);
        let far = |(a, c): (&[f64; 3], &[f64; 3])| (0..3).any(|i| (a[i] - c[i]).abs() > 0.05 * a[i]);
        let changed = a.mean.iter().zip(&c.mean).filter(|pair| far(*pair)).count();
        assert!(10 * changed > a.mean.len(), "{name}: {changed} of {} pixels", a.mean.len());
    }
}

/// Dispersing glass with a coat: what lamps send through it is found one segment later than without.
#[test]
fn direct_looks_through_layered_glass() {
    let clearcoat = Clearcoat { strength: 0.5, roughness: 0.5, ..Clearcoat::default() };
    let layers = Layers { dispersion: 5.0, clearcoat, ..Layers::default() };
    let mut scene = Scene::default();
    let glass = scene.add_material(Material { layers, ..dielectric("glass", 1.5, 0.45) });
    scene.add_shape("ball", sphere([0.0, 0.0, 0.0], 0.6), glass, Affine3A::IDENTITY);
    let kind = LightKind::Point { position: Vec3::new(0.4, 1.5, 1.2), intensity: Vec3::splat(5.0) };
    scene.lights.push(Light::new("lamp", kind));
    let kind = LightKind::Point { position: Vec3::new(-0.4, 0.5, -1.5), intensity: Vec3::splat(9.0) };
    scene.lights.push(Light::new("behind", kind));
    scene.cameras.push(camera([0.0, 0.0, 2.5], [0.0, 0.0, 0.0], 35.0));
    let settings = DirectSettings { max_depth: 2, ..DirectSettings::default() };
    let direct = Job { seed: 1, integrator: Integrator::Direct(settings), ..job(&scene, 16, 16, 2) };
    let (a, b) = (estimate(&scene, &direct, 4096), estimate(&scene, &job(&scene, 16, 16, 3), 4096));
    assert_same_coarse("direct glass", &a, &b);
}

/// The layer `albedo`, and the picture of `aov`, have the colours of layers.
#[test]
fn first_hits_have_the_colour_of_layers() {
    let color = Vec3::new(0.2, 0.8, 0.3);
    let diffuse_transmission = DiffuseTransmission { strength: 0.5, color, ..Default::default() };
    let layers = Layers { diffuse_transmission, ..Layers::default() };
    let paper = Material { specular: 0.0, layers, ..metallic_roughness("paper", [0.6, 0.4, 0.5], 0.0, 0.5) };
    let scene = lit(paper, 0.3, 0.0);
    let job = Job { integrator: Integrator::Aov, aovs: vec![Aov::Albedo], ..job(&scene, 2, 2, 1) };
    let film = render(&scene, &job, 2);
    let AovData::Float(albedo) = film.aov(Aov::Albedo).expect("asked for") else { panic!("colours") };
    for (a, b) in albedo.data()[..3].iter().zip([0.4, 0.6, 0.4]) {
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
    assert_mean("aov", &Estimate::from_film(&film), [0.4, 0.6, 0.4], 1e-3);
}
