//! The wavefront against the megakernel, kernel by kernel; pictures of many scenes are compared in `alhazen/tests`.

use super::*;
use crate::batch::BatchPixels;
use crate::device::{SUMS_BY_GROUP, SUMS_BY_INVOCATION};
use crate::kernel::KernelKind;
use crate::megakernel::Megakernel;
use crate::open_for_test;
use crate::tracer::{Instances, TracerKind, bvh::BvhTracer, query::QueryTracer};
use backend::{Integrator, PathSettings, SamplerKind};
use film::{Film, Rect};
use optics::camera::{CAMERA_PERSPECTIVE, CameraFrame};
use optics::{vec2f, vec3f};
use scene::tables::SceneTables;
use std::sync::Arc;

/// Every pixel once, in parts of nearly the same size that fit.
#[test]
fn waves_cover_all_pixels_evenly() {
    for (pixels, most) in [(1, 1), (100, 1), (100, 30), (100, 100), (100, 1000), (2_073_600, 16_384)] {
        let parts: Vec<_> = waves(pixels, most).collect();
        let mut next = 0;
        for &(first, count) in &parts {
            assert_eq!(first, next);
            assert!((1..=most).contains(&count), "{count} of {most}");
            next = first + count;
        }
        assert_eq!(next, pixels);
        assert_eq!(parts.len() as u32, pixels.div_ceil(most));
    }
}

/// The Cornell box from its open side: a lamp, diffuse walls, two blocks, and the dark around it.
fn view(splitting: u32) -> backend::View {
    backend::View {
        camera: CameraFrame {
            kind: CAMERA_PERSPECTIVE,
            origin: vec3f(2.78, 2.73, -8.0),
            right: vec3f(-1.0, 0.0, 0.0),
            up: vec3f(0.0, 1.0, 0.0),
            forward: vec3f(0.0, 0.0, 1.0),
            half_size: vec2f(0.5, 0.375),
            lens_radius: 0.0,
            focus_distance: 1.0,
            distortion: optics::distortion::no_distortion(),
        },
        width: 24,
        height: 18,
        window: Rect { x: 3, y: 2, width: 17, height: 13 },
        integrator: Integrator::Path(PathSettings { max_depth: 4, splitting, ..PathSettings::default() }),
        single_scatter: false,
        sampler: SamplerKind::Independent,
        seed: 3,
        first_sample: 0,
        aovs: Vec::new(),
        shutter: None,
    }
}

/// A device with a scene and a tracer.
struct Setup {
    gpu: testkit::Exclusive<Gpu>,
    scene: GpuScene,
    tracer: Box<dyn Tracer>,
}

impl Setup {
    /// `None` and a visible skip where there is no such device.
    fn new(test: &str, kind: TracerKind) -> Option<Self> {
        let gpu = open_for_test(test, &crate::GpuOptions::default())?;
        if let Err(error) = kind.check(&gpu) {
            testkit::skip_without_gpu(test, &error.to_string());
            return None;
        }
        let tables = Arc::new(SceneTables::build(&testkit::scenes::cornell()));
        let scene = GpuScene::upload(&gpu, tables).expect("upload");
        let tracer: Box<dyn Tracer> = match kind {
            TracerKind::Query => Box::new(QueryTracer::new(&gpu, &scene).expect("structures")),
            _ => Box::new(BvhTracer::new(&gpu, &scene, Instances::StandStill).expect("structures")),
        };
        Some(Self { gpu, scene, tracer })
    }

    fn film(&self, splitting: u32) -> FilmBuffers {
        FilmBuffers::new(&self.gpu, &view(splitting), false).expect("memory")
    }

    fn megakernel(&self, splitting: u32) -> Megakernel {
        let variant = variant(splitting);
        Megakernel::new(&self.gpu, KernelKind::Path, variant, &self.scene, &*self.tracer).expect("a kernel")
    }

    fn wavefront(&self, splitting: u32, paths: Option<u32>) -> WavefrontKernel {
        let queues = Queues::new(&self.gpu, paths).expect("memory");
        WavefrontKernel::new(&self.gpu, variant(splitting), &self.scene, &*self.tracer, queues)
            .expect("a kernel")
    }

    /// Sums of every pixel, and rays.
    fn render(&self, kernel: &mut dyn Kernel, splitting: u32) -> (Vec<[f64; 3]>, u64) {
        let mut buffers = self.film(splitting);
        let mut timer = Timer::new(&self.gpu).expect("memory");
        for (first_sample, sample_count) in [(0, 5), (5, 2)] {
            let pixels = BatchPixels::Rows { first: 0, count: 13 };
            let batch = Batch { pixels, first_sample, sample_count };
            kernel.submit(&self.gpu, &mut buffers, batch, &mut timer).expect("submit");
        }
        timer.collect(&self.gpu).expect("times");
        let passes = timer.take();
        assert!(
            passes.iter().all(|p| p.name == passes[0].name) || passes.iter().any(|p| p.name == "connect")
        );
        let v = view(splitting);
        let mut film = Film::with_window(v.width, v.height, v.window, &[]).expect("a film");
        let rays = buffers.fold_into(&self.gpu, &mut film).expect("read").rays();
        assert_eq!(film.total_samples(), 7 * 17 * 13);
        (film.pixels().iter().map(|p| p.mean()).collect(), rays)
    }
}

/// What adds rays up among a workgroup, as hardware does, counts as many as what does not, as software drivers do: one for each
/// sample of a kernel that looks at first hits.
#[test]
fn rays_are_counted_by_workgroups_and_by_invocations() {
    let Some(mut setup) = Setup::new("rays_are_counted_by_workgroups_and_by_invocations", TracerKind::Bvh)
    else {
        return;
    };
    for sums in [SUMS_BY_GROUP, SUMS_BY_INVOCATION] {
        setup.gpu.sums = sums;
        let (scene, tracer) = (&setup.scene, &*setup.tracer);
        let kernel = Megakernel::new(&setup.gpu, KernelKind::Aov, variant(1), scene, tracer);
        let (_, rays) = setup.render(&mut kernel.expect("a kernel"), 1);
        assert_eq!(rays, 7 * 17 * 13, "{sums:?}");
    }
}

fn variant(splitting: u32) -> Variant {
    Variant { sampler: view(splitting).sampler, splitting: splitting > 1, ..Variant::default() }
}

/// Share of the pixels that differ by more than rounding.
fn differing(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-4 * (a.abs() + b.abs()) + 1e-6;
    let differ = a.iter().zip(b).filter(|(a, b)| !a.iter().zip(b.iter()).all(close)).count();
    assert!(a.len() == b.len() && !a.is_empty());
    differ as f64 / a.len() as f64
}

/// Of this share of the pixels, rounding may tip a path's decision: different shaders may be rounded differently.
const TIPPED: f64 = 0.01;

#[test]
fn samples_are_the_megakernels() {
    for kind in [TracerKind::Bvh, TracerKind::Query] {
        let Some(mut setup) = Setup::new("samples_are_the_megakernels", kind) else { continue };
        for splitting in [1, 3] {
            let (expected, expected_rays) = setup.render(&mut setup.megakernel(splitting), splitting);
            // Once as on hardware: software drivers take minutes for it.
            let as_on_hardware = kind == TracerKind::Bvh && splitting == 3;
            setup.gpu.sums = if as_on_hardware { SUMS_BY_GROUP } else { SUMS_BY_INVOCATION };
            assert!(expected.iter().flatten().sum::<f64>() > 10.0, "the picture is not black");
            // One wave, several waves, and, once because it takes long, less paths than a pixel has samples.
            let few = (kind == TracerKind::Bvh && splitting == 1).then_some(Some(4));
            for paths in [None, Some(500)].into_iter().chain(few) {
                let (picture, rays) = setup.render(&mut setup.wavefront(splitting, paths), splitting);
                let share = differing(&picture, &expected);
                let name = format!("{}, {splitting} branches, {paths:?} paths", kind.name());
                assert!(share <= TIPPED, "{name}: {:.1} % of the pixels differ", 100.0 * share);
                let more = rays as f64 / expected_rays as f64 - 1.0;
                assert!(more.abs() < 1e-3, "{name}: {rays} rays instead of {expected_rays}");
            }
        }
    }
}

/// What the comparison above is worth: a `connect` that adds nothing is noticed, and so is a `shade` that drops emission.
#[test]
fn a_stage_that_does_nothing_is_noticed() {
    let Some(setup) = Setup::new("a_stage_that_does_nothing_is_noticed", TracerKind::Bvh) else { return };
    let (expected, _) = setup.render(&mut setup.megakernel(1), 1);
    let linkage = Linkage::of(variant(1)).with(&setup.tracer.linkage());
    let tracing = linkage.text(Stage::Extend.spec().module).expect("linked");
    let shading = linkage.text(Stage::Shade.spec().module).expect("linked");
    for (stage, text, line) in [
        (Stage::Connect, tracing, "gathered[shadow_ray_slot(id.x)] += vec4f(ray.contribution, 0.0);"),
        (Stage::Shade, shading, "gathered[slot] = vec4f(path.state.radiance, 0.0);"),
    ] {
        let mut kernel = setup.wavefront(1, None);
        let broken = text.replace(line, "");
        assert_ne!(broken, text, "{line}");
        kernel.stages[stage as usize].replace(&setup.gpu, broken).expect("valid");
        let (picture, _) = setup.render(&mut kernel, 1);
        let share = differing(&picture, &expected);
        assert!(share > TIPPED, "{}: only {:.1} % of the pixels differ", stage.spec().name, 100.0 * share);
    }
}

/// More branches than paths may be in flight is an error that names both numbers.
#[test]
fn too_many_branches_are_an_error() {
    let Some(setup) = Setup::new("too_many_branches_are_an_error", TracerKind::Bvh) else { return };
    let mut kernel = setup.wavefront(3, Some(2));
    let pixels = BatchPixels::Rows { first: 0, count: 1 };
    let batch = Batch { pixels, first_sample: 0, sample_count: 1 };
    let mut timer = Timer::new(&setup.gpu).expect("memory");
    let error = kernel.submit(&setup.gpu, &mut setup.film(3), batch, &mut timer).expect_err("too many");
    assert!(matches!(error, GpuError::Limit { needed: 3, offered: 2, .. }), "{error}");
}
