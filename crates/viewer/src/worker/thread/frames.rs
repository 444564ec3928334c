//! Frames of the real-time path tracer: each builds on those before, wherever the camera goes.
//!
//! Other pictures begin anew when anything changes. Frames do not: the back end keeps what they have found, and finds it again
//! from where the camera is now. So nothing is restarted, samples are numbered on from frame to frame, and a picture that was
//! given up has whole frames all the same. What ends the past is another size.

use super::State;
use super::passes::{Made, pixels_of, scaled};
use crate::worker::{Wish, lock};
use alhazen::{BackendError, Control, Integrator, Job};
use std::time::Instant;

/// Where the numbers of frames begin anew: far from where sample indices end, and weeks away.
const LAST_FRAME: u32 = u32::MAX / 2;

/// The frames that the back end knows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Frames {
    /// Width and height that they have, in pixels.
    size: [u32; 2],
    /// The number of the next one, which is its sample's index.
    next: u32,
}

impl Frames {
    /// The number of the next frame of this size.
    fn next(&mut self, size: [u32; 2]) -> u32 {
        if self.size != size || self.next > LAST_FRAME {
            *self = Self { size, next: 0 };
        }
        self.next
    }
}

impl State {
    /// Whether a picture is made of frames that build on each other.
    pub(super) fn makes_frames(&self, job: &Job) -> bool {
        matches!(self.possible(job).integrator, Integrator::Realtime(_))
    }

    /// What the back end can make of a picture: on the CPU and of scenes with media there are no frames, but what they come near.
    pub(super) fn possible(&self, job: &Job) -> Job {
        let has_frames = || {
            let knows_all = !self.renderer.tables().is_some_and(|t| t.needs_volumes());
            knows_all && self.renderer.backend_name() != "cpu"
        };
        match job.integrator {
            Integrator::Realtime(settings) if !has_frames() => {
                Job { integrator: Integrator::Path(settings.path), ..job.clone() }
            }
            _ => job.clone(),
        }
    }

    /// Begins the picture anew, and frames without a past.
    pub(super) fn restart(&mut self) {
        self.renderer.restart();
        self.frames = Frames::default();
    }

    /// Renders frames of a picture and shows the last one: one while the camera moves, else more and more.
    pub(super) fn render_frames(
        &mut self,
        wish: &Wish,
        whole: &Job,
        control: &Control,
    ) -> Result<(), BackendError> {
        let start = Instant::now();
        let (side, compares) = (self.side, wish.other.is_some());
        let pixels = pixels_of(whole);
        let done = self.pictures[side].spp;
        let hurries = wish.moving || (!self.pictures[side].visible && self.pace.needs_preview(pixels));
        let scale = if hurries { self.pace.moving_scale(pixels) } else { 1.0 };
        let preview = scale < 1.0;
        let job = if preview { scaled(whole, scale) } else { whole.clone() };
        let count = match (hurries, compares) {
            (true, _) => 1,
            (false, false) => self.pace.samples(pixels, done).min(wish.spp.saturating_sub(done).max(1)),
            // The back end has one past, and it is the other picture's: each turn makes all frames, twice as many as the last.
            (false, true) => done.saturating_mul(2).clamp(1, wish.spp),
        };
        if compares {
            self.restart();
        }
        let mut view = job.view(0.0);
        let size = job.crop.map_or([job.width, job.height], |crop| [crop.width, crop.height]);
        view.first_sample = self.frames.next(size);
        // A frame is short, and the next one needs it.
        lock(&self.shared.running).finish = hurries;
        let stats = self.renderer.render_pass(&view, count, control)?;
        let frames = stats.samples / pixels_of(&job).max(1);
        let frames = u32::try_from(frames).unwrap_or(count).min(count);
        self.frames.next += frames;
        if !compares && !preview {
            self.pictures[side].spp += frames;
        }
        if stats.cancelled {
            return Ok(());
        }
        if compares {
            self.pictures[side].spp = if preview { 0 } else { frames };
            self.keep_film(side, true)?;
        }
        let pixels = pixels_of(&job) as u32;
        self.finish_pass(wish, whole, Made { stats, preview, hurried: hurries, start, pixels })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_on_until_they_have_another_size() {
        let mut frames = Frames::default();
        for expected in 0..3 {
            assert_eq!(frames.next([4, 3]), expected);
            frames.next += 1;
        }
        assert_eq!(frames.next([3, 4]), 0);
        frames.next = LAST_FRAME + 1;
        assert_eq!(frames.next([3, 4]), 0);
    }
}
