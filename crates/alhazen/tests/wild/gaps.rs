//! How far off a surface rays start: what lies close behind it is seen, and no surface shadows itself.

use super::common::{assert_mean, estimate, from_above, job};
use alhazen::{Environment, Material, Scene, Shape};
use glam::{Affine3A, Quat, Vec3};
use testkit::scenes::{Build, camera, cuboid, dielectric, emitter, flipped, ground, lambert, sphere};

/// Glass that does not bend or reflect light.
pub fn clear() -> Material {
    dielectric("clear", 1.0, 0.0)
}

/// What shines with a radiance of 1, upwards, `gap` metres below `height`.
pub fn add_shining_floor(scene: &mut Scene, height: f32, gap: f32) {
    let material = scene.add_material(emitter("below", [1.0; 3]));
    scene.add_mesh("below", ground(height - gap, 1.0), material);
}

/// Straight down through clear glass onto what shines 10 µm below it. Rays that start beyond it are black.
#[test]
fn what_lies_close_below_glass_is_seen() {
    const HEIGHT: f32 = 3.0;
    const GAP: f32 = 1e-5;
    let lifted = Affine3A::from_translation(Vec3::new(0.0, HEIGHT, 0.0));
    let turned = lifted * Affine3A::from_rotation_y(0.7);
    let pane = |half_size: f32| Shape::Triangles(ground(0.0, half_size));
    let down = |half_size: f32| Shape::Triangles(flipped(ground(0.0, half_size)));
    let plate = || Shape::Triangles(cuboid([-0.5, 0.0, -0.5], [0.5, 0.1, 0.5]));
    let ball = || sphere([0.0, 0.5, 0.0], 0.5);
    let shapes: [(&str, Shape, Affine3A, bool); 9] = [
        ("pane", pane(1.0), lifted, false),
        ("pane of 10 m", pane(5.0), lifted, false),
        ("pane seen from its back", down(1.0), lifted, false),
        ("moving pane", pane(1.0), turned, true),
        ("plate", plate(), lifted, false),
        ("moving plate", plate(), turned, true),
        ("ball", ball(), lifted, false),
        ("turned ball", ball(), turned, false),
        ("moving ball", ball(), turned, true),
    ];
    for (what, shape, place, dynamic) in shapes {
        let mut scene = Scene::default();
        add_shining_floor(&mut scene, HEIGHT, GAP);
        let glass = scene.add_material(clear());
        scene.add_shape("glass", shape, glass, place);
        scene.instances[1].dynamic = dynamic;
        // Where the ball is within a tenth of the gap of its lowest point.
        scene.cameras.push(from_above(0.0, 0.0, HEIGHT + 2.0, 1e-3));
        assert_mean(what, &estimate(&scene, &job(&scene, 8, 8, 8), 16), [1.0; 3], 1e-3);
    }
}

/// A convex white body under a white sky is white, by direct light alone, if nothing of it shadows itself.
#[test]
fn convex_bodies_do_not_shadow_themselves() {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.5, 1.1, -0.4);
    let box_of = |size: [f64; 3]| Shape::Triangles(cuboid(size.map(|s| -0.5 * s), size.map(|s| 0.5 * s)));
    let shapes = || {
        [("cube", box_of([1.0; 3])), ("stick", box_of([1.0, 0.004, 1.0])), ("sphere", sphere([0.0; 3], 0.5))]
    };
    for position in [Vec3::ZERO, Vec3::new(40.0, 3.0, -25.0), Vec3::new(3000.0, 200.0, -7000.0)] {
        for dynamic in [false, true] {
            for (what, shape) in shapes() {
                let mut scene = Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() };
                let white = scene.add_material(lambert("white", [1.0; 3]));
                let place = Affine3A::from_rotation_translation(turn, position);
                scene.add_shape("body", shape, white, place);
                scene.instances[0].dynamic = dynamic;
                let eye = (position + Vec3::new(0.6, 1.5, 2.5)).as_dvec3();
                scene.cameras.push(camera(eye.to_array(), position.as_dvec3().to_array(), 30.0));
                let e = estimate(&scene, &job(&scene, 24, 24, 2), 32);
                assert_mean(&format!("{what} at {position}, dynamic: {dynamic}"), &e, [1.0; 3], 1e-3);
            }
        }
    }
}
