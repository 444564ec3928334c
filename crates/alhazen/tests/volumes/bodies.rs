//! Bodies that overlap.

use super::*;

// ---------------------------------------------------------------------------------------------- overlapping bodies

fn body(name: &str, ior: f32, absorption: f32, priority: Option<i32>) -> Material {
    let interior = Interior {
        attenuation_color: Vec3::splat((-absorption).exp()),
        attenuation_distance: if absorption > 0.0 { 1.0 } else { f32::INFINITY },
    };
    Material { interior, priority, ..dielectric(name, ior, 0.0) }
}

/// Reflectance at normal incidence.
fn reflectance(n: f64) -> f64 {
    ((n - 1.0) / (n + 1.0)).powi(2)
}

/// Water over glass over a lamp, seen from straight above. The slabs overlap; the one of higher priority counts there.
#[test]
fn of_overlapping_slabs_the_one_of_higher_priority_is_there() {
    let (water, glass) = (1.33f32, 1.6f32);
    for (water_priority, glass_priority, border) in [(1, 2, 1.0f64), (2, 1, 0.6)] {
        let mut scene = Scene::default();
        add_slab(&mut scene, 0.6, 2.0, body("water", water, 0.5, Some(water_priority)));
        add_slab(&mut scene, 0.0, 1.0, body("glass", glass, 0.9, Some(glass_priority)));
        let lamp = scene.add_material(emitter("lamp", [1.0; 3]));
        scene.add_mesh("lamp", ground(-1.0, 40.0), lamp);
        scene.cameras.push(from_above(0.0, 0.0, 5.0, 0.1));
        // Three interfaces with all reflections between them, from the top; the lamp reflects nothing.
        let (n1, n2) = (f64::from(water), f64::from(glass));
        let [r1, r2, r3] = [reflectance(n1), reflectance(n2 / n1), reflectance(n2)];
        let (in_water, in_glass) = ((-0.5 * (2.0 - border)).exp(), (-0.9 * border).exp());
        let between = 1.0 / (1.0 - in_water * in_water * r1 * r2);
        let upper = (1.0 - r1) * in_water * (1.0 - r2) * between;
        let from_below = r2 + (1.0 - r2).powi(2) * in_water.powi(2) * r1 * between;
        let expected = upper * in_glass * (1.0 - r3) / (1.0 - in_glass.powi(2) * from_below * r3);
        let e = estimate(&scene, &job(&scene, 16, 16, 64), 1024);
        assert_mean(&format!("water {water_priority}, glass {glass_priority}"), &e, [expected; 3], ROUNDING);
    }
}

/// A hollow ball of glass filled with water, modelled as it is made (the water reaches into the glass, and priorities say
/// who is there) and as textbooks say (one surface between the two, whose index is the quotient): the same picture. The
/// second scene is rendered by the tracer that knows no interiors.
#[test]
fn overlapping_bodies_look_like_bodies_that_do_not_overlap() {
    let (water, glass, absorption) = (1.33f32, 1.5f32, 0.6f32);
    let build = |overlapping: bool| {
        let mut scene = Scene {
            environment: Environment::Sky(Sky {
                horizon: Vec3::new(1.0, 0.8, 0.6),
                zenith: Vec3::new(0.1, 0.3, 1.0),
                ground: Vec3::new(0.3, 0.5, 0.1),
                sun: None,
            }),
            ..Scene::default()
        };
        let floor = scene.add_material(lambert("floor", [0.6, 0.3, 0.2]));
        scene.add_mesh("floor", ground(-1.05, 3.0), floor);
        let inner = Affine3A::from_scale(Vec3::splat(0.8));
        let cavity = Shape::Triangles(flipped(uv_sphere(48, 24)));
        if overlapping {
            let shell = scene.add_material(body("glass", glass, absorption, Some(2)));
            let inside = scene.add_material(body("water", water, 0.0, Some(1)));
            scene.add_shape("shell", sphere([0.0; 3], 1.0), shell, Affine3A::IDENTITY);
            scene.add_shape("cavity", cavity, shell, inner);
            scene.add_shape("water", sphere([0.0; 3], 0.87), inside, Affine3A::IDENTITY);
        } else {
            let shell = scene.add_material(body("glass", glass, absorption, None));
            let inside = scene.add_material(body("glass to water", glass / water, absorption, None));
            scene.add_shape("shell", sphere([0.0; 3], 1.0), shell, Affine3A::IDENTITY);
            scene.add_shape("cavity", cavity, inside, inner);
        }
        scene.cameras.push(camera([0.0, 0.5, 4.0], [0.0; 3], 32.0));
        let job = job(&scene, 32, 32, 24);
        estimate(&scene, &Job { seed: u32::from(overlapping), ..job }, 128)
    };
    common::assert_same("glass of water", &build(true), &build(false));
}

/// Without priorities nothing refracts otherwise than without media.
#[test]
fn fog_does_not_change_how_bodies_refract() {
    let build = |fog: bool| {
        let mut scene = testkit::scenes::glass();
        scene.fog = fog.then(|| Fog { medium: medium([1e-9; 3], [0.0; 3], 0.0), top: f32::INFINITY });
        let job = job(&scene, 32, 32, 12);
        estimate(&scene, &Job { seed: u32::from(fog), ..job }, 128)
    };
    common::assert_same("glass in thin fog", &build(true), &build(false));
}
