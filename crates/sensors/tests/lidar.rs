//! The scanner against scenes whose answers are known.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use alhazen::{
    Control, Instance, Material, Mesh, Model, RayQueries, Scene, SceneTables, Shape, Sphere, TriangleMesh,
};
use glam::{Affine3A, DAffine3, DVec3, Vec3, Vec4};
use sensors::{Lidar, PointCloud, ReturnMode, level_pose};
use std::collections::BTreeMap;

/// A millimetre, in metres.
const ALLOWED: f64 = 1e-3;

fn scene(shapes: Vec<(Shape, f32)>) -> Scene {
    let mut scene = Scene::default();
    for (i, (shape, albedo)) in (0..).zip(shapes) {
        let base_color = Vec4::new(albedo, albedo, albedo, 1.0);
        scene.materials.push(Material { model: Model::Lambert, base_color, ..Material::default() });
        scene.meshes.push(Mesh::single(format!("mesh {i}"), shape, i));
        scene.instances.push(Instance::new(format!("instance {i}"), i, Affine3A::IDENTITY));
    }
    scene
}

fn queries(scene: &Scene) -> RayQueries {
    RayQueries::new(SceneTables::build(scene), Some(2)).expect("threads")
}

/// A square of side `2 half` through `center` that is spanned by two unit vectors.
fn square(center: Vec3, u: Vec3, v: Vec3, half: f32) -> Shape {
    let corner = |a: f32, b: f32| center + (u * a + v * b) * half;
    Shape::Triangles(TriangleMesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    })
}

fn scan(lidar: &Lidar, scene: &Scene, pose: &DAffine3) -> PointCloud {
    lidar.scan(&queries(scene), pose, &Control::new()).expect("a scan")
}

/// Checks every point's range and position, and that exactly the beams have one for which `expected` (world origin and unit
/// direction) knows a range.
fn check(
    lidar: &Lidar,
    scene: &Scene,
    pose: &DAffine3,
    expected: impl Fn(DVec3, DVec3) -> Option<f64>,
) -> usize {
    let cloud = scan(lidar, scene, pose);
    let mut next = 0;
    for firing in 0..lidar.azimuths {
        for channel in 0..lidar.elevations.len() {
            let direction = lidar.direction(channel, firing);
            let within = |r: &f64| *r > f64::from(lidar.min_range) && *r < f64::from(lidar.max_range);
            let range = expected(pose.translation, pose.transform_vector3(direction)).filter(within);
            let Some(range) = range else { continue };
            assert!(next < cloud.len(), "the beam {channel}, {firing} has no point");
            assert_eq!((usize::from(cloud.channels[next]), cloud.firings[next]), (channel, firing));
            let error = f64::from(cloud.ranges[next]) - range;
            assert!(error.abs() < ALLOWED, "the beam {channel}, {firing} is {error} m off at {range} m");
            let at = Vec3::from(cloud.positions[next]).as_dvec3();
            assert!(at.distance(direction * range) < 1.1 * ALLOWED, "{at} instead of {}", direction * range);
            next += 1;
        }
    }
    assert_eq!(next, cloud.len(), "points that should not be there");
    next
}

fn floor() -> Scene {
    scene(vec![(square(Vec3::ZERO, Vec3::Z, Vec3::X, 2000.0), 0.5)])
}

fn range_to_floor(origin: DVec3, direction: DVec3) -> Option<f64> {
    (direction.y < 0.0).then(|| origin.y / -direction.y)
}

#[test]
fn a_floor_is_at_height_over_sine() {
    let lidar = Lidar::uniform(64, (-25f64).to_radians(), 15f64.to_radians(), 512);
    let points = check(&lidar, &floor(), &level_pose(DVec3::new(3.0, 1.8, -2.0), 0.7), range_to_floor);
    // Elevations below -0.86° reach the floor within 120 m: 39 of 64 channels.
    let reaching = lidar.elevations.iter().filter(|e| 1.8 / -e.sin() < 120.0 && **e < 0.0).count();
    assert_eq!(points, reaching * 512);
    assert!((30..50).contains(&reaching));
}

#[test]
#[should_panic(expected = "m off at")]
fn two_millimetres_are_noticed() {
    let lidar = Lidar::uniform(8, -0.4, -0.1, 16);
    check(&lidar, &floor(), &level_pose(DVec3::new(0.0, 1.8, 0.0), 0.0), |o, d| {
        range_to_floor(o, d).map(|r| r + 0.002)
    });
}

#[test]
#[should_panic(expected = "has no point")]
fn a_missing_point_is_noticed() {
    let lidar = Lidar::uniform(8, 0.1, 0.4, 16);
    check(&lidar, &floor(), &level_pose(DVec3::new(0.0, 1.8, 0.0), 0.0), |_, _| Some(5.0));
}

#[test]
fn the_inside_of_a_sphere_returns_every_beam() {
    let (center, radius) = (DVec3::new(5.0, -3.0, 2.0), 60.0);
    let ball = Shape::Spheres(vec![Sphere { center: center.as_vec3(), radius: radius as f32 }]);
    let lidar = Lidar::uniform(32, -1.5, 1.5, 360);
    let points =
        check(&lidar, &scene(vec![(ball, 0.5)]), &level_pose(DVec3::new(20.0, 10.0, -7.0), 2.0), |o, d| {
            let to_center = center - o;
            let along = to_center.dot(d);
            Some(along + (along * along - to_center.length_squared() + radius * radius).sqrt())
        });
    assert_eq!(points, 32 * 360);
}

#[test]
fn walls_far_from_the_origin_are_as_exact() {
    let far = DVec3::new(2048.0, 64.0, -1024.0);
    let wall = square((far + DVec3::X * 40.0).as_vec3(), Vec3::Y, Vec3::Z, 10.0);
    let lidar = Lidar::uniform(16, -0.2, 0.2, 720);
    let points = check(&lidar, &scene(vec![(wall, 0.5)]), &level_pose(far, 0.0), |_, d| {
        let t = 40.0 / d.x;
        let on = d * t;
        // Not a beam may pass within a millimetre of the edge, or the test itself would be a matter of rounding.
        let edge = (on.y.abs() - 10.0).abs().min((on.z.abs() - 10.0).abs());
        assert!(d.x <= 0.0 || edge > 1e-3, "a beam meets the edge");
        (d.x > 0.0 && on.y.abs() < 10.0 && on.z.abs() < 10.0).then_some(t)
    });
    assert!(points > 500);
}

#[test]
fn intensity_is_albedo_times_cosine() {
    let pose = level_pose(DVec3::new(0.0, 2.0, 0.0), 0.0);
    let cloud = scan(&Lidar::uniform(16, -1.2, -0.1, 64), &floor(), &pose);
    assert_eq!(cloud.len(), 16 * 64);
    for i in 0..cloud.len() {
        let cosine = 2.0 / cloud.ranges[i];
        assert!((cloud.intensities[i] - 0.5 * cosine).abs() < 1e-4, "point {i}");
        assert_eq!(cloud.instances[i], 0);
    }
    let seeing = Lidar { min_intensity: 0.25, ..Lidar::uniform(16, -1.2, -0.1, 64) };
    let seen = scan(&seeing, &floor(), &pose);
    assert_eq!(seen.len(), cloud.intensities.iter().filter(|i| **i >= 0.25).count());
    assert!(!seen.is_empty() && seen.len() < cloud.len());
}

#[test]
fn wide_beams_divide_between_surfaces() {
    // The beam's axis passes an edge: half of the beam meets the near wall, half the far one.
    let near = square(Vec3::new(0.0, 5.0, -10.0), Vec3::X, Vec3::Y, 5.0);
    let far = square(Vec3::new(0.0, 0.0, -30.0), Vec3::X, Vec3::Y, 100.0);
    let scene = scene(vec![(near, 0.5), (far, 1.0)]);
    let of = |mode| {
        let beam = Lidar { divergence: 0.01, beam_rays: 256, mode, ..Lidar::uniform(1, 0.0, 0.0, 1) };
        let cloud = scan(&beam, &scene, &level_pose(DVec3::ZERO, 0.0));
        assert_eq!(cloud.len(), 1, "one return a beam");
        (cloud.ranges[0], cloud.intensities[0], cloud.instances[0])
    };
    let (first, last) = (of(ReturnMode::First), of(ReturnMode::Last));
    assert!((first.0 - 10.0).abs() < 2e-3 && (first.1 - 0.25).abs() < 0.01 && first.2 == 0, "{first:?}");
    assert!((last.0 - 30.0).abs() < 2e-3 && (last.1 - 0.5).abs() < 0.02 && last.2 == 1, "{last:?}");
    assert_eq!(of(ReturnMode::Strongest), last);
}

#[test]
fn noise_is_normal_and_follows_the_seed() {
    let ball = Shape::Spheres(vec![Sphere { center: Vec3::ZERO, radius: 50.0 }]);
    let scene = scene(vec![(ball, 0.5)]);
    let noisy = |seed| {
        let lidar = Lidar { range_noise: 0.02, seed, ..Lidar::uniform(64, -1.0, 1.0, 1024) };
        scan(&lidar, &scene, &level_pose(DVec3::ZERO, 0.0)).ranges
    };
    let first = noisy(1);
    assert_eq!(first, noisy(1));
    assert_ne!(first, noisy(2));
    let n = first.len() as f64;
    let errors: Vec<f64> = first.iter().map(|r| (f64::from(*r) - 50.0) / 0.02).collect();
    let moment = |k: i32| errors.iter().map(|e| e.powi(k)).sum::<f64>() / n;
    // Standard errors of the moments of 65536 normal numbers: 0.004, 0.006 and 0.04.
    assert!(moment(1).abs() < 0.016 && (moment(2) - 1.0).abs() < 0.024 && (moment(4) - 3.0).abs() < 0.16);
}

#[test]
fn impossible_settings_are_named() {
    let (scene, level) = (floor(), level_pose(DVec3::ZERO, 0.0));
    let good = Lidar::uniform(2, -0.1, 0.1, 8);
    let cases = BTreeMap::from([
        ("channels", Lidar { elevations: vec![], ..good.clone() }),
        ("elevation", Lidar { elevations: vec![f64::NAN], ..good.clone() }),
        ("azimuths", Lidar { azimuths: 0, ..good.clone() }),
        ("sweep", Lidar { sweep: 7.0, ..good.clone() }),
        ("range", Lidar { min_range: 5.0, max_range: 5.0, ..good.clone() }),
        ("beam rays", Lidar { beam_rays: 0, ..good.clone() }),
        ("divergence", Lidar { divergence: -1.0, ..good.clone() }),
        ("range noise", Lidar { range_noise: f32::NAN, ..good.clone() }),
    ]);
    for (name, lidar) in cases {
        let error = lidar.scan(&queries(&scene), &level, &Control::new()).expect_err(name).to_string();
        assert!(error.starts_with(&format!("{name}:")), "{error}");
    }
    let scaled = DAffine3::from_scale(DVec3::splat(2.0));
    let error = good.scan(&queries(&scene), &scaled, &Control::new()).expect_err("scaled").to_string();
    assert!(error.starts_with("pose:"), "{error}");
    let control = Control::new();
    control.cancel();
    assert_eq!(
        good.scan(&queries(&scene), &level, &control).expect_err("cancelled").to_string(),
        "cancelled"
    );
}

#[test]
fn clouds_are_written_and_read_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let cloud =
        scan(&Lidar::uniform(8, -0.5, -0.1, 32), &floor(), &level_pose(DVec3::new(0.0, 1.0, 0.0), 0.0));
    let (ply, npz) = (folder.path().join("a.ply"), folder.path().join("a.npz"));
    cloud.write(&ply).expect("written");
    cloud.write(&npz).expect("written");
    let bytes = std::fs::read(&ply).expect("read");
    let end = b"end_header\n";
    let header = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    assert!(String::from_utf8_lossy(&bytes[..header]).contains("element vertex 256\n"));
    assert_eq!(bytes.len() - header, 256 * (5 * 4 + 2 + 4 + 4));
    let number = |at: usize| f32::from_le_bytes(bytes[header + at..][..4].try_into().expect("four bytes"));
    assert_eq!([number(30), number(34), number(38)], cloud.positions[1]);
    // Not compressed, so the numbers stand in the archive as they are; the package for Python reads it with NumPy.
    let archive = std::fs::read(&npz).expect("read");
    let numbers: Vec<u8> = cloud.positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    assert!(archive.windows(numbers.len()).any(|w| w == numbers));
    for name in ["positions", "ranges", "intensities", "channels", "firings", "instances"] {
        let name = format!("{name}.npy");
        assert!(archive.windows(name.len()).any(|w| w == name.as_bytes()), "{name}");
    }
    let error = cloud.write(&folder.path().join("a.las")).expect_err("unknown").to_string();
    assert!(error.contains("a.las") && error.contains(".npz"), "{error}");
}
