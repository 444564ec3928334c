//! Sampling routines: samples follow the density that their documentation states, and densities integrate to one.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use optics::constants::ONE_MINUS_EPSILON;
use optics::warp::*;
use optics::{Vec2f, Vec3f, vec2f};
use std::f64::consts::{PI, TAU};
use testkit::{Random, assert_chi2};

const SAMPLES: usize = 200_000;
/// How many χ² tests this file makes: 1 disk, 1 cosine, 1 sphere, 5 cones, 1 triangle, 3 alias tables.
const TESTS: usize = 12;

/// `SAMPLES` random pairs.
fn pairs(seed: u64) -> impl Iterator<Item = Vec2f> {
    let mut random = Random::new(seed);
    (0..SAMPLES).map(move |_| vec2f(random.uniform_f32(), random.uniform_f32()))
}

/// The four corners of the unit square, its centre, and points next to where the maps fold.
fn corners() -> Vec<Vec2f> {
    let edge = [0.0, 1e-7, 0.25, 0.49999997, 0.5, 0.50000006, 0.75, ONE_MINUS_EPSILON];
    edge.iter().flat_map(|&x| edge.iter().map(move |&y| vec2f(x, y))).collect()
}

fn bin(x: f64, bins: usize) -> usize {
    ((x * bins as f64).max(0.0) as usize).min(bins - 1)
}

fn turn(x: f32, y: f32) -> f64 {
    (f64::from(y).atan2(f64::from(x)) / TAU).rem_euclid(1.0)
}

/// χ² on a grid over height (`rise` maps a direction to `[0, 1]`, uniform in z from `top` down by `depth`) and azimuth,
/// against a density over solid angle that depends on z alone and at most linearly.
fn check_directions(
    what: &str,
    depth: f64,
    rise: impl Fn(Vec3f) -> f64,
    pdf: impl Fn(f64) -> f64,
    sample: impl Fn(Vec2f) -> Vec3f,
) {
    let (nz, nphi) = (20, 24);
    let mut observed = vec![0; nz * nphi];
    for u in pairs(1) {
        let d = sample(u);
        observed[bin(rise(d), nz) * nphi + bin(turn(d.x, d.y), nphi)] += 1;
    }
    let cell = depth / nz as f64 * TAU / nphi as f64;
    let expected: Vec<f64> = (0..nz * nphi)
        .map(|i| {
            let z = 1.0 - depth * (1.0 - ((i / nphi) as f64 + 0.5) / nz as f64);
            SAMPLES as f64 * pdf(z) * cell
        })
        .collect();
    let total: f64 = expected.iter().sum();
    assert!((total / SAMPLES as f64 - 1.0).abs() < 1e-5, "{what}: the density integrates to {total}");
    assert_chi2(what, &observed, &expected, TESTS);
}

#[test]
fn disk_samples_are_uniform() {
    let (nr, nphi) = (20, 32);
    let mut observed = vec![0; nr * nphi];
    for u in pairs(2) {
        let p = sample_disk(u);
        let r2 = f64::from(p.x).powi(2) + f64::from(p.y).powi(2);
        observed[bin(r2, nr) * nphi + bin(turn(p.x, p.y), nphi)] += 1;
    }
    assert_chi2("disk", &observed, &vec![SAMPLES as f64 / (nr * nphi) as f64; nr * nphi], TESTS);
    for u in corners() {
        let p = sample_disk(u);
        assert!(p.x * p.x + p.y * p.y <= 1.0 + 1e-6, "{u:?} → {p:?}");
    }
}

/// What "low distortion" is for: neighbours stay neighbours (the polar map fails this at the seam of its angle).
#[test]
fn disk_map_is_continuous() {
    let step = 1e-3;
    for i in 0..1000 {
        for j in 0..1000 {
            let (u, v) = (vec2f(i as f32, j as f32) * step, vec2f(i as f32 + 1.0, j as f32) * step);
            let (p, q) = (sample_disk(u), sample_disk(v));
            assert!((p.x - q.x).hypot(p.y - q.y) < 4.0 * step, "{u:?} and {v:?} go to {p:?} and {q:?}");
        }
    }
}

#[test]
fn cosine_samples_follow_their_density() {
    let pdf = |z: f64| f64::from(pdf_cosine_hemisphere(z as f32));
    check_directions("cosine hemisphere", 1.0, |d| f64::from(d.z), pdf, sample_cosine_hemisphere);
    assert_eq!(pdf_cosine_hemisphere(-0.5), 0.0);
}

#[test]
fn sphere_samples_are_uniform() {
    let pdf = |_: f64| 1.0 / (4.0 * PI);
    check_directions("sphere", 2.0, |d| 0.5 * (f64::from(d.z) + 1.0), pdf, sample_sphere);
}

#[test]
fn cone_samples_follow_their_density_however_narrow() {
    // The last is the sun's: half an angle of 0.27°.
    for one_minus_cos in [2.0f32, 1.0, 0.3, 1e-3, 1.1e-5] {
        let depth = f64::from(one_minus_cos);
        let rise = |d: Vec3f| {
            // 1 − cos from the sine where z has no digits left for it.
            let sin2 = f64::from(d.x).powi(2) + f64::from(d.y).powi(2);
            let narrow = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
            1.0 - if depth < 0.5 { narrow } else { 1.0 - f64::from(d.z) } / depth
        };
        let pdf = |_: f64| f64::from(pdf_cone(one_minus_cos));
        check_directions(&format!("cone {depth:e}"), depth, rise, pdf, |u| sample_cone(u, one_minus_cos));
    }
}

#[test]
fn directions_have_unit_length_in_the_corners() {
    for u in corners() {
        for d in [sample_cosine_hemisphere(u), sample_sphere(u), sample_cone(u, 0.2), sample_cone(u, 2.0)] {
            assert!((d.x * d.x + d.y * d.y + d.z * d.z - 1.0).abs() < 1e-5, "{u:?} → {d:?}");
        }
        assert!(sample_cosine_hemisphere(u).z >= 0.0);
    }
}

#[test]
fn triangle_samples_are_uniform() {
    let n = 16;
    let mut observed = vec![0; n * n];
    for u in pairs(3) {
        let b = sample_triangle(u);
        observed[bin(f64::from(b.y), n) * n + bin(f64::from(b.x), n)] += 1;
    }
    // Squares on the diagonal are half inside; those beyond it are outside.
    let share = |x: usize, y: usize| match (x + y + 1).cmp(&n) {
        std::cmp::Ordering::Less => 1.0,
        std::cmp::Ordering::Equal => 0.5,
        std::cmp::Ordering::Greater => 0.0,
    };
    let area = 2.0 * SAMPLES as f64 / (n * n) as f64;
    let mut expected: Vec<f64> = (0..n * n).map(|i| share(i % n, i / n) * area).collect();
    // A sum that rounds to 1 falls beyond the diagonal; there is no room for it but one square.
    for i in 0..n * n {
        if expected[i] == 0.0 && observed[i] > 0 {
            assert!(observed[i] <= 2, "{} samples outside of the triangle", observed[i]);
            observed[i] = 0;
            expected[i] = 0.0;
        }
    }
    assert_chi2("triangle", &observed, &expected, TESTS);
    for u in corners() {
        let b = sample_triangle(u);
        assert!(b.x >= 0.0 && b.y >= 0.0 && b.x + b.y <= 1.0 + 1e-6, "{u:?} → {b:?}");
    }
}

/// Thresholds and aliases after Vose, for the test only.
fn vose(weights: &[f64]) -> Vec<(f32, u32)> {
    let n = weights.len();
    let total: f64 = weights.iter().sum();
    let mut scaled: Vec<f64> = weights.iter().map(|w| w / total * n as f64).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    let mut table = vec![(1.0, 0); n];
    while let (Some(s), Some(&l)) = (small.pop(), large.last()) {
        table[s] = (scaled[s] as f32, l as u32);
        scaled[l] -= 1.0 - scaled[s];
        if scaled[l] < 1.0 {
            small.push(l);
            large.pop();
        }
    }
    table
}

/// The choice follows the weights, and what is left of the random number is uniform whatever was chosen.
#[test]
fn alias_tables_choose_by_weight_and_leave_a_uniform_remainder() {
    let uneven: Vec<f64> = (0..37).map(|i| ((i * 7919) % 101) as f64).collect();
    for (case, weights) in [vec![1.0], vec![3.0, 0.0, 1.0], uneven].into_iter().enumerate() {
        let table = vose(&weights);
        let (count, cells) = (weights.len(), 16);
        let mut observed = vec![0; count * cells];
        let mut random = Random::new(4);
        for _ in 0..SAMPLES {
            let u = random.uniform_f32();
            let slot = alias_slot(u, count as u32);
            let (threshold, other) = table[slot as usize];
            let choice = alias_choose(u, count as u32, slot, threshold, other);
            assert!((0.0..1.0).contains(&choice.remainder), "{u} leaves {choice:?}");
            observed[choice.index as usize * cells + bin(f64::from(choice.remainder), cells)] += 1;
        }
        let total: f64 = weights.iter().sum();
        let expected: Vec<f64> =
            (0..count * cells).map(|i| SAMPLES as f64 * weights[i / cells] / total / cells as f64).collect();
        assert_chi2(&format!("alias table {case}"), &observed, &expected, TESTS);
    }
}

#[test]
fn alias_slots_are_in_range_for_any_number() {
    for count in [1, 2, 3, 1000, 1 << 20, 20_000_000] {
        for u in [0.0, 1e-9, 0.3, 0.5, ONE_MINUS_EPSILON] {
            let slot = alias_slot(u, count);
            assert!(slot < count);
            for threshold in [0.0, 0.5, 1.0] {
                let c = alias_choose(u, count, slot, threshold, 0);
                assert!(
                    (0.0..1.0).contains(&c.remainder),
                    "count {count}, u {u}, threshold {threshold}: {c:?}"
                );
            }
        }
    }
}

#[test]
#[should_panic(expected = "do not follow the density")]
fn a_wrong_density_is_noticed() {
    // A cosine hemisphere that claims to be 4 % flatter than it is.
    let pdf = |z: f64| (0.96 * z + 0.02) / PI;
    check_directions("flattened", 1.0, |d| f64::from(d.z), pdf, sample_cosine_hemisphere);
}
