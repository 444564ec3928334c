//! Adaptive sampling: the same expected picture as with equal samples, with less error for the same samples; on every back
//! end.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{
    Adaptive, Aov, Backend, Control, Film, Job, Limits, PixelSamples, Renderer, Sampling, Scene, SceneTables,
    metrics,
};
use common::{gpu_renderers, job, path};
use cpu::CpuBackend;
use std::sync::Arc;
use testkit::scenes;

const SPP: u32 = 32;

fn adaptive() -> Sampling {
    Sampling::Adaptive(Adaptive { min_spp: 8, floor: Some(metrics::REL_MSE_EPSILON) })
}

fn renderer(scene: &Scene) -> Renderer {
    let mut renderer = Renderer::cpu(None).unwrap();
    renderer.load(scene).unwrap();
    renderer
}

fn render(renderer: &mut Renderer, job: &Job, sampling: Sampling, spp: u32) -> Film {
    renderer.restart();
    let limits = Limits { spp, sampling, ..Limits::default() };
    let summary = renderer.render(job, &limits, &Control::new()).unwrap();
    let film = renderer.film().unwrap().unwrap().clone();
    assert_eq!(summary.samples, film.total_samples() + film.invalid_samples());
    film
}

/// Mean and variance of the mean, over many seeds, of the mean radiance of blocks of pixels.
fn blocks(renderer: &mut Renderer, job: &Job, sampling: Sampling, seeds: u32) -> Vec<(f64, f64)> {
    const BLOCK: usize = 4;
    let columns = job.width as usize / BLOCK;
    let mut sums = vec![(0.0, 0.0); columns * (job.height as usize / BLOCK)];
    for seed in 0..seeds {
        let film = render(renderer, &Job { seed: 1000 + seed, ..job.clone() }, sampling, SPP);
        let mut means = vec![0.0; sums.len()];
        for (i, pixel) in film.pixels().iter().enumerate() {
            let (x, y) = (i % job.width as usize, i / job.width as usize);
            let mean = pixel.mean().iter().sum::<f64>() / (3 * BLOCK * BLOCK) as f64;
            means[y / BLOCK * columns + x / BLOCK] += mean;
        }
        for (sum, mean) in sums.iter_mut().zip(means) {
            (sum.0, sum.1) = (sum.0 + mean, sum.1 + mean * mean);
        }
    }
    let n = f64::from(seeds);
    sums.iter().map(|(s, q)| (s / n, (q / n - (s / n).powi(2)) / (n - 1.0))).collect()
}

/// Renders of many seeds have the same mean, whether samples are spread evenly or by error: in every block of pixels, and in
/// the whole picture.
#[test]
fn the_expected_picture_is_the_same() {
    let scene = scenes::glass();
    let job = Job { integrator: path(8), ..job(&scene, 24, 16, 8) };
    let mut renderer = renderer(&scene);
    let uniform = blocks(&mut renderer, &job, Sampling::Uniform, 300);
    let adaptive = blocks(&mut renderer, &job, adaptive(), 300);
    let z = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0) / (a.1 + b.1).sqrt().max(1e-12);
    for (i, (a, b)) in uniform.iter().zip(&adaptive).enumerate() {
        assert!(z(*a, *b).abs() < 4.5, "block {i}: {a:?} and {b:?}");
    }
    let whole = |blocks: &[(f64, f64)]| blocks.iter().fold((0.0, 0.0), |s, b| (s.0 + b.0, s.1 + b.1));
    let (a, b) = (whole(&uniform), whole(&adaptive));
    assert!(z(a, b).abs() < 4.0, "the picture: {a:?} and {b:?}");
    // The test is worth something only where it would notice two per cent.
    assert!((a.1 + b.1).sqrt() < 0.005 * a.0, "too noisy to tell: {a:?} {b:?}");
}

#[test]
fn the_same_samples_have_less_error() {
    let scene = scenes::glass();
    let job = job(&scene, 40, 30, 8);
    let mut renderer = renderer(&scene);
    let truth = render(&mut renderer, &Job { seed: 77, ..job.clone() }, Sampling::Uniform, 4096).to_image();
    let mut error = |sampling: Sampling| -> f64 {
        let of_seed = |seed| {
            let film = render(&mut renderer, &Job { seed, ..job.clone() }, sampling, 64);
            assert!(film.total_samples() < 70 * film.pixels().len() as u64, "more than was asked for");
            metrics::rel_mse(&truth, &film.to_image()).unwrap()
        };
        (1..=4).map(of_seed).sum()
    };
    let (uniform, adaptive) = (error(Sampling::Uniform), error(adaptive()));
    assert!(adaptive < 0.9 * uniform, "{adaptive} instead of {uniform}");
}

/// The samples of a pixel are the same whatever the others get.
#[test]
fn listed_pixels_get_the_samples_that_they_would_get_anyway() {
    let scene = scenes::cornell();
    let job = Job { aovs: vec![Aov::Albedo, Aov::Depth], ..job(&scene, 21, 13, 5) };
    let view = job.view(0.0);
    let mut backend = CpuBackend::new(Some(3)).unwrap();
    backend.load(Arc::new(SceneTables::build(&scene))).unwrap();
    let control = Control::new();
    backend.render(&view, 12, &control).unwrap();
    let whole = backend.film().unwrap().unwrap().clone();
    backend.restart();
    for (first, count) in [(0, 5), (5, 7)] {
        // In any order.
        let pixels: Vec<_> = (0..21 * 13).rev().map(|pixel| PixelSamples { pixel, first, count }).collect();
        let stats = backend.render_pixels(&view, &pixels, &control).unwrap();
        assert_eq!(stats.samples, 21 * 13 * u64::from(count));
    }
    assert!(*backend.film().unwrap().unwrap() == whole, "other bits");
    let outside = [PixelSamples { pixel: 21 * 13, first: 0, count: 1 }];
    assert!(backend.render_pixels(&view, &outside, &control).is_err());
}

#[test]
fn any_number_of_threads_gives_the_same_allocation() {
    let scene = scenes::glass();
    let job = job(&scene, 33, 17, 6);
    let films: Vec<Film> = [1, 3]
        .into_iter()
        .map(|threads| {
            let mut renderer = Renderer::cpu(Some(threads)).unwrap();
            renderer.load(&scene).unwrap();
            render(&mut renderer, &job, adaptive(), 24)
        })
        .collect();
    assert!(films[0] == films[1], "other bits");
    let counts: Vec<u64> = films[0].pixels().iter().map(|p| p.count()).collect();
    assert!(counts.iter().min() == Some(&8) && counts.iter().max() > Some(&40), "{counts:?}");
}

#[test]
fn rendering_ends_at_the_error_asked_for() {
    let scene = scenes::cornell();
    let mut renderer = renderer(&scene);
    let limits = Limits { spp: 10_000, noise: Some(0.08), sampling: adaptive(), ..Limits::default() };
    let summary = renderer.render(&job(&scene, 24, 24, 5), &limits, &Control::new()).unwrap();
    let noise = summary.noise.unwrap();
    assert!((0.05..=0.08).contains(&noise), "{noise}");
    assert!(summary.spp > 8 && summary.spp < 10_000, "{}", summary.spp);
}

/// Rounding differs, so a few pixels may get a few samples more or less, but nobody sees another picture.
#[track_caller]
fn assert_alike(what: &str, expected: &Film, film: &Film) {
    let counts = |film: &Film| film.pixels().iter().map(|p| p.taken() as f64).collect::<Vec<_>>();
    let (a, b) = (counts(expected), counts(film));
    let differing = a.iter().zip(&b).filter(|(a, b)| (*a - *b).abs() > 8.0).count();
    assert!(differing * 20 < a.len(), "{what}: {differing} of {} pixels have other counts", a.len());
    let total = |counts: &[f64]| counts.iter().sum::<f64>();
    assert!((total(&b) / total(&a) - 1.0).abs() < 0.02, "{what}: {} and {}", total(&a), total(&b));
    // The same samples, up to rounding: pictures are alike far beyond their noise.
    let error = metrics::rel_mse(&expected.to_image(), &film.to_image()).unwrap();
    let noise = expected.relative_error().unwrap().powi(2);
    assert!(error < 0.3 * noise, "{what}: {error}, with noise of {noise}");
    assert_eq!(film.aovs(), expected.aovs());
}

#[test]
fn gpus_spread_samples_as_the_cpu_does() {
    let scene = scenes::glass();
    let job = Job { aovs: vec![Aov::Normal, Aov::Albedo], ..job(&scene, 32, 24, 6) };
    let other_job = Job { seed: 7, ..job.clone() };
    let mut cpu = renderer(&scene);
    let expected = [&job, &other_job].map(|job| render(&mut cpu, job, adaptive(), SPP));
    for gpu in gpu_renderers("gpus_spread_samples_as_the_cpu_does").iter_mut() {
        gpu.load(&scene).unwrap();
        let name = gpu.backend_name();
        assert_alike(name, &expected[0], &render(gpu, &job, adaptive(), SPP));
        // The next picture takes over the film, on the device and on the host, and finds nothing of the one before in it.
        assert_alike(&format!("{name}, then"), &expected[1], &render(gpu, &other_job, adaptive(), SPP));
    }
}
