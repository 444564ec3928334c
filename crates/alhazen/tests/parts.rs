//! Pictures made in parts, by several machines or in several sittings, are the pictures made whole, bit for bit.

mod common;

use alhazen::{
    Aov, Checkpoint, Control, Description, Job, Merger, Part, PartError, PartJob, RenderPartError, Renderer,
    Scene, Tile, finish,
};
use common::{job, path};
use film::{ExrFile, Precision};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use testkit::Random;
use testkit::scenes;

const SPP: u32 = 21;

fn renderer(scene: &Scene) -> Renderer {
    let mut renderer = Renderer::cpu(Some(2)).unwrap();
    renderer.load(scene).unwrap();
    renderer
}

fn picture(scene: &Scene) -> Job {
    let aovs = vec![Aov::Depth, Aov::Normal, Aov::MaterialId, Aov::StandardError, Aov::SampleCount];
    Job { aovs, integrator: path(4), ..job(scene, 43, 29, 3) }
}

/// All that a picture's file says and shows, but how long it took.
fn contents(part: Part) -> ExrFile {
    assert!(part.missing().is_empty(), "incomplete: {:?}", part.missing());
    let (film, metadata) = finish(part).unwrap();
    let mut file = ExrFile::from_film(&film, Precision::Float);
    file.metadata = metadata;
    assert!(file.metadata.remove("render_seconds").is_some());
    file
}

#[test]
fn random_splits_merge_to_the_picture_made_whole() {
    let scene = scenes::cornell();
    let (job, about) = (picture(&scene), Description::new("cornell", &[], &scene));
    let whole_job = PartJob::whole(&job, SPP, &about);
    let mut renderer = renderer(&scene);
    let (whole, summary) = renderer.render_part(&whole_job, None, &Control::new(), None).unwrap();
    assert_eq!((summary.spp, summary.samples, summary.cancelled), (SPP, 43 * 29 * u64::from(SPP), false));
    // What the plain way of rendering makes.
    let limits = alhazen::Limits { spp: SPP, ..Default::default() };
    renderer.restart();
    renderer.render(&job, &limits, &Control::new()).unwrap();
    assert!(renderer.film().unwrap().unwrap() == whole.film());
    let expected = contents(whole);

    let mut random = Random::new(11);
    for parts in [2, 3, 7, 16, 64] {
        // Some tiles, each in some ranges of samples, in any order.
        let tiles = 1 + (random.uniform() * f64::from(parts.min(9) - 1)) as u32;
        let ranges = u32::min(parts / tiles, SPP).max(1);
        let mut list: Vec<(u32, u32)> =
            (0..tiles).flat_map(|tile| (0..ranges).map(move |r| (tile, r))).collect();
        for i in (1..list.len()).rev() {
            list.swap(i, (random.uniform() * (i + 1) as f64) as usize);
        }
        let mut merger = Merger::new();
        for (index, range) in list {
            let tile = Some(Tile { index, count: tiles });
            let samples = Some(SPP * range / ranges..SPP * (range + 1) / ranges);
            let part_job = PartJob { tile, samples, ..whole_job.clone() };
            let (part, _) = renderer.render_part(&part_job, None, &Control::new(), None).unwrap();
            let bytes = part.to_bytes().unwrap();
            merger.add(&format!("{index}/{range}"), Part::from_bytes("part", &bytes).unwrap()).unwrap();
        }
        assert!(contents(merger.finish().unwrap()) == expected, "{tiles} tiles of {ranges} ranges");
    }
}

/// The comparison of the test above would notice one lost sample.
#[test]
fn another_seed_is_another_picture() {
    let scene = scenes::cornell();
    let about = Description::new("cornell", &[], &scene);
    let mut renderer = renderer(&scene);
    let mut of_seed = |seed| {
        let job = Job { seed, ..picture(&scene) };
        contents(
            renderer.render_part(&PartJob::whole(&job, 2, &about), None, &Control::new(), None).unwrap().0,
        )
    };
    let [mut a, mut b] = [of_seed(3), of_seed(4)];
    assert_ne!(a.metadata.remove("seed"), b.metadata.remove("seed"));
    assert!(a.metadata != b.metadata, "the noise is the same to the last digit");
    assert!(a.channels != b.channels);
}

#[test]
fn cancelled_renders_go_on_where_they_were() {
    let scene = scenes::cornell();
    let (job, about) = (picture(&scene), Description::new("cornell", &[], &scene));
    // Enough samples that several passes are needed.
    let part_job = PartJob::whole(&job, 300, &about);
    let mut renderer = renderer(&scene);
    let whole = renderer.render_part(&part_job, None, &Control::new(), None).unwrap().0;
    let mut so_far: Option<Part> = None;
    let mut sittings = 0;
    loop {
        let control = Control::new();
        let finished = AtomicBool::new(false);
        let (part, summary) = std::thread::scope(|scope| {
            scope.spawn(|| {
                // Somewhere in the middle of a pass.
                while !finished.load(Ordering::Relaxed) {
                    if control.progress().samples_done > 100_003 {
                        control.cancel();
                    }
                    std::thread::yield_now();
                }
            });
            let so_far = so_far.take().map(|p| ("before", p));
            let result = renderer.render_part(&part_job, so_far, &control, None).unwrap();
            finished.store(true, Ordering::Relaxed);
            result
        });
        sittings += 1;
        if !summary.cancelled && part.missing().is_empty() {
            assert!(contents(part) == contents(whole), "in {sittings} sittings");
            break;
        }
        assert!(!part.covered().is_empty(), "nothing was kept");
        so_far = Some(Part::from_bytes("saved", &part.to_bytes().unwrap()).unwrap());
    }
    assert!(sittings > 1, "nothing was interrupted");
}

#[test]
fn checkpoints_are_written_and_gone_on_from() {
    let scene = scenes::cornell();
    let (job, about) = (picture(&scene), Description::new("cornell", &[], &scene));
    let part_job = PartJob::whole(&job, SPP, &about);
    let mut renderer = renderer(&scene);
    let whole = renderer.render_part(&part_job, None, &Control::new(), None).unwrap().0;

    let folder = tempfile::tempdir().unwrap();
    let mut checkpoint = Checkpoint::new(folder.path().join("c.exr"), Duration::ZERO);
    assert!(checkpoint.load().unwrap().is_none());
    let half = PartJob { samples: Some(3..12), ..part_job.clone() };
    renderer.render_part(&half, None, &Control::new(), Some(&mut checkpoint)).unwrap();
    let saved = checkpoint.load().unwrap().expect("written at the end");
    assert_eq!(saved.covered().to_text(), "0,0,43,29,3..12");

    // Of another scene, nothing can be gone on from.
    let other = Job { seed: 77, ..job.clone() };
    let foreign = PartJob { job: &other, ..part_job.clone() };
    let error = renderer.render_part(&foreign, Some(("c.exr", saved.clone())), &Control::new(), None);
    let Err(RenderPartError::Part(error @ PartError::Foreign { .. })) = error else { panic!("not refused") };
    assert!(error.to_string().contains("c.exr") && error.to_string().contains("seed is `77`"), "{error}");

    let so_far = Some(("c.exr", saved));
    let (all, summary) =
        renderer.render_part(&part_job, so_far, &Control::new(), Some(&mut checkpoint)).unwrap();
    assert_eq!(summary.samples, 43 * 29 * (u64::from(SPP) - 9), "only what was missing is rendered");
    assert!(contents(all) == contents(whole.clone()));
    assert!(contents(checkpoint.load().unwrap().unwrap()) == contents(whole));
}

#[test]
fn parts_that_cannot_be_are_refused() {
    let scene = scenes::cornell();
    let (job, about) = (picture(&scene), Description::new("cornell", &[], &scene));
    let whole = PartJob::whole(&job, SPP, &about);
    let refused = |part_job: PartJob| part_job.share().unwrap_err().to_string();
    let tile = Some(Tile { index: 0, count: 5000 });
    assert!(
        refused(PartJob { tile, ..whole.clone() }).contains("43×29 pixels cannot be cut into 5000 tiles")
    );
    let samples = Some(20..22);
    assert!(
        refused(PartJob { samples, ..whole.clone() }).contains("20..22 are not among the picture's 0..21")
    );
    assert!(refused(PartJob { samples: Some(3..3), ..whole }).contains("3..3"));
}

#[test]
fn parts_of_a_gpu_merge_to_the_same_picture_up_to_rounding() {
    let scene = scenes::cornell();
    let (job, about) = (picture(&scene), Description::new("cornell", &[], &scene));
    let whole_job = PartJob::whole(&job, 8, &about);
    let name = "parts_of_a_gpu_merge_to_the_same_picture_up_to_rounding";
    for renderer in &mut *common::gpu_renderers(name) {
        renderer.load(&scene).unwrap();
        let mut render =
            |part_job: &PartJob| renderer.render_part(part_job, None, &Control::new(), None).unwrap().0;
        let whole = render(&whole_job);
        let mut parts = Vec::new();
        for (index, samples) in [(0, 0..3), (1, 0..8), (0, 3..8)] {
            let tile = Some(Tile { index, count: 2 });
            let part = render(&PartJob { tile, samples: Some(samples), ..whole_job.clone() });
            parts.push(Part::from_bytes("part", &part.to_bytes().unwrap()).unwrap());
        }
        let merged = |order: [usize; 3]| {
            let mut merger = Merger::new();
            order.into_iter().for_each(|i| merger.add("part", parts[i].clone()).unwrap());
            merger.finish().unwrap()
        };
        let [sum, again] = [merged([0, 1, 2]), merged([2, 1, 0])];
        assert!(sum == again, "the order of merging shows");
        assert!(sum.missing().is_empty() && sum.film().total_samples() == whole.film().total_samples());
        let layers = |part: &Part| [Aov::Depth, Aov::MaterialId].map(|aov| part.film().aov(aov));
        assert!(layers(&sum) == layers(&whole));
        let [a, b] = [&sum, &whole].map(|part| part.film().to_image());
        for (a, b) in a.data().iter().zip(b.data()) {
            assert!((a - b).abs() <= 1e-5 * b.abs() + 1e-6, "{a} in parts, {b} whole");
        }
    }
}
