//! Scenes in geographic coordinates: what stands far from the origin has the same shape as at the origin, in every loader.

use base64::Engine as _;
use glam::{DVec3, Vec3, dvec3};
use scene::load::scene_file::{Parameters, parse};
use scene::{LoadOptions, Loaded, Scene, Shape};
use std::path::Path;

const FAR: DVec3 = dvec3(500_000.25, 100.0, -4_600_000.3);

/// Corners of all triangles in the scene's world relative to `at`, in order.
fn corners(scene: &Scene, at: DVec3) -> Vec<Vec3> {
    let mut corners = Vec::new();
    for instance in &scene.instances {
        for part in &scene.meshes[instance.mesh as usize].parts {
            let Shape::Triangles(mesh) = &part.shape else { continue };
            let place = |p: &Vec3| (scene.to_world(instance.transform.transform_point3(*p)) - at).as_vec3();
            corners.extend(mesh.positions.iter().map(place));
        }
    }
    corners
}

fn assert_near(found: &[Vec3], expected: &[Vec3], tolerance: f32) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!(a.distance(*b) < tolerance, "{a} instead of {b}");
    }
}

fn assert_says_so(loaded: &Loaded) {
    assert!(loaded.scene.origin.distance(FAR) < 10.0, "{}", loaded.scene.origin);
    let said = loaded.report.notes.iter().any(|note| note.message.contains("far from the origin"));
    assert!(said, "{:?}", loaded.report.notes);
}

fn toml(text: &str) -> Loaded {
    parse(text, Path::new("far.toml"), Path::new(""), &Parameters::new(), &LoadOptions::default())
        .expect("a scene")
}

/// A scene file with everything at `at`.
fn scene_file(at: DVec3) -> String {
    let place = |x: f64, y: f64, z: f64| format!("[{:.3}, {:.3}, {:.3}]", at.x + x, at.y + y, at.z + z);
    format!(
        "[[shape]]\nkind = \"box\"\nsize = [1, 2, 3]\nrotate = [10, 20, 30]\ntranslate = {}\n\
         [[shape]]\nkind = \"quad\"\ncorners = [{}, {}, {}, {}]\n\
         [[shape]]\nkind = \"box\"\nrepeat = {{ at = [{}] }}\n\
         [[camera]]\neye = {}\ntarget = {}\n\
         [[camera]]\norbit = {{ center = {}, radius = 4, period = 1 }}\ntarget = {}\n\
         [[light]]\nkind = \"point\"\nposition = {}\nintensity = 1\n\
         [environment]\ncolor = 1\nportals = [{{ corners = [{}, {}, {}, {}] }}]\n",
        place(0.125, 0.5, 0.0),
        place(0.0, 0.0, 0.0),
        place(1.0, 0.0, 0.0),
        place(1.0, 0.0, 1.0),
        place(0.0, 0.0, 1.0),
        place(2.5, 0.0, 0.125),
        place(0.5, 1.0, 5.0),
        place(0.25, 0.5, 0.0),
        place(0.0, 1.0, 0.0),
        place(0.0, 0.0, 0.0),
        place(0.125, 3.0, 0.0),
        place(0.0, 0.0, 2.0),
        place(1.0, 0.0, 2.0),
        place(1.0, 1.0, 2.0),
        place(0.0, 1.0, 2.0),
    )
}

#[test]
fn scene_files_are_as_at_the_origin() {
    let near = toml(&scene_file(DVec3::ZERO));
    let far = toml(&scene_file(FAR));
    assert_eq!(near.scene.origin, DVec3::ZERO);
    assert_says_so(&far);
    assert_near(&corners(&far.scene, FAR), &corners(&near.scene, DVec3::ZERO), 2e-6);
    for (a, b) in far.scene.cameras.iter().zip(&near.scene.cameras) {
        for time in [0.0, 0.3] {
            let (a, b) = (a.at(time), b.at(time));
            let world = |p: Vec3| (far.scene.to_world(p) - FAR).as_vec3();
            assert_near(&[world(a.eye), world(a.target)], &[b.eye, b.target], 2e-6);
        }
    }
    let position = |scene: &Scene, at: DVec3| {
        let scene::LightKind::Point { position, .. } = scene.lights[0].kind else { panic!("a point") };
        (scene.to_world(position) - at).as_vec3()
    };
    assert_near(&[position(&far.scene, FAR)], &[position(&near.scene, DVec3::ZERO)], 2e-6);
    let portal = far.scene.portals[0].corners().map(|c| (far.scene.to_world(c) - FAR).as_vec3());
    assert_near(&portal, &near.scene.portals[0].corners(), 2e-6);
}

#[test]
fn text_files_keep_their_digits() {
    let folder = tempfile::tempdir().expect("a folder");
    let shape = [Vec3::ZERO, Vec3::new(1.0, 0.0, 0.25), Vec3::new(0.0, 1.0, -0.5)];
    let world = shape.map(|p| FAR + p.as_dvec3());
    let line = |prefix: &str| world.map(|p| format!("{prefix}{:.3} {:.3} {:.3}\n", p.x, p.y, p.z)).concat();
    let obj = format!("{}f 1 2 3\n", line("v "));
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
                  element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let ply = format!("{header}{}3 0 1 2\n", line(""));
    for (name, text) in [("far.obj", &obj), ("far.ply", &ply)] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        let loaded = scene::load::load(&path, &LoadOptions::default()).expect(name);
        assert_says_so(&loaded);
        assert_near(&corners(&loaded.scene, FAR), &shape, 1e-6);
        // Placed in a scene file, and scaled there.
        let text = format!("[[model]]\nfile = \"{name}\"\n[[model]]\nfile = \"{name}\"\nfit = 2\n");
        let place = Path::new("placed.toml");
        let placed = parse(&text, place, folder.path(), &Parameters::new(), &LoadOptions::default());
        let placed = placed.expect("placed").scene;
        // One copy is at the origin: the scene is as large as its distance, and is not moved.
        assert_eq!(placed.origin, DVec3::ZERO);
        let fitted = placed.instances[1].transform;
        let size = fitted.matrix3.x_axis.x;
        assert!((size - 2.0).abs() < 1e-5, "{size}");
        let text = format!("[[model]]\nfile = \"{name}\"\n");
        let placed = parse(&text, place, folder.path(), &Parameters::new(), &LoadOptions::default());
        let placed = placed.expect("placed");
        assert_says_so(&placed);
        assert_near(&corners(&placed.scene, FAR), &shape, 1e-6);
    }
}

#[test]
fn transforms_of_pbrt_are_composed_in_double_precision() {
    // What pbrt itself can say in single precision.
    let at = dvec3(500_000.0, 100.0, -4_600_000.0);
    let scene = |at: DVec3| {
        let DVec3 { x, y, z } = at;
        let text = format!(
            "LookAt {} {y} {} {x} {y} {z} 0 1 0\nCamera \"perspective\"\nWorldBegin\nTranslate {x} {y} {z}\n\
             LightSource \"point\"\nRotate 30 0 1 0\nShape \"trianglemesh\" \"integer indices\" [0 1 2] \
             \"point3 P\" [0 0 0 1 0 0.25 0 1 -0.5]\n",
            x + 1.0,
            z + 3.0
        );
        scene::load::pbrt::load_bytes(Path::new("s.pbrt"), text.into_bytes(), &LoadOptions::default())
            .expect("a scene")
            .scene
    };
    let (near, far) = (scene(DVec3::ZERO), scene(at));
    let mirrored = dvec3(-at.x, at.y, at.z);
    assert!(far.origin.distance(mirrored) < 10.0, "{}", far.origin);
    assert_near(&corners(&far, mirrored), &corners(&near, DVec3::ZERO), 2e-6);
    let forward = |scene: &Scene| (scene.cameras[0].target - scene.cameras[0].eye).normalize();
    assert_near(&[forward(&far)], &[forward(&near)], 1e-6);
}

/// A skinned and animated triangle, a camera and a light below a node at `at`.
fn gltf(at: DVec3) -> String {
    let mut bytes: Vec<u8> = Vec::new();
    let mut floats = |values: &[f32]| values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0, 1.0, -0.5]); // positions, 36 bytes
    floats(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]); // weights, 48 bytes
    floats(&[0.0, 1.0]); // times, 8 bytes
    floats(&[0.0, 0.0, 0.0, 0.5, 0.0, 0.0]); // translations, 24 bytes
    bytes.extend([0u8; 12]); // joints
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let DVec3 { x, y, z } = at;
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
        "nodes": [{{"children": [1, 2, 3, 4, 5], "translation": [{x}, {y}, {z}], "rotation": [0, 0.6, 0, 0.8]}},
            {{"mesh": 0}}, {{"mesh": 0, "skin": 0}}, {{"translation": [0.5, 0, 0]}},
            {{"camera": 0, "translation": [1, 0, 3]}},
            {{"translation": [0, 2, 0], "extensions": {{"KHR_lights_punctual": {{"light": 0}}}}}}],
        "skins": [{{"joints": [3]}}],
        "cameras": [{{"type": "perspective", "perspective": {{"yfov": 0.6, "znear": 0.01}}}}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {{"KHR_lights_punctual": {{"lights": [{{"type": "point"}}]}}}},
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "WEIGHTS_0": 1, "JOINTS_0": 2}}}}]}}],
        "animations": [{{"samplers": [{{"input": 3, "output": 4}}], "channels": [
            {{"sampler": 0, "target": {{"node": 1, "path": "translation"}}}},
            {{"sampler": 0, "target": {{"node": 3, "path": "translation"}}}},
            {{"sampler": 0, "target": {{"node": 4, "path": "translation"}}}},
            {{"sampler": 0, "target": {{"node": 5, "path": "translation"}}}}]}}],
        "buffers": [{{"byteLength": 128, "uri": "data:application/octet-stream;base64,{data}"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}, {{"buffer": 0, "byteOffset": 36, "byteLength": 48}},
            {{"buffer": 0, "byteOffset": 116, "byteLength": 12}}, {{"buffer": 0, "byteOffset": 84, "byteLength": 8}},
            {{"buffer": 0, "byteOffset": 92, "byteLength": 24}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, -0.5], "max": [1, 1, 0.25]}},
            {{"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC4"}},
            {{"bufferView": 2, "componentType": 5121, "count": 3, "type": "VEC4"}},
            {{"bufferView": 3, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]}},
            {{"bufferView": 4, "componentType": 5126, "count": 2, "type": "VEC3"}}]}}"#
    )
}

#[test]
fn gltf_is_as_at_the_origin_at_rest_and_at_every_moment() {
    let load = |at| {
        let text = gltf(at);
        scene::load::gltf::load_bytes(Path::new("s.gltf"), text.as_bytes(), &LoadOptions::default())
            .expect("a scene")
    };
    let (mut near, mut far) = (load(DVec3::ZERO), load(FAR));
    assert_says_so(&far);
    for time in [None, Some(0.0), Some(0.4), Some(1.0)] {
        if let Some(time) = time {
            near.scene.set_time(time);
            far.scene.set_time(time);
        }
        assert_near(&corners(&far.scene, FAR), &corners(&near.scene, DVec3::ZERO), 3e-6);
        let (a, b) = (&far.scene.cameras[0], &near.scene.cameras[0]);
        let world = |p: Vec3| (far.scene.to_world(p) - FAR).as_vec3();
        assert_near(&[world(a.eye), world(a.target)], &[b.eye, b.target], 3e-6);
        let position = |scene: &Scene| match scene.lights[0].kind {
            scene::LightKind::Point { position, .. } => position,
            _ => panic!("a point"),
        };
        assert_near(&[world(position(&far.scene))], &[position(&near.scene)], 3e-6);
    }
}

#[test]
fn files_of_others_keep_their_camera_and_their_square() {
    let Some(shared) = testkit::require_shared("files_of_others_keep_their_camera_and_their_square") else {
        return;
    };
    let folder = shared.join("wild/far-from-origin");
    let load = |name: &str| scene::load::load(&folder.join(name), &LoadOptions::default()).expect(name).scene;
    let scene = load("p.gltf");
    let camera = &scene.cameras[0];
    let heading = (camera.target - camera.eye).normalize();
    let expected = Vec3::new(-0.5, 0.0, -(0.75f32.sqrt()));
    assert!(heading.distance(expected) < 1e-6, "{heading}");
    let scene = load("s.gltf");
    let square = corners(&scene, dvec3(5e5, 100.0, -4.6e6));
    let area = (square[1] - square[0]).cross(square[2] - square[0]).length();
    assert!((area - 1.0).abs() < 1e-6, "{area}");
}
