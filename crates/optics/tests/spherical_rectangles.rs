//! Rectangles sampled by solid angle: the angle is right, samples are uniform over it and stay in the rectangle, neighbouring
//! numbers give neighbouring points, and whichever way a lamp is sampled, hits know the density.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod double;

use double::{V, cross, dot, solid_angle, unit, wide};
use optics::light::{
    LIGHT_RECTANGLE, Light, flat_light_is_above, light_reach, rectangle_is_near, rectangle_light_pdf,
    rectangle_light_sample,
};
use optics::spherical_rectangle::*;
use optics::spherical_triangle::spherical_triangle_new;
use optics::{Vec2f, Vec3f, vec2f, vec3f};
use std::f64::consts::PI;
use testkit::{Random, assert_chi2};

/// A rectangle given by the way to its first corner and its edges.
#[derive(Clone, Copy, Debug)]
struct Rectangle {
    to_first: Vec3f,
    edge1: Vec3f,
    edge2: Vec3f,
}

impl Rectangle {
    /// One in the plane z = `height`, from `low` to `high`, turned to somewhere else in space.
    fn new(low: [f32; 2], high: [f32; 2], height: f32) -> Self {
        let axes = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]].map(|a| vec3f(a[0], a[1], a[2]));
        Self {
            to_first: axes[0] * low[0] + axes[1] * low[1] + axes[2] * height,
            edge1: axes[0] * (high[0] - low[0]),
            edge2: axes[1] * (high[1] - low[1]),
        }
    }

    fn seen(&self) -> SphericalRectangle {
        spherical_rectangle_new(self.to_first, self.edge1, self.edge2)
    }

    /// The point at shares `b` of the edges.
    fn at(&self, b: [f64; 2]) -> V {
        let (o, e1, e2) = (wide(self.to_first), wide(self.edge1), wide(self.edge2));
        [0, 1, 2].map(|i| o[i] + e1[i] * b[0] + e2[i] * b[1])
    }

    /// Solid angle of the part from shares `low` to `high` of the edges.
    fn part(&self, low: [f64; 2], high: [f64; 2]) -> f64 {
        let [a, b, c, d] = [low, [high[0], low[1]], high, [low[0], high[1]]].map(|at| self.at(at));
        solid_angle([a, b, c]) + solid_angle([a, c, d])
    }

    fn solid_angle(&self) -> f64 {
        self.part([0.0, 0.0], [1.0, 1.0])
    }
}

/// Facing, over a corner, beside it, nearly all of the upper half, a tube, a tube over its middle, over an edge, flat, and seen
/// under a small angle.
fn rectangles() -> [Rectangle; 9] {
    [
        Rectangle::new([-1.0, -1.0], [1.0, 1.0], 1.0),
        Rectangle::new([0.0, 0.0], [1.5, 1.0], 0.3),
        Rectangle::new([0.4, -0.2], [1.4, 0.7], 0.2),
        Rectangle::new([-9.0, -6.0], [8.0, 7.0], 0.3),
        Rectangle::new([-0.3, 0.5], [1.7, 0.52], 0.2),
        Rectangle::new([-0.9, -0.01], [1.1, 0.01], 0.1),
        Rectangle::new([-1.0, 0.0], [1.0, 1.0], 0.06),
        Rectangle::new([0.3, 0.2], [1.3, 1.1], 0.01),
        Rectangle::new([-2.0, 3.0], [-1.0, 4.0], 20.0),
    ]
}

/// A few rectangles whose solid angle has a closed form.
#[test]
fn solid_angles_are_those_of_formulas() {
    // A face of a cube, seen from its middle, and a quarter of one.
    let faces = [([-1.0, -1.0], 1.0, 1.0), ([0.0, 0.0], 1.0, 0.25)];
    for (low, high, share) in faces {
        let seen = Rectangle::new(low, [high, high], 1.0).seen().solid_angle;
        let expected = 4.0 * PI / 6.0 * share;
        assert!((f64::from(seen) / expected - 1.0).abs() < 1e-6, "{seen} instead of {expected}");
    }
    // Centred: 4 asin(ab / √((a² + d²)(b² + d²))) of half edges a, b at a distance d.
    for (a, b, d) in [(1.0, 2.0, 3.0), (0.5, 0.01, 0.2), (10.0, 10.0, 0.1), (1.0f64, 0.3, 0.004)] {
        let seen = Rectangle::new([-a as f32, -b as f32], [a as f32, b as f32], d as f32).seen().solid_angle;
        let expected = 4.0 * (a * b / ((a * a + d * d) * (b * b + d * d)).sqrt()).asin();
        assert!((f64::from(seen) / expected - 1.0).abs() < 1e-5, "{seen} instead of {expected}");
    }
}

#[test]
fn solid_angles_are_the_sum_of_two_triangles() {
    let mut random = Random::new(11);
    let mut tested = 0;
    for _ in 0..20_000 {
        let mut number = || random.uniform_f32() * 2.0 - 1.0;
        let [x0, x1, y0, y1, height] = [(); 5].map(|()| number());
        let r = Rectangle::new([x0, y0], [x1.max(x0) + 0.01, y1.max(y0) + 0.01], height);
        let (seen, expected) = (r.seen(), r.solid_angle());
        if seen.solid_angle > 0.0 {
            tested += 1;
            let error = (f64::from(seen.solid_angle) - expected).abs();
            assert!(error <= 3e-4 * expected, "{r:?}: {} instead of {expected}", seen.solid_angle);
            let corner = r.edge1 + r.edge2;
            let halves = [(r.edge1, corner), (corner, r.edge2)]
                .map(|(a, b)| spherical_triangle_new(r.to_first, a, b).solid_angle);
            if halves[0] > 0.0 && halves[1] > 0.0 {
                let sum = f64::from(halves[0] + halves[1]);
                // Halves as thin as hairs are exact to millionths of a steradian only.
                let error = (sum - expected).abs();
                assert!(error <= 3e-4 * expected + 4e-6, "{r:?}: triangles {sum} of {expected}");
            }
        }
    }
    assert!(tested > 18_500, "only {tested} can be sampled");
}

const SIDE: usize = 12;

/// How many of `COUNT` points that `sample` makes fall into each of `SIDE²` equal parts of the rectangle, and how many should.
fn counts(r: &Rectangle, sample: impl Fn(Vec2f) -> Vec2f) -> (Vec<u64>, Vec<f64>) {
    const COUNT: usize = 200_000;
    let mut observed = vec![0; SIDE * SIDE];
    let mut random = Random::new(5);
    for _ in 0..COUNT {
        let b = sample(vec2f(random.uniform_f32(), random.uniform_f32()));
        assert!((0.0..=1.0).contains(&b.x) && (0.0..=1.0).contains(&b.y), "{r:?}: {b:?} is outside");
        let part = |x: f32| ((x * SIDE as f32) as usize).min(SIDE - 1);
        observed[part(b.x) * SIDE + part(b.y)] += 1;
    }
    let scale = COUNT as f64 / r.solid_angle();
    let share = |i: usize| i as f64 / SIDE as f64;
    let part = |i: usize| {
        let (x, y) = (i / SIDE, i % SIDE);
        r.part([share(x), share(y)], [share(x + 1), share(y + 1)]) * scale
    };
    (observed, (0..SIDE * SIDE).map(part).collect())
}

#[test]
fn samples_are_uniform_over_the_solid_angle() {
    for r in rectangles() {
        let seen = r.seen();
        assert!(seen.solid_angle > 0.0, "{r:?}");
        let (observed, expected) = counts(&r, |u| sample_spherical_rectangle(seen, u));
        assert_chi2(&format!("{r:?}"), &observed, &expected, rectangles().len());
    }
}

#[test]
#[should_panic(expected = "beside")]
fn samples_uniform_over_the_area_are_noticed() {
    let (observed, expected) = counts(&rectangles()[2], |u| u);
    assert_chi2("beside", &observed, &expected, 1);
}

/// The first number is the share that the cut leaves behind it; the second, how far the sine on the cut has come.
#[test]
fn samples_give_their_numbers_back() {
    let mut random = Random::new(3);
    for r in rectangles() {
        let seen = r.seen();
        let along = unit(wide(r.edge2));
        let sine = |v: V| dot(unit(v), along);
        for _ in 0..300 {
            let u = vec2f(random.uniform_f32(), random.uniform_f32());
            let point = sample_spherical_rectangle(seen, u);
            let [x, y] = [point.x, point.y].map(f64::from);
            let first = r.part([0.0, 0.0], [x, 1.0]) / r.solid_angle();
            let (begin, end) = (sine(r.at([x, 0.0])), sine(r.at([x, 1.0])));
            let second = (sine(r.at([x, y])) - begin) / (end - begin);
            let error = (first - f64::from(u.x)).abs().max((second - f64::from(u.y)).abs());
            assert!(error < 1e-3, "{r:?}: {first}, {second} instead of {u:?}");
        }
    }
}

/// The longest step along each edge, if one number goes from 0 to 1 in `steps` steps and the other one is `other`. No step goes
/// back.
fn longest_steps(r: &Rectangle, other: f32, steps: usize) -> [f32; 2] {
    let seen = r.seen();
    let (mut last, mut longest) = ([0.0f32; 2], [0.0f32; 2]);
    for i in 0..=steps {
        let number = (i as f32 / steps as f32).min(1.0 - f32::EPSILON);
        let x = sample_spherical_rectangle(seen, vec2f(number, other)).x;
        let y = sample_spherical_rectangle(seen, vec2f(other, number)).y;
        for (axis, at) in [x, y].into_iter().enumerate() {
            assert!(at >= last[axis] - 2e-4, "{r:?} goes back at {i} of {steps}, {other}");
            longest[axis] = longest[axis].max(at - last[axis]);
            last[axis] = at;
        }
    }
    assert!(last[0] > 0.99 && last[1] > 0.99, "{r:?} ends at {last:?}");
    longest
}

/// Neighbouring numbers give neighbouring points: shorter steps of numbers are shorter steps on the rectangle.
#[test]
fn points_move_with_their_numbers() {
    for r in rectangles() {
        for other in [0.0, 0.3, 0.999] {
            let (coarse, fine) = (longest_steps(&r, other, 400), longest_steps(&r, other, 8000));
            for axis in 0..2 {
                assert!(fine[axis] < 0.3 * coarse[axis] + 1e-3, "{r:?}, {other}: {coarse:?}, {fine:?}");
            }
        }
    }
}

fn lamp(r: &Rectangle) -> Light {
    let emission = vec3f(1.0, 1.0, 1.0);
    let (position, edge1, edge2) = (r.to_first, r.edge1, r.edge2);
    Light { kind: LIGHT_RECTANGLE, position, edge1, edge2, emission, size: 0.0, two_sided: true }
}

const ORIGIN: Vec3f = vec3f(0.0, 0.0, 0.0);

/// Whichever way a lamp is sampled: what is met by chance knows the density.
#[test]
fn hits_have_the_density_of_samples_near_and_far() {
    let mut ways = [0; 2];
    for r in rectangles() {
        for k in 0..40 {
            let p = vec3f(0.3 * k as f32, -0.1 * k as f32, -0.4 * k as f32);
            let r = Rectangle { to_first: r.to_first - p, ..r };
            let near = rectangle_is_near(r.to_first, r.edge1, r.edge2);
            ways[usize::from(near)] += 1;
            let s = rectangle_light_sample(lamp(&r), ORIGIN, vec2f(0.3, 0.8));
            let pdf = rectangle_light_pdf(r.to_first, r.edge1, r.edge2, s.wi, s.distance);
            assert!(s.pdf > 0.0 && (pdf / s.pdf - 1.0).abs() < 1e-4, "{r:?}: {pdf} instead of {}", s.pdf);
            let seen = r.seen().solid_angle;
            if near && seen > 0.0 {
                assert_eq!(s.pdf, 1.0 / seen);
            }
        }
    }
    assert!(ways[0] > 20 && ways[1] > 20, "all are near or far: {ways:?}");
}

/// Irradiance of a facing square by samples, near and far, against the integral over its solid angle.
#[test]
fn samples_bring_the_form_factor() {
    let mut random = Random::new(17);
    for distance in [0.02, 0.3, 1.0, 5.0] {
        let r = Rectangle::new([-1.0, -1.0], [1.0, 1.0], distance);
        let normal = unit(cross(wide(r.edge1), wide(r.edge2)));
        let mut sum = 0.0;
        const COUNT: usize = 40_000;
        for _ in 0..COUNT {
            let u = vec2f(random.uniform_f32(), random.uniform_f32());
            let s = rectangle_light_sample(lamp(&r), ORIGIN, u);
            sum += f64::from(s.radiance.x) * dot(wide(s.wi), normal).abs() / f64::from(s.pdf);
        }
        // Between a small area and the middle of a square of half edge 1: Siegel and Howell, "Thermal Radiation Heat Transfer".
        let d = f64::from(distance);
        let root = (1.0 + d * d).sqrt();
        let expected = 4.0 / root * (1.0 / root).atan();
        let irradiance = sum / COUNT as f64;
        assert!((irradiance / expected - 1.0).abs() < 0.01, "at {d}: {irradiance} of {expected}");
    }
}

/// Receivers anywhere, on corners, edges and planes; rectangles of all sizes, without area, without extent, far away.
#[test]
fn degenerate_rectangles_give_finite_samples() {
    let mut random = Random::new(29);
    for i in 0..20_000 {
        let size = 10f32.powi(i % 37 - 18);
        let mut number =
            || if random.bits().is_multiple_of(4) { 0.0 } else { random.uniform_f32() * 2.0 - 1.0 };
        let mut r = Rectangle::new([number() * size, number() * size], [number(), number()], number());
        match i % 7 {
            0 => r.edge2 = vec3f(0.0, 0.0, 0.0),
            1 => r.to_first = r.edge1 * -0.5,
            2 => r.to_first = r.edge1 * -0.5 - r.edge2 * 0.3,
            3 => r.to_first = vec3f(0.0, 0.0, 0.0),
            4 => (r.edge1, r.edge2) = (r.edge1 * size, r.edge2 * (1.0 / size)),
            _ => {}
        }
        for u in [vec2f(0.0, 0.0), vec2f(0.999_999_94, 0.999_999_94), vec2f(0.0, 0.7), vec2f(0.6, 0.0)] {
            let seen = r.seen();
            assert!((0.0..=2.0 * PI as f32 + 1e-5).contains(&seen.solid_angle), "{r:?}: {seen:?}");
            if seen.solid_angle > 0.0 {
                let b = sample_spherical_rectangle(seen, u);
                assert!((0.0..=1.0).contains(&b.x) && (0.0..=1.0).contains(&b.y), "{r:?}, {u:?}: {b:?}");
            }
            let s = rectangle_light_sample(lamp(&r), ORIGIN, u);
            assert!(s.pdf >= 0.0 && s.pdf.is_finite(), "{r:?}, {u:?}: {s:?}");
            let pdf = rectangle_light_pdf(r.to_first, r.edge1, r.edge2, s.wi, s.distance);
            assert!(pdf >= 0.0 && !pdf.is_nan(), "{r:?}, {u:?}: density {pdf}");
        }
    }
}

/// All corners count, the fourth one too.
#[test]
fn a_rectangle_is_above_with_any_of_its_corners() {
    let r = Rectangle::new([-1.0, -1.0], [1.0, 1.0], 1.0);
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|b| r.at(b));
    for corner in corners {
        // Planes through the origin that have all other corners behind them, or this one, too.
        let center = r.at([0.5, 0.5]);
        let outwards = [0, 1, 2].map(|i| corner[i] - center[i]);
        let (out, far) = (dot(outwards, corner), dot(center, center));
        for (share, above) in [(0.9, true), (1.1, false)] {
            let n = [0, 1, 2].map(|i| outwards[i] - center[i] * share * out / far);
            let normal = vec3f(n[0] as f32, n[1] as f32, n[2] as f32);
            let expected = corners.iter().any(|c| dot(*c, n) > 0.0);
            assert_eq!(expected, above, "of {corner:?}");
            assert_eq!(flat_light_is_above(lamp(&r), r.to_first, normal), above, "{corner:?}");
        }
    }
}

/// Nowhere beyond the reach does a lamp give more than the cutoff.
#[test]
fn the_reach_holds_all_that_a_rectangle_lights() {
    let r = Rectangle::new([-0.5, 2.0], [1.5, 3.0], 1.0);
    let reach = light_reach(lamp(&r), 0.01, vec3f(0.0, 0.0, 1.0));
    let center = r.at([0.5, 0.5]);
    assert!((0..3).all(|i| (f64::from(reach.center.to_array()[i]) - center[i]).abs() < 1e-5), "{reach:?}");
    // Radiance 1 over an area of 2: half its diagonal beyond the distance at which 2 / d² is 0.01.
    let expected = 5f64.sqrt() / 2.0 + 200f64.sqrt();
    assert!((f64::from(reach.radius) - expected).abs() < 1e-3, "{reach:?} instead of {expected}");
}
