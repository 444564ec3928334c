//! Rendering and judging for tests of pictures.
#![allow(dead_code, reason = "every test file compiles this and uses a part of it")]

pub mod on_gpus;

use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::{Gpu, GpuBackend, GpuError, GpuOptions, has_hardware};
use alhazen::{
    Camera, Control, Film, Integrator, Job, Limits, PathSettings, Renderer, SamplerKind, Scene, Summary,
};
use glam::Vec3;
use scene::Projection;
use scene::tables::SceneTables;
use testkit::{Comparison, Estimate, Exclusive, WHOLE_IMAGE};

/// Path tracing up to `max_depth` segments, without Russian roulette.
pub fn path(max_depth: u32) -> Integrator {
    Integrator::Path(PathSettings { max_depth, roulette_start: u32::MAX, ..PathSettings::default() })
}

/// A picture by the scene's camera with independent samples, whose variance a film estimates rightly.
pub fn job(scene: &Scene, width: u32, height: u32, max_depth: u32) -> Job {
    let integrator = path(max_depth);
    Job { width, height, integrator, sampler: SamplerKind::Independent, ..Job::for_scene(scene) }
}

/// A parallel projection straight down from `height` onto the square of side `size` around (`x`, `z`); the picture's
/// right is +X, its bottom +Z.
pub fn from_above(x: f32, z: f32, height: f32, size: f32) -> Camera {
    let eye = Vec3::new(x, height, z);
    let mut camera = Camera::perspective("above", eye, Vec3::new(x, height - 1.0, z), 1.0);
    camera.up = Vec3::NEG_Z;
    camera.projection = Projection::Orthographic { height: size };
    camera
}

/// What it says of a scene where its surfaces shine: what is true, anywhere, or nowhere.
pub const SHINES: [fn(SceneTables) -> SceneTables; 3] = [
    |tables| tables,
    |tables| SceneTables { emitter_boxes: vec![[[-1e4; 3], [1e4; 3]]], ..tables },
    |tables| SceneTables { emitter_boxes: Vec::new(), ..tables },
];

/// Renders with what was noted on the way.
pub fn render_with(scene: &Scene, job: &Job, spp: u32, threads: Option<usize>) -> (Film, Summary) {
    let mut renderer = Renderer::cpu(threads).unwrap();
    renderer.load(scene).unwrap();
    let limits = Limits { spp, ..Limits::default() };
    let summary = renderer.render(job, &limits, &Control::new()).unwrap();
    (renderer.film().unwrap().unwrap().clone(), summary)
}

/// Renders a scene in which no sample may be invalid.
#[track_caller]
pub fn render(scene: &Scene, job: &Job, spp: u32) -> Film {
    let (film, summary) = render_with(scene, job, spp, None);
    assert_eq!(summary.invalid_samples, 0, "{}: samples were NaN or infinite", scene.name);
    film
}

/// As [`render`], as an estimate.
#[track_caller]
pub fn estimate(scene: &Scene, job: &Job, spp: u32) -> Estimate {
    Estimate::from_film(&render(scene, job, spp))
}

/// Mean and standard error of each channel over the whole picture.
pub fn mean_and_error(e: &Estimate) -> ([f64; 3], [f64; 3]) {
    let n = e.mean.len() as f64;
    let variance = |c: usize| e.variance.iter().map(|v| v[c]).sum::<f64>();
    (e.mean_colour(), std::array::from_fn(|c| variance(c).sqrt() / n))
}

/// Asserts that the picture's mean radiance is `expected`, apart from noise (4.5 standard errors: one in 150,000) and
/// the share `tolerance`, for what is not noise: rounding, tables, the size of the spot that is looked at.
///
/// The noise itself may not be more than half a per cent: a test that would pass anything says nothing.
#[track_caller]
pub fn assert_mean(what: &str, e: &Estimate, expected: [f64; 3], tolerance: f64) {
    let (mean, error) = mean_and_error(e);
    for c in 0..3 {
        let scale = expected[c].abs().max(1e-9);
        assert!(error[c] <= 0.005 * scale, "{what}: too noisy to tell: {mean:?} ± {error:?}");
        assert!(
            (mean[c] - expected[c]).abs() <= 4.5 * error[c] + tolerance * scale,
            "{what}: channel {c} is {} ± {} instead of {} ({:+.2} %); see the test for the formula",
            mean[c],
            error[c],
            expected[c],
            100.0 * (mean[c] / expected[c] - 1.0)
        );
    }
}

/// Asserts that two pictures have the same expectation by single pixels, blocks of 8×8 and as a whole.
#[track_caller]
pub fn assert_same(what: &str, a: &Estimate, b: &Estimate) {
    for block in [1, 8, WHOLE_IMAGE] {
        // Fireflies: a pixel without its rare bright paths underestimates its variance.
        let failing_share = 0.001;
        Comparison { failing_share, ..Comparison::new(what, block) }.assert(a, b);
    }
}

/// Asserts it by blocks of 8×8 and as a whole: for pictures of few samples.
#[track_caller]
pub fn assert_same_coarse(what: &str, a: &Estimate, b: &Estimate) {
    for block in [8, WHOLE_IMAGE] {
        Comparison::new(what, block).assert(a, b);
    }
}

/// Renderers for every tracer that this machine has; says which are skipped. The environment variable
/// `ALHAZEN_TEST_BACKENDS` names those that count, for who works on one of them.
pub fn gpu_renderers(test: &str) -> Exclusive<Vec<Renderer>> {
    Exclusive::new(has_hardware(), || all_gpu_renderers(test))
}

/// Of several back ends those that a scene is tried on, which is the `turn`th of a test's: all of them on hardware. Software
/// drivers compile a kernel in half a minute, and most scenes have their own, so there the back ends take turns.
pub fn in_turn<T>(all: &mut [T], turn: usize) -> &mut [T] {
    if has_hardware() || all.is_empty() {
        return all;
    }
    let one = turn % all.len();
    &mut all[one..=one]
}

fn all_gpu_renderers(test: &str) -> Vec<Renderer> {
    let mut found = Vec::new();
    let named = std::env::var("ALHAZEN_TEST_BACKENDS").ok();
    let counts = |kind: &TracerKind| named.as_ref().is_none_or(|n| n.split(',').any(|n| n == kind.name()));
    for kind in TracerKind::ALL.into_iter().filter(counts) {
        let gpu = match Gpu::open(&GpuOptions::default()) {
            Ok(gpu) => gpu,
            Err(error) => {
                testkit::skip_without_gpu(test, &error.to_string());
                return found;
            }
        };
        match GpuBackend::new(gpu, kind) {
            Ok(backend) => found.push(Renderer::new(Box::new(backend))),
            Err(error @ GpuError::Unsupported { .. }) => testkit::skip_without_gpu(test, &error.to_string()),
            Err(error) => panic!("{test}: {}: {error}", kind.name()),
        }
    }
    found
}
