//! Exact layers and data sets of a scene whose answers are known: a wall, and a ball in front of it.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use alhazen::{
    Aov, Camera, Control, ExrFile, Instance, Job, Limits, Material, Mesh, Model, RayQueries, Renderer, Scene,
    SceneTables, Shape, Sphere, TriangleMesh,
};
use glam::{Affine3A, Vec3, Vec4};
use sensors::dataset::{Dataset, Poses};
use sensors::{Categories, GroundTruth, Motion};
use std::collections::BTreeMap;

const MATRIX: [[f64; 3]; 3] = [[60.0, 0.0, 31.5], [0.0, 60.0, 23.5], [0.0, 0.0, 1.0]];
const SIZE: (u32, u32) = (64, 48);

/// A camera that looks along -Z from `eye`.
fn pose(eye: [f64; 3]) -> [[f64; 4]; 4] {
    let [x, y, z] = eye;
    [[1.0, 0.0, 0.0, x], [0.0, -1.0, 0.0, y], [0.0, 0.0, -1.0, z], [0.0, 0.0, 0.0, 1.0]]
}

fn camera(eye: [f64; 3]) -> Camera {
    let [x, y, z, _] = pose(eye);
    Camera::from_opencv(MATRIX, [x, y, z], SIZE.0, SIZE.1).expect("a camera")
}

/// A wall of 16 m × 3 m at z = 0 and a ball of 0.5 m at z = 3.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let base_color = Vec4::new(0.8, 0.4, 0.2, 1.0);
    scene.materials.push(Material { model: Model::Lambert, base_color, ..Material::default() });
    let corners = [(-8.0, -1.5), (8.0, -1.5), (8.0, 1.5), (-8.0, 1.5)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let wall = TriangleMesh {
        positions: corners.to_vec(),
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    };
    let ball = Shape::Spheres(vec![Sphere { center: Vec3::ZERO, radius: 0.5 }]);
    scene.meshes.push(Mesh::single("wall", Shape::Triangles(wall), 0));
    scene.meshes.push(Mesh::single("ball", ball, 0));
    scene.instances.push(Instance::new("wall", 0, Affine3A::IDENTITY));
    scene.instances.push(Instance::new("ball", 1, Affine3A::from_translation(Vec3::new(0.0, 0.0, 3.0))));
    scene.environment = alhazen::Environment::Constant(Vec3::ONE);
    scene
}

fn observe(scene: &Scene, camera: &Camera, next: Option<Motion>) -> GroundTruth {
    let queries = RayQueries::new(SceneTables::build(scene), Some(2)).expect("threads");
    let categories = Categories::new(scene, &BTreeMap::new());
    GroundTruth::observe(scene, &queries, &categories, camera, SIZE, next, &Control::new())
        .expect("a picture")
}

#[test]
fn depth_is_along_the_axis_and_ids_are_those_of_the_scene() {
    let truth = observe(&scene(), &camera([0.0, 0.0, 6.0]), None);
    let (mut walls, mut balls) = (0, 0);
    for (i, (x, y)) in (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))).enumerate() {
        // Where the pixel's ray meets the wall's plane, 6 m away.
        let at = [(f64::from(x) - 31.5) / 10.0, (23.5 - f64::from(y)) / 10.0];
        let on_wall = at[1].abs() < 1.5;
        match truth.instance[i] {
            0 => {
                walls += 1;
                assert!((truth.depth[i] - 6.0).abs() < 1e-5, "{} at ({x}, {y})", truth.depth[i]);
                let error =
                    Vec3::from(truth.position[i]).distance(Vec3::new(at[0] as f32, at[1] as f32, 0.0));
                assert!(error < 1e-5, "({x}, {y}) is {error} m off");
                assert_eq!((truth.normal[i], truth.category[i]), ([0.0, 0.0, 1.0], 1));
                assert!(on_wall);
            }
            1 => {
                balls += 1;
                assert!((2.5..3.0).contains(&truth.depth[i]) && truth.category[i] == 2);
            }
            id => {
                assert_eq!((id, truth.depth[i], truth.category[i]), (GroundTruth::NOTHING, 0.0, 0));
                assert!(!on_wall);
            }
        }
    }
    // The ball's outline is where 0.5 m at 3 m is tangent: a disc of 60 · tan(asin(1/6)) pixels.
    let expected = std::f64::consts::PI * (60.0 * (1f64 / 6.0).asin().tan()).powi(2);
    assert!((f64::from(balls) - expected).abs() < 0.05 * expected, "{balls} instead of {expected}");
    assert_eq!(walls + balls, 30 * 64, "rows up to 1.5 m from the axis are full");
}

#[test]
fn flow_is_focal_length_times_motion_over_depth() {
    let here = camera([0.0, 0.0, 6.0]);
    // The camera moves 0.1 m to the right, the ball 0.2 m up.
    let there = camera([0.1, 0.0, 6.0]);
    let mut then = scene();
    then.instances[1].transform = Affine3A::from_translation(Vec3::new(0.0, 0.2, 3.0));
    let truth = observe(&scene(), &here, Some(Motion { camera: &there, scene: Some(&then) }));
    for i in 0..truth.flow.len() {
        let [x, y] = truth.flow[i];
        let expected = match truth.instance[i] {
            0 => [-60.0 * 0.1 / 6.0, 0.0],
            1 => [-60.0 * 0.1 / truth.depth[i], -60.0 * 0.2 / truth.depth[i]],
            _ => [0.0, 0.0],
        };
        assert!((x - expected[0]).abs() < 1e-3 && (y - expected[1]).abs() < 1e-3, "pixel {i}: {x}, {y}");
    }
    assert!(observe(&scene(), &here, None).flow.is_empty());
}

#[test]
fn lenses_show_the_scene_where_opencv_does_and_nothing_outside_of_their_field() {
    // r (1 − 2.5 r²) grows up to r = 0.365, where it is 0.243; the picture's corners are at 0.66 focal lengths.
    let lens =
        |x: f64| camera([x, 0.0, 6.0]).with_opencv_distortion(&[-2.5, 0.0, 0.0, 0.0], false).expect("a lens");
    let then = scene();
    let next = Motion { camera: &lens(0.1), scene: Some(&then) };
    let truth = observe(&scene(), &lens(0.0), Some(next));
    for (i, (x, y)) in (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))).enumerate() {
        let seen = ((f64::from(x) - 31.5) / 60.0).hypot((f64::from(y) - 23.5) / 60.0);
        let sees = truth.instance[i] != GroundTruth::NOTHING;
        // At 6 m the wall is 1.5 m high on both sides of the axis: up to a quarter of the distance.
        if seen > 0.26 {
            assert!(!sees && truth.flow[i][0].is_nan(), "({x}, {y}) is outside of the field");
        } else if seen < 0.2 {
            assert!(sees, "({x}, {y})");
            let at = Vec3::from(truth.position[i]);
            let r = f64::from(at.x.hypot(at.y)) / (6.0 - f64::from(at.z));
            assert!((r * (1.0 - 2.5 * r * r) - seen).abs() < 1e-4, "({x}, {y}): {r} is seen at {seen}");
            assert!(truth.flow[i][0] < 0.0, "what is seen moves to the left");
        }
    }
}

fn dataset(moves: BTreeMap<String, Vec<[[f64; 4]; 4]>>) -> Dataset {
    let scene = scene();
    let poses = vec![pose([0.0, 0.0, 6.0]), pose([0.1, 0.0, 6.0])];
    let job = Job::for_scene(&scene);
    let categories = BTreeMap::from([("ball".into(), "toy".into())]);
    let poses = Poses {
        width: SIZE.0,
        height: SIZE.1,
        matrix: MATRIX,
        distortion: vec![],
        fisheye: false,
        poses,
        moves,
    };
    Dataset { scene, poses, categories, job, limits: Limits { spp: 4, ..Limits::default() } }
}

#[test]
fn data_sets_hold_what_was_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let place =
        |y: f64| [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, 3.0], [0.0, 0.0, 0.0, 1.0]];
    let moves = BTreeMap::from([("ball".into(), vec![place(0.0), place(0.2)])]);
    let mut renderer = Renderer::cpu(Some(2)).expect("threads");
    let mut heard = Vec::new();
    let exported = dataset(moves).export(folder.path(), &mut renderer, &Control::new(), |i| heard.push(i));
    let exported = exported.expect("a data set");
    assert_eq!((exported.images, exported.annotations, heard), (2, 4, vec![0, 1]));

    let text = std::fs::read_to_string(folder.path().join("annotations.json")).expect("annotations");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(json["categories"][1]["name"], "toy");
    assert_eq!(
        (json["images"][1]["id"].as_u64(), json["images"][1]["camera"]["pose"][0][3].as_f64()),
        (Some(1), Some(0.1))
    );
    let ball = &json["annotations"][3];
    assert_eq!(
        (ball["image_id"].as_u64(), ball["category_id"].as_u64(), ball["name"].as_str()),
        (Some(1), Some(2), Some("ball"))
    );
    let center: Vec<f64> = serde_json::from_value(ball["box3d"]["center"].clone()).expect("numbers");
    assert!(
        (center[1] - 0.2).abs() < 1e-6 && (center[2] - 3.0).abs() < 1e-6,
        "the box is where the ball went"
    );

    let exr = ExrFile::read(&folder.path().join("layers/000001.exr")).expect("layers");
    let ids = exr.channels.iter().find(|c| c.name == "instance.I").expect("ids");
    let alhazen::ExrSamples::Uint(ids) = &ids.samples else { panic!("ids are whole numbers") };
    // The run lengths go column by column, outside first.
    let counts: Vec<usize> = serde_json::from_value(ball["segmentation"]["counts"].clone()).expect("numbers");
    let mask: Vec<bool> = counts.iter().enumerate().flat_map(|(i, n)| vec![i % 2 == 1; *n]).collect();
    assert_eq!(mask.len(), ids.len());
    let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
    for (i, inside) in mask.iter().enumerate() {
        assert_eq!(*inside, ids[i % height * width + i / height] == 1, "pixel {i} of the mask");
    }
    assert_eq!(ball["area"].as_u64(), Some(mask.iter().filter(|m| **m).count() as u64));
    let first = ExrFile::read(&folder.path().join("layers/000000.exr")).expect("layers");
    let flow = first.layer("flow").expect("flow");
    let on_ball = flow.pixel(32, 24);
    assert!((on_ball[1] + 60.0 * 0.2 / 2.5).abs() < 0.1, "the ball moves up by 4.8 pixels: {on_ball:?}");

    // The picture shows what the layers say: the ball in the rendered ids covers the same pixels but for its edge.
    renderer.restart();
    let [x, y, z, _] = pose([0.1, 0.0, 6.0]);
    let camera = Camera::from_opencv(MATRIX, [x, y, z], SIZE.0, SIZE.1).expect("a camera");
    let job = Job {
        camera,
        width: SIZE.0,
        height: SIZE.1,
        aovs: vec![Aov::InstanceId],
        ..Job::for_scene(&scene())
    };
    let limits = Limits { spp: 1, ..Limits::default() };
    renderer.render(&job, &limits, &Control::new()).expect("a picture");
    let film = renderer.film().expect("a film").expect("rendered");
    let Some(alhazen::AovData::Integer(rendered)) = film.aov(Aov::InstanceId) else { panic!("ids") };
    let differ = rendered.iter().zip(ids).filter(|(a, b)| a != b).count();
    assert!(differ < 60, "{differ} pixels differ");
    assert!(folder.path().join("images/000001.png").is_file());
}

#[test]
fn unknown_instances_and_cancelled_work_are_errors() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut renderer = Renderer::cpu(Some(1)).expect("threads");
    let unknown = dataset(BTreeMap::from([("car".into(), vec![pose([0.0; 3]); 2])]));
    let error = unknown.export(folder.path(), &mut renderer, &Control::new(), |_| {}).expect_err("no car");
    assert!(error.to_string().contains("moves: car"), "{error}");
    let control = Control::new();
    control.cancel();
    let error = dataset(BTreeMap::new()).export(folder.path(), &mut renderer, &control, |_| {});
    assert_eq!(error.expect_err("cancelled").to_string(), "cancelled");
    assert!(!folder.path().join("annotations.json").exists(), "an incomplete data set has no annotations");
}
