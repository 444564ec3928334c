//! Media: phase functions are densities, samples follow them, and distances have the weights that conserve energy.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use optics::medium::transmittance;
use optics::volume::*;
use optics::{Vec3f, vec2f, vec3f};
use std::f64::consts::TAU;
use testkit::{Random, assert_chi2};

const SAMPLES: usize = 200_000;
const ANISOTROPIES: [f32; 8] = [-0.9, -0.3, -1e-4, 0.0, 5e-4, 0.2, 0.7, 0.95];

fn random_direction(random: &mut Random) -> Vec3f {
    optics::warp::sample_sphere(vec2f(random.uniform_f32(), random.uniform_f32()))
}

fn cos(a: Vec3f, b: Vec3f) -> f64 {
    f64::from(optics::vector::dot(a, b))
}

/// Integral of the phase function over a band of cosines, by its antiderivative; `c` is that of the angle of turning.
fn share_up_to(c: f64, g: f64) -> f64 {
    if g == 0.0 {
        return 0.5 * (c + 1.0);
    }
    (1.0 - g * g) / (2.0 * g) * (1.0 / (1.0 + g * g - 2.0 * g * c).sqrt() - 1.0 / (1.0 + g))
}

#[test]
fn phase_functions_integrate_to_one_with_their_mean_cosine() {
    for g in ANISOTROPIES {
        let n = 400_000;
        let (mut sum, mut mean) = (0.0, 0.0);
        for i in 0..n {
            // Steps that are fine where the function is steep: cosines whose distance from ±1 is squared.
            let x = (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
            let (c, dc) = (1.5 * x - 0.5 * x.powi(3), 1.5 * (1.0 - x * x) * 2.0 / f64::from(n));
            let p = f64::from(phase_eval(-c as f32, g)) * TAU * dc;
            sum += p;
            mean += c * p;
        }
        assert!((sum - 1.0).abs() < 2e-5, "g = {g}: the phase function integrates to {sum}");
        assert!((mean - f64::from(g)).abs() < 2e-5, "g = {g}: the mean cosine is {mean}");
    }
}

#[test]
fn phase_samples_follow_their_density() {
    let (bands, sectors) = (24, 16);
    for g in ANISOTROPIES {
        let mut random = Random::new(11);
        let wo = random_direction(&mut random);
        let frame = optics::frame::frame_from_normal(-wo);
        let mut observed = vec![0; bands * sectors];
        let mut mean = 0.0;
        for _ in 0..SAMPLES {
            let wi = phase_sample(wo, g, vec2f(random.uniform_f32(), random.uniform_f32()));
            let local = optics::frame::to_local(frame, wi);
            let c = -cos(wo, wi);
            mean += c / SAMPLES as f64;
            let share = share_up_to(c, f64::from(g)).clamp(0.0, 0.999_999);
            let turn = (f64::from(local.y).atan2(f64::from(local.x)) / TAU).rem_euclid(1.0);
            let (band, sector) = ((share * bands as f64) as usize, (turn * sectors as f64) as usize);
            observed[band * sectors + sector.min(sectors - 1)] += 1;
        }
        let expected = vec![SAMPLES as f64 / (bands * sectors) as f64; bands * sectors];
        assert_chi2(&format!("phase function of g = {g}"), &observed, &expected, ANISOTROPIES.len());
        // The standard deviation of a cosine is at most 1.
        let error = 4.5 / (SAMPLES as f64).sqrt();
        assert!((mean - f64::from(g)).abs() < error, "g = {g}: the mean cosine of samples is {mean}");
    }
}

fn coloured(scattering: [f32; 3]) -> Medium {
    let [x, y, z] = scattering;
    Medium { absorption: vec3f(0.3, 0.0, 1.0), scattering: vec3f(x, y, z), ..vacuum() }
}

/// The weights of paths that get through have the mean exp(−σ d), those of paths that scatter σₛ/σ (1 − exp(−σ d)); no
/// channel's throughput becomes more than the sum of all was.
#[test]
fn distances_have_the_weights_of_the_law_of_beer_and_lambert() {
    let cases = [
        (coloured([0.5, 2.0, 8.0]), vec3f(1.0, 1.0, 1.0), 0.7f32),
        (coloured([0.0, 0.0, 3.0]), vec3f(0.9, 0.1, 0.0), 2.0),
        (coloured([20.0, 0.1, 0.1]), vec3f(0.01, 0.5, 1.0), 0.5),
        (Medium { scattering: vec3f(1.0, 1.0, 1.0), ..vacuum() }, vec3f(0.0, 0.0, 0.0), 1.0),
    ];
    for (m, throughput, end) in cases {
        let sigma = medium_extinction(m);
        let mut random = Random::new(5);
        let (mut through, mut scattered) = ([0.0f64; 3], [0.0f64; 3]);
        let (mut through2, mut scattered2) = ([0.0f64; 3], [0.0f64; 3]);
        for _ in 0..SAMPLES {
            let s = medium_sample(m, throughput, end, vec2f(random.uniform_f32(), random.uniform_f32()));
            assert!(s.distance >= 0.0 && s.distance <= end && (s.scattered || s.distance == end));
            let brought = throughput * s.weight;
            let total = throughput.x + throughput.y + throughput.z;
            for c in [brought.x, brought.y, brought.z] {
                assert!(c <= total * 1.0001 + 1e-6, "a throughput of {throughput:?} became {brought:?}");
            }
            let (sum, squares) =
                if s.scattered { (&mut scattered, &mut scattered2) } else { (&mut through, &mut through2) };
            for (i, w) in [s.weight.x, s.weight.y, s.weight.z].into_iter().enumerate() {
                sum[i] += f64::from(w);
                squares[i] += f64::from(w).powi(2);
            }
        }
        let left = transmittance(sigma, end);
        let ratio = |s: f32, e: f32, left: f32| if e > 0.0 { s / e * (1.0 - left) } else { 0.0 };
        let means = [
            ("through", through, through2, [left.x, left.y, left.z]),
            (
                "scattered",
                scattered,
                scattered2,
                [
                    ratio(m.scattering.x, sigma.x, left.x),
                    ratio(m.scattering.y, sigma.y, left.y),
                    ratio(m.scattering.z, sigma.z, left.z),
                ],
            ),
        ];
        let powers = [throughput.x, throughput.y, throughput.z];
        for (what, sum, squares, expected) in means {
            for i in 0..3 {
                // A channel without throughput has no share in the choice, and may have any variance.
                if powers[i] <= 0.02 && throughput.x + throughput.y + throughput.z > 0.0 {
                    continue;
                }
                let n = SAMPLES as f64;
                let mean = sum[i] / n;
                let error = ((squares[i] / n - mean * mean).max(0.0) / n).sqrt();
                assert!(
                    (mean - f64::from(expected[i])).abs() < 4.5 * error + 1e-4,
                    "{what}, channel {i}: {mean} ± {error} instead of {}",
                    expected[i]
                );
            }
        }
    }
}

/// ε ∫ exp(−σ t) dt, by small steps.
#[test]
fn what_a_medium_emits_is_the_integral_of_what_arrives() {
    for (sigma, length) in [(0.0f32, 3.0f32), (1e-5, 2.0), (1e-3, 1.0), (0.5, 4.0), (30.0, 2.0)] {
        let n = 200_000;
        let step = f64::from(length) / f64::from(n);
        let arrives = |i: i32| (-f64::from(sigma) * (f64::from(i) + 0.5) * step).exp() * step;
        let expected: f64 = (0..n).map(arrives).sum();
        let actual = f64::from(effective_length(sigma, length));
        assert!((actual / expected - 1.0).abs() < 1e-3, "σ = {sigma}, {length} m: {actual}, not {expected}");
    }
    let m = Medium { emission: vec3f(2.0, 1.0, 0.0), absorption: vec3f(1.0, 1.0, 1.0), ..vacuum() };
    let e = medium_emitted(m, optics::constants::FAR);
    assert_eq!([e.x, e.y, e.z], [2.0, 1.0, 0.0]);
}

#[test]
fn fog_with_a_top_is_below_it() {
    let cases = [
        ((1.0, 0.5, 2.0, 10.0), (0.0, 2.0)),
        ((1.0, 0.5, 2.0, 1.5), (0.0, 1.5)),
        ((1.0, -0.5, 2.0, 10.0), (0.0, 10.0)),
        ((1.0, 0.0, 2.0, 10.0), (0.0, 10.0)),
        ((3.0, -0.5, 2.0, 10.0), (2.0, 10.0)),
        ((3.0, -0.5, 2.0, 1.0), (1.0, 1.0)),
        ((3.0, 0.5, 2.0, 10.0), (10.0, 10.0)),
        ((3.0, 0.0, 2.0, 10.0), (10.0, 10.0)),
    ];
    for ((height, slope, top, end), (from, to)) in cases {
        let part = below_height(height, slope, top, end);
        assert_eq!((part.x, part.y), (from, to), "from {height} by {slope}, fog up to {top}, {end} m");
        // Rounding may leave less than nothing of a ray: it is nowhere.
        let nowhere = below_height(height, slope, top, -1e-5);
        assert!(nowhere.y <= nowhere.x, "from {height} by {slope}, fog up to {top}: {nowhere:?}");
    }
}
