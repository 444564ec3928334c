//! Media that scatter often.

use super::*;

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

/// Mitsuba 3.9.1's `volpath` (scalar_rgb, max_depth 64, no roulette, 12 × 1024 samples a pixel) of the scene below: means of
/// blocks of 8×8 pixels, and their standard errors. A `null` cube of a `homogeneous` medium, sigma_t (1, 2, 4), albedo (0.9,
/// 0.8, 0.5), `hg` with g = 0.5; in it a `diffuse` sphere; a `rectangle` with an `area` emitter above, which Mitsuba makes black.
const MITSUBA: [[[f64; 3]; 4]; 4] = [
    [
        [0.00507, 0.00771, 0.00554],
        [0.08525, 0.10945, 0.06081],
        [0.10408, 0.13398, 0.07611],
        [0.00806, 0.01230, 0.00940],
    ],
    [
        [0.01501, 0.01756, 0.00993],
        [0.26758, 0.25124, 0.06811],
        [0.33149, 0.30900, 0.08627],
        [0.02081, 0.02608, 0.01652],
    ],
    [
        [0.16347, 0.13009, 0.09127],
        [0.16194, 0.09882, 0.01772],
        [0.22529, 0.14173, 0.03009],
        [0.28778, 0.26954, 0.23443],
    ],
    [
        [0.32220, 0.29968, 0.26664],
        [0.37492, 0.34429, 0.30040],
        [0.41176, 0.37939, 0.33243],
        [0.43450, 0.42047, 0.39224],
    ],
];
const MITSUBA_ERRORS: [[[f64; 3]; 4]; 4] = [
    [
        [0.00007, 0.00010, 0.00008],
        [0.00045, 0.00049, 0.00033],
        [0.00035, 0.00033, 0.00026],
        [0.00007, 0.00013, 0.00011],
    ],
    [
        [0.00015, 0.00012, 0.00005],
        [0.00143, 0.00083, 0.00030],
        [0.00100, 0.00101, 0.00036],
        [0.00012, 0.00015, 0.00008],
    ],
    [
        [0.00040, 0.00027, 0.00017],
        [0.00121, 0.00042, 0.00011],
        [0.00182, 0.00052, 0.00003],
        [0.00048, 0.00029, 0.00014],
    ],
    [
        [0.00070, 0.00042, 0.00024],
        [0.00051, 0.00030, 0.00020],
        [0.00051, 0.00025, 0.00010],
        [0.00048, 0.00034, 0.00018],
    ],
];

#[test]
fn a_medium_in_a_room_looks_as_in_mitsuba() {
    let mut scene = Scene::default();
    let floor = scene.add_material(lambert("floor", [0.5; 3]));
    scene.add_mesh("floor", ground(0.0, 10.0), floor);
    let lamp = scene.add_material(emitter("lamp", [8.0; 3]));
    let above = Affine3A::from_translation(Vec3::new(0.5, 3.0, 0.5));
    scene.add_shape("lamp", Shape::Triangles(flipped(ground(0.0, 1.0))), lamp, above);
    let inside = scene.add_material(filled(medium([0.1, 0.4, 2.0], [0.9, 1.6, 2.0], 0.5)));
    scene.add_mesh("box", cuboid([-0.7, 0.1, -0.7], [0.7, 1.5, 0.7]), inside);
    let ball = scene.add_material(lambert("ball", [0.8; 3]));
    scene.add_shape("ball", sphere([0.0, 0.8, 0.0], 0.3), ball, Affine3A::IDENTITY);
    scene.cameras.push(camera([0.0, 1.2, 4.0], [0.0, 0.6, 0.0], 40.0));
    let e = estimate(&scene, &job(&scene, 32, 32, 64), 256);
    for (i, (theirs, errors)) in MITSUBA.iter().flatten().zip(MITSUBA_ERRORS.iter().flatten()).enumerate() {
        let pixels = (0..64).map(|p| (i / 4 * 8 + p / 8) * 32 + i % 4 * 8 + p % 8);
        for c in 0..3 {
            let ours = pixels.clone().map(|p| e.mean[p][c]).sum::<f64>() / 64.0;
            let noise = pixels.clone().map(|p| e.variance[p][c]).sum::<f64>().sqrt() / 64.0;
            // Five standard errors; theirs are themselves estimated from 12 renders, and rounded.
            let allowed = 5.0 * noise.hypot(1.3 * errors[c] + 5e-6) + 1e-3 * theirs[c];
            let apart = (ours - theirs[c]).abs();
            assert!(apart <= allowed, "block {i}, channel {c}: {ours} ± {noise}, Mitsuba {}", theirs[c]);
            assert!(
                noise < 0.02 * theirs[c] + 5e-4,
                "block {i}, channel {c}: ± {noise} of {ours} says nothing"
            );
        }
    }
}
