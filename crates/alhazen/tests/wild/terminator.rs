//! Where light grazes meshes with vertex normals.

use super::common::{job, render};
use super::parts::light;
use alhazen::{Camera, Film, Integrator, Scene, Shape};
use glam::{Affine3A, Vec3};
use scene::{Model, Projection, ShadowTerminator};
use testkit::scenes::{Build, lambert};

const SIZE: u32 = 64;

/// A smooth sphere of so many segments, seen from +Z, under a sun at `degrees` from there.
fn sphere_under_sun(segments: u32, degrees: f32, terminator: ShadowTerminator) -> Scene {
    let mut scene = Scene::default();
    scene.defaults.shadow_terminator = Some(terminator);
    let white = scene.add_material(lambert("white", [1.0; 3]));
    let mesh = scene::shapes::uv_sphere(1.0, segments, segments * 2 / 3);
    scene.add_shape("ball", Shape::Triangles(mesh), white, Affine3A::IDENTITY);
    light(&mut scene, 0.0, sun(degrees));
    let mut camera = Camera::perspective("front", Vec3::Z * 4.0, Vec3::ZERO, 1.0);
    camera.projection = Projection::Orthographic { height: 2.2 };
    scene.cameras.push(camera);
    scene
}

fn sun(degrees: f32) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new(sin, 0.0, cos)
}

fn picture(scene: &Scene, integrator: Option<Integrator>) -> Film {
    let mut job = job(scene, SIZE, SIZE, 2);
    job.integrator = integrator.unwrap_or(job.integrator);
    render(scene, &job, 4)
}

/// Pixels that are black although the smooth surface there faces the light (N·L > 0.05), and how many face it at all.
fn black_pixels(film: &Film, degrees: f32) -> (usize, usize) {
    let (mut black, mut facing) = (0, 0);
    for (i, pixel) in film.pixels().iter().enumerate() {
        let at = |k: u32| 2.2 * ((k as f32 + 0.5) / SIZE as f32 - 0.5);
        let (x, y) = (at(i as u32 % SIZE), -at(i as u32 / SIZE));
        let z2 = 1.0 - x * x - y * y;
        // Inside of the mesh's outline, too.
        if z2 > 0.1 && Vec3::new(x, y, z2.sqrt()).dot(sun(degrees)) > 0.05 {
            facing += 1;
            black += usize::from(pixel.mean() == [0.0; 3]);
        }
    }
    (black, facing)
}

/// 12 × 8 segments and a sun at 80°: what the report had.
#[test]
fn smooth_meshes_have_no_black_triangles_at_the_terminator() {
    for degrees in [30.0, 80.0, 110.0] {
        let scene = sphere_under_sun(12, degrees, ShadowTerminator::Smooth);
        for integrator in [None, Some(Integrator::Direct(alhazen::DirectSettings::default()))] {
            let (black, facing) = black_pixels(&picture(&scene, integrator), degrees);
            assert!(facing > 200 && black == 0, "sun at {degrees}°: {black} of {facing} pixels are black");
        }
    }
    let exact = sphere_under_sun(12, 80.0, ShadowTerminator::Exact);
    let (black, _) = black_pixels(&picture(&exact, None), 80.0);
    assert!(black > 40, "exact: {black} pixels are black; the test would pass anything");
}

/// The coarse mesh reflects what the fine one does.
#[test]
fn the_terminator_keeps_energy() {
    let mean = |segments: u32, degrees: f32, terminator: ShadowTerminator| {
        picture(&sphere_under_sun(segments, degrees, terminator), None).mean()[0]
    };
    for degrees in [0.0, 45.0, 80.0] {
        let fine = mean(192, degrees, ShadowTerminator::Exact);
        let coarse = mean(24, degrees, ShadowTerminator::Smooth);
        let ratio = coarse / fine;
        // The outline of 24 × 16 segments has 1.6 % less area.
        assert!((0.96..1.02).contains(&ratio), "sun at {degrees}°: {ratio} of the fine sphere's light");
    }
}

/// A white sphere in a white sky stays invisible: no path is lost where its normals and triangles disagree.
#[test]
fn a_coarse_white_sphere_in_a_furnace_stays_white() {
    for model in [Model::Lambert, Model::MetallicRoughness] {
        let mut scene = sphere_under_sun(12, 0.0, ShadowTerminator::Smooth);
        scene.lights.clear();
        scene.environment = alhazen::Environment::Constant(Vec3::ONE);
        scene.materials[0].model = model;
        let film = render(&scene, &job(&scene, 24, 24, 8), 64);
        let mean = film.mean()[0];
        let least = if model == Model::Lambert { 0.995 } else { 0.98 };
        assert!((least..1.005).contains(&mean), "{model:?}: {mean}");
    }
}

/// What stands on a box with rounded normals keeps its shadow: corners are not smooth surfaces.
#[test]
fn boxes_with_rounded_normals_stay_exact() {
    let lit = |terminator| {
        let mut scene = Scene::default();
        scene.defaults.shadow_terminator = Some(terminator);
        let white = scene.add_material(lambert("white", [0.8; 3]));
        let mut table = testkit::scenes::cuboid([-1.0; 3], [1.0; 3]);
        table.normals = table.positions.iter().map(|p| p.normalize()).collect();
        scene.add_mesh("table", table, white);
        scene.add_mesh("plate", testkit::scenes::cuboid([-0.4, 1.1, -0.4], [0.4, 1.2, 0.4]), white);
        light(&mut scene, 0.0, Vec3::new(0.3, 1.0, 0.2));
        scene.cameras.push(super::common::from_above(0.0, 0.0, 1.05, 0.1));
        picture(&scene, None).mean()
    };
    assert_eq!(lit(ShadowTerminator::Smooth), lit(ShadowTerminator::Exact));
}
