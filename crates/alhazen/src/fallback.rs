//! A back end that goes on with another one when its device fails.

use crate::causes::full_text;
use crate::choice::open_step;
use backend::{
    AdaptiveRounds, Backend, BackendError, Control, LoadStats, PassTime, PixelSamples, Stats, View,
    ViewBatch, ViewPictures,
};
use film::{Film, Image};
use gpu::tracer::TracerKind;
use gpu::{GpuOptions, PathKernel};
use post::NetworkInput;
use scene::tables::{Changes, SceneTables};
use std::sync::Arc;
use std::time::Duration;

/// What to try when a back end has failed.
#[derive(Clone, Debug)]
pub enum Step {
    /// The CPU with a number of threads.
    Cpu(Option<usize>),
    /// A GPU.
    Gpu(TracerKind, GpuOptions, PathKernel),
}

/// Renders with one back end until its device fails, and then with the next.
///
/// The scene is loaded again, and whole samples that the failed one had moved to its film are kept.
pub struct Fallback {
    current: Box<dyn Backend>,
    /// What is left to try, the last first.
    steps: Vec<Step>,
    tables: Option<Arc<SceneTables>>,
    /// What failed back ends have rendered of the current picture, and its view.
    rescued: Option<(View, Film)>,
    /// `rescued` and the current back end's film together.
    merged: Option<Film>,
    /// Samples of every pixel that the current back end has made of the current picture, and its view.
    made: Option<(View, u32)>,
    notices: Vec<String>,
}

impl Fallback {
    /// Begins with `first`; `steps` are tried from the last to the first.
    pub fn new(first: Box<dyn Backend>, steps: Vec<Step>) -> Self {
        Self {
            current: first,
            steps,
            tables: None,
            rescued: None,
            merged: None,
            made: None,
            notices: Vec::new(),
        }
    }

    /// Replaces the current back end after `error`, or returns it when there is nothing left to try.
    fn step(&mut self, error: BackendError) -> Result<LoadStats, BackendError> {
        let mut error = error;
        while matches!(error, BackendError::Device { .. }) {
            let Some(step) = self.steps.pop() else { break };
            let failed = self.current.name();
            let why = full_text(&error);
            match self.take_over(&step) {
                Ok(stats) => {
                    let taken = self.current.name();
                    self.notices.push(format!("{why}; going on with {taken} instead of {failed}"));
                    return Ok(stats);
                }
                Err(next) => {
                    self.notices.push(why);
                    error = next;
                }
            }
        }
        Err(error)
    }

    fn take_over(&mut self, step: &Step) -> Result<LoadStats, BackendError> {
        let mut next = open_step(step)?;
        let stats = match &self.tables {
            Some(tables) => next.load(tables.clone())?,
            None => LoadStats::default(),
        };
        self.current = next;
        Ok(stats)
    }

    /// Keeps what the current back end has rendered of `view`; returns how many samples every pixel has.
    fn rescue(&mut self, view: &View) -> Result<u32, BackendError> {
        // A device that failed may fail to hand over its film as well; what it moved before is lost then, too.
        let Ok(Some(film)) = self.current.film() else { return Ok(0) };
        let whole = film.pixels().iter().map(|p| p.count() + p.invalid()).min().unwrap_or(0);
        let most = film.pixels().iter().map(|p| p.count() + p.invalid()).max().unwrap_or(0);
        // Samples of a part of the pixels cannot be told from those that would be made again.
        if whole == 0 || whole != most {
            return Ok(0);
        }
        let film = film.clone();
        match &mut self.rescued {
            Some((of, rescued)) if is_same(of, view) => rescued.merge(&film)?,
            other => *other = Some((view.clone(), film)),
        }
        Ok(u32::try_from(whole).unwrap_or(u32::MAX))
    }

    /// Keeps what the current back end has rendered of `view`, whose pixels have different numbers of samples. Takes what is
    /// there from `left`, which is to be rendered, and adds what was lost; returns how many samples of `left` are done.
    fn rescue_pixels(&mut self, view: &View, left: &mut Vec<PixelSamples>) -> Result<u64, BackendError> {
        if let Ok(Some(film)) = self.current.film() {
            let film = film.clone();
            match &mut self.rescued {
                Some((of, rescued)) if is_same(of, view) => rescued.merge(&film)?,
                other => *other = Some((view.clone(), film)),
            }
        }
        let rescued = self.rescued.as_ref().filter(|(of, _)| is_same(of, view));
        let mut done = 0;
        for pixel in left.iter_mut() {
            let known = rescued.map_or(0, |(_, film)| film.pixels()[pixel.pixel as usize].taken());
            // The samples of a pixel are made in their order, so those that there are are the first ones.
            let next = view.first_sample.saturating_add(u32::try_from(known).unwrap_or(u32::MAX));
            let end = pixel.first + pixel.count;
            done += u64::from(next.clamp(pixel.first, end) - pixel.first);
            pixel.first = next.min(end);
            pixel.count = end - pixel.first;
        }
        left.retain(|p| p.count > 0);
        Ok(done)
    }
}

fn sum(a: Option<Duration>, b: Option<Duration>) -> Option<Duration> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a + b),
        (a, b) => a.or(b),
    }
}

/// Whether two views add samples to the same film.
fn is_same(a: &View, b: &View) -> bool {
    View { first_sample: b.first_sample, ..a.clone() } == *b
}

impl Backend for Fallback {
    fn name(&self) -> &'static str {
        self.current.name()
    }

    fn describe(&self) -> String {
        self.current.describe()
    }

    fn load(&mut self, scene: Arc<SceneTables>) -> Result<LoadStats, BackendError> {
        (self.rescued, self.merged, self.made) = (None, None, None);
        self.tables = Some(scene.clone());
        self.current.load(scene).or_else(|error| self.step(error))
    }

    fn update(&mut self, scene: Arc<SceneTables>, changes: Changes) -> Result<LoadStats, BackendError> {
        (self.rescued, self.merged, self.made) = (None, None, None);
        self.tables = Some(scene.clone());
        self.current.update(scene, changes).or_else(|error| self.step(error))
    }

    fn render(&mut self, view: &View, samples: u32, control: &Control) -> Result<Stats, BackendError> {
        if self.rescued.as_ref().is_some_and(|(of, _)| !is_same(of, view)) {
            self.rescued = None;
        }
        if self.made.as_ref().is_some_and(|(of, _)| !is_same(of, view)) {
            self.made = None;
        }
        let mut total = Stats::default();
        let (mut view, mut left) = (view.clone(), samples);
        loop {
            let known = self.made.as_ref().map_or(0, |(_, samples)| *samples);
            match self.current.render(&view, left, control) {
                Ok(stats) => {
                    self.made = Some((view, known + if stats.cancelled { 0 } else { left }));
                    total.samples += stats.samples;
                    total.rays += stats.rays;
                    total.elapsed += stats.elapsed;
                    total.cancelled = stats.cancelled;
                    total.device_time = sum(total.device_time, stats.device_time);
                    return Ok(total);
                }
                Err(error @ BackendError::Device { .. }) => {
                    let kept = self.rescue(&view)?;
                    self.step(error)?;
                    self.made = None;
                    // Of this call some samples may be done; of those before it some may have to be made again.
                    let (done, lost) = (kept.saturating_sub(known).min(left), known.saturating_sub(kept));
                    total.samples += u64::from(done) * view.window.area() as u64;
                    view.first_sample = (view.first_sample + done).saturating_sub(lost);
                    left = left - done + lost;
                    if left == 0 {
                        return Ok(total);
                    }
                }
                Err(error) => return Err(error),
            }
        }
    }

    fn render_pixels(
        &mut self,
        view: &View,
        pixels: &[PixelSamples],
        control: &Control,
    ) -> Result<Stats, BackendError> {
        let mut total = Stats::default();
        let mut left = pixels.to_vec();
        loop {
            match self.current.render_pixels(view, &left, control) {
                Ok(stats) => {
                    total.samples += stats.samples;
                    total.rays += stats.rays;
                    total.elapsed += stats.elapsed;
                    total.cancelled = stats.cancelled;
                    total.device_time = sum(total.device_time, stats.device_time);
                    return Ok(total);
                }
                Err(error @ BackendError::Device { .. }) => {
                    total.samples += self.rescue_pixels(view, &mut left)?;
                    self.step(error)?;
                    self.made = None;
                }
                Err(error) => return Err(error),
            }
        }
    }

    fn render_rounds(
        &mut self,
        view: &View,
        rounds: &AdaptiveRounds,
        control: &Control,
    ) -> Result<Option<Stats>, BackendError> {
        // A device does not know what others have made of the picture.
        if self.rescued.as_ref().is_some_and(|(of, _)| is_same(of, view)) {
            return Ok(None);
        }
        match self.current.render_rounds(view, rounds, control) {
            Err(error @ BackendError::Device { .. }) => {
                self.rescue_pixels(view, &mut Vec::new())?;
                self.step(error)?;
                self.made = None;
                Ok(None)
            }
            result => result,
        }
    }

    fn render_views(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
    ) -> Result<(ViewPictures, Stats), BackendError> {
        loop {
            match self.current.render_views(batch, control) {
                // Of views nothing is kept: they are made again.
                Err(error @ BackendError::Device { .. }) => self.step(error)?,
                result => return result,
            };
        }
    }

    fn relative_error(&mut self) -> Result<Option<f64>, BackendError> {
        match &self.rescued {
            Some(_) => Ok(self.film()?.and_then(Film::relative_error)),
            None => self.current.relative_error(),
        }
    }

    fn restart(&mut self) {
        (self.rescued, self.merged, self.made) = (None, None, None);
        self.current.restart();
    }

    fn film(&mut self) -> Result<Option<&Film>, BackendError> {
        let Some((_, rescued)) = &self.rescued else { return self.current.film() };
        let mut merged = rescued.clone();
        if let Some(film) = self.current.film()? {
            merged.merge(film)?;
        }
        self.merged = Some(merged);
        Ok(self.merged.as_ref())
    }

    fn filter_noise(&mut self, picture: &NetworkInput<'_>) -> Option<Image> {
        self.current.filter_noise(picture)
    }

    fn take_passes(&mut self) -> Vec<PassTime> {
        self.current.take_passes()
    }

    fn kernel(&self) -> Option<&'static str> {
        self.current.kernel()
    }

    fn take_notices(&mut self) -> Vec<String> {
        let mut notices = std::mem::take(&mut self.notices);
        notices.extend(self.current.take_notices());
        notices
    }
}
