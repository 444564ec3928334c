//! Beams of the scanner that pass glass and media, and what blocks them near by.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use alhazen::{
    AlphaMode, Control, Fog, Instance, Interior, LoadOptions, Loaded, Material, Medium, Mesh, Model,
    RayQueries, Scene, SceneTables, Shape, Source, Subsurface, TriangleMesh,
};
use glam::{Affine3A, DVec3, Vec3, Vec4};
use sensors::{Lidar, PointCloud, ReturnMode, level_pose};

/// What a thin pane of index 1.5 lets through along its normal: 1 − 2 F / (1 + F), F = 0.04.
const SHEET: f32 = 1.0 - 0.08 / 1.04;

/// The surface of a box, facing outwards.
fn cuboid(low: Vec3, high: Vec3) -> TriangleMesh {
    let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let mut mesh = TriangleMesh::default();
    for (axis, side) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
        let (mut n, mut u, mut v) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        n[axis] = side * half[axis];
        u[(axis + 1) % 3] = half[(axis + 1) % 3];
        v[(axis + 2) % 3] = side * half[(axis + 2) % 3];
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([-u - v, u - v, u + v, -u + v].map(|corner| center + n + corner));
        mesh.indices.extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|i| first + i)));
    }
    mesh
}

/// A square across the beam, `distance` metres ahead.
fn pane(distance: f32) -> TriangleMesh {
    let corner = |x: f32, y: f32| Vec3::new(x, y, -distance);
    TriangleMesh {
        positions: vec![corner(-3.0, -3.0), corner(3.0, -3.0), corner(3.0, 3.0), corner(-3.0, 3.0)],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    }
}

/// What stands in front of a grey wall at 5 m.
fn scene(things: Vec<(TriangleMesh, Material)>) -> Scene {
    let base_color = Vec4::new(0.5, 0.5, 0.5, 1.0);
    let wall = Material { model: Model::Lambert, base_color, ..Material::default() };
    let mut scene = Scene::default();
    for (i, (mesh, material)) in (0..).zip(things.into_iter().chain([(pane(5.0), wall)])) {
        scene.materials.push(material);
        scene.meshes.push(Mesh::single(format!("mesh {i}"), Shape::Triangles(mesh), i));
        scene.instances.push(Instance::new(format!("instance {i}"), i, Affine3A::IDENTITY));
    }
    scene
}

fn glass() -> Material {
    Material { model: Model::Dielectric, roughness: 0.0, base_color: Vec4::ONE, ..Material::default() }
}

fn sheet() -> Material {
    Material { thin_walled: true, ..glass() }
}

/// One beam straight ahead from the origin.
fn shoot(scene: &Scene, mode: ReturnMode) -> PointCloud {
    let queries = RayQueries::new(SceneTables::build(scene), Some(1)).expect("threads");
    let lidar = Lidar { mode, ..Lidar::uniform(1, 0.0, 0.0, 1) };
    lidar.scan(&queries, &level_pose(DVec3::ZERO, 0.0), &Control::new()).expect("a scan")
}

/// Checks the ranges and intensities of all returns.
fn check(name: &str, scene: &Scene, expected: &[(f32, f32)]) {
    let cloud = shoot(scene, ReturnMode::All);
    let found: Vec<_> = cloud.ranges.iter().copied().zip(cloud.intensities.iter().copied()).collect();
    let close = |(a, b): (&(f32, f32), &(f32, f32))| {
        (a.0 - b.0).abs() < 1e-3 && (a.1 - b.1).abs() < 1e-3 * b.1.abs().max(1e-3)
    };
    let same = found.len() == expected.len() && found.iter().zip(expected).all(close);
    assert!(same, "{name}: {found:?} instead of {expected:?}");
}

#[test]
fn clear_panes_dim_what_is_behind_them_twice() {
    check("no pane", &scene(vec![]), &[(5.0, 0.5)]);
    check("thin", &scene(vec![(pane(2.0), sheet())]), &[(5.0, 0.5 * SHEET.powi(2))]);
    let two = scene(vec![(pane(2.0), sheet()), (pane(3.0), sheet())]);
    check("two thin ones", &two, &[(5.0, 0.5 * SHEET.powi(4))]);
    let grey = Material { base_color: Vec4::new(0.4, 1.0, 1.0, 1.0), ..sheet() };
    check("tinted", &scene(vec![(pane(2.0), grey)]), &[(5.0, 0.5 * (0.4 * SHEET).powi(2))]);
    let black = Material { base_color: Vec4::new(0.0, 0.0, 0.0, 1.0), ..sheet() };
    check("black", &scene(vec![(pane(2.0), black)]), &[]);
    // Blender and glTF say glass in this way.
    let mixed = |transmission| Material { model: Model::MetallicRoughness, transmission, ..sheet() };
    check("transmission", &scene(vec![(pane(2.0), mixed(1.0))]), &[(5.0, 0.5 * SHEET.powi(2))]);
}

#[test]
fn the_range_through_glass_is_its_optical_length() {
    let slab = cuboid(Vec3::new(-3.0, -3.0, -2.2), Vec3::new(3.0, 3.0, -2.0));
    let expected = 0.5 * 0.96f32.powi(4);
    check("slab", &scene(vec![(slab.clone(), glass())]), &[(5.1, expected)]);
    let smoked = Interior { attenuation_color: Vec3::splat(0.5), attenuation_distance: 0.1 };
    let absorbing = Material { interior: smoked, ..glass() };
    // Four tenths of a metre of it, there and back.
    check("smoked", &scene(vec![(slab, absorbing)]), &[(5.1, expected / 16.0)]);
    // A wall inside of the glass: the beam is refracted once, and a denser medium dims by its index
    // squared.
    let block = cuboid(Vec3::new(-9.0, -9.0, -9.0), Vec3::new(9.0, 9.0, -2.0));
    let inside = 0.5 * 0.96f32.powi(2) / 2.25;
    check("inside", &scene(vec![(block, glass())]), &[(2.0 + 3.0 * 1.5, inside)]);
}

#[test]
fn partly_clear_panes_have_a_return_of_their_own() {
    let half = Material {
        model: Model::MetallicRoughness,
        transmission: 0.5,
        specular: 0.0,
        roughness: 0.0,
        ..Material { base_color: Vec4::new(0.6, 0.6, 0.6, 1.0), ..sheet() }
    };
    let scene_of_half = scene(vec![(pane(2.0), half)]);
    let all = shoot(&scene_of_half, ReturnMode::All);
    assert_eq!(all.instances, [0, 1]);
    let wall = 0.5 * (0.5 * 0.6 * SHEET).powi(2);
    assert!(all.intensities[0] > 0.2 && (all.intensities[1] - wall).abs() < 1e-4, "{all:?}");
    for (mode, instance) in [(ReturnMode::First, 0), (ReturnMode::Strongest, 0), (ReturnMode::Last, 1)] {
        assert_eq!(shoot(&scene_of_half, mode).instances, [instance], "{mode:?}");
    }
    // Microfacets of this roughness: one in five is tilted so little that light is turned by less
    // than 10 mrad.
    let frosted = Material { roughness: 0.1, ..sheet() };
    let last = shoot(&scene(vec![(pane(2.0), frosted)]), ReturnMode::Last);
    let wall = 0.5 * (0.2 * SHEET).powi(2);
    assert!(last.instances == [1] && (last.intensities[0] - wall).abs() < 1e-4, "{last:?}");
}

#[test]
fn media_dim_returns_by_their_extinction_twice() {
    let rain = |scattering: f32| Medium {
        scattering: Vec3::splat(scattering),
        absorption: Vec3::splat(0.01),
        ..Medium::default()
    };
    let mut foggy = scene(vec![]);
    foggy.fog = Some(Fog { medium: rain(0.04), top: f32::INFINITY });
    check("fog", &foggy, &[(5.0, 0.5 * (-2.0f32 * 0.05 * 5.0).exp())]);
    let cloud = Material { model: Model::Boundary, medium: Some(rain(0.49)), ..Material::default() };
    let cube = cuboid(Vec3::new(-1.0, -1.0, -3.0), Vec3::new(1.0, 1.0, -2.0));
    let clouded = scene(vec![(cube.clone(), cloud.clone())]);
    check("cloud", &clouded, &[(5.0, 0.5 * (-1.0f32).exp())]);
    // The sensor stands in it.
    let around = cuboid(Vec3::splat(-2.0), Vec3::splat(2.0));
    check("inside", &scene(vec![(around, cloud)]), &[(5.0, 0.5 * (-2.0f32).exp())]);
    let wax = Material {
        subsurface: Some(Subsurface { radius: Vec3::splat(0.01), anisotropy: 0.0 }),
        base_color: Vec4::new(0.7, 0.5, 0.4, 1.0),
        ..glass()
    };
    let wax = shoot(&scene(vec![(cube, wax)]), ReturnMode::All);
    assert!(wax.len() == 1 && (wax.ranges[0] - 2.0).abs() < 1e-3, "{wax:?}");
    assert!((wax.intensities[0] - 0.7 * 0.96).abs() < 0.03, "about as from a diffuse surface: {wax:?}");
}

#[test]
fn what_is_too_near_blocks_the_beam() {
    let grey = || Material { model: Model::Lambert, ..Material::default() };
    check("post", &scene(vec![(pane(0.3), grey())]), &[]);
    check("window", &scene(vec![(pane(0.3), sheet())]), &[(5.0, 0.5 * SHEET.powi(2))]);
    let hole =
        Material { alpha_mode: AlphaMode::Mask(0.5), base_color: Vec4::new(1.0, 1.0, 1.0, 0.1), ..grey() };
    check("hole", &scene(vec![(pane(0.3), hole)]), &[(5.0, 0.5)]);
    let queries = RayQueries::new(SceneTables::build(&scene(vec![])), Some(1)).expect("threads");
    let short = Lidar { max_range: 4.9, ..Lidar::uniform(1, 0.0, 0.0, 1) };
    let cloud = short.scan(&queries, &level_pose(DVec3::ZERO, 0.0), &Control::new()).expect("a scan");
    assert!(cloud.is_empty());
}

#[test]
fn files_that_were_wrong_once_are_right() {
    let Some(shared) = testkit::require_shared("files_that_were_wrong_once_are_right") else { return };
    let load = |name: &str| -> Loaded {
        let path = shared.join("wild").join(name);
        Source::parse(&path.display().to_string()).load(&LoadOptions::default()).expect("a scene")
    };
    let near = load("lidar-near/s.gltf").scene;
    assert!(shoot(&near, ReturnMode::Strongest).is_empty(), "the wall is behind the post");
    let open = shoot(&load("lidar-glass/mask0.gltf").scene, ReturnMode::Strongest).intensities;
    for mode in [ReturnMode::First, ReturnMode::Strongest, ReturnMode::Last] {
        let cloud = shoot(&load("lidar-glass/glass.gltf").scene, mode);
        assert_eq!(cloud.len(), 1);
        let dimmed = open[0] * SHEET.powi(2);
        assert!((cloud.ranges[0] - 5.0).abs() < 1e-3 && (cloud.intensities[0] - dimmed).abs() < 1e-4);
    }
}
