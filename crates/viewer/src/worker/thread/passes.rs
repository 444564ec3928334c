//! One pass of a picture, and whether it is good enough.

use super::{Progress, Rendered, State};
use crate::worker::{Event, PassReport, Wish, lock};
use alhazen::{BackendError, Control, Film, Job};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Samples per pixel below which an error estimate is none.
const LEAST_TO_TELL: u32 = 16;

impl State {
    /// Renders one pass and shows it.
    pub(super) fn pass(&mut self, wish: &Wish, control: &Control) -> Result<(), BackendError> {
        let start = Instant::now();
        self.side = self.next_side(wish);
        let compares = wish.other.is_some();
        let side = self.side;
        let whole = wish.other.as_ref().filter(|_| side == 1).unwrap_or(&wish.job);
        let pixels = u64::from(whole.width) * u64::from(whole.height);
        let picture = &self.pictures[side];
        let preview = wish.moving || (!picture.visible && self.pace.needs_preview(pixels));
        let job = if preview { scaled(whole, self.pace.moving_scale(pixels)) } else { whole.clone() };
        let samples =
            if preview { 1 } else { self.pace.samples(pixels, picture.spp).min(wish.left(picture.spp)) };
        let adaptive = wish.adaptive(preview, picture.spp);
        let mut view = job.view(0.0);
        view.first_sample = if preview { 0 } else { picture.spp };
        if adaptive.is_some() {
            // Each pixel goes on from what it has.
            view.first_sample = 0;
        } else if view.first_sample == 0 || compares {
            // The film may have a picture of the same view that was given up half-way, or the other one.
            self.renderer.restart();
        }
        lock(&self.shared.running).finish = preview;
        let stats = match adaptive {
            Some(adaptive) => self.renderer.render_round(&view, &adaptive, samples, control)?,
            None => Some(self.renderer.render_pass(&view, samples, control)?),
        };
        let render = start.elapsed();
        let Some(stats) = stats else {
            self.pictures[side].done = true;
            return self.show(side);
        };
        for notice in self.renderer.take_notices() {
            self.tell(Event::Notice(notice));
        }
        let picture = &mut self.pictures[side];
        if stats.cancelled {
            // Some pixels have more samples than others.
            if !compares {
                picture.spp = 0;
            }
            return Ok(());
        }
        if compares {
            keep(picture, self.renderer.film()?, preview || view.first_sample == 0)?;
        }
        if !preview {
            picture.spp += samples;
        }
        (picture.begun, picture.visible) = (true, true);
        (picture.denoised, picture.done) = (None, !preview && picture.spp >= wish.spp);
        picture.total += render;
        picture.rendered = Some(Rendered { job: Arc::new(whole.clone()), preview, changes: self.changes });
        picture.last_pass = PassReport {
            samples: stats.samples,
            rays: stats.rays,
            render,
            noise: None,
            denoised_by: None,
            show: Duration::ZERO,
            total: picture.total,
            device: self.renderer.take_passes(),
            kernel: self.renderer.kernel(),
        };
        self.look_at_noise(wish, side)?;
        self.show(side)?;
        if !self.shown.layer.is_geometric() {
            self.pace.record(preview, stats.samples, start.elapsed());
        }
        Ok(())
    }

    /// Finds out whether a picture is good enough.
    fn look_at_noise(&mut self, wish: &Wish, side: usize) -> Result<(), BackendError> {
        let Some(limit) = wish.noise else { return Ok(()) };
        let noise = match &self.pictures[side].film {
            Some(film) => film.relative_error(),
            None => self.renderer.film()?.and_then(Film::relative_error),
        };
        let picture = &mut self.pictures[side];
        picture.last_pass.noise = noise;
        // An error estimate of a few samples is not one.
        let is_estimate = picture.spp >= LEAST_TO_TELL;
        picture.done |= is_estimate && noise.is_some_and(|noise| noise <= limit);
        Ok(())
    }

    /// Whose turn it is: pictures that are compared take turns until one is done.
    fn next_side(&self, wish: &Wish) -> usize {
        if wish.other.is_none() {
            return 0;
        }
        let done = |side: usize| {
            let picture = &self.pictures[side];
            if wish.moving { picture.begun } else { picture.done }
        };
        let next = 1 - self.side;
        if done(next) { self.side } else { next }
    }
}

/// Adds a pass to the film of a picture that takes turns with another.
fn keep(picture: &mut Progress, made: Option<&Film>, first: bool) -> Result<(), BackendError> {
    let Some(made) = made else { return Ok(()) };
    match &mut picture.film {
        Some(film) if !first => film.merge(made)?,
        film => *film = Some(made.clone()),
    }
    Ok(())
}

/// The same picture with fewer pixels.
fn scaled(job: &Job, scale: f32) -> Job {
    let side = |n: u32| ((n as f32 * scale).round() as u32).max(1);
    Job { width: side(job.width), height: side(job.height), ..job.clone() }
}
