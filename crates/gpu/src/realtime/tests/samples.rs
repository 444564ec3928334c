//! Samples of frames: how many there are, and that they are those of `path`.

use super::*;
use backend::{Backend, Control, FrameSamples};
use testkit::{Comparison, Estimate};

/// Intermediate views are on the film.
pub(super) fn views_show_what_they_say(stage: &mut Stage) {
    // Nothing is ever calm enough.
    let allocation = AllocationSettings { tolerance: 1e-9, ..AllocationSettings::default() };
    let show = |show, samples| RealtimeSettings { show, samples, allocation, ..settings() };
    let adaptive = FrameSamples { least: 2, most: 4 };
    stage.begin();
    stage.frames(&view(0.0, show(FrameView::Samples, adaptive)), 1);
    let first = stage.film();
    let brightest = |film: &Film| film.pixels().iter().map(|p| p.mean()[0]).fold(0.0, f64::max);
    assert_eq!(brightest(&first), 1.0, "without a past all want the most");
    stage.begin();
    stage.frames(&view(0.0, show(FrameView::History, adaptive)), 3);
    let history = stage.film();
    let wall = (0..AREA).find(|&p| wall_behind(p, 0.0, 1.3).is_some()).expect("a pixel of the wall");
    let expected = 12.0 / f64::from(RealtimeSettings::default().history.most);
    let shown = history.pixels()[wall].mean()[0];
    assert!((shown - expected).abs() < 1e-5, "{shown} instead of {expected}");
}

/// Frames with a budget take no more samples than it allows, and their times are told like those of
/// others.
pub(super) fn budgets_limit_samples(stage: &mut Stage) {
    let samples = FrameSamples { least: 2, most: 4 };
    let mut rays = |budget| {
        stage.begin();
        stage.timer.collect(&stage.gpu).expect("times");
        stage.timer.take();
        stage.frames(&view(0.0, RealtimeSettings { budget: Some(budget), samples, ..settings() }), 6);
        let time = stage.timer.collect(&stage.gpu).expect("times");
        let passes = stage.timer.take();
        if let Some(time) = time {
            assert_eq!(passes.iter().map(|p| p.duration).sum::<Duration>(), time);
            assert!(passes.iter().filter(|p| p.name == SAMPLES).count() >= 6, "{passes:?}");
        }
        stage.film_and_rays().1
    };
    let (few, many) = (rays(Duration::from_nanos(1)), rays(Duration::from_secs(60)));
    assert!(many > 3 * few, "{few} and {many} rays");
}

/// The reference: paths on the CPU.
pub(super) fn paths(scene: &scene::Scene, samples: u32) -> Film {
    let mut cpu = cpu::CpuBackend::new(None).expect("the CPU is there");
    cpu.load(Arc::new(SceneTables::build(scene))).expect("a scene");
    let view = View { integrator: Integrator::Path(settings().path), seed: 77, ..view(0.0, settings()) };
    cpu.render(&view, samples, &Control::new()).expect("rendered");
    cpu.film().expect("a film").expect("a film").clone()
}

const ALLOCATION: AllocationSettings =
    AllocationSettings { tolerance: 0.005, white: 1.0, noise_radius: 2, blur_radius: 1, refresh: 4 };

/// The mean of many frames is what `path` shows, whatever number of samples each pixel had in each
/// of them.
pub(super) fn unfiltered_frames_are_paths(stage: &mut Stage) {
    stage.begin();
    let samples = FrameSamples { least: 2, most: 6 };
    let settings = RealtimeSettings { filter: false, samples, allocation: ALLOCATION, ..settings() };
    stage.frames(&view(0.0, settings), 400);
    let film = stage.film();
    assert!(film.pixels().iter().all(|p| p.count() == 400), "a frame counts once");
    let comparison = Comparison::new("unfiltered real-time frames", 8);
    comparison.assert(&Estimate::from_film(&film), &Estimate::from_film(&paths(&scene(), 512)));
}

/// However paths are followed, samples, rays and what is known of second surfaces are the same, up
/// to rounding.
pub(super) fn waves_make_the_same_samples(stage: &mut Stage) {
    for samples in [FrameSamples { least: 2, most: 2 }, FrameSamples { least: 1, most: 5 }] {
        waves_make_the_same(stage, samples);
    }
}

fn waves_make_the_same(stage: &mut Stage, samples: FrameSamples) {
    let mut followed = |kernel: PathKernel| {
        stage.begin();
        // New records: random numbers go on where a pixel's last ones ended.
        (stage.kernel.buffers, stage.kernel.bindings) = (None, None);
        stage.kernel.set_path_kernel(kernel);
        let settings = RealtimeSettings { filter: false, samples, allocation: ALLOCATION, ..settings() };
        stage.frames(&view(0.0, settings), 3);
        assert_eq!(stage.kernel.taken_kernel(), kernel);
        // Without the filter, the past is that of the last frame's samples alone.
        let distances = stage.histories().iter().map(|h| f64::from(h.hit_distance)).collect::<Vec<_>>();
        let (film, rays) = stage.film_and_rays();
        (film, rays as f64, distances)
    };
    let (expected, expected_rays, expected_distances) = followed(PathKernel::Megakernel);
    let (found, rays, distances) = followed(PathKernel::Wavefront);
    stage.kernel.set_path_kernel(PathKernel::Auto);
    assert!(expected_distances.iter().filter(|d| **d > 0.0).count() > AREA / 4, "second surfaces are seen");
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-4 * (a.abs() + b.abs()) + 1e-6;
    let pixels = expected.pixels().iter().zip(found.pixels());
    let differ = pixels.zip(expected_distances.iter().zip(&distances)).filter(|((a, b), (d, e))| {
        !close(**d, **e) || !a.mean().iter().zip(b.mean()).all(|(&a, b)| close(a, b))
    });
    let differ = differ.count();
    assert!(differ * 50 <= AREA, "{differ} of {AREA} pixels differ");
    assert!((rays - expected_rays).abs() <= 0.002 * expected_rays, "{rays} rays, {expected_rays} expected");
    let sum: f64 = found.pixels().iter().flat_map(|p| p.mean()).sum();
    assert!(sum > 10.0, "the picture is not black");
}

/// Means of 8 × 8 pixels where no surface ends.
pub(super) fn block_means(film: &Film) -> Vec<f64> {
    let blocks = (0..HEIGHT / 8).flat_map(|y| (0..WIDTH / 8).map(move |x| (8 * x, 8 * y)));
    let mean = |(x, y): (u32, u32)| {
        let pixels = (0..64).map(|i| film.pixels()[((y + i / 8) * WIDTH + x + i % 8) as usize].mean());
        pixels.map(|p| p.iter().sum::<f64>()).sum::<f64>() / 192.0
    };
    blocks.map(mean).collect()
}

/// What a thousand frames have gathered, with pixels left alone once they are calm, is the
/// reference. With a rule under which calm pixels stay alone for good, it is not: what has seen no
/// light by chance never will.
pub(super) fn gathered_frames_converge_unless_they_stop_for_good(stage: &mut Stage) {
    let reference = block_means(&paths(&scene(), 512));
    let mut error_of = |refresh| {
        stage.begin();
        let allocation = AllocationSettings { refresh, ..ALLOCATION };
        let samples = FrameSamples { least: 1, most: 4 };
        let settings = RealtimeSettings { filter_passes: 0, samples, allocation, ..settings() };
        stage.frames(&view(0.0, settings), 1000);
        let film = stage.film();
        let blocks = block_means(&film);
        let differences = blocks.iter().zip(&reference).map(|(a, b)| (a / b - 1.0).abs());
        differences.sum::<f64>() / reference.len() as f64
    };
    let (right, wrong) = (error_of(ALLOCATION.refresh), error_of(0));
    println!("mean error of blocks: {right:.4} with refreshing, {wrong:.4} without");
    assert!(right < 0.01, "1000 frames are {right} off");
    assert!(wrong > 2.0 * right.max(0.005), "the biased rule is not noticed: {wrong} against {right}");
}
