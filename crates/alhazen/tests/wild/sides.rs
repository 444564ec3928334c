//! Which sides of surfaces there are: emitters of two sides, and backs that are culled.

use super::common::{assert_mean, estimate, from_above, job};
use super::parts::{add_floor, light, unlit};
use alhazen::{Environment, LoadOptions, Material, Scene, Source};
use glam::Vec3;
use scene::Shape;
use testkit::scenes::{Build, emitter, flipped, ground, quads, sphere};

/// A quadrilateral of glTF whose front, +Z, emits 2; it stands on the camera's far side with its back to it.
fn gltf(double_sided: bool) -> Scene {
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "materials":[{{"doubleSided":{double_sided},"emissiveFactor":[1,1,1],
        "pbrMetallicRoughness":{{"baseColorFactor":[0,0,0,1]}},
        "extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":2}}}}}}],
        "extensionsUsed":["KHR_materials_emissive_strength"],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-9,-9,0],"max":[9,9,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{TRIANGLE}"}}]}}"#
    );
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("lamp.gltf");
    std::fs::write(&path, text).expect("written");
    Source::parse(path.to_str().expect("text")).load(&LoadOptions::default()).expect("valid").scene
}

/// (−9, −9, 0), (9, −9, 0), (0, 9, 0) as little-endian floats.
const TRIANGLE: &str = "AAAQwQAAEMEAAAAAAAAQQQAAEMEAAAAAAAAAAAAAEEEAAAAA";

#[test]
fn double_sided_emitters_shine_on_both_sides() {
    for (double_sided, back) in [(false, 0.0), (true, 2.0)] {
        for (z, expected) in [(5.0, 2.0), (-5.0, back)] {
            let mut scene = gltf(double_sided);
            scene.environment = Environment::Constant(Vec3::ZERO);
            scene.lights.clear();
            scene.cameras = vec![testkit::scenes::camera([0.0, 0.0, z], [0.0; 3], 5.0)];
            let e = estimate(&scene, &job(&scene, 4, 4, 1), 16);
            let mean = e.mean_colour();
            assert!(
                mean.iter().all(|c| (c - expected).abs() < 1e-5),
                "double-sided: {double_sided}, seen from z = {z}: {mean:?}"
            );
        }
    }
}

/// A lamp that faces away from the floor lights it with its back: next-event estimation agrees with what paths find.
#[test]
fn backs_of_double_sided_emitters_light() {
    let lit = |two_sided: bool, height: f64| {
        let mut scene = Scene::default();
        add_floor(&mut scene, 0.0);
        let lamp =
            Material { emission_two_sided: two_sided, double_sided: two_sided, ..emitter("lamp", [3.0; 3]) };
        let lamp = scene.add_material(lamp);
        let s = 0.5;
        let up = [[-s, height, s], [s, height, s], [s, height, -s], [-s, height, -s]];
        scene.add_mesh("lamp", quads(&[up]), lamp);
        scene.cameras.push(from_above(0.0, 0.0, 0.1, 0.01));
        estimate(&scene, &job(&scene, 16, 16, 2), 512)
    };
    // Form factor of a square above its centre: four corners, each of a quarter.
    let (a, h) = (0.5f64, 1.0f64);
    let x = a / h;
    let corner = x / (1.0 + x * x).sqrt() * (x / (1.0 + x * x).sqrt()).atan();
    let form = 4.0 * corner / std::f64::consts::PI;
    assert_mean("both sides", &lit(true, h), [0.5 * 3.0 * form; 3], 2e-3);
    assert_eq!(lit(false, h).mean_colour(), [0.0; 3]);
}

/// Backs are drawn and block light, unless they are culled: then no ray meets them.
#[test]
fn culled_backs_are_not_there() {
    // What a camera above or below the pane sees of a floor in the sun.
    let seen = |culls: bool, double_sided: bool, front_up: bool, height: f32| {
        let mut scene = Scene::default();
        scene.defaults.cull_backs = Some(culls);
        add_floor(&mut scene, 0.0);
        let pane = scene.add_material(Material { double_sided, ..unlit([0.25; 3]) });
        let mesh = ground(1.0, 0.2);
        scene.add_mesh("pane", if front_up { mesh } else { flipped(mesh) }, pane);
        light(&mut scene, 0.0, Vec3::Y);
        scene.cameras = vec![from_above(0.0, 0.0, height, 0.01)];
        estimate(&scene, &job(&scene, 4, 4, 1), 4).mean_colour()[0]
            + estimate(&scene, &job(&scene, 4, 4, 2), 256).mean_colour()[0]
    };
    let (sun, pane) = (0.5 * 3.0 / std::f64::consts::PI, 0.25);
    for (culls, double_sided, front_up, from_above, in_shadow) in [
        (false, false, false, true, true),
        (false, false, true, true, true),
        // The camera sees through the back, but the floor sees the front.
        (true, false, false, false, true),
        (true, false, true, true, false),
        (true, true, false, true, true),
    ] {
        let case = (culls, double_sided, front_up);
        let above = seen(culls, double_sided, front_up, 2.0);
        assert_eq!(above == 2.0 * pane, from_above, "{case:?}: {above} from above");
        let below = seen(culls, double_sided, front_up, 0.5);
        assert_eq!(below < 0.1 * sun, in_shadow, "{case:?}: {below} on the floor");
    }
}

/// Spheres have backs, too: from inside, a culled one is not there.
#[test]
fn the_inside_of_a_culled_sphere_is_open() {
    let mut scene = Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() };
    let ball = scene.add_material(unlit([0.25; 3]));
    let shape: Shape = sphere([0.0; 3], 1.0);
    scene.add_shape("ball", shape, ball, glam::Affine3A::IDENTITY);
    for (culls, height, expected) in [(false, 0.0, 0.25), (true, 0.0, 1.0), (true, 3.0, 0.25)] {
        scene.defaults.cull_backs = Some(culls);
        scene.cameras = vec![from_above(0.0, 0.0, height, 0.01)];
        let radiance = estimate(&scene, &job(&scene, 4, 4, 2), 4).mean_colour()[0];
        assert!((radiance - expected).abs() < 1e-5, "culls: {culls}, from {height}: {radiance}");
    }
}
