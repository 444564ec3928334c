//! A picture that grows in slices of time: a page has one thread, which must not be away for long.

use alhazen::{BackendError, Control, Image, Job, Renderer, View};
use serde::Serialize;
use web_time::{Duration, Instant};

/// How long the first picture after a motion may take, seconds.
const COARSE_SECONDS: f64 = 0.06;
/// How long a slice may take, seconds.
const SLICE_SECONDS: f64 = 0.02;
/// Samples a second, before any were made.
const FIRST_SPEED: f64 = 3.0e5;
/// Pixels along a side of the picture that one coarse pixel stands for, at most.
const COARSEST: u32 = 16;

/// How far a picture is.
#[derive(Clone, Debug, Serialize)]
pub struct Progressive {
    /// Samples that every pixel has.
    pub spp: u32,
    /// Rows that have one more.
    pub rows: u32,
    /// Pixels along a side of the picture that a pixel stands for: more than 1 after a motion.
    pub coarseness: u32,
    /// Samples a second, lately.
    pub speed: f64,
    #[serde(skip)]
    view: View,
    #[serde(skip)]
    full: View,
    /// What is shown where the view has no samples yet.
    #[serde(skip)]
    below: Option<Image>,
}

impl Progressive {
    /// A picture that begins.
    pub fn new(job: &Job) -> Self {
        let view = job.view(0.0);
        let mut new = Self {
            spp: 0,
            rows: 0,
            coarseness: 1,
            speed: FIRST_SPEED,
            full: view.clone(),
            view,
            below: None,
        };
        new.move_to(job);
        new
    }

    /// Begins anew, in full size.
    pub fn restart(&mut self, job: &Job) {
        self.full = job.view(0.0);
        self.view = self.full.clone();
        (self.spp, self.rows, self.coarseness) = (0, 0, 1);
        self.below = None;
    }

    /// Begins anew with a picture so coarse that it is there at once.
    pub fn move_to(&mut self, job: &Job) {
        self.restart(job);
        let pixels = |coarseness: u32| f64::from(job.width / coarseness) * f64::from(job.height / coarseness);
        let shortest = job.width.min(job.height);
        while pixels(self.coarseness) > self.speed * COARSE_SECONDS
            && self.coarseness < COARSEST
            && shortest / (2 * self.coarseness) > 0
        {
            self.coarseness *= 2;
        }
        let [width, height] = [job.width, job.height].map(|side| (side / self.coarseness).max(1));
        self.view = Job { width, height, ..job.clone() }.view(0.0);
    }

    /// Adds samples for about `time`, up to `spp` a pixel. Ends early when a coarse picture is whole, so that it can be
    /// shown.
    ///
    /// # Errors
    /// Of rendering.
    pub fn render(&mut self, renderer: &mut Renderer, spp: u32, time: Duration) -> Result<(), BackendError> {
        let start = Instant::now();
        while !self.is_done(spp) {
            let begun = Instant::now();
            let affordable = self.speed * SLICE_SECONDS / f64::from(self.view.width);
            let rows = self.rows..self.rows.saturating_add((affordable as u32).max(1)).min(self.view.height);
            let stats = renderer.render_rows(&self.view, rows.clone(), self.spp, &Control::new())?;
            let speed = stats.samples as f64 / begun.elapsed().as_secs_f64().max(1e-4);
            self.speed = (0.8 * self.speed + 0.2 * speed).max(1.0);
            self.rows = rows.end;
            if self.rows == self.view.height {
                (self.rows, self.spp) = (0, self.spp + 1);
                if self.coarseness > 1 {
                    return self.refine(renderer);
                }
                self.below = None;
            }
            if start.elapsed() >= time {
                break;
            }
        }
        Ok(())
    }

    /// Whether every pixel of the whole picture has so many samples.
    pub fn is_done(&self, spp: u32) -> bool {
        self.coarseness == 1 && self.spp >= spp
    }

    /// Goes on in full size over what is there.
    fn refine(&mut self, renderer: &mut Renderer) -> Result<(), BackendError> {
        self.below = renderer.film()?.map(alhazen::Film::to_image);
        self.view = self.full.clone();
        (self.spp, self.rows, self.coarseness) = (0, 0, 1);
        Ok(())
    }

    /// What is shown where there are no samples yet: a picture of the same view, of another size.
    pub(crate) fn below(&self) -> Option<&Image> {
        self.below.as_ref()
    }
}
