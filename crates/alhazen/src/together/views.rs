//! Batches of views: each device makes its share of them.

use super::Together;
use super::member::add;
use backend::{BackendError, Control, Stats, ViewBatch, ViewPictures, ViewValues};
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;
use web_time::Instant;

/// The views of a batch in equal parts, as many as there are members.
fn parts(count: usize, members: usize) -> Vec<Range<usize>> {
    let begin = |i: usize| count * i / members.max(1);
    (0..members).map(|i| begin(i)..begin(i + 1)).collect()
}

fn part(batch: &ViewBatch, views: &Range<usize>) -> ViewBatch {
    let of = |cameras: &[_]| cameras.get(views.clone()).map(<[_]>::to_vec).unwrap_or_default();
    ViewBatch {
        view: batch.view.clone(),
        cameras: of(&batch.cameras),
        next: of(&batch.next),
        layers: batch.layers.clone(),
        samples: batch.samples,
    }
}

/// Makes views by all GPUs, or, if there is none, by the processor; a lost device's are made by the others.
pub(super) fn render(
    all: &mut Together,
    batch: &ViewBatch,
    control: &Control,
) -> Result<(ViewPictures, Stats), BackendError> {
    let start = Instant::now();
    loop {
        control.begin(batch.all_samples());
        let has_devices = all.members.iter().any(|m| !m.is_processor());
        // What a processor adds to a GPU is less than what it takes to wait for it.
        let workers: Vec<usize> =
            (0..all.members.len()).filter(|&i| !(has_devices && all.members[i].is_processor())).collect();
        if workers.is_empty() {
            return Err(BackendError::NoScene { backend: "all" });
        }
        let batches: Vec<ViewBatch> =
            parts(batch.cameras.len(), workers.len()).iter().map(|views| part(batch, views)).collect();
        let results = render_parts(all, &workers, &batches, control);
        let (mut pictures, mut sum, mut lost) = (ViewPictures::default(), Stats::default(), Vec::new());
        for (&number, result) in workers.iter().zip(results) {
            match result {
                Ok((made, stats)) => {
                    add(&mut sum, &stats);
                    append(&mut pictures, made);
                }
                Err(error @ BackendError::Device { .. }) => lost.push((number, error)),
                Err(error) => return Err(error),
            }
        }
        if lost.is_empty() {
            (sum.cancelled, sum.elapsed) = (control.is_cancelled(), start.elapsed());
            return Ok((pictures, sum));
        }
        all.drop_lost(lost)?;
    }
}

type Made = Result<(ViewPictures, Stats), BackendError>;

fn render_parts(
    all: &mut Together,
    workers: &[usize],
    batches: &[ViewBatch],
    control: &Control,
) -> Vec<Made> {
    let controls: Vec<Arc<Control>> = workers.iter().map(|_| Arc::default()).collect();
    let members = all.members.iter_mut().enumerate().filter(|(i, _)| workers.contains(i));
    std::thread::scope(|scope| {
        let threads: Vec<_> = members
            .zip(batches)
            .zip(&controls)
            .map(|(((_, member), batch), control)| {
                scope.spawn(move || member.backend.render_views(batch, control))
            })
            .collect();
        while !threads.iter().all(std::thread::ScopedJoinHandle::is_finished) {
            std::thread::park_timeout(Duration::from_millis(1));
            if control.is_cancelled() {
                controls.iter().for_each(|c| c.cancel());
            }
            let done: u64 = controls.iter().map(|c| c.progress().samples_done).sum();
            control.advance(done.saturating_sub(control.progress().samples_done));
        }
        let done: u64 = controls.iter().map(|c| c.progress().samples_done).sum();
        control.advance(done.saturating_sub(control.progress().samples_done));
        threads.into_iter().map(|t| t.join().unwrap_or_else(|p| std::panic::resume_unwind(p))).collect()
    })
}

/// Puts views behind others of the same layers.
fn append(pictures: &mut ViewPictures, mut more: ViewPictures) {
    pictures.invalid_samples += more.invalid_samples;
    if pictures.layers.is_empty() {
        pictures.layers = std::mem::take(&mut more.layers);
        return;
    }
    for ((_, values), (_, added)) in pictures.layers.iter_mut().zip(more.layers) {
        match (values, added) {
            (ViewValues::Float(values), ViewValues::Float(added)) => values.extend(added),
            (ViewValues::Id(values), ViewValues::Id(added)) => values.extend(added),
            // Both are of the same layer.
            _ => {}
        }
    }
}
