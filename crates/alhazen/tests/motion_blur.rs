//! What moves while the shutter is open is blurred as it should be: against closed forms, and
//! against the mean of many instants.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{
    Animation, Control, DirectSettings, Film, Integrator, Job, Keyed, KeyedObject, Limits, Renderer, Rolling,
    SamplerKind, Scene, Shutter, ShutterShape,
};
use common::{from_above, job, path, render};
use glam::{Affine3A, DAffine3, DVec3, Quat, Vec3};
use scene::animation::{
    AnimatedLight, Channel, Clip, Interpolation, Node, Punctual, PunctualKind, Rig, Target, Track,
};
use scene::{Camera, Environment, Fog, Instance, Light, LightKind, Medium, Mesh, Shape, Sphere};
use std::sync::Arc;
use testkit::scenes::{assortment, emitter, ground, lambert};
use testkit::{Comparison, Estimate, WHOLE_IMAGE};

fn shutter(open: f32, close: f32) -> Shutter {
    Shutter::new(open, close).expect("a shutter")
}

/// Lets an object go through transforms at moments.
fn keyed(scene: &mut Scene, object: KeyedObject, keys: &[(f32, Affine3A)]) {
    let (times, transforms) = keys.iter().copied().unzip();
    let keyed = Keyed::new(object, times, transforms).expect("a motion");
    scene.animations.push(Animation { keyed: vec![keyed], ..Animation::default() });
}

/// A panel that shines, 2 m wide and deep around the origin, seen from above: 1 m of the world are
/// `pixels`.
fn panel(size: f32) -> Scene {
    let mut scene = Scene { materials: vec![emitter("panel", [1.0; 3])], ..Scene::default() };
    scene.meshes.push(Mesh::single("panel", Shape::Triangles(ground(0.0, 1.0)), 0));
    scene.instances.push(Instance::new("panel", 0, Affine3A::IDENTITY));
    scene.cameras.push(from_above(0.0, 0.0, 5.0, size));
    scene
}

/// The picture while the shutter is open around time 0, with light seen directly.
fn open(mut scene: Scene, shutter: Shutter, side: u32, spp: u32) -> Film {
    scene.open_shutter(0.0, &shutter);
    let job = Job { shutter: Some(shutter), sampler: SamplerKind::Sobol, ..job(&scene, side, side, 1) };
    render(&scene, &job, spp)
}

fn at(film: &Film, x: u32, y: u32) -> f64 {
    film.pixels()[(y * film.width() + x) as usize].mean()[0]
}

fn along_x(x: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::X * x)
}

/// A shutter's shape, and the share of its light that has passed at a share of its time.
type Passed = (ShutterShape, fn(f64) -> f64);

/// A pixel is covered for the share of time that the edge has passed it; how a shutter opens weighs
/// that time.
#[test]
fn a_moving_edge_is_a_ramp_of_the_shutters_shape() {
    let shapes: [Passed; 3] = [
        (ShutterShape::Box, |t| t),
        (ShutterShape::Triangle, |t| if t < 0.5 { 2.0 * t * t } else { 1.0 - 2.0 * (1.0 - t) * (1.0 - t) }),
        (ShutterShape::Trapezoid(0.0, 1.0), |t| 1.0 - (1.0 - t) * (1.0 - t)),
    ];
    for (shape, passed) in shapes {
        let mut scene = panel(4.0);
        // Its right edge goes from -1 to 1 in the quarter of a second that the shutter is open.
        let place = |x: f32| along_x(x) * Affine3A::from_scale(Vec3::new(4.0, 1.0, 1.0));
        keyed(&mut scene, KeyedObject::Instance(0), &[(-0.5, place(-7.0)), (0.5, place(1.0))]);
        let film = open(scene, Shutter { shape, ..shutter(-0.25, 0.0) }, 32, 512);
        for x in 0..32 {
            // From 0 to 1 on the way of the edge.
            let place = ((f64::from(x) + 0.5) / 8.0 - 2.0 + 1.0) / 2.0;
            let expected = if place < 0.0 { 1.0 } else { 1.0 - passed(place.min(1.0)) };
            let found = at(&film, x, 16);
            assert!((found - expected).abs() < 0.02, "{shape}: {x}: {found}, not {expected}");
        }
    }
}

/// What turns goes along an arc, not along the chord between its keys, and nothing of it is lost.
#[test]
fn what_turns_keeps_its_distance() {
    let mut scene = panel(6.0);
    // Beside the axis that it turns about.
    let Shape::Triangles(mesh) = &mut scene.meshes[0].parts[0].shape else { panic!("a mesh") };
    mesh.positions.iter_mut().for_each(|p| *p = Vec3::new(2.0 + 0.25 * p.x, 0.0, 0.05 * p.z));
    let turned = Affine3A::from_rotation_y;
    keyed(&mut scene, KeyedObject::Instance(0), &[(0.0, turned(0.0)), (1.0, turned(3.0))]);
    let film = open(scene, shutter(0.0, 1.0), 48, 2048);
    let (mut sum, mut outside) = (0.0, 0.0);
    for (x, y) in (0..48).flat_map(|y| (0..48).map(move |x| (x, y))) {
        let place = |i: u32| (f64::from(i) + 0.5) / 8.0 - 3.0;
        let radius = place(x).hypot(place(y));
        sum += at(&film, x, y) / 64.0;
        outside += if (1.6..2.4).contains(&radius) { 0.0 } else { at(&film, x, y) };
    }
    assert_eq!(outside, 0.0, "light off the ring");
    assert!((sum - 0.05).abs() < 0.002, "area {sum}");
}

/// A body that accelerates is long where it is slow.
#[test]
fn several_keys_follow_an_acceleration() {
    let mut scene = panel(4.0);
    let place = |t: f32| along_x(-2.0 + 2.0 * t * t);
    let keys: Vec<_> = (0..=64).map(|i| i as f32 / 64.0).map(|t| (t, place(t))).collect();
    keyed(&mut scene, KeyedObject::Instance(0), &keys);
    let film = open(scene, shutter(0.0, 1.0), 32, 512);
    for x in 8..24 {
        let way = ((f64::from(x) + 0.5) / 8.0 - 2.0 + 1.0) / 2.0;
        let (found, expected) = (at(&film, x, 16), 1.0 - way.sqrt());
        assert!((found - expected).abs() < 0.025, "{x}: {found}, not {expected}");
    }
}

/// Rows that are exposed one after the other see an edge that moves sideways slanted.
#[test]
fn a_rolling_shutter_slants_what_moves_sideways() {
    for (text, columns) in [("rows:1", false), ("columns:1", true)] {
        let rolling: Rolling = text.parse().expect("a rolling shutter");
        let mut scene = panel(4.0);
        // Along the lines that are exposed together.
        let place = |s: f32| Affine3A::from_translation(if columns { Vec3::Z * s } else { Vec3::X * s });
        keyed(&mut scene, KeyedObject::Instance(0), &[(0.0, place(-2.0)), (1.0, place(0.0))]);
        let film = open(scene, Shutter { rolling: Some(rolling), ..shutter(0.0, 0.0) }, 32, 256);
        for line in 8..24 {
            let sum: f64 =
                (0..32).map(|i| if columns { at(&film, line, i) } else { at(&film, i, line) }).sum();
            // The edge is at −1 + 2 t, from −2 on; the other one is outside until t is 1/2.
            let t = (f64::from(line) + 0.5) / 32.0;
            let far = -1.0 + 2.0 * t;
            let near = (-3.0 + 2.0 * t).max(-2.0);
            let expected = (far - near) * 8.0;
            assert!((sum - expected).abs() < 0.2, "{text}: line {line}: {sum}, not {expected}");
        }
    }
}

/// All of a scene that moves, with every kind of surface and light.
fn everything_moves() -> Scene {
    let mut scene = assortment();
    for index in 1..scene.instances.len() {
        let here = scene.instances[index].transform;
        let angle = 0.2 + 0.07 * index as f32;
        let center = Affine3A::from_translation(here.translation.into());
        let turn = Affine3A::from_rotation_y(angle) * Affine3A::from_rotation_x(0.1);
        let there = along_x(0.3 - 0.05 * index as f32) * center * turn * center.inverse() * here;
        keyed(&mut scene, KeyedObject::Instance(index as u32), &[(0.0, here), (1.0, there)]);
    }
    carry_lights(&mut scene);
    let camera = scene.cameras[0].clone();
    let look = |eye: Vec3| camera_at(&Camera { eye, ..camera.clone() });
    let keys = [(0.0, look(camera.eye)), (1.0, look(camera.eye + Vec3::new(0.5, 0.2, -0.3)))];
    keyed(&mut scene, KeyedObject::Camera(0), &keys);
    scene
}

fn camera_at(camera: &Camera) -> Affine3A {
    camera.world_to_camera().inverse()
}

/// Puts the points and spots of a scene on a node that moves.
fn carry_lights(scene: &mut Scene) {
    let light = |light: &Light| {
        let (kind, color, place) = match light.kind {
            LightKind::Point { position, intensity } => {
                (PunctualKind::Point, intensity, DAffine3::from_translation(position.as_dvec3()))
            }
            LightKind::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                let turn = glam::DQuat::from_rotation_arc(DVec3::NEG_Z, direction.as_dvec3().normalize());
                let place = DAffine3::from_rotation_translation(turn, position.as_dvec3());
                (PunctualKind::Spot { inner: inner_angle, outer: outer_angle }, intensity, place)
            }
            _ => return None,
        };
        Some((Punctual { kind, color, intensity: 1.0 }, place))
    };
    let carried: Vec<_> = (0..)
        .zip(&scene.lights)
        .filter_map(|(i, l)| Some((i, light(l).filter(|_| l.profile.is_none())?)))
        .collect();
    assert!(carried.len() >= 2, "a point and a spot");
    let mut rig = Rig::default();
    let (mut lights, mut channels) = (Vec::new(), Vec::new());
    for (index, (source, place)) in carried {
        let node = rig.nodes.len() as u32;
        let (_, rotation, translation) = place.to_scale_rotation_translation();
        rig.nodes.push(Node { rotation, translation, ..Node::default() });
        rig.order.push(node);
        let [a, b] = [translation, translation + DVec3::new(0.7, -0.2, 0.3)].map(|t| t.as_vec3());
        let linear = Interpolation::Linear;
        let values = [a.to_array(), b.to_array()].concat();
        let track = Track::new(vec![0.0, 1.0], values, 3, linear).expect("a track");
        channels.push(Channel { target: Target::Translation(node), track: Arc::new(track) });
        let turned = rotation.as_quat() * Quat::from_rotation_x(0.4);
        let values = [rotation.as_quat().to_array(), turned.to_array()].concat();
        let track = Track::new(vec![0.0, 1.0], values, 4, linear).expect("a track");
        channels.push(Channel { target: Target::Rotation(node), track: Arc::new(track) });
        lights.push(AnimatedLight { light: index, node, source, root: DAffine3::IDENTITY });
    }
    let clips = Arc::new(vec![Clip { name: "lights".into(), channels }]);
    scene.animations.push(Animation { clips, rig: Arc::new(rig), lights, ..Animation::default() });
}

/// Stratified moments that a blurred picture is compared with.
const INSTANTS: u32 = 256;

/// The mean of instants of the second that begins at 0, with its variance.
fn mean_of_instants(scene: &Scene, job: &Job, spp: u32) -> Estimate {
    let mut scene = scene.clone();
    let mut renderer = Renderer::cpu(None).expect("threads");
    let mut sum: Option<Estimate> = None;
    for i in 0..INSTANTS {
        scene.set_time((i as f32 + 0.5) / INSTANTS as f32);
        renderer.update(&scene).expect("the scene");
        let job = Job { camera: scene.cameras[0].clone(), seed: 1000 + i, shutter: None, ..job.clone() };
        let limits = Limits { spp, ..Limits::default() };
        renderer.render(&job, &limits, &Control::new()).expect("a picture");
        let one = Estimate::from_film(renderer.film().expect("a film").expect("rendered"));
        let n = f64::from(INSTANTS);
        let sum = sum.get_or_insert_with(|| Estimate {
            mean: vec![[0.0; 3]; one.mean.len()],
            variance: vec![[0.0; 3]; one.mean.len()],
            ..one
        });
        for (sum, one) in sum.mean.iter_mut().zip(&one.mean) {
            (0..3).for_each(|c| sum[c] += one[c] / n);
        }
        for (sum, one) in sum.variance.iter_mut().zip(&one.variance) {
            (0..3).for_each(|c| sum[c] += one[c] / (n * n));
        }
    }
    sum.expect("instants")
}

/// Compares a picture of the second that begins at 0 with the mean of its instants, by single
/// pixels, blocks, and as a whole.
fn compare_with_instants(name: &str, scene: &Scene, job: &Job, spp: u32) {
    let mut open = scene.clone();
    let shutter = shutter(0.0, 1.0);
    open.open_shutter(0.0, &shutter);
    let blurred = Job { camera: open.cameras[0].clone(), shutter: Some(shutter), ..job.clone() };
    let film = render(&open, &blurred, spp);
    let instants = mean_of_instants(scene, job, spp.div_ceil(INSTANTS).max(2));
    for block in [4, 8, WHOLE_IMAGE] {
        Comparison::new(format!("{name} by {block}"), block).assert(&Estimate::from_film(&film), &instants);
    }
}

#[test]
fn the_mean_of_instants_is_the_blurred_picture() {
    let scene = everything_moves();
    let direct = Integrator::Direct(DirectSettings::default());
    for (integrator, spp) in [(path(4), 2048), (direct, 1024), (Integrator::Aov, 1024)] {
        let job = Job { integrator, ..job(&scene, 32, 24, 4) };
        compare_with_instants(integrator.name(), &scene, &job, spp);
    }
}

/// A lamp of triangles and one that is a sphere, which move over a floor.
fn passing_lamps() -> Scene {
    let mut scene = Scene { materials: vec![lambert("floor", [0.8; 3])], ..Scene::default() };
    scene.materials.push(emitter("lamp", [9.0, 6.0, 3.0]));
    let panel = testkit::scenes::flipped(ground(0.0, 0.5));
    scene.meshes.push(Mesh::single("floor", Shape::Triangles(ground(0.0, 3.0)), 0));
    scene.meshes.push(Mesh::single("panel", Shape::Triangles(panel), 1));
    let ball = Sphere { center: Vec3::new(0.1, 0.0, 0.2), radius: 0.3 };
    scene.meshes.push(Mesh::single("ball", Shape::Spheres(vec![ball]), 1));
    for (mesh, name) in (0..).zip(["floor", "panel", "ball"]) {
        scene.instances.push(Instance::new(name, mesh, Affine3A::IDENTITY));
    }
    scene.cameras.push(from_above(0.0, 0.0, 5.0, 4.0));
    let place = |x: f32, z: f32| Affine3A::from_translation(Vec3::new(x, 0.4, z));
    let turned = place(1.2, 0.5) * Affine3A::from_rotation_x(1.0);
    keyed(&mut scene, KeyedObject::Instance(1), &[(0.0, place(-1.2, 0.5)), (1.0, turned)]);
    let grown = place(0.0, -1.5) * Affine3A::from_scale(Vec3::splat(1.5));
    keyed(&mut scene, KeyedObject::Instance(2), &[(0.0, place(-1.0, -1.0)), (1.0, grown)]);
    scene
}

/// By next-event estimation and by chance.
#[test]
fn lamps_that_move_light_what_they_pass() {
    let scene = passing_lamps();
    compare_with_instants("lamps", &scene, &job(&scene, 24, 24, 3), 2048);
}

#[test]
fn bodies_move_through_fog() {
    let mut scene = Scene { materials: vec![lambert("ball", [0.8, 0.5, 0.3])], ..Scene::default() };
    scene.environment = Environment::Constant(Vec3::splat(0.3));
    let ball = Sphere { center: Vec3::ZERO, radius: 0.7 };
    scene.meshes.push(Mesh::single("ball", Shape::Spheres(vec![ball]), 0));
    scene.instances.push(Instance::new("ball", 0, Affine3A::IDENTITY));
    let medium = Medium { scattering: Vec3::splat(0.3), ..Medium::default() };
    scene.fog = Some(Fog { medium, top: 4.0 });
    scene.cameras.push(from_above(0.0, 0.0, 3.0, 4.0));
    keyed(&mut scene, KeyedObject::Instance(0), &[(0.0, along_x(-1.0)), (1.0, along_x(1.0))]);
    compare_with_instants("fog", &scene, &job(&scene, 16, 16, 3), 1024);
}

/// A shutter changes nothing where nothing moves, to the last bit.
#[test]
fn what_stands_still_keeps_its_bits() {
    let mut scene = assortment();
    let job = Job { sampler: SamplerKind::Sobol, ..job(&scene, 24, 16, 4) };
    let before = render(&scene, &job, 4);
    let shutter = shutter(-0.5, 0.5);
    scene.open_shutter(0.0, &shutter);
    assert!(scene.motion.is_none());
    let after = render(&scene, &Job { shutter: Some(shutter), ..job }, 4);
    assert_eq!(before.pixels(), after.pixels());
}

/// However the work is divided, the picture is the same.
#[test]
fn blurred_pictures_do_not_depend_on_threads_or_passes() {
    let mut scene = everything_moves();
    let shutter = shutter(0.0, 1.0);
    scene.open_shutter(0.0, &shutter);
    let job = Job { shutter: Some(shutter), ..job(&scene, 24, 16, 4) };
    let (one, _) = common::render_with(&scene, &job, 4, Some(1));
    let mut renderer = Renderer::cpu(Some(2)).expect("threads");
    renderer.load(&scene).expect("the scene");
    let mut view = job.view(0.0);
    for pass in 0..4 {
        view.first_sample = pass;
        renderer.render_pass(&view, 1, &Control::new()).expect("a pass");
    }
    assert_eq!(one.pixels(), renderer.film().expect("a film").expect("rendered").pixels());
}

#[test]
fn what_moves_is_not_replayed() {
    let mut scene = everything_moves();
    let shutter = shutter(0.0, 1.0);
    scene.open_shutter(0.0, &shutter);
    let job = Job { shutter: Some(shutter), ..job(&scene, 8, 8, 3) };
    let queries = alhazen::RayQueries::new(alhazen::SceneTables::build(&scene), None).expect("threads");
    let refused = queries.replay(&job.view(0.0), [4, 4], 0);
    assert!(matches!(refused, Err(alhazen::BackendError::View { .. })), "{refused:?}");
}

/// The compute hierarchy makes the CPU's samples, up to rounding; who traces in hardware takes it,
/// and says so.
#[test]
fn the_compute_hierarchy_blurs_as_the_cpu_does() {
    let mut scene = passing_lamps();
    let camera = scene.cameras[0].clone();
    let moved = Affine3A::from_translation(Vec3::new(0.5, 0.0, 0.2)) * camera_at(&camera);
    keyed(&mut scene, KeyedObject::Camera(0), &[(0.0, camera_at(&camera)), (1.0, moved)]);
    let shutter = Shutter { rolling: "rows:0.25".parse().ok(), ..shutter(0.0, 0.75) };
    scene.open_shutter(0.0, &shutter);
    let job = Job { shutter: Some(shutter), ..job(&scene, 16, 12, 3) };
    let expected = render(&scene, &job, 8);
    let name = "the_compute_hierarchy_blurs_as_the_cpu_does";
    for renderer in &mut *common::gpu_renderers(name) {
        renderer.load(&scene).expect("the scene");
        let notices = renderer.take_notices();
        if renderer.backend_name() != "gpu-bvh" {
            assert!(notices.iter().any(|notice| notice.contains("gpu-bvh")), "{notices:?}");
            continue;
        }
        assert!(notices.is_empty(), "{notices:?}");
        let limits = Limits { spp: 8, ..Limits::default() };
        renderer.render(&job, &limits, &Control::new()).expect("a picture");
        let film = renderer.film().expect("a film").expect("rendered");
        let differs = |(a, b): &(&film::PixelStats, &film::PixelStats)| {
            a.mean().iter().zip(b.mean()).any(|(a, b)| (a - b).abs() > 2e-3 * (a.abs() + b.abs()) + 1e-6)
        };
        let wrong = film.pixels().iter().zip(expected.pixels()).filter(differs).count();
        assert!(wrong * 10 < film.pixels().len(), "{wrong} of {} pixels differ", film.pixels().len());
        let [a, b] = [film, &expected].map(Estimate::from_film);
        common::assert_same_coarse(name, &a, &b);
    }
}
