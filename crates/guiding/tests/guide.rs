//! What a guide has learned is a density, its samples follow it, and it is the same whoever adds in which order.

#![allow(clippy::disallowed_methods, reason = "what is learned from need not have the same bits everywhere")]

use guiding::{Found, Guide, Learner, MOST_LEAVES, MOST_NODES};
use optics::guiding::{guide_direction, guide_jacobian};
use optics::vector::{dot, normalize};
use optics::{Vec3f, vec2f, vec3f};
use std::sync::Arc;
use testkit::{Random, assert_chi2};

const BOUNDS: [[f32; 3]; 2] = [[-1.0, 0.0, -2.0], [1.0, 2.0, 2.0]];

/// A find of a path that samples the whole sphere evenly where a narrow light is on the left and a wide one on the right.
fn find(random: &mut Random) -> Found {
    let uniform = |random: &mut Random, low: f32, high: f32| low + (high - low) * random.uniform_f32();
    let position = vec3f(
        uniform(random, -1.0, 1.0),
        uniform(random, 0.0, 2.0) * random.uniform_f32(),
        uniform(random, -2.0, 2.0),
    );
    let z = uniform(random, -1.0, 1.0);
    let angle = uniform(random, 0.0, std::f32::consts::TAU);
    let across = (1.0 - z * z).sqrt();
    let wi = vec3f(across * angle.cos(), across * angle.sin(), z);
    let lobe = |axis: Vec3f, sharpness: f32| (sharpness * (dot(wi, normalize(axis)) - 1.0)).exp();
    let radiance = if position.x < 0.0 {
        lobe(vec3f(1.0, 0.3, 0.2), 200.0) + 0.01
    } else {
        lobe(vec3f(-0.2, -0.9, 0.6), 4.0)
    };
    let pdf = 1.0 / (4.0 * std::f32::consts::PI);
    Found { position, wi, pdf, bsdf_pdf: pdf, guide_pdf: pdf, radiance, contribution: radiance }
}

/// A guide that has learned in a few runs.
fn learned(runs: u32, finds: u32, most_finds: u32) -> Guide {
    let mut random = Random::new(7);
    let mut guide = Guide::unlearned(BOUNDS);
    for run in 0..runs {
        let learner = Learner::new(Arc::new(guide), 0.1);
        for _ in 0..finds {
            let found = find(&mut random);
            let guide_pdf = learner.guide().pdf(learner.guide().leaf(found.position), found.wi);
            learner.add(&Found { guide_pdf, ..found });
        }
        guide = learner.refine(most_finds, run + 1 == runs);
    }
    guide
}

const PLACES: [Vec3f; 3] =
    [Vec3f::vec3(-0.5, 0.2, 0.0), Vec3f::vec3(0.7, 1.9, 1.5), Vec3f::vec3(5.0, -9.0, 0.0)];

/// Directions of a grid of the unit square, with the solid angle of each.
fn directions(n: u32) -> impl Iterator<Item = (Vec3f, f64)> {
    (0..n * n).map(move |i| {
        let at = |i: u32| (i as f32 + 0.5) / n as f32;
        let wi = guide_direction(vec2f(at(i % n), at(i / n)));
        (wi, 1.0 / f64::from(guide_jacobian(wi)) / f64::from(n * n))
    })
}

/// A bin of a direction, of bands of equal area that know nothing of the octahedral map.
fn bin(wi: Vec3f) -> usize {
    let band = ((wi.z * 0.5 + 0.5) * 16.0).clamp(0.0, 15.0) as usize;
    let turn = (wi.y.atan2(wi.x) / std::f32::consts::TAU + 0.5) * 32.0;
    band * 32 + turn.clamp(0.0, 31.0) as usize
}

#[test]
fn densities_integrate_to_one_and_samples_follow_them() {
    let guide = learned(4, 40_000, 4000);
    assert!(guide.leaves() > 8, "{}", guide.leaves());
    let mut random = Random::new(1);
    for place in PLACES {
        let leaf = guide.leaf(place);
        let mut expected = vec![0.0; 512];
        for (wi, angle) in directions(1024) {
            expected[bin(wi)] += f64::from(guide.pdf(leaf, wi)) * angle;
        }
        let whole: f64 = expected.iter().sum();
        assert!((whole - 1.0).abs() < 1e-4, "{place:?}: the density integrates to {whole}");
        let count = 100_000;
        let mut observed = vec![0; 512];
        for _ in 0..count {
            let s = guide.sample(leaf, vec2f(random.uniform_f32(), random.uniform_f32()));
            let pdf = guide.pdf(leaf, s.wi);
            assert!((pdf / s.pdf - 1.0).abs() < 1e-3 || near_an_edge(s.wi), "{pdf} {s:?}");
            observed[bin(s.wi)] += 1;
        }
        let expected: Vec<f64> = expected.iter().map(|e| e * f64::from(count)).collect();
        assert_chi2(&format!("{place:?}"), &observed, &expected, PLACES.len());
    }
}

/// Whether rounding may say that a direction is in the next square.
fn near_an_edge(wi: Vec3f) -> bool {
    let s = optics::guiding::guide_square(wi);
    [s.x, s.y].iter().any(|x| ((x * 1024.0) - (x * 1024.0).round()).abs() < 1e-3)
}

#[test]
fn light_is_found_where_it_is() {
    let guide = learned(4, 40_000, 4000);
    let narrow = normalize(vec3f(1.0, 0.3, 0.2));
    let mut random = Random::new(2);
    let near = |place: Vec3f, random: &mut Random| {
        let leaf = guide.leaf(place);
        let hits = (0..1000).filter(|_| {
            let u = vec2f(random.uniform_f32(), random.uniform_f32());
            dot(guide.sample(leaf, u).wi, narrow) > 0.97
        });
        hits.count()
    };
    // 1.5 % of the sphere, from which a fifth of the light on the left comes: 2π / 200 of that and 0.01 · 4π.
    let (left, right) = (near(PLACES[0], &mut random), near(PLACES[1], &mut random));
    assert!((150..250).contains(&left) && right < 50, "{left} {right}");
    // Where the light is narrow, a guide is worth most.
    assert!(guide.leaf(PLACES[0]).fraction > 0.0);
}

#[test]
fn order_does_not_matter() {
    let guide = Arc::new(learned(2, 20_000, 2000));
    let mut random = Random::new(3);
    let finds: Vec<Found> = (0..20_000).map(|_| find(&mut random)).collect();
    let (forwards, threads) = (Learner::new(guide.clone(), 0.1), Learner::new(guide, 0.1));
    finds.iter().for_each(|found| forwards.add(found));
    std::thread::scope(|scope| {
        for first in 0..4 {
            let (finds, learner) = (&finds, &threads);
            scope.spawn(move || finds.iter().rev().skip(first).step_by(4).for_each(|f| learner.add(f)));
        }
    });
    assert_eq!(forwards.refine(1000, true), threads.refine(1000, true));
    assert_ne!(forwards.refine(1000, true), forwards.refine(3000, true));
}

#[test]
fn memory_is_bounded() {
    // Every leaf wants to be divided again and again.
    let guide = learned(3, 60_000, 1);
    assert!(guide.leaves() > MOST_LEAVES / 2, "{}", guide.leaves());
    assert!(guide.leaves() <= MOST_LEAVES && guide.nodes() <= MOST_NODES);
    let learner = Learner::new(Arc::new(guide.clone()), 1.0);
    assert!(guide.memory_bytes() + learner.memory_bytes() < 40 << 20);
}

#[test]
fn what_is_no_light_is_not_learned_from() {
    let learner = Learner::new(Arc::new(Guide::unlearned(BOUNDS)), f32::NAN);
    let good = find(&mut Random::new(4));
    for radiance in [f32::NAN, -1.0, 0.0, f32::INFINITY] {
        for _ in 0..100 {
            learner.add(&Found { radiance, contribution: radiance, ..good });
        }
    }
    let guide = learner.refine(1000, true);
    let whole: f64 =
        directions(256).map(|(wi, angle)| f64::from(guide.pdf(guide.leaf(good.position), wi)) * angle).sum();
    assert!((whole - 1.0).abs() < 0.01, "{whole}");
}
