//! Coverage, emission and glass.

use super::*;

// ---------------------------------------------------------------------------------------- coverage, emission, glass

pub fn camera_above() -> alhazen::Camera {
    from_above(0.0, 0.0, 5.0, 1.0)
}

/// Half coverage lets half of the light through; two layers a quarter, also where they are copies of each other.
#[test]
fn coverage_is_the_share_that_is_seen() {
    for layers in 1..4 {
        for dynamic in [false, true] {
            let mut scene = under_white_sky();
            let veil = scene.add_material(covering(lambert("veil", [0.0; 3]), 0.5));
            let mesh = scene.add_mesh("veil", ground(0.0, 1.0), veil);
            scene.instances[0].dynamic = dynamic;
            for layer in 1..layers {
                let lower = Affine3A::from_translation(Vec3::new(0.0, -0.5 * layer as f32, 0.0));
                scene.instances.push(scene::Instance::new("copy", mesh, lower));
            }
            scene.cameras.push(camera_above());
            let e = estimate(&scene, &job(&scene, 32, 32, 4), 512);
            assert_mean(&format!("{layers} layers of half coverage"), &e, [0.5f64.powi(layers); 3], ROUNDING);
        }
    }
}

/// Shadows of what covers a half are half as dark, for suns and for lights with an extent.
#[test]
fn shadows_of_half_coverage() {
    for extended in [false, true] {
        let mut scene = floor_spot();
        let veil = scene.add_material(covering(lambert("veil", [0.0; 3]), 0.25));
        let over = Affine3A::from_translation(Vec3::Y);
        scene.add_shape("veil", Shape::Triangles(ground(0.0, 5.0)), veil, over);
        let expected = if extended {
            let light = scene.add_material(emitter("light", [3.0; 3]));
            scene.add_shape("light", sphere([2.0, 2.0, 0.0], 0.5), light, Affine3A::IDENTITY);
            PI * 3.0 * 0.25 / 8.0 * (2.0 / 8f64.sqrt())
        } else {
            let direction = Vec3::NEG_Y;
            add_light(
                &mut scene,
                LightKind::Directional { direction, irradiance: Vec3::ONE, angular_diameter: 0.0 },
            );
            1.0
        };
        let e = estimate(&scene, &job(&scene, 16, 16, 2), 512);
        assert_mean("shadow of a quarter's coverage", &e, reflected(0.75 * expected), ROUNDING);
    }
}

/// A light with holes sends less light, seen directly and as illumination alike.
#[test]
fn a_light_of_half_coverage_is_half_a_light() {
    for (what, masked) in [("blend", false), ("mask", true)] {
        let mut scene = floor_spot();
        let mut material = covering(emitter("light", [2.0; 3]), 0.5);
        if masked {
            // All of it is below the cutoff: nothing is left.
            material.alpha_mode = scene::AlphaMode::Mask(0.7);
        }
        let light = scene.add_material(material);
        let h = 0.5;
        scene.add_mesh("light", quads(&[[[h, 1.0, -h], [h, 1.0, h], [-h, 1.0, h], [-h, 1.0, -h]]]), light);
        let e = estimate(&scene, &job(&scene, 16, 16, 2), 512);
        let x = 0.5f64;
        let s = (1.0 + x * x).sqrt();
        let factor = 4.0 * (2.0 * x / s * (x / s).atan()) / (2.0 * PI);
        let share = if masked { 0.0 } else { 0.5 };
        assert_mean(
            &format!("{what}: light of half coverage"),
            &e,
            reflected(PI * 2.0 * factor * share),
            ROUNDING,
        );
    }
}

/// What emits shows its radiance, at any depth, from the side that emits.
#[test]
fn emission_is_seen_as_it_is() {
    for shape in
        [sphere([0.0; 3], 1.0), Shape::Triangles(uv_sphere(32, 16)), Shape::Triangles(ground(0.5, 1.0))]
    {
        let mut scene = Scene::default();
        let light = scene.add_material(emitter("light", [0.25, 3.0, 1e4]));
        scene.add_shape("light", shape, light, Affine3A::IDENTITY);
        scene.cameras.push(from_above(0.0, 0.0, 5.0, 0.8));
        for depth in [1, 2, 8] {
            let e = estimate(&scene, &job(&scene, 8, 8, depth), 4);
            for (mean, expected) in e.mean_colour().into_iter().zip([0.25, 3.0, 1e4]) {
                assert!(
                    (mean / expected - 1.0).abs() < 1e-5,
                    "depth {depth}: emission {mean} instead of {expected}"
                );
            }
        }
    }
}

/// A pane between a camera and white ground below black sky: T = (1 − R) / (1 + R) with all reflections inside it.
#[test]
fn glass_at_normal_incidence() {
    let down = Sky { horizon: Vec3::ZERO, zenith: Vec3::ZERO, ground: Vec3::ONE, sun: None };
    let r = (0.5f64 / 2.5).powi(2);
    for (what, thin) in [("thin", true), ("slab", false)] {
        let mut scene = Scene { environment: Environment::Sky(down), ..Scene::default() };
        let glass = scene.add_material(Material { thin_walled: thin, ..dielectric("glass", 1.5, 0.0) });
        let pane = if thin { ground(0.0, 2.0) } else { cuboid([-2.0, -0.2, -2.0], [2.0, 0.0, 2.0]) };
        scene.add_mesh("pane", pane, glass);
        scene.cameras.push(camera_above());
        let e = estimate(&scene, &job(&scene, 32, 32, 64), 64);
        assert_mean(&format!("{what} pane"), &e, [(1.0 - r) / (1.0 + r); 3], ROUNDING);
    }
}

/// Glass seen from inside: total reflection beyond the critical angle, refraction bends towards the normal.
#[test]
fn under_water_the_sky_is_a_disc() {
    let sky = Sky { horizon: Vec3::ONE, zenith: Vec3::ONE, ground: Vec3::ZERO, sun: None };
    let mut scene = Scene { environment: Environment::Sky(sky), ..Scene::default() };
    let water = scene.add_material(dielectric("water", 1.33, 0.0));
    let black = scene.add_material(lambert("ground", [0.0; 3]));
    scene.add_mesh("surface", ground(0.0, 1000.0), water);
    scene.add_mesh("ground", ground(-2.0, 1000.0), black);
    let critical = (1.0f64 / 1.33).asin();
    for (angle, bright) in [(0.0, true), (critical - 0.05, true), (critical + 0.02, false), (1.2, false)] {
        scene.cameras = vec![camera([0.0, -1.0, 0.0], [angle.sin(), angle.cos() - 1.0, 0.0], 1.0)];
        scene.cameras[0].up = Vec3::Z;
        let mean = estimate(&scene, &job(&scene, 16, 16, 8), 16).mean_colour()[0];
        // Where the boundary is matters here, not how bright it is.
        assert!((mean > 0.5) == bright, "at {angle} rad under water: {mean}");
    }
}
