//! Lights: densities are those of the samples, samples lie on the light, and irradiance has the values that can be had
//! in closed form.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use optics::constants::{FAR, ONE_MINUS_EPSILON};
use optics::light::*;
use optics::{Vec2f, Vec3f, vec2f, vec3f};
use std::f64::consts::PI;
use wgsl_rs::std::{cross, dot, length, normalize};

/// Points a side of the grid over the unit square.
const GRID: usize = 256;
/// Relative. The midpoint rule on `GRID²` points is good to a few 10⁻⁵ for these integrands, whose only kinks are the
/// fold of the triangle map and the horizon of receivers inside of spheres; f32 adds some 10⁻⁶.
const CLOSE: f64 = 2e-4;

fn light(kind: u32) -> Light {
    Light {
        kind,
        position: vec3f(0.0, 0.0, 0.0),
        edge1: vec3f(0.0, 0.0, 0.0),
        edge2: vec3f(0.0, 0.0, 0.0),
        emission: vec3f(2.0, 3.0, 5.0),
        size: 0.0,
        two_sided: false,
    }
}

fn sphere(center: Vec3f, radius: f32) -> Light {
    Light { position: center, size: radius, ..light(LIGHT_SPHERE) }
}

fn triangle(a: Vec3f, b: Vec3f, c: Vec3f) -> Light {
    Light { position: a, edge1: b - a, edge2: c - a, ..light(LIGHT_TRIANGLE) }
}

fn grid() -> impl Iterator<Item = Vec2f> {
    let at = |i: usize| (i as f32 + 0.5) / GRID as f32;
    (0..GRID * GRID).map(move |i| vec2f(at(i % GRID), at(i / GRID)))
}

/// Mean over the unit square of what an estimator of `∫ f dω` adds up: `f / pdf`.
fn integrate(light: Light, p: Vec3f, f: impl Fn(LightSample) -> f64) -> f64 {
    let estimate = |s: LightSample| if s.pdf > 0.0 { f(s) / f64::from(s.pdf) } else { 0.0 };
    grid().map(|u| estimate(light_sample(light, p, u))).sum::<f64>() / (GRID * GRID) as f64
}

/// Irradiance at `p` on a surface of unit normal `n`, red channel.
fn irradiance(light: Light, p: Vec3f, n: Vec3f) -> f64 {
    integrate(light, p, |s| f64::from(s.radiance.x) * f64::from(dot(s.wi, n)).max(0.0))
}

fn solid_angle(light: Light, p: Vec3f) -> f64 {
    integrate(light, p, |_| 1.0)
}

#[track_caller]
fn assert_close(what: &str, actual: f64, expected: f64, tolerance: f64) {
    let error = (actual / expected - 1.0).abs();
    assert!(
        error <= tolerance,
        "{what}: {actual} instead of {expected}, off by {error:.2e}, allowed {tolerance:.2e}"
    );
}

const UP: Vec3f = Vec3f::vec3(0.0, 0.0, 1.0);

type V = [f64; 3];

fn wide(v: Vec3f) -> V {
    v.to_array().map(f64::from)
}

fn dot64(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross64(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Unit vector from `p` to `v`.
fn toward(p: Vec3f, v: Vec3f) -> V {
    let (p, v) = (wide(p), wide(v));
    let d = [v[0] - p[0], v[1] - p[1], v[2] - p[2]];
    d.map(|c| c / dot64(d, d).sqrt())
}

/// Lambert's formula for the irradiance of a polygon of radiance 1 that is above the receiver's horizon; the sign tells
/// which way it winds.
fn lambert_polygon(p: Vec3f, n: Vec3f, vertices: &[Vec3f]) -> f64 {
    let edge = |i: usize| {
        let (a, b) = (toward(p, vertices[i]), toward(p, vertices[(i + 1) % vertices.len()]));
        let normal = cross64(a, b);
        let sine = dot64(normal, normal).sqrt();
        sine.atan2(dot64(a, b)) * dot64(normal, wide(n)) / sine
    };
    0.5 * (0..vertices.len()).map(edge).sum::<f64>()
}

/// Solid angle of a triangle. Source: Van Oosterom and Strackee 1983.
fn triangle_solid_angle(p: Vec3f, t: [Vec3f; 3]) -> f64 {
    let [a, b, c] = t.map(|v| toward(p, v));
    let numerator = dot64(a, cross64(b, c)).abs();
    2.0 * numerator.atan2(1.0 + dot64(a, b) + dot64(b, c) + dot64(c, a))
}

fn triangles() -> Vec<[Vec3f; 3]> {
    vec![
        [vec3f(-1.0, -1.0, 2.0), vec3f(0.0, 1.5, 2.0), vec3f(1.0, -1.0, 2.0)],
        [vec3f(0.5, 0.2, 1.0), vec3f(0.7, 2.0, 1.4), vec3f(3.0, 0.1, 0.6)],
        [vec3f(10.0, 10.0, 20.0), vec3f(10.01, 10.02, 20.0), vec3f(10.02, 10.0, 20.03)],
    ]
}

#[test]
fn triangles_have_lamberts_irradiance_and_their_solid_angle() {
    let p = vec3f(0.1, -0.2, 0.05);
    for t in triangles() {
        let expected = 2.0 * lambert_polygon(p, UP, &t);
        let [front, back] = [triangle(t[0], t[1], t[2]), triangle(t[0], t[2], t[1])];
        // Whichever of the two faces the receiver.
        let (lit, dark) = if irradiance(front, p, UP) > 0.0 { (front, back) } else { (back, front) };
        assert_close("irradiance of a triangle", irradiance(lit, p, UP), expected.abs(), CLOSE);
        assert_close("solid angle of a triangle", solid_angle(lit, p), triangle_solid_angle(p, t), CLOSE);
        assert_eq!(irradiance(dark, p, UP), 0.0, "the back of a one-sided light shines");
        let both = Light { two_sided: true, ..dark };
        assert_close("irradiance of a back side", irradiance(both, p, UP), expected.abs(), CLOSE);
    }
}

/// Counter-clockwise vertices are the front, as in glTF.
#[test]
fn triangles_shine_to_the_side_they_wind_counter_clockwise_from() {
    let facing_down = triangle(vec3f(0.0, 0.0, 1.0), vec3f(0.0, 1.0, 1.0), vec3f(1.0, 0.0, 1.0));
    assert!(light_sample(facing_down, vec3f(0.0, 0.0, 0.0), vec2f(0.3, 0.4)).pdf > 0.0);
    assert_eq!(light_sample(facing_down, vec3f(0.0, 0.0, 2.0), vec2f(0.3, 0.4)).pdf, 0.0);
}

#[test]
fn triangle_samples_lie_on_the_triangle_with_the_density_of_hits() {
    let p = vec3f(0.1, -0.2, 0.05);
    for t in triangles() {
        let lamp = Light { two_sided: true, ..triangle(t[0], t[1], t[2]) };
        for u in grid().step_by(37) {
            let s = light_sample(lamp, p, u);
            let at = lamp.position + lamp.edge1 * s.barycentrics.x + lamp.edge2 * s.barycentrics.y;
            assert!(length(p + s.wi * s.distance - at) < 1e-5 * s.distance, "{s:?} misses its point {at:?}");
            assert!(s.barycentrics.x >= 0.0 && s.barycentrics.y >= 0.0);
            assert!(s.barycentrics.x + s.barycentrics.y <= 1.0 + 1e-6);
            let pdf = triangle_light_pdf(lamp.position - p, lamp.edge1, lamp.edge2, s.wi, s.distance);
            assert_close("density of a triangle", f64::from(pdf), f64::from(s.pdf), 1e-5);
            assert!(!s.delta && s.radiance.y == 3.0);
        }
    }
}

#[test]
fn spheres_have_the_irradiance_of_their_form_factor() {
    let center = vec3f(1.0, 2.0, 3.0);
    for radius in [1.0f32, 0.01, 100.0] {
        // Distance of the centre in radii: touching, near, far, so far that 1 − cos is below the precision of cos.
        for ratio in [1.001f32, 1.1, 2.0, 30.0, 1e4] {
            let lamp = sphere(center, radius);
            let away = normalize(vec3f(0.3, -0.2, 0.9));
            let p = center + away * (radius * ratio);
            // As rounding has it: the receiver is not exactly where it was asked to be.
            let d = f64::from(length(center - p));
            let sin2 = (f64::from(radius) / d).powi(2);
            let what = format!("sphere of radius {radius} seen from {ratio} radii");
            // Rounding of the receiver's place moves the cosine near the surface: 1 − sin² has few digits there.
            let tolerance =
                CLOSE + 3e-7 / (1.0 - sin2).sqrt() * f64::from(length(center)) / f64::from(radius);
            assert_close(&what, irradiance(lamp, p, -away), 2.0 * PI * sin2, tolerance);
            let expected = 2.0 * PI * sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
            assert_close(&what, solid_angle(lamp, p), expected, tolerance);
            // Tilted, but still wholly above the horizon.
            if ratio >= 2.0 {
                let tilted = normalize(-away + normalize(cross(away, UP)) * 0.7);
                let cos = f64::from(dot(tilted, -away));
                assert_close(&what, irradiance(lamp, p, tilted), 2.0 * PI * sin2 * cos, tolerance);
            }
        }
    }
}

#[test]
fn spheres_shine_inwards_if_they_have_two_sides() {
    let lamp = Light { two_sided: true, ..sphere(vec3f(0.0, 0.0, 0.0), 2.0) };
    for p in [vec3f(0.1, 0.0, 0.0), vec3f(0.5, 1.0, 0.3), vec3f(0.0, 0.0, 1.99)] {
        assert_close("irradiance within a sphere", irradiance(lamp, p, UP), 2.0 * PI, 2e-3);
        assert_close("solid angle within a sphere", solid_angle(lamp, p), 4.0 * PI, CLOSE);
        assert_eq!(
            solid_angle(Light { two_sided: false, ..lamp }, p),
            0.0,
            "within a sphere that shines outwards"
        );
    }
}

#[test]
fn sphere_samples_lie_on_the_sphere_with_the_density_of_hits() {
    let center = vec3f(-3.0, 0.5, 1.0);
    for radius in [0.02f32, 1.0] {
        for d in [0.5f32, 0.99, 1.01, 1.5, 10.0, 3000.0] {
            let lamp = Light { two_sided: true, ..sphere(center, radius) };
            let p = center + normalize(vec3f(0.5, 0.7, -0.4)) * (radius * d);
            for u in grid().step_by(41) {
                let s = light_sample(lamp, p, u);
                let off = length(p + s.wi * s.distance - center) - radius;
                // Half a chord is a square root: near the silhouette an error of the angle, 10⁻⁷, becomes its root.
                assert!(
                    off.abs() <= 1e-3 * radius + 2e-6 * radius * d,
                    "{s:?} is {off} off a sphere of {radius}"
                );
                // The near side, so that a shadow ray of this length does not end behind the surface.
                if d > 1.0 {
                    assert!(dot(p + s.wi * s.distance - center, s.wi) < 1e-3 * radius * d.max(1.0), "{s:?}");
                }
                assert!((length(s.wi) - 1.0).abs() < 1e-5);
                let pdf = sphere_light_pdf(center, radius, p);
                assert_close("density of a sphere", f64::from(pdf), f64::from(s.pdf), 1e-6);
            }
        }
    }
}

#[test]
fn directional_discs_have_the_irradiance_of_their_angle() {
    let towards = normalize(vec3f(0.3, -0.5, 0.8));
    // Angular radii: the sun's, and larger ones.
    for radius in [0.00465f64, 0.04, 0.5] {
        let size = (2.0 * (0.5 * radius).sin().powi(2)) as f32; // 1 − cos without cancellation
        let lamp = Light { position: towards, size, ..light(LIGHT_DIRECTIONAL) };
        let p = vec3f(5.0, 6.0, 7.0);
        let expected = 2.0 * PI * radius.sin().powi(2);
        assert_close("irradiance of a disc", irradiance(lamp, p, towards), expected, CLOSE);
        let tilted = normalize(towards + vec3f(0.2, 0.1, 0.0));
        let cos = f64::from(dot(tilted, towards));
        assert_close("irradiance of a tilted disc", irradiance(lamp, p, tilted), expected * cos, CLOSE);
        for u in grid().step_by(53) {
            let s = light_sample(lamp, p, u);
            assert!(!s.delta && s.distance == FAR);
            // The outermost percent of the angle is within rounding of the edge of the sun's disc.
            assert!(u.x > 0.98 || directional_light_contains(lamp, s.wi), "{s:?} is outside of its disc");
        }
        let beside = (radius * 1.02) as f32;
        let sideways = normalize(cross(towards, UP));
        assert!(!directional_light_contains(lamp, towards * beside.cos() + sideways * beside.sin()));
        assert!(directional_light_contains(lamp, towards));
    }
}

#[test]
fn one_direction_is_a_delta_light() {
    let towards = normalize(vec3f(-0.3, 0.5, 0.8));
    let lamp = Light { position: towards, ..light(LIGHT_DIRECTIONAL) };
    let s = light_sample(lamp, vec3f(1.0, 2.0, 3.0), vec2f(0.9, 0.1));
    assert!(s.delta && s.pdf == 1.0 && s.wi.to_array() == towards.to_array() && s.radiance.x == 2.0);
    assert!(!directional_light_contains(lamp, towards), "a delta light cannot be hit");
}

#[test]
fn points_follow_the_inverse_square_law() {
    let lamp = Light { position: vec3f(1.0, 2.0, 5.0), ..light(LIGHT_POINT) };
    for p in [vec3f(1.0, 2.0, 4.9), vec3f(0.0, 0.0, 0.0), vec3f(-300.0, 40.0, 2.0)] {
        let to = lamp.position - p;
        let d2 = f64::from(dot(to, to));
        let cos = f64::from(to.z) / d2.sqrt();
        assert_close("point light", irradiance(lamp, p, UP), 2.0 * cos / d2, 1e-5);
        let s = light_sample(lamp, p, vec2f(0.5, 0.5));
        assert!(s.delta && s.pdf == 1.0 && (f64::from(s.distance) / d2.sqrt() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn spots_fall_off_between_their_angles() {
    let (inner, outer) = (0.3f32, 0.6f32);
    let falloff = spot_falloff_parameters(inner.cos(), outer.cos());
    let lamp = Light {
        position: vec3f(0.0, 0.0, 2.0),
        edge1: vec3f(0.0, 0.0, -1.0),
        edge2: vec3f(falloff.x, falloff.y, 0.0),
        ..light(LIGHT_SPOT)
    };
    let intensity = |angle: f32| {
        let p = vec3f(2.0 * angle.tan(), 0.0, 0.0);
        let s = light_sample(lamp, p, vec2f(0.5, 0.5));
        s.radiance.x * s.distance * s.distance
    };
    for angle in [0.0, 0.15, 0.29] {
        assert_close("inside", f64::from(intensity(angle)), 2.0, 1e-5);
    }
    let mut last = intensity(0.3);
    for i in 1..=30 {
        let angle = 0.3 + 0.01 * i as f32;
        let now = intensity(angle);
        let t = f64::from(angle.cos() - outer.cos()) / f64::from(inner.cos() - outer.cos());
        assert!((f64::from(now) - 2.0 * t.max(0.0).powi(2)).abs() < 1e-4, "{angle}: {now}");
        assert!(now <= last + 1e-6);
        last = now;
    }
    for angle in [0.61, 1.0, 1.5] {
        assert_eq!(intensity(angle), 0.0);
    }
    // Equal angles make a hard edge, not a division by zero.
    let hard = spot_falloff_parameters(0.8, 0.8);
    assert_eq!(spot_falloff(0.79, hard.x, hard.y), 0.0);
    assert_eq!(spot_falloff(0.81, hard.x, hard.y), 1.0);
}

/// How far along a ray from `origin` a light is met first; infinite if it is not.
fn first_meeting(light: Light, origin: Vec3f, direction: Vec3f) -> f32 {
    if light.kind == LIGHT_SPHERE {
        let hit = optics::intersect::intersect_sphere(origin, direction, light.position, light.size);
        return if hit.hit { hit.near } else { f32::INFINITY };
    }
    let normal = cross(light.edge1, light.edge2);
    dot(light.position - origin, normal) / dot(direction, normal)
}

/// Shadow rays begin beside the point that the light was sampled for, here almost a millimetre above
/// it. They meet the light where it was sampled, not before: lights do not hide themselves.
#[test]
fn ways_from_beside_the_receiver_end_where_the_light_was_sampled() {
    let panel = Light { edge1: vec3f(0.0, 0.4, 0.0), edge2: vec3f(0.4, 0.0, 0.0), ..light(LIGHT_RECTANGLE) };
    let lamps = [
        sphere(vec3f(0.0, 0.0, 0.15), 0.08),
        triangle(vec3f(0.1, 0.2, 0.5), vec3f(0.0, 0.8, 0.5), vec3f(0.9, 0.2, 0.6)),
        Light { position: vec3f(-0.2, -0.2, 0.7), ..panel },
    ];
    for lamp in lamps {
        for p in [vec3f(0.3, 0.2, 0.0), vec3f(-1.0, 0.4, 0.0), vec3f(2.0, -1.5, 0.0)] {
            let origin = optics::offset::offset_ray_origin(p, UP, 7.6e-4);
            assert!(origin.z > 5e-4, "{origin:?}");
            let (mut samples, mut hidden, mut hidden_aside) = (0, 0, 0);
            for s in grid().step_by(7).map(|u| light_sample(lamp, p, u)).filter(|s| s.pdf > 0.0) {
                samples += 1;
                let way = light_way(s.wi, s.distance, origin - p);
                let end = origin + way.direction * way.distance;
                assert!(length(end - (p + s.wi * s.distance)) < 2e-6, "{s:?} from {p:?}: {way:?}");
                hidden += u32::from(first_meeting(lamp, origin, way.direction) < 0.9999 * way.distance);
                let aside = s.distance - dot(origin - p, s.wi);
                hidden_aside += u32::from(first_meeting(lamp, origin, s.wi) < 0.9999 * aside);
            }
            assert!(samples > 5000, "{samples}");
            // All that is left is the outline of a sphere.
            assert!(hidden * 200 <= samples, "{lamp:?} hides {hidden} of {samples} samples from {p:?}");
            assert!(hidden_aside * 10 > samples, "the test would not notice: {hidden_aside} of {samples}");
        }
    }
}

/// What is infinitely far away is in the same direction from everywhere, and no way has no
/// direction.
#[test]
fn ways_to_distant_lights_and_to_nowhere_keep_their_direction() {
    let wi = normalize(vec3f(0.3, -0.5, 0.8));
    let far = light_way(wi, FAR, vec3f(3.0, 4.0, 5.0));
    assert!(far.direction.to_array() == wi.to_array() && far.distance == FAR, "{far:?}");
    let nowhere = light_way(UP, 0.25, UP * 0.25);
    assert!(nowhere.direction.to_array() == UP.to_array() && nowhere.distance.is_finite(), "{nowhere:?}");
}

/// Lights without extent, and receivers on the light: no light or finite light, never NaN.
#[test]
fn degenerate_lights_give_finite_samples() {
    let o = vec3f(0.0, 0.0, 0.0);
    let x = vec3f(1.0, 0.0, 0.0);
    let tiny = vec3f(1e-25, 0.0, 0.0);
    let mut lamps = vec![
        triangle(o, o, o),
        triangle(o, x, x),
        triangle(o, x, x * 2.0),
        triangle(o, tiny, vec3f(0.0, 1e-25, 0.0)),
        triangle(o, x, vec3f(0.5, 1e-12, 0.0)),
        triangle(vec3f(-1.0, -1.0, 0.0), vec3f(1.0, -1.0, 0.0), vec3f(0.0, 1.0, 0.0)),
        sphere(o, 0.0),
        sphere(o, 1e-22),
        sphere(o, 1e-12),
        sphere(o, 1.0),
        sphere(o, 1e15),
        Light { position: UP, ..light(LIGHT_DIRECTIONAL) },
        Light { position: UP, size: 1e-30, ..light(LIGHT_DIRECTIONAL) },
        Light { position: UP, size: 2.0, ..light(LIGHT_DIRECTIONAL) },
        light(LIGHT_POINT),
        Light { edge1: -UP, edge2: vec3f(1000.0, -900.0, 0.0), ..light(LIGHT_SPOT) },
        light(LIGHT_ENVIRONMENT),
        light(77),
    ];
    for i in 0..lamps.len() {
        lamps.push(Light { two_sided: true, ..lamps[i] });
    }
    let receivers = [o, x, UP, vec3f(1e-20, 0.0, 0.0), vec3f(0.25, 0.0, 1e-15), vec3f(3.0, 4.0, 1e12)];
    for lamp in lamps {
        for p in receivers {
            for u in [
                vec2f(0.0, 0.0),
                vec2f(0.5, 0.5),
                vec2f(ONE_MINUS_EPSILON, ONE_MINUS_EPSILON),
                vec2f(0.25, 0.7),
            ] {
                let s = light_sample(lamp, p, u);
                let what = format!("{lamp:?} at {p:?} with {u:?}: {s:?}");
                assert!(s.pdf >= 0.0 && s.pdf.is_finite(), "{what}");
                if s.pdf > 0.0 {
                    assert!(s.wi.to_array().iter().all(|c| c.is_finite()), "{what}");
                    assert!((length(s.wi) - 1.0).abs() < 1e-4, "{what}");
                    assert!(s.distance >= 0.0 && s.distance.is_finite(), "{what}");
                    let arriving = s.radiance.x / s.pdf;
                    assert!(arriving >= 0.0 && arriving.is_finite(), "{what}");
                }
            }
        }
    }
}

#[test]
#[should_panic(expected = "instead of")]
fn a_wrong_irradiance_is_noticed() {
    // Half a percent too much.
    let lamp = sphere(vec3f(0.0, 0.0, 2.0), 1.0);
    assert_close("sphere", irradiance(lamp, vec3f(0.0, 0.0, 0.0), UP), 1.005 * 2.0 * PI * 0.25, CLOSE);
}

/// Four units wide and two high at a distance of one, thrown along −z from the origin.
fn projector() -> Light {
    Light { edge1: vec3f(4.0, 0.0, 0.0), edge2: vec3f(0.0, -2.0, 0.0), ..light(LIGHT_PROJECTOR) }
}

/// As a camera at its place sees it, a picture is upright: its left is left, its top is up.
#[test]
fn a_projector_throws_its_picture_upright() {
    let inside = [(-1.0, 0.5, 0.25, 0.25), (0.0, 0.0, 0.5, 0.5), (1.9, -0.9, 0.975, 0.95)];
    for (x, y, u, v) in inside {
        let p = vec3f(3.0 * x, 3.0 * y, -3.0);
        let sample = light_sample(projector(), p, vec2f(0.5, 0.5));
        assert!(sample.delta && sample.pdf == 1.0);
        assert_close("u", sample.barycentrics.x.into(), u, 1e-6);
        assert_close("v", sample.barycentrics.y.into(), v, 1e-6);
        let distance2 = f64::from(dot(p, p));
        assert_close("inverse squares", sample.radiance.y.into(), 3.0 / distance2, 1e-6);
        let textured = textured_radiance(projector(), sample.distance, vec3f(1.0, 0.5, 7.0));
        assert_close("of the picture", textured.z.into(), 7.0 / distance2, 1e-6);
    }
    for p in [vec3f(2.1, 0.0, -1.0), vec3f(0.0, 1.1, -1.0), vec3f(0.0, 0.0, 1.0), vec3f(0.0, 0.0, 0.0)] {
        assert_eq!(light_sample(projector(), p, vec2f(0.5, 0.5)).pdf, 0.0, "{p:?} is outside");
    }
}
