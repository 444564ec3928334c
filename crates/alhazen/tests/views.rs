//! Batches of views: each view is what a picture of its own is, whatever it is made together with.

mod common;

use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::{Gpu, GpuBackend, GpuError, GpuOptions, has_hardware};
use alhazen::{
    Backend, Camera, Control, Distortion, Fallback, Film, Integrator, Job, Limits, RayQueries, Renderer,
    Scene, SceneTables, Step, ViewBatch, ViewLayer, ViewPictures, ViewValues, camera_frame, picture_point,
    picture_ray,
};
use common::path;
use glam::Vec3;
use testkit::{Exclusive, scenes};

const SIZE: (u32, u32) = (13, 9);
const EXACT: [ViewLayer; 8] = [
    ViewLayer::Depth,
    ViewLayer::Normal,
    ViewLayer::Position,
    ViewLayer::Albedo,
    ViewLayer::Flow,
    ViewLayer::Instance,
    ViewLayer::Material,
    ViewLayer::Primitive,
];

/// Cameras around a scene's own, and what they are in the next picture. Of some the lens bends lines.
fn cameras(scene: &Scene, count: usize) -> [Vec<Camera>; 2] {
    let moved = |i: usize, by: f32| {
        let mut camera = scene.default_camera();
        let turn = 0.05 * i as f32 + by;
        camera.eye += Vec3::new(turn, 0.5 * turn, 0.0);
        if i % 3 == 1 {
            camera.distortion =
                Some(Distortion::BrownConrady { k: [-0.1, 0.0, 0.0, 0.0, 0.0, 0.0], p: [0.001, 0.0] });
        }
        camera
    };
    [0.0, 0.02].map(|by| (0..count).map(|i| moved(i, by)).collect())
}

fn job(integrator: Integrator) -> Job {
    Job { width: SIZE.0, height: SIZE.1, integrator, seed: 7, ..Job::for_scene(&scenes::cornell()) }
}

/// Everything at once, of `count` views.
fn batch(scene: &Scene, integrator: Integrator, count: usize) -> ViewBatch {
    let [now, next] = cameras(scene, count);
    job(integrator).views(&now, &next, ViewLayer::ALL.to_vec(), 2)
}

/// Only one of a batch's views.
fn one(batch: &ViewBatch, number: usize) -> ViewBatch {
    let (cameras, next) = (vec![batch.cameras[number]], vec![batch.next[number]]);
    ViewBatch { cameras, next, ..batch.clone() }
}

fn made(renderer: &mut Renderer, batch: &ViewBatch) -> ViewPictures {
    let control = Control::new();
    let (pictures, stats) = renderer.render_views(batch, &control).expect("views");
    assert_eq!((stats.samples, stats.cancelled), (batch.all_samples(), false));
    assert_eq!(control.progress().samples_done, batch.all_samples());
    assert!(stats.rays >= batch.all_samples() || !batch.wants_colors());
    pictures
}

/// The bits of a layer, of one view of `count`.
fn bits(pictures: &ViewPictures, layer: ViewLayer, number: usize, count: usize) -> Vec<u32> {
    let words: Vec<u32> = match &pictures.layers.iter().find(|(l, _)| *l == layer).expect("a layer").1 {
        ViewValues::Float(numbers) => numbers.iter().map(|x| x.to_bits()).collect(),
        ViewValues::Id(ids) => ids.clone(),
    };
    let length = words.len() / count;
    words[number * length..(number + 1) * length].to_vec()
}

/// What a film of one view of the batch shows.
fn film_of(renderer: &mut Renderer, batch: &ViewBatch, number: usize) -> Film {
    let limits = Limits { spp: batch.samples, ..Limits::default() };
    renderer.render_view(&batch.single(number), &limits, &Control::new(), &mut |_, _| {}).expect("a picture");
    renderer.film().expect("a film").expect("rendered").clone()
}

/// Every view has the bits of a batch of its own, and the colours of a film of its own.
fn assert_views_are_pictures(renderer: &mut Renderer, batch: &ViewBatch) {
    let count = batch.cameras.len();
    let all = made(renderer, batch);
    for number in 0..count {
        let alone = made(renderer, &one(batch, number));
        for layer in ViewLayer::ALL {
            let same = bits(&all, layer, number, count) == bits(&alone, layer, 0, 1);
            assert!(same, "{}: {layer} of view {number}", renderer.backend_name());
        }
        let film = film_of(renderer, batch, number).to_image();
        let expected: Vec<u32> = film.data().iter().map(|x| x.to_bits()).collect();
        let found = bits(&all, ViewLayer::Rgb, number, count);
        assert_eq!(found, expected, "{}: colours of view {number}", renderer.backend_name());
    }
    let ids = all.ids(ViewLayer::Instance).expect("ids");
    assert!(ids.iter().any(|id| *id != ids[0]), "nothing to tell apart");
}

fn cpu(scene: &Scene) -> Renderer {
    let mut renderer = Renderer::cpu(None).expect("threads");
    renderer.load(scene).expect("a scene");
    renderer
}

#[test]
fn views_on_the_cpu_are_pictures_bit_for_bit() {
    for scene in [scenes::cornell(), scenes::assortment()] {
        let mut renderer = cpu(&scene);
        for integrator in [path(4), Integrator::Direct(Default::default())] {
            assert_views_are_pictures(&mut renderer, &batch(&scene, integrator, 4));
        }
    }
}

/// Exact layers are what rays through the pixels' centres meet.
#[test]
fn exact_layers_are_what_rays_meet() {
    let scene = scenes::assortment();
    let [now, next] = cameras(&scene, 3);
    let batch = job(path(4)).views(&now, &next, EXACT.to_vec(), 0);
    let pictures = made(&mut cpu(&scene), &batch);
    let queries = RayQueries::new(SceneTables::build(&scene), None).expect("threads");
    let (width, height) = SIZE;
    let pixels = batch.pixels();
    let (mut hits, mut flows) = (0, 0);
    for (view, (camera, then)) in now.iter().zip(&next).enumerate() {
        let (frame, then) = (camera_frame(camera, width, height), camera_frame(then, width, height));
        let center = |i: usize| ((i as u32 % width) as f32 + 0.5, (i as u32 / width) as f32 + 0.5);
        let ray = |i: usize| picture_ray(&frame, width, height, center(i).0, center(i).1);
        let seen = queries.map(pixels, &Control::new(), ray, |_, point| {
            point.map(|p| (p.position(), p.normal(), p.instance(), p.material()))
        });
        for (i, seen) in seen.iter().enumerate() {
            let at = view * pixels + i;
            let number = |layer, c: usize| pictures.numbers(layer).expect("numbers")[3 * at + c];
            let vector = |layer| [0, 1, 2].map(|c| number(layer, c));
            let id = |layer| pictures.ids(layer).expect("ids")[at];
            let depth = pictures.numbers(ViewLayer::Depth).expect("depth")[at];
            let flow = &pictures.numbers(ViewLayer::Flow).expect("flow")[2 * at..2 * at + 2];
            let direction = Vec3::from(ray(i).direction);
            let offset = seen.map_or(direction, |s| Vec3::from(s.0) - next[view].eye).as_dvec3();
            if let Some(to) = picture_point(&then, width, height, offset).filter(|_| ray(i).t_max > 0.0) {
                let (x, y) = center(i);
                let error = (to.x as f32 - x - flow[0]).abs() + (to.y as f32 - y - flow[1]).abs();
                assert!(error < 1e-3, "view {view}, pixel {i}: {flow:?} instead of {to} − ({x}, {y})");
                flows += 1;
            } else {
                assert!(flow[0].is_nan() && flow[1].is_nan(), "{flow:?}");
            }
            let Some((position, normal, instance, material)) = *seen else {
                assert_eq!((depth, id(ViewLayer::Instance)), (0.0, ViewLayer::NOTHING));
                assert_eq!(id(ViewLayer::Material), ViewLayer::NOTHING);
                continue;
            };
            hits += 1;
            assert_eq!((vector(ViewLayer::Position), vector(ViewLayer::Normal)), (position, normal));
            assert_eq!((id(ViewLayer::Instance), id(ViewLayer::Material)), (instance, material));
            let axis = (camera.target - camera.eye).normalize();
            let along = (Vec3::from(position) - camera.eye).dot(axis);
            assert!((depth - along).abs() < 1e-4 * along, "{depth} instead of {along}");
        }
    }
    assert!(hits > pixels && flows > pixels, "{hits} hits, {flows} flows");
}

/// For every way of tracing that this machine has.
fn gpu_backends(test: &str) -> Exclusive<Vec<GpuBackend>> {
    let kinds = [TracerKind::Bvh, TracerKind::Query, TracerKind::Pipeline].into_iter();
    let open = |kind: TracerKind| GpuBackend::new(Gpu::open(&GpuOptions::default())?, kind);
    let skipped = |error: GpuError| testkit::skip_without_gpu(test, &error.to_string());
    Exclusive::new(has_hardware(), || kinds.filter_map(|kind| open(kind).map_err(skipped).ok()).collect())
}

/// Values of a layer that are not alike.
fn differing(a: &ViewPictures, b: &ViewPictures, layer: ViewLayer) -> usize {
    if let (Some(a), Some(b)) = (a.ids(layer), b.ids(layer)) {
        return a.iter().zip(b).filter(|(a, b)| a != b).count();
    }
    let numbers = |p: &'_ ViewPictures| p.numbers(layer).expect("numbers").to_vec();
    let alike = |a: f32, b: f32| (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-3 * (1.0 + a.abs());
    numbers(a).iter().zip(numbers(b)).filter(|(a, b)| !alike(**a, *b)).count()
}

/// A scene whose kernels software drivers compile fast.
#[test]
fn views_on_gpus_are_pictures_bit_for_bit_in_chunks_of_any_size() {
    let scene = scenes::cornell();
    let batch = batch(&scene, Integrator::Aov, 5);
    let expected = made(&mut cpu(&scene), &batch);
    let test = "views_on_gpus_are_pictures_bit_for_bit_in_chunks_of_any_size";
    gpu_backends(test).map(|backends| {
        for mut backend in backends {
            let name = backend.name();
            backend.load(testkit_tables(&scene)).expect("a scene");
            let (whole, _) = backend.render_views(&batch, &Control::new()).expect("views");
            for layer in ViewLayer::ALL {
                let wrong = differing(&whole, &expected, layer);
                assert!(wrong <= 25, "{name}: {wrong} values of {layer} are not those of the CPU");
            }
            // Two views a chunk of exact layers, and one of colours.
            backend.set_view_chunk_bytes(2 * 4 * 17 * batch.pixels() as u64);
            let (cut, stats) = backend.render_views(&batch, &Control::new()).expect("views");
            assert_eq!(stats.samples, batch.all_samples(), "{name}");
            for layer in ViewLayer::ALL {
                for number in 0..5 {
                    let same = bits(&cut, layer, number, 5) == bits(&whole, layer, number, 5);
                    assert!(same, "{name}: {layer} of view {number} in chunks");
                }
            }
            // Whatever came before, a call needs no more than the first.
            let bytes = backend.memory_bytes();
            for _ in 0..20 {
                backend.render_views(&batch, &Control::new()).expect("views");
            }
            assert_eq!(backend.memory_bytes(), bytes, "{name}");
            let mut renderer = Renderer::new(Box::new(backend));
            assert_views_are_pictures(&mut renderer, &batch);
        }
    });
}

fn testkit_tables(scene: &Scene) -> std::sync::Arc<SceneTables> {
    std::sync::Arc::new(SceneTables::build(scene))
}

#[test]
fn views_go_on_where_a_device_is_lost_and_stop_when_cancelled() {
    use alhazen::gpu::{FaultKind, InjectedFault};
    let scene = scenes::cornell();
    let [now, _] = cameras(&scene, 3);
    let batch = job(path(4)).views(&now, &[], vec![ViewLayer::Depth, ViewLayer::Instance], 0);
    let expected = made(&mut cpu(&scene), &batch);
    let control = Control::new();
    control.cancel();
    let (nothing, stats) = cpu(&scene).render_views(&batch, &control).expect("cancelled");
    assert!(stats.cancelled && stats.samples == 0);
    assert!(nothing.numbers(ViewLayer::Depth).is_some_and(|depth| depth.iter().all(|d| *d == 0.0)));

    let test = "views_go_on_where_a_device_is_lost_and_stop_when_cancelled";
    for steps in [30, 60, 90, 120] {
        let fault = InjectedFault::after(steps, FaultKind::Lost);
        let options = GpuOptions { fault: Some(fault.clone()), ..GpuOptions::default() };
        let opened = Exclusive::new(has_hardware(), || {
            Gpu::open(&options).and_then(|gpu| GpuBackend::new(gpu, TracerKind::Bvh))
        });
        opened.map(|opened| {
            let backend = match opened {
                Ok(backend) => backend,
                Err(error) if fault.has_happened() => return drop(error),
                Err(error) => return testkit::skip_without_gpu(test, &error.to_string()),
            };
            let fallback = Fallback::new(Box::new(backend), vec![Step::Cpu(Some(1))]);
            let mut renderer = Renderer::new(Box::new(fallback));
            renderer.load(&scene).expect("by the CPU, if need be");
            let pictures = made(&mut renderer, &batch);
            let wrong = differing(&pictures, &expected, ViewLayer::Instance);
            assert!(wrong <= 5, "after {steps} steps: {wrong} wrong ids");
        });
    }
}

#[test]
fn impossible_batches_are_refused() {
    let scene = scenes::cornell();
    let mut renderer = cpu(&scene);
    let refused = |renderer: &mut Renderer, batch: &ViewBatch, why: &str| {
        let error = renderer.render_views(batch, &Control::new()).expect_err(why).to_string();
        assert!(error.contains(why), "{error}");
    };
    let mut wrong = batch(&scene, path(4), 3);
    wrong.cameras[1].origin.x = f32::NAN;
    refused(&mut renderer, &wrong, "view 1: the camera's position");
    refused(&mut renderer, &batch(&scene, Integrator::Realtime(Default::default()), 1), "`realtime`");
    let mut wrong = batch(&scene, path(4), 2);
    wrong.next.pop();
    refused(&mut renderer, &wrong, "1 next cameras for 2 views");
    let nobody = batch(&scene, path(4), 0);
    assert_eq!(made(&mut renderer, &nobody).numbers(ViewLayer::Rgb), Some(&[][..]));
    let mut empty = Renderer::cpu(None).expect("threads");
    refused(&mut empty, &batch(&scene, path(4), 1), "no scene");
}
