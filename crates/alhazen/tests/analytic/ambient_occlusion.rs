//! Ambient occlusion: how much of the hemisphere is open, in closed form.

use super::*;
use alhazen::AmbientOcclusion;

fn occlusion(scene: &Scene, distance: f32) -> Job {
    let ambient = AmbientOcclusion { samples: 4, distance };
    Job { integrator: Integrator::AmbientOcclusion(ambient), ..job(scene, 16, 16, 1) }
}

fn assert_open(what: &str, scene: &Scene, distance: f32, expected: f64) {
    let e = estimate(scene, &occlusion(scene, distance), 256);
    assert_mean(what, &e, [expected; 3], ROUNDING);
}

/// A sphere of radius r whose centre is h above a point hides (r / h)² of its hemisphere. Within a
/// distance d from the point lies its cap up to the angle θ with cos θ = (h² + d² − r²) / (2 h d),
/// which hides sin² θ.
#[test]
fn a_sphere_above_a_floor_hides_its_form_factor() {
    let (r, h) = (1.0f64, 2.0f64);
    let mut scene = floor_spot();
    let ball = scene.add_material(emitter("ball", [7.0; 3]));
    scene.add_shape("ball", sphere([0.0, h as f32, 0.0], r as f32), ball, Affine3A::IDENTITY);
    assert_open("sphere", &scene, f32::INFINITY, 1.0 - (r / h).powi(2));
    for d in [1.2f64, 1.5] {
        let cosine = (h * h + d * d - r * r) / (2.0 * h * d);
        assert_open(&format!("sphere within {d} m"), &scene, d as f32, cosine * cosine);
    }
    assert_open("sphere out of reach", &scene, 0.9, 1.0);
}

/// Of the hemisphere's projection, a unit disc, a wall at distance a hides what lies beyond a / d:
/// a segment.
#[test]
fn a_wall_hides_a_segment_of_the_disc() {
    let (a, d) = (0.75f64, 1.25f64);
    let mut scene = floor_spot();
    let wall = scene.add_material(dielectric("wall", 1.5, 0.0));
    let (x, far) = (a, 5.0);
    scene.add_mesh("wall", quads(&[[[x, -far, -far], [x, -far, far], [x, far, far], [x, far, -far]]]), wall);
    let c = a / d;
    let segment = (c.acos() - c * (1.0 - c * c).sqrt()) / PI;
    assert_open("wall within reach", &scene, d as f32, 1.0 - segment);
    assert_open("wall out of reach", &scene, 0.7, 1.0);
}

/// A closed room is black, unless its walls are out of reach. Lights and the environment's colour
/// do not matter.
#[test]
fn a_room_is_dark_unless_its_walls_are_out_of_reach() {
    let mut scene = under_white_sky();
    let white = scene.add_material(emitter("white", [3.0; 3]));
    scene.add_mesh("room", cuboid([-2.0, 0.0, -2.0], [2.0, 2.5, 2.0]), white);
    scene.cameras.push(from_above(0.0, 0.0, 0.5, 0.01));
    assert_open("room", &scene, 1.9, 1.0);
    let closed = estimate(&scene, &occlusion(&scene, f32::INFINITY), 16);
    assert_eq!(closed.mean_colour(), [0.0; 3]);
}

/// A ceiling that covers a quarter hides a quarter of what it would; misses of the camera are
/// black.
#[test]
fn occluders_of_partial_coverage_hide_their_share() {
    let mut scene = floor_spot();
    let veil = scene.add_material(covering(lambert("veil", [0.0; 3]), 0.25));
    let over = Affine3A::from_translation(Vec3::Y);
    scene.add_shape("veil", sphere([0.0, 1.0, 0.0], 1.0), veil, over);
    // Rays cross the sphere twice.
    assert_open("veil", &scene, f32::INFINITY, 1.0 - 0.25 * (1.0 - 0.75f64.powi(2)));
    let mut empty = under_white_sky();
    empty.cameras.push(from_above(0.0, 0.0, 0.5, 0.01));
    assert_eq!(estimate(&empty, &occlusion(&empty, 1.0), 4).mean_colour(), [0.0; 3]);
}
