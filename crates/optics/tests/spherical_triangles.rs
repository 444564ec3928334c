//! Triangles sampled by solid angle: the angle is right, samples are uniform over it and stay in the triangle, and the numbers
//! they were made of can be had back.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod double;

use double::{V, dot, solid_angle, unit, wide};
use optics::light::{LIGHT_TRIANGLE, Light, triangle_is_near, triangle_light_pdf, triangle_light_sample};
use optics::portal::triangle_is_passed;
use optics::spherical_triangle::*;
use optics::warp::sample_triangle;
use optics::{Vec2f, Vec3f, vec2f, vec3f};
use testkit::{Random, assert_chi2};

/// A triangle given by the way to its first vertex and its edges.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    to_first: Vec3f,
    edge1: Vec3f,
    edge2: Vec3f,
}

impl Triangle {
    fn new(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> Self {
        let [a, b, c] = [a, b, c].map(|v| vec3f(v[0], v[1], v[2]));
        Self { to_first: a, edge1: b - a, edge2: c - a }
    }

    fn seen(&self) -> SphericalTriangle {
        spherical_triangle_new(self.to_first, self.edge1, self.edge2)
    }

    /// The point with barycentric weights `b` of the second and third vertex.
    fn at(&self, b: [f64; 2]) -> V {
        let (o, e1, e2) = (wide(self.to_first), wide(self.edge1), wide(self.edge2));
        [0, 1, 2].map(|i| o[i] + e1[i] * b[0] + e2[i] * b[1])
    }

    fn solid_angle(&self) -> f64 {
        solid_angle([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|b| self.at(b)))
    }
}

/// Facing, oblique, nearly all of the upper half, a sliver, over an edge, seen under a small angle.
fn triangles() -> [Triangle; 6] {
    [
        Triangle::new([-1.0, -1.0, 2.0], [0.0, 1.5, 2.0], [1.0, -1.0, 2.0]),
        Triangle::new([0.4, 0.4, 0.95], [0.6, 2.2, 1.35], [2.9, 0.3, 0.55]),
        Triangle::new([-9.0, -6.0, 0.3], [9.0, -6.0, 0.3], [0.0, 12.0, 0.3]),
        Triangle::new([-1.0, 0.2, 0.4], [1.0, 0.2, 0.4], [1.0, 0.21, 0.41]),
        Triangle::new([-1.0, 0.0, 0.06], [1.0, 0.0, 0.06], [0.0, 1.0, 0.06]),
        Triangle::new([3.0, 4.0, 20.0], [4.0, 4.0, 20.0], [3.0, 5.0, 20.5]),
    ]
}

#[test]
fn solid_angles_are_those_of_double_precision() {
    let mut random = Random::new(11);
    let mut tested = 0;
    for _ in 0..20_000 {
        let mut number = || random.uniform_f32() * 2.0 - 1.0;
        let mut point = || [number(), number(), number()];
        let t = Triangle::new(point(), point(), point());
        let (seen, expected) = (t.seen(), t.solid_angle());
        if seen.solid_angle > 0.0 {
            tested += 1;
            // Edge-on, the volume of the three directions is what rounding leaves of it.
            let error = (f64::from(seen.solid_angle) - expected).abs();
            assert!(error <= 2e-5 * expected + 2e-6, "{t:?}: {} instead of {expected}", seen.solid_angle);
        }
    }
    assert!(tested > 19_000, "only {tested} can be sampled");
}

/// How many of `COUNT` points that `sample` makes fall into each of `SIDE²` equal parts of the triangle, and how many should.
fn counts(t: &Triangle, sample: impl Fn(Vec2f) -> Vec2f) -> (Vec<u64>, Vec<f64>) {
    const SIDE: usize = 12;
    const COUNT: usize = 200_000;
    let mut observed = vec![0; SIDE * SIDE];
    let mut random = Random::new(5);
    for _ in 0..COUNT {
        let b = sample(vec2f(random.uniform_f32(), random.uniform_f32()));
        assert!(b.x >= 0.0 && b.y >= 0.0 && b.x + b.y <= 1.0 + 1e-6, "{t:?}: {b:?} is outside");
        let (x, y) = (b.x * SIDE as f32, b.y * SIDE as f32);
        let (i, j) = ((x as usize).min(SIDE - 1), (y as usize).min(SIDE - 1));
        let upper = usize::from(x - i as f32 + (y - j as f32) > 1.0);
        // Row `i` of the parts has 2 (SIDE − i) − 1 of them.
        let row = i * (2 * SIDE - i);
        observed[(row + 2 * j + upper).min(row + 2 * (SIDE - i) - 2)] += 1;
    }
    let mut expected = vec![];
    let step = 1.0 / SIDE as f64;
    for i in 0..SIDE {
        for j in 0..SIDE - i {
            let corner = |di: usize, dj: usize| t.at([(i + di) as f64 * step, (j + dj) as f64 * step]);
            expected.push(solid_angle([corner(0, 0), corner(1, 0), corner(0, 1)]));
            if i + j + 1 < SIDE {
                expected.push(solid_angle([corner(1, 0), corner(1, 1), corner(0, 1)]));
            }
        }
    }
    let scale = COUNT as f64 / t.solid_angle();
    (observed, expected.iter().map(|e| e * scale).collect())
}

#[test]
fn samples_are_uniform_over_the_solid_angle() {
    for t in triangles() {
        let seen = t.seen();
        assert!(seen.solid_angle > 0.0, "{t:?}");
        let (observed, expected) = counts(&t, |u| sample_spherical_triangle(seen, u));
        assert_chi2(&format!("{t:?}"), &observed, &expected, triangles().len());
    }
}

#[test]
#[should_panic(expected = "oblique")]
fn samples_uniform_over_the_area_are_noticed() {
    let (observed, expected) = counts(&triangles()[1], sample_triangle);
    assert_chi2("oblique", &observed, &expected, 1);
}

/// The first number is the share that an arc from the second vertex cuts off; the second, of 1 − cosine on that arc.
#[test]
fn samples_give_their_numbers_back() {
    let mut random = Random::new(3);
    for t in triangles() {
        let seen = t.seen();
        let [a, b] = [t.at([0.0, 0.0]), t.at([1.0, 0.0])];
        for _ in 0..300 {
            let u = vec2f(random.uniform_f32(), 0.05 + 0.9 * random.uniform_f32());
            let point = sample_spherical_triangle(seen, u);
            let weights =
                [1.0 - f64::from(point.x) - f64::from(point.y), f64::from(point.x), f64::from(point.y)];
            // Where the arc through the point ends, on the edge from the first vertex to the third.
            let end = t.at([0.0, weights[2] / (weights[0] + weights[2])]);
            let first = solid_angle([a, b, end]) / t.solid_angle();
            let b = unit(b);
            let along = |v: V| {
                let v = unit(v);
                let chord = [v[0] - b[0], v[1] - b[1], v[2] - b[2]];
                dot(chord, chord)
            };
            let second = along(t.at([weights[1], weights[2]])) / along(end);
            let error = (first - f64::from(u.x)).abs().max((second - f64::from(u.y)).abs());
            assert!(error < 2e-4, "{t:?}: {first}, {second} instead of {u:?}");
        }
    }
}

fn lamp(t: &Triangle) -> Light {
    let emission = vec3f(1.0, 1.0, 1.0);
    let (position, edge1, edge2) = (t.to_first, t.edge1, t.edge2);
    Light { kind: LIGHT_TRIANGLE, position, edge1, edge2, emission, size: 0.0, two_sided: true }
}

/// Whichever way a lamp is sampled: what is met by chance knows the density.
#[test]
fn hits_have_the_density_of_samples_near_and_far() {
    let mut ways = [0; 2];
    for t in triangles() {
        for k in 0..40 {
            let p = vec3f(0.3 * k as f32, -0.1 * k as f32, -0.4 * k as f32);
            let t = Triangle { to_first: t.to_first - p, ..t };
            let near = triangle_is_near(t.to_first, t.edge1, t.edge2);
            ways[usize::from(near)] += 1;
            let s = triangle_light_sample(lamp(&t), vec3f(0.0, 0.0, 0.0), vec2f(0.3, 0.8));
            let pdf = triangle_light_pdf(t.to_first, t.edge1, t.edge2, s.wi, s.distance);
            assert!(s.pdf > 0.0 && (pdf / s.pdf - 1.0).abs() < 1e-4, "{t:?}: {pdf} instead of {}", s.pdf);
            let seen = t.seen().solid_angle;
            if near && seen > 0.0 {
                assert_eq!(s.pdf, 1.0 / seen);
            }
        }
    }
    assert!(ways[0] > 20 && ways[1] > 20, "all are near or far: {ways:?}");
}

/// Receivers anywhere, on vertices, edges and planes; triangles of all sizes, without area, without extent.
#[test]
fn degenerate_triangles_give_finite_samples() {
    let mut random = Random::new(29);
    for i in 0..20_000 {
        let size = 10f32.powi(i % 25 - 12);
        let mut number =
            || if random.bits().is_multiple_of(4) { 0.0 } else { random.uniform_f32() * 2.0 - 1.0 };
        let mut point = |size: f32| vec3f(number(), number(), number()) * size;
        let (to_first, mut edge1, mut edge2) = (point(1.0), point(size), point(size));
        match i % 7 {
            0 => edge2 = edge1 * 0.5,
            1 => edge1 = to_first * -2.0,
            2 => edge2 = edge1 - to_first * 1.000_001,
            _ => {}
        }
        let t = Triangle { to_first, edge1, edge2 };
        for u in [vec2f(0.0, 0.0), vec2f(0.999_999_94, 0.999_999_94), vec2f(0.0, 0.7), vec2f(0.6, 0.0)] {
            let s = triangle_light_sample(lamp(&t), vec3f(0.0, 0.0, 0.0), u);
            assert!(s.pdf >= 0.0 && s.pdf.is_finite(), "{t:?}, {u:?}: {s:?}");
            let b = s.barycentrics;
            assert!(b.x >= 0.0 && b.y >= 0.0 && b.x + b.y <= 1.0 + 1e-6, "{t:?}, {u:?}: {s:?}");
            let pdf = triangle_light_pdf(t.to_first, t.edge1, t.edge2, s.wi, s.distance);
            assert!(pdf >= 0.0 && !pdf.is_nan(), "{t:?}, {u:?}: density {pdf}");
        }
    }
}

/// What is passed is what is sampled: rays through points of the triangle, and none through points beside it or behind.
#[test]
fn rays_pass_triangles_within_their_edges() {
    let mut random = Random::new(41);
    for t in triangles() {
        for _ in 0..500 {
            let b = [random.uniform() * 2.0 - 0.5, random.uniform() * 2.0 - 0.5];
            let margin = b[0].min(b[1]).min(1.0 - b[0] - b[1]);
            let wi = unit(t.at(b)).map(|c| c as f32);
            let passes = |s: f32| {
                triangle_is_passed(t.to_first, t.edge1, t.edge2, vec3f(s * wi[0], s * wi[1], s * wi[2]))
            };
            assert!(passes(1.0) == (margin > 0.0) || margin.abs() < 1e-3, "{t:?} at {b:?}");
            assert!(!passes(-1.0), "{t:?} lies behind");
        }
    }
}
