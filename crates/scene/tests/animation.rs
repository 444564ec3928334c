//! Animated glTF files over time: every kind of target and interpolation in a small file, and real assets.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use base64::Engine as _;
use glam::{Vec2, Vec3, vec3};
use scene::animation::Moment;
use scene::edits::{Editable, Edits, MaterialRecord, Resources};
use scene::tables::SceneTables;
use scene::{LightKind, LoadOptions, Loaded, Projection, Scene, Severity, Shape, TriangleMesh};
use serde_json::{Value, json};
use std::path::Path;

/// A glTF file under construction: all numbers in one buffer.
#[derive(Default)]
struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

impl Builder {
    fn accessor(&mut self, kind: &str, width: usize, numbers: &[f32]) -> usize {
        let bytes = numbers.iter().flat_map(|n| n.to_le_bytes());
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": numbers.len() * 4}));
        let view = self.views.len() - 1;
        let count = numbers.len() / width;
        self.accessors.push(json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind}));
        self.accessors.len() - 1
    }

    /// A channel with keys at the given times.
    fn channel(&mut self, target: Value, interpolation: &str, times: &[f32], values: (&str, usize, &[f32])) {
        let input = self.accessor("SCALAR", 1, times);
        let output = self.accessor(values.0, values.1, values.2);
        self.samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
        self.channels.push(json!({"sampler": self.samplers.len() - 1, "target": target}));
    }

    fn pointer(&mut self, pointer: &str, values: (&str, usize, &[f32])) {
        let extension = json!({"KHR_animation_pointer": {"pointer": pointer}});
        let target = json!({"path": "pointer", "extensions": extension});
        self.channel(target, "LINEAR", &[0.0, 2.0], values);
    }

    fn load(self, mut json: Value) -> Loaded {
        let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let uri = format!("data:application/octet-stream;base64,{data}");
        json["asset"] = json!({"version": "2.0"});
        json["buffers"] = json!([{"byteLength": self.bytes.len(), "uri": uri}]);
        json["bufferViews"] = self.views.into();
        json["accessors"] = self.accessors.into();
        json["animations"] = json!([{"name": "all", "channels": self.channels, "samplers": self.samplers}]);
        let text = json.to_string();
        scene::load::gltf::load_bytes(Path::new("test.gltf"), text.as_bytes(), &LoadOptions::default())
            .unwrap_or_else(|error| panic!("{error}"))
    }
}

/// A triangle that morphs, below a node that moves, which is below one that is hidden at first; a light and a camera.
fn everything() -> Loaded {
    let mut b = Builder::default();
    let positions = b.accessor("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let uvs = b.accessor("VEC2", 2, &[0.0; 6]);
    let target = b.accessor("VEC3", 3, &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let shifted = b.accessor("VEC2", 2, &[1.0; 6]);
    let keys = [0.0, 2.0];
    b.channel(
        json!({"node": 1, "path": "translation"}),
        "LINEAR",
        &keys,
        ("VEC3", 3, &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0]),
    );
    b.channel(
        json!({"node": 1, "path": "scale"}),
        "STEP",
        &[0.0, 1.0],
        ("VEC3", 3, &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]),
    );
    // Both tangents are 0: the curve starts and ends flat.
    let spline = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    b.channel(json!({"node": 1, "path": "weights"}), "CUBICSPLINE", &keys, ("SCALAR", 1, &spline));
    b.channel(json!({"path": "translation"}), "LINEAR", &keys, ("VEC3", 3, &[0.0; 6])); // without a target
    let half = std::f32::consts::FRAC_1_SQRT_2;
    b.channel(
        json!({"node": 2, "path": "rotation"}),
        "LINEAR",
        &keys,
        ("VEC4", 4, &[0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half]),
    );
    b.pointer("/nodes/0/extensions/KHR_node_visibility/visible", ("SCALAR", 1, &[0.0, 1.0]));
    b.pointer(
        "/materials/0/pbrMetallicRoughness/baseColorFactor",
        ("VEC4", 4, &[0.0, 0.0, 0.0, 1.0, 1.0, 0.5, 0.0, 1.0]),
    );
    b.pointer("/materials/0/emissiveFactor", ("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
    b.pointer("/extensions/KHR_lights_punctual/lights/0/intensity", ("SCALAR", 1, &[10.0, 20.0]));
    b.pointer("/cameras/0/perspective/yfov", ("SCALAR", 1, &[0.5, 1.5]));
    b.pointer("/materials/0/doubleSided", ("SCALAR", 1, &[0.0, 1.0]));
    b.load(json!({
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"children": [1], "extensions": {"KHR_node_visibility": {"visible": false}}},
            {"mesh": 0, "name": "moving"},
            {"camera": 0, "name": "eye", "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0,
            "targets": [{"POSITION": target, "TEXCOORD_0": shifted}],
        }]}],
        "materials": [{"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8.0}}}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 10.0}]}},
    }))
}

fn triangles(scene: &Scene, mesh: usize) -> &TriangleMesh {
    let Shape::Triangles(mesh) = &scene.meshes[mesh].parts[0].shape else { panic!("glTF has no spheres") };
    mesh
}

fn intensity(scene: &Scene) -> f32 {
    let LightKind::Spot { intensity, .. } = scene.lights[0].kind else { panic!("{:?}", scene.lights) };
    intensity.x
}

#[test]
fn the_file_at_rest_is_loaded_as_without_animations() {
    let loaded = everything();
    let scene = &loaded.scene;
    assert!(scene.is_animated() && scene.duration() == 2.0);
    assert!(!scene.instances[0].visible && !scene.instances[0].dynamic);
    assert_eq!(triangles(scene, 0).positions[1], Vec3::X);
    assert_eq!(intensity(scene), 10.0);
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { fov_y: 0.7 });
    let ignored: Vec<_> = loaded.report.notes.iter().filter(|n| n.severity == Severity::Ignored).collect();
    assert_eq!(ignored.len(), 1, "one pointer is not understood: {:?}", loaded.report);
    assert!(ignored[0].message.contains("/materials/0/doubleSided"), "{:?}", loaded.report);
    assert!(loaded.report.notes.iter().any(|n| n.message.contains("`all` (2.00 s)")), "{:?}", loaded.report);
}

#[test]
fn everything_moves_together() {
    let mut scene = everything().scene;
    scene.set_time(1.0);
    let instance = &scene.instances[0];
    assert!(instance.visible && instance.dynamic, "any number but 0 is shown");
    assert_eq!(Vec3::from(instance.transform.translation), vec3(2.0, 0.0, 0.0));
    assert_eq!(instance.transform.matrix3.x_axis.x, 2.0, "the step was at one second");
    let mesh = triangles(&scene, 0);
    assert!((mesh.positions[1] - vec3(1.0, 0.0, 0.5)).length() < 1e-6, "half way on a symmetric curve");
    assert!((mesh.uv0[0] - Vec2::splat(0.5)).length() < 1e-6);
    let material = &scene.materials[0];
    assert!((material.base_color.truncate() - vec3(0.5, 0.25, 0.0)).length() < 1e-6);
    assert!((material.emission - vec3(4.0, 0.0, 0.0)).length() < 1e-6, "the factor, times the strength");
    assert_eq!(intensity(&scene), 15.0);
    let camera = &scene.cameras[0];
    assert_eq!(camera.projection, Projection::Perspective { fov_y: 1.0 });
    let (sin, cos) = std::f32::consts::FRAC_PI_4.sin_cos();
    assert!(((camera.target - camera.eye) - vec3(-sin, 0.0, -cos)).length() < 1e-5, "{camera:?}");
    let LightKind::Spot { direction, .. } = scene.lights[0].kind else { panic!("{:?}", scene.lights) };
    assert!((direction - vec3(-sin, 0.0, -cos)).length() < 1e-5, "{direction}");
}

#[test]
fn time_can_go_back_and_holds_or_repeats_after_the_end() {
    let mut scene = everything().scene;
    let place = |scene: &Scene| scene.instances[0].transform.translation.x;
    for (time, expected) in [(9.0, 4.0), (0.5, 1.0), (2.0, 4.0), (0.0, 0.0)] {
        scene.set_time(time);
        assert_eq!(place(&scene), expected, "at {time} s");
    }
    assert!(!scene.instances[0].visible);
    scene.animations[0].repeat = true;
    scene.set_time(2.5);
    assert_eq!(place(&scene), 1.0);
    assert!(!scene.play("none") && !scene.play("1") && scene.play("all") && scene.play("0"));
}

#[test]
fn included_files_move_where_they_are_placed() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut b = Builder::default();
    let positions = b.accessor("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let values = [0.0, 0.0, 0.0, 4.0, 0.0, 0.0];
    b.channel(json!({"node": 0, "path": "translation"}), "LINEAR", &[0.0, 2.0], ("VEC3", 3, &values));
    let data = base64::engine::general_purpose::STANDARD.encode(&b.bytes);
    let json = json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": positions}}]}],
        "buffers": [{"byteLength": b.bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}")}],
        "bufferViews": b.views, "accessors": b.accessors,
        "animations": [{"channels": b.channels, "samplers": b.samplers}],
    });
    std::fs::write(folder.path().join("moving.gltf"), json.to_string()).expect("written");
    let text = "[[model]]\nfile = \"moving.gltf\"\ntranslate = [0, 10, 0]\n[[model]]\nfile = \"moving.gltf\"\ntranslate = [0, 20, 0]\n";
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    let mut scene = scene::load::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
    scene.set_time(1.0);
    let places: Vec<_> = scene.instances.iter().map(|i| Vec3::from(i.transform.translation)).collect();
    assert_eq!(places, [vec3(2.0, 10.0, 0.0), vec3(2.0, 20.0, 0.0)]);
}

fn asset(test: &str, name: &str) -> Option<Scene> {
    let path = testkit::require_shared(test)?.join("scenes").join(name);
    Some(scene::load::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene)
}

#[test]
fn a_strip_bends_at_its_joint() {
    let Some(mut scene) = asset("a_strip_bends_at_its_joint", "khr_SimpleSkin/SimpleSkin.gltf") else {
        return;
    };
    let rest = triangles(&scene, 0).positions.clone();
    scene.set_time(1.5);
    // The joint at (0, 1, 0) has turned by 90° about +Z: what was above it is to its left.
    let bent = &triangles(&scene, 0).positions;
    for (rest, bent) in rest.iter().zip(bent).filter(|(rest, _)| rest.y == 2.0) {
        assert!((*bent - vec3(1.0 - rest.y, 1.0 + rest.x, 0.0)).length() < 1e-4, "{rest} → {bent}");
    }
    assert!(rest.iter().zip(bent).filter(|(rest, _)| rest.y == 0.0).all(|(a, b)| a == b), "its foot stands");
    scene.set_time(0.0);
    assert!(rest.iter().zip(&triangles(&scene, 0).positions).all(|(a, b)| (*a - *b).length() < 1e-6));
}

#[test]
fn clips_are_chosen_by_name() {
    let Some(mut scene) = asset("clips_are_chosen_by_name", "khr_Fox/Fox.glb") else { return };
    let names: Vec<_> = scene.animations[0].clips.iter().map(|c| c.name.clone()).collect();
    assert_eq!(names, ["Survey", "Walk", "Run"]);
    let mut poses = Vec::new();
    for name in ["Survey", "Walk", "Run"] {
        assert!(scene.play(name));
        assert!((0.5..4.0).contains(&scene.duration()), "{name}: {}", scene.duration());
        scene.set_time(0.3);
        let mesh = triangles(&scene, 0);
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
        poses.push(mesh.positions.clone());
    }
    assert!(poses[0] != poses[1] && poses[1] != poses[2]);
}

#[test]
fn morph_targets_are_weighed_over_time() {
    let name = "khr_MorphStressTest/morph-stress-test.glb";
    let Some(mut scene) = asset("morph_targets_are_weighed_over_time", name) else { return };
    assert_eq!(scene.animations[0].clips.len(), 3);
    let moved = |scene: &Scene| -> Vec<Vec3> {
        let parts = scene.meshes.iter().flat_map(|m| &m.parts);
        let positions = parts.map(|part| match &part.shape {
            Shape::Triangles(mesh) => mesh.positions.clone(),
            Shape::Spheres(_) => panic!("glTF has no spheres"),
        });
        positions.flatten().collect()
    };
    let (low, high) = scene.bounds().expect("geometry");
    scene.set_time(0.0);
    let start = moved(&scene);
    let farthest = |scene: &mut Scene, share: f32| {
        scene.set_time(scene.duration() * share);
        start.iter().zip(moved(scene)).map(|(a, b)| (*a - b).length()).fold(0.0, f32::max)
    };
    let farthest =
        [0.1, 0.3, 0.5, 0.7].map(|share| farthest(&mut scene, share)).into_iter().fold(0.0, f32::max);
    assert!(farthest > 0.02 * (high - low).length(), "nothing moves by more than {farthest} m");
}

fn at(seconds: f32) -> Moment {
    Moment { time: Some(seconds), ..Moment::default() }
}

fn fingerprint(scene: &Scene) -> String {
    SceneTables::build(scene).fingerprint()
}

#[test]
fn edited_scenes_come_to_a_moment_from_anywhere() {
    let none = Resources::default();
    let mut scenes = vec![everything().scene];
    if let Some(shared) = testkit::require_shared("edited_scenes_come_to_a_moment_from_anywhere") {
        let skin = shared.join("scenes/khr_SimpleSkin/SimpleSkin.gltf");
        scenes
            .push(scene::load::load(&skin, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene);
    }
    for scene in scenes {
        let mut edits = Edits::default();
        let rest = fingerprint(&scene);
        let fresh = |edits: &Edits, moment: &Moment| {
            let mut fresh = Editable::new(scene.clone());
            fresh.set_at(edits, &none, moment).unwrap_or_else(|e| panic!("{e}"));
            fingerprint(fresh.scene())
        };
        let mut direct = scene.clone();
        direct.set_time(0.7);
        assert_eq!(fresh(&edits, &at(0.7)), fingerprint(&direct));
        let mut moved = Editable::new(scene.clone());
        for moment in [at(0.3), at(1.7), at(0.7), Moment::default(), at(1.7), Moment::default()] {
            for roughness in [0.25, 0.75] {
                edits.materials.insert(0, MaterialRecord { roughness, ..(&scene.materials[0]).into() });
                moved.set_at(&edits, &none, &moment).unwrap_or_else(|e| panic!("{e}"));
                assert_eq!(fingerprint(moved.scene()), fresh(&edits, &moment), "{moment:?}");
            }
        }
        moved.set(&Edits::default(), &none).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(fingerprint(moved.scene()), rest, "at rest again");
        assert_ne!(rest, fresh(&Edits::default(), &at(1.7)), "time changes nothing");
    }
}

#[test]
fn time_takes_back_no_edit() {
    let scene = everything().scene;
    let mut edits = Edits::default();
    edits.object(0).visible = Some(false);
    edits
        .materials
        .insert(0, MaterialRecord { base_color: [0.25, 0.5, 0.75, 1.0], ..(&scene.materials[0]).into() });
    let kind = LightKind::Point { position: Vec3::ONE, intensity: Vec3::splat(3.0) };
    edits.lights = Some(vec![scene::Light::new("p", kind)]);
    let mut edited = Editable::new(scene);
    let mut show = |edits: &Edits, time: f32| {
        edited.set_at(edits, &Resources::default(), &at(time)).unwrap_or_else(|e| panic!("{e}"));
        edited.scene().clone()
    };
    let later = show(&edits, 2.0);
    assert!(!later.instances[0].visible, "what was hidden appears");
    assert_eq!(later.instances[0].transform.translation.x, 4.0, "and moves nevertheless");
    assert_eq!(later.materials[0].base_color.truncate(), vec3(0.25, 0.5, 0.75));
    assert!(matches!(later.lights[0].kind, LightKind::Point { .. }), "{:?}", later.lights);
    edits.object(0).visible = None;
    assert!(show(&edits, 2.0).instances[0].visible);
    edits.object(0).set_transform(&glam::Affine3A::from_translation(Vec3::Y));
    assert_eq!(
        show(&edits, 2.0).instances[0].transform.translation,
        Vec3::Y.into(),
        "what was put stays there"
    );
}

/// A lamp of 200 candela below and 50 to the side.
const LAMP: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 2 2 1 1 2 0 0 0\n1 1 60\n0 90\n0\n100 25\n";

/// Photometric lights: one on a node that turns, from a URI; one on a node that stands, from a buffer view.
fn lamps(light: Value) -> Value {
    let text = base64::engine::general_purpose::STANDARD.encode(LAMP);
    let uri = format!("data:application/octet-stream;base64,{text}");
    let lights = json!([{"uri": uri}, {"bufferView": 0, "mimeType": "application/x-ies-lm-63"}]);
    json!({
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"name": "turning", "extensions": {"EXT_lights_ies": {"light": 0}}},
            {"translation": [1, 2, 3], "scale": [5, 5, 5], "extensions": {"EXT_lights_ies": light}},
        ],
        "extensionsRequired": ["EXT_lights_ies"],
        "extensions": {"EXT_lights_ies": {"lights": lights}},
    })
}

#[test]
fn photometric_lights_are_carried_by_their_nodes() {
    let mut b = Builder::default();
    b.bytes.extend(LAMP.as_bytes());
    b.views.push(json!({"buffer": 0, "byteLength": LAMP.len()}));
    b.bytes.resize(LAMP.len().next_multiple_of(4), 0);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turn = [0.0, 0.0, 0.0, 1.0, half, 0.0, 0.0, half];
    b.channel(json!({"node": 0, "path": "rotation"}), "LINEAR", &[0.0, 2.0], ("VEC4", 4, &turn));
    let loaded = b.load(lamps(json!({"light": 1, "multiplier": 0.5, "color": [1.0, 0.5, 2.0]})));
    let repaired = loaded.report.notes.iter().filter(|n| n.severity == Severity::Repaired);
    assert_eq!(repaired.count(), 1, "a colour above 1: {:?}", loaded.report);
    let mut scene = loaded.scene;
    let point = |scene: &Scene, i: usize| {
        let LightKind::Point { position, intensity } = scene.lights[i].kind else { panic!("a point") };
        let profile = scene.lights[i].profile.clone().expect("a profile");
        (position, intensity, profile.axis, profile.zero)
    };
    assert_eq!(scene.lights[1].profile.as_ref().map(|p| p.profile.values()[90]), Some(0.25));
    let standing = (vec3(1.0, 2.0, 3.0), vec3(100.0, 50.0, 100.0), Vec3::NEG_Z, Vec3::X);
    assert_eq!(point(&scene, 1), standing);
    assert_eq!(point(&scene, 0), (Vec3::ZERO, Vec3::splat(200.0), Vec3::NEG_Z, Vec3::X));
    // A quarter about +X: what was aimed along −Z is aimed along +Y, however often the scene is set.
    for _ in 0..2 {
        scene.set_time(2.0);
        let (_, intensity, axis, zero) = point(&scene, 0);
        assert!((axis - Vec3::Y).length() < 1e-6 && (zero - Vec3::X).length() < 1e-6, "{axis} {zero}");
        assert_eq!(intensity, Vec3::splat(200.0));
        assert_eq!(point(&scene, 1), standing);
    }
}

#[test]
fn broken_photometric_lights_are_named_or_left_out() {
    let load = |light: Value, lenient: bool| {
        let mut json = lamps(light);
        json["asset"] = json!({"version": "2.0"});
        json["extensions"]["EXT_lights_ies"]["lights"][1] = json!({"uri": "data:text/plain;base64,aGVsbG8="});
        let options = LoadOptions { lenient, ..LoadOptions::default() };
        scene::load::gltf::load_bytes(Path::new("lamps.gltf"), json.to_string().as_bytes(), &options)
    };
    let refused = |light: Value| load(light, false).map(|_| ()).unwrap_err().to_string();
    let missing = refused(json!({"light": 7}));
    assert!(missing.contains("photometric light 7"), "{missing}");
    let damaged = refused(json!({"light": 1}));
    assert!(damaged.contains("photometric light 1") && damaged.contains("TILT="), "{damaged}");
    let rest = load(json!({"light": 1}), true).unwrap();
    assert_eq!((rest.scene.lights.len(), rest.report.notes.len()), (1, 1), "{:?}", rest.report);
    let dark = load(json!({"light": 0, "multiplier": -1.0}), false).unwrap();
    assert_eq!((dark.scene.lights.len(), dark.report.notes.len()), (1, 1), "{:?}", dark.report);
}
