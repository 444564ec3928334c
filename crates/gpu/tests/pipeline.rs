//! Pictures of the ray tracing pipeline against those of the CPU.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]
#![cfg(not(target_vendor = "apple"))]

use backend::{
    AmbientOcclusion, Backend, Control, DirectSettings, Integrator, PathSettings, SamplerKind, View,
};
use film::{Aov, AovData, Film, Rect};
use gpu::tracer::TracerKind;
use gpu::{Gpu, GpuBackend, GpuError, GpuOptions};
use optics::camera::{CAMERA_PERSPECTIVE, CameraFrame};
use optics::{Vec3f, vec2f, vec3f};
use scene::Scene;
use scene::tables::SceneTables;
use std::sync::Arc;
use testkit::{Comparison, Estimate, Exclusive, WHOLE_IMAGE, scenes};

const SIZE: u32 = 48;

/// A back end of ray tracing pipelines, on a device that may not use ray queries; or `None` and a visible skip.
fn pipeline(test: &str) -> Option<Exclusive<GpuBackend>> {
    let features = wgpu::Features::all() - wgpu::Features::EXPERIMENTAL_RAY_QUERY;
    let opened = Exclusive::new(gpu::has_hardware(), || {
        Gpu::open(&GpuOptions { features, ..GpuOptions::default() })
            .and_then(|gpu| GpuBackend::new(gpu, TracerKind::Pipeline))
    });
    if let Err(error @ (GpuError::NoAdapter { .. } | GpuError::Unsupported { .. })) = &*opened {
        testkit::skip_without_gpu(test, &error.to_string());
        return None;
    }
    Some(opened.map(|backend| backend.unwrap_or_else(|error| panic!("{test}: {error}"))))
}

/// The scene's perspective camera for a square picture.
fn camera(scene: &Scene) -> CameraFrame {
    let camera = &scene.cameras[0];
    let scene::Projection::Perspective { fov_y } = camera.projection else {
        panic!("not a perspective camera")
    };
    let axis = (camera.target - camera.eye).normalize();
    let right = axis.cross(camera.up).normalize();
    let vector = |v: glam::Vec3| -> Vec3f { vec3f(v.x, v.y, v.z) };
    let half = (fov_y * 0.5).tan();
    CameraFrame {
        kind: CAMERA_PERSPECTIVE,
        origin: vector(camera.eye),
        right: vector(right),
        up: vector(right.cross(axis)),
        forward: vector(axis),
        half_size: vec2f(half, half),
        lens_radius: camera.lens_radius,
        focus_distance: camera.focus_distance,
        distortion: optics::distortion::no_distortion(),
    }
}

fn view(scene: &Scene, integrator: Integrator, seed: u32) -> View {
    View {
        camera: camera(scene),
        width: SIZE,
        height: SIZE,
        window: Rect::full(SIZE, SIZE),
        integrator,
        single_scatter: false,
        sampler: SamplerKind::Independent,
        seed,
        first_sample: 0,
        aovs: vec![Aov::Depth, Aov::Normal, Aov::MaterialId],
        shutter: None,
    }
}

fn render(backend: &mut dyn Backend, scene: &Scene, integrator: Integrator, samples: u32, seed: u32) -> Film {
    let view = view(scene, integrator, seed);
    backend.load(Arc::new(SceneTables::build(scene))).expect("load");
    let stats = backend.render(&view, samples, &Control::new()).expect("render");
    assert!(stats.rays > 0);
    backend.film().expect("film").expect("a film was rendered").clone()
}

fn cpu() -> cpu::CpuBackend {
    cpu::CpuBackend::new(None).expect("the CPU is there")
}

fn path() -> Integrator {
    Integrator::Path(PathSettings { max_depth: 6, ..PathSettings::default() })
}

/// A scene with holes: leaves of partial coverage in front of the Cornell box's walls.
fn leaves() -> Scene {
    let mut scene = scenes::cornell();
    scene.name = "leaves".into();
    let leaf = scenes::covering(scenes::lambert("leaf", [0.1, 0.6, 0.1]), 0.4);
    for material in &mut scene.materials {
        if material.name == "red" {
            *material = leaf.clone();
        }
    }
    scene
}

/// Other noise, the same expected picture.
#[test]
fn pictures_are_those_of_the_cpu() {
    let Some(mut gpu) = pipeline("pictures_are_those_of_the_cpu") else { return };
    for scene in [scenes::cornell(), scenes::glass(), leaves()] {
        let occlusion = Integrator::AmbientOcclusion(AmbientOcclusion::default());
        for integrator in [path(), Integrator::Direct(DirectSettings::default()), occlusion] {
            let expected = Estimate::from_film(&render(&mut cpu(), &scene, integrator, 128, 1));
            let actual = Estimate::from_film(&render(&mut *gpu, &scene, integrator, 128, 2));
            for block in [8, WHOLE_IMAGE] {
                let name = format!("pipeline-{}-{}", scene.name, integrator.name());
                Comparison::new(name, block).assert(&actual, &expected);
            }
        }
    }
}

/// With the same random numbers the same layers, but where a ray grazes an edge.
#[test]
fn layers_are_those_of_the_cpu() {
    let Some(mut gpu) = pipeline("layers_are_those_of_the_cpu") else { return };
    for scene in [scenes::cornell(), scenes::glass()] {
        let expected = render(&mut cpu(), &scene, Integrator::Aov, 1, 7);
        let actual = render(&mut *gpu, &scene, Integrator::Aov, 1, 7);
        let mut different = 0;
        for aov in [Aov::Depth, Aov::Normal, Aov::MaterialId] {
            match (expected.aov(aov), actual.aov(aov)) {
                (Some(AovData::Float(e)), Some(AovData::Float(a))) => {
                    let close = |(e, a): (&f32, &f32)| (e - a).abs() <= 1e-3 * e.abs().max(1.0);
                    different += e.data().iter().zip(a.data()).filter(|&pair| !close(pair)).count();
                }
                (Some(AovData::Integer(e)), Some(AovData::Integer(a))) => {
                    different += e.iter().zip(&a).filter(|(e, a)| e != a).count();
                }
                other => panic!("{aov:?}: {other:?}"),
            }
        }
        let allowed = (SIZE * SIZE / 200) as usize;
        assert!(different <= allowed, "{}: {different} values differ, {allowed} may", scene.name);
    }
}

/// Films of different sizes one after the other, scenes reloaded: nothing of one is left in the next.
#[test]
fn films_and_scenes_follow_each_other() {
    let Some(mut gpu) = pipeline("films_and_scenes_follow_each_other") else { return };
    let first = render(&mut *gpu, &scenes::cornell(), path(), 4, 3).mean();
    render(&mut *gpu, &scenes::glass(), path(), 4, 3);
    render(&mut *gpu, &scenes::cornell(), Integrator::Aov, 1, 3);
    assert_eq!(first, render(&mut *gpu, &scenes::cornell(), path(), 4, 3).mean());
}

/// A device that is lost in the middle is an error, and everything made on it goes without a crash.
#[test]
fn a_lost_device_is_an_error() {
    let Some(mut gpu) = pipeline("a_lost_device_is_an_error") else { return };
    let scene = scenes::cornell();
    render(&mut *gpu, &scene, Integrator::Aov, 1, 3);
    gpu.gpu().device.destroy();
    let view = view(&scene, Integrator::Aov, 4);
    let error = gpu.render(&view, 1, &Control::new()).expect_err("the device is gone");
    let mut causes = std::iter::successors(Some(&error as &dyn std::error::Error), |e| e.source());
    assert!(causes.any(|e| e.to_string().contains("lost")), "{error:?}");
    let error = gpu.load(Arc::new(SceneTables::build(&scene))).expect_err("the device is gone");
    assert!(!error.to_string().is_empty());
}
