//! One pass of a picture, and whether it is good enough.

use super::{Rendered, State};
use crate::worker::{Event, PassReport, Wish, lock};
use alhazen::{BackendError, Control, Film, Job, PassStats, Rect};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Samples per pixel below which an error estimate is none.
pub(super) const LEAST_TO_TELL: u32 = 16;

impl State {
    /// Renders one pass and shows it.
    pub(super) fn pass(&mut self, wish: &Wish, control: &Control) -> Result<(), BackendError> {
        self.side = self.next_side(wish);
        let whole = wish.other.as_ref().filter(|_| self.side == 1).unwrap_or(&wish.job);
        if self.makes_frames(whole) {
            self.render_frames(wish, whole, control)
        } else {
            self.render_samples(wish, whole, control)
        }
    }

    /// Adds samples to a picture, all of which count alike.
    fn render_samples(&mut self, wish: &Wish, whole: &Job, control: &Control) -> Result<(), BackendError> {
        let start = Instant::now();
        let (side, compares) = (self.side, wish.other.is_some());
        let pixels = pixels_of(whole);
        let picture = &self.pictures[side];
        let preview = wish.moving || (!picture.visible && self.pace.needs_preview(pixels));
        let job = self.possible(whole);
        let job = if preview { scaled(&job, self.pace.moving_scale(pixels)) } else { job };
        let picture = &self.pictures[side];
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
            self.restart();
        }
        lock(&self.shared.running).finish = preview;
        let stats = match adaptive {
            Some(adaptive) => self.renderer.render_round(&view, &adaptive, samples, control)?,
            None => Some(self.renderer.render_pass(&view, samples, control)?),
        };
        let Some(stats) = stats else {
            self.pictures[side].done = true;
            return self.show(side);
        };
        let picture = &mut self.pictures[side];
        if stats.cancelled {
            // Some pixels have more samples than others.
            if !compares {
                picture.spp = 0;
            }
            return Ok(());
        }
        if !preview {
            picture.spp += samples;
        }
        if compares {
            self.keep_film(side, preview || view.first_sample == 0)?;
        }
        let pixels = pixels_of(&job) as u32;
        self.finish_pass(wish, whole, Made { stats, preview, hurried: preview, start, pixels })
    }

    /// Notes what a pass has made of a picture, and shows it.
    pub(super) fn finish_pass(&mut self, wish: &Wish, whole: &Job, made: Made) -> Result<(), BackendError> {
        let Made { stats, preview, hurried, start, pixels } = made;
        let (side, render) = (self.side, start.elapsed());
        for notice in self.renderer.take_notices() {
            self.tell(Event::Notice(notice));
        }
        let picture = &mut self.pictures[side];
        (picture.begun, picture.visible) = (true, true);
        picture.done = !preview && picture.spp >= wish.spp;
        match &mut picture.clean {
            // Of another size.
            clean if picture.rendered.as_ref().is_some_and(|r| r.preview != preview) => *clean = None,
            Some(clean) => clean.is_current = false,
            None => {}
        }
        picture.total += render;
        picture.rendered = Some(Rendered { job: Arc::new(whole.clone()), preview, changes: self.changes });
        picture.pixels = pixels;
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
        // Of frames that build on each other the film cannot tell the noise.
        if !self.makes_frames(whole) {
            self.look_at_noise(wish, side)?;
        }
        self.show(side)?;
        if !self.shown.layer.is_geometric() {
            self.pace.record(hurried, stats.samples, start.elapsed());
        }
        Ok(())
    }

    /// Adds a pass to the film of a picture that takes turns with another; `first`: there was none before.
    pub(super) fn keep_film(&mut self, side: usize, first: bool) -> Result<(), BackendError> {
        let Some(made) = self.renderer.film()? else { return Ok(()) };
        match &mut self.pictures[side].film {
            Some(film) if !first => film.merge(made)?,
            film => *film = Some(made.clone()),
        }
        Ok(())
    }

    /// Finds out whether a picture is good enough.
    fn look_at_noise(&mut self, wish: &Wish, side: usize) -> Result<(), BackendError> {
        // Nobody reads it while the camera moves.
        if wish.moving && wish.noise.is_none() {
            return Ok(());
        }
        let noise = match &self.pictures[side].film {
            Some(film) => film.relative_error(),
            None => self.renderer.film()?.and_then(Film::relative_error),
        };
        let picture = &mut self.pictures[side];
        picture.last_pass.noise = noise;
        // An error estimate of a few samples is not one.
        let is_estimate = picture.spp >= LEAST_TO_TELL;
        picture.done |= is_estimate && noise.zip(wish.noise).is_some_and(|(noise, limit)| noise <= limit);
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

/// What a pass has made.
pub(super) struct Made {
    pub stats: PassStats,
    /// At reduced size.
    pub preview: bool,
    /// While the camera moves, or before anything is seen.
    pub hurried: bool,
    /// When it began.
    pub start: Instant,
    /// How many pixels it has.
    pub pixels: u32,
}

/// The same picture with fewer pixels.
pub(super) fn scaled(job: &Job, scale: f32) -> Job {
    let side = |n: u32| ((n as f32 * scale).round() as u32).max(1);
    let (width, height) = (side(job.width), side(job.height));
    let crop = job.crop.map(|crop| {
        let span = |low: u32, length: u32, size: u32| {
            let edge = |v: u32| (v as f32 * scale).round() as u32;
            let first = edge(low).min(size - 1);
            (first, edge(low + length).clamp(first + 1, size) - first)
        };
        let (x, across) = span(crop.x, crop.width, width);
        let (y, down) = span(crop.y, crop.height, height);
        Rect { x, y, width: across, height: down }
    });
    Job { width, height, crop, ..job.clone() }
}

/// How many pixels of a picture are rendered.
pub(super) fn pixels_of(job: &Job) -> u64 {
    job.crop.map_or(u64::from(job.width) * u64::from(job.height), |crop| crop.area() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smaller_pictures_have_the_same_part() {
        let crop = Some(Rect { x: 100, y: 50, width: 200, height: 3 });
        let whole = Job { width: 400, height: 200, crop, ..Job::for_scene(&alhazen::Scene::default()) };
        let small = scaled(&whole, 0.25);
        assert_eq!((small.width, small.height), (100, 50));
        assert_eq!(small.crop, Some(Rect { x: 25, y: 13, width: 50, height: 1 }));
        assert_eq!((pixels_of(&whole), pixels_of(&small)), (600, 50));
        let whole = Job { crop: None, ..whole };
        assert_eq!((scaled(&whole, 0.25).crop, pixels_of(&whole)), (None, 80_000));
    }
}
