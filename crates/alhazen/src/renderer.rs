//! Rendering until a limit is reached, through whatever back end.

use crate::part::least_samples;
use crate::{Job, Sampling};
use backend::{
    AdaptiveRounds, Backend, BackendError, Control, LoadStats, PassTime, PixelSamples, Stats, View,
    ViewBatch, ViewPictures,
};
use cpu::CpuBackend;
use film::{Film, Image};
use optics::camera::CameraFrame;
use post::NetworkInput;
use scene::Scene;
use scene::tables::{Changes, SceneTables};
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;
use web_time::Instant;

/// Names of all back ends that this build has.
pub const BACKENDS: &[&str] = &["cpu", "gpu-bvh", "gpu-query", "gpu-pipeline"];

/// When a picture is done: whatever comes first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Samples per pixel; on average, where sampling is adaptive.
    pub spp: u32,
    /// Wall time of rendering. At least one sample is made.
    pub time: Option<Duration>,
    /// Relative standard error of the picture ([`Film::relative_error`]).
    pub noise: Option<f64>,
    /// How samples are spread over the picture until then.
    pub sampling: Sampling,
}

impl Default for Limits {
    fn default() -> Self {
        Self { spp: 64, time: None, noise: None, sampling: Sampling::Uniform }
    }
}

/// What rendering a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Samples per pixel made; on average, where sampling is adaptive.
    pub spp: u32,
    /// Samples of all pixels.
    pub samples: u64,
    /// Rays traced.
    pub rays: u64,
    /// Wall time of rendering.
    pub elapsed: Duration,
    /// Samples that were NaN or infinite and were dropped.
    pub invalid_samples: u64,
    /// Time that the device itself was busy, where it has a clock.
    pub device_time: Option<Duration>,
    /// Whether it was cancelled before a limit was reached.
    pub cancelled: bool,
    /// Relative standard error reached, if there are enough samples to tell.
    pub noise: Option<f64>,
}

impl Summary {
    /// Counts one more pass. Its wall time and samples per pixel are the caller's to know.
    pub(crate) fn add(&mut self, pass: &Stats) {
        self.samples += pass.samples;
        self.rays += pass.rays;
        if let Some(time) = pass.device_time {
            *self.device_time.get_or_insert_default() += time;
        }
        self.cancelled = pass.cancelled;
    }
}

/// A back end with a scene.
pub struct Renderer {
    backend: Box<dyn Backend>,
    /// What is loaded.
    tables: Option<Arc<SceneTables>>,
    /// Its fingerprint, once somebody has asked.
    fingerprint: Option<String>,
}

/// Sees how far a picture is, and the renderer, which has it.
pub type AfterPass<'a> = dyn FnMut(&mut Renderer, &Summary) + 'a;

impl Renderer {
    /// On the CPU, with `threads` threads, at most 1024; `None` uses all cores.
    ///
    /// # Errors
    /// When threads cannot be started.
    pub fn cpu(threads: Option<usize>) -> Result<Self, BackendError> {
        // Pictures do not depend on the number; what is meant by a huge one is all there is.
        const MOST: usize = 1024;
        Ok(Self::new(Box::new(CpuBackend::new(threads.map(|n| n.min(MOST)))?)))
    }

    /// On any back end.
    pub fn new(backend: Box<dyn Backend>) -> Self {
        Self { backend, tables: None, fingerprint: None }
    }

    /// Name of the back end, such as `cpu`.
    pub fn backend_name(&self) -> &'static str {
        self.backend.name()
    }

    /// What it runs on.
    pub fn describe(&self) -> String {
        self.backend.describe()
    }

    /// How the last picture was spread over the GPU's dispatches, `megakernel` or `wavefront`; `None` where there is
    /// nothing to choose.
    pub fn kernel(&self) -> Option<&'static str> {
        self.backend.kernel()
    }

    /// Flattens a scene and hands it to the back end.
    ///
    /// # Errors
    /// When the device cannot hold the scene.
    pub fn load(&mut self, scene: &Scene) -> Result<LoadStats, BackendError> {
        self.load_tables(SceneTables::build(scene))
    }

    /// Hands over tables built before, so that the caller can free the scene first.
    ///
    /// # Errors
    /// When the device cannot hold the scene.
    pub fn load_tables(&mut self, tables: SceneTables) -> Result<LoadStats, BackendError> {
        let tables = Arc::new(tables);
        (self.tables, self.fingerprint) = (None, None);
        let stats = self.backend.load(tables.clone())?;
        self.tables = Some(tables);
        Ok(stats)
    }

    /// Brings the back end to a new version of the scene that is loaded. Other materials, lights, environments and
    /// transforms of dynamic instances go there without building or moving what stays the same, and meshes that deform by
    /// [`Scene::set_time`] are refitted; any other change loads the scene anew. The picture restarts.
    ///
    /// # Errors
    /// As [`Renderer::load`].
    pub fn update(&mut self, scene: &Scene) -> Result<LoadStats, BackendError> {
        let tables = SceneTables::build(scene);
        let changes = self.tables.as_ref().and_then(|old| Changes::between(old, &tables));
        // Structures of meshes that deform are refitted. Anything else that has new vertices deserves better ones.
        let changes = changes.filter(|changes| !changes.vertices || scene.is_animated());
        let Some(changes) = changes else { return self.load_tables(tables) };
        let tables = Arc::new(tables);
        (self.tables, self.fingerprint) = (None, None);
        let stats = self.backend.update(tables.clone(), changes)?;
        self.tables = Some(tables);
        Ok(stats)
    }

    /// Renders a picture of the loaded scene at time 0.
    ///
    /// # Errors
    /// Without a scene, for impossible views, and when the device fails.
    pub fn render(&mut self, job: &Job, limits: &Limits, control: &Control) -> Result<Summary, BackendError> {
        self.render_view(&job.view(0.0), limits, control, &mut |_, _| {})
    }

    /// Renders a view; `after_pass` sees after each pass how far it is, and may look at the picture as it is then.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_view(
        &mut self,
        view: &View,
        limits: &Limits,
        control: &Control,
        after_pass: &mut AfterPass<'_>,
    ) -> Result<Summary, BackendError> {
        check_view(view)?;
        let mut summary = match &limits.sampling {
            Sampling::Uniform => self.render_evenly(view, limits, control, after_pass)?,
            Sampling::Adaptive(adaptive) => {
                self.render_adaptively(view, limits, adaptive, control, after_pass)?
            }
        };
        if let Some(film) = self.backend.film()? {
            summary.invalid_samples = film.invalid_samples();
            summary.noise = summary.noise.or_else(|| film.relative_error());
            if summary.cancelled && limits.sampling == Sampling::Uniform {
                // The pass that was cut short may have given some samples to all pixels.
                summary.spp = summary.spp.max(least_samples(film));
            }
        }
        Ok(summary)
    }

    /// Gives every pixel the same samples until a limit is reached.
    pub(crate) fn render_evenly(
        &mut self,
        view: &View,
        limits: &Limits,
        control: &Control,
        after_pass: &mut AfterPass<'_>,
    ) -> Result<Summary, BackendError> {
        let start = Instant::now();
        let mut summary = Summary::default();
        while summary.spp < limits.spp && !control.is_cancelled() {
            let samples = next_pass(&summary, limits, start.elapsed());
            let mut view = view.clone();
            view.first_sample += summary.spp;
            let stats = self.backend.render(&view, samples, control)?;
            summary.add(&stats);
            if !stats.cancelled {
                summary.spp += samples;
            }
            summary.elapsed = start.elapsed();
            if limits.noise.is_some() {
                summary.noise = self.backend.relative_error()?;
            }
            after_pass(self, &summary);
            let quiet = limits.noise.zip(summary.noise).is_some_and(|(limit, noise)| noise <= limit);
            // An error estimate of a few samples is not one.
            if limits.time.is_some_and(|t| summary.elapsed >= t) || (quiet && summary.spp >= 16) {
                break;
            }
        }
        Ok(summary)
    }

    /// A hash of the contents of the loaded scene ([`SceneTables::fingerprint`]).
    ///
    /// # Errors
    /// [`BackendError::NoScene`].
    pub fn scene_fingerprint(&mut self) -> Result<String, BackendError> {
        let tables = self.tables.as_ref().ok_or(BackendError::NoScene { backend: self.backend.name() })?;
        Ok(self.fingerprint.get_or_insert_with(|| tables.fingerprint()).clone())
    }

    /// Forgets what was rendered: the next picture begins anew, even if its view is the same.
    pub fn restart(&mut self) {
        self.backend.restart();
    }

    /// The tables of the loaded scene, to be shared with [`cpu::RayQueries`].
    pub fn tables(&self) -> Option<Arc<SceneTables>> {
        self.tables.clone()
    }

    /// Adds `samples` samples to every pixel of a view, whatever the limits. A view that differs from the last one in more
    /// than its first sample begins a new film.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_pass(
        &mut self,
        view: &View,
        samples: u32,
        control: &Control,
    ) -> Result<Stats, BackendError> {
        check_view(view)?;
        self.backend.render(view, samples, control)
    }

    /// Makes many pictures of the loaded scene in one go: what takes time before the first one is kept for the next call
    /// ([`Backend::render_views`]). The picture that [`Renderer::film`] has may be another one after it.
    ///
    /// # Errors
    /// Without a scene, for impossible views, and when the device fails.
    pub fn render_views(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
    ) -> Result<(ViewPictures, Stats), BackendError> {
        batch.check()?;
        for (number, camera) in batch.cameras.iter().chain(&batch.next).enumerate() {
            let number = number % batch.cameras.len().max(1);
            check_camera(camera)
                .map_err(|reason| BackendError::View { reason: format!("view {number}: {reason}") })?;
        }
        self.backend.render_views(batch, control)
    }

    /// Adds a sample, that of index `sample`, to each pixel of some rows of a view's window: for programs that have only one
    /// thread and must not be away for long. The picture is the same as by whole passes.
    ///
    /// - `rows`: of the window, from its upper edge; those beyond its lower edge are left out.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_rows(
        &mut self,
        view: &View,
        rows: Range<u32>,
        sample: u32,
        control: &Control,
    ) -> Result<Stats, BackendError> {
        check_view(view)?;
        let rows = rows.start..rows.end.min(view.window.height);
        let pixels = rows.start * view.window.width..rows.end * view.window.width;
        let one = |pixel| PixelSamples { pixel, first: sample, count: 1 };
        self.backend.render_pixels(view, &pixels.map(one).collect::<Vec<_>>(), control)
    }

    /// Adds samples to some pixels of a view that was checked before.
    pub(crate) fn render_some(
        &mut self,
        view: &View,
        pixels: &[PixelSamples],
        control: &Control,
    ) -> Result<Stats, BackendError> {
        self.backend.render_pixels(view, pixels, control)
    }

    /// As [`Backend::render_rounds`], of a view that was checked before.
    pub(crate) fn render_by_itself(
        &mut self,
        view: &View,
        rounds: &AdaptiveRounds,
        control: &Control,
    ) -> Result<Option<Stats>, BackendError> {
        self.backend.render_rounds(view, rounds, control)
    }

    /// See [`Film::relative_error`]; `None` before the first picture.
    pub(crate) fn relative_error(&mut self) -> Result<Option<f64>, BackendError> {
        self.backend.relative_error()
    }

    /// The learned denoiser's network on the device that renders; `None` where the CPU is to run it.
    pub(crate) fn filter_noise(&mut self, picture: &NetworkInput<'_>) -> Option<Image> {
        self.backend.filter_noise(picture)
    }

    /// What users should hear of that is no error. Each once.
    pub fn take_notices(&mut self) -> Vec<String> {
        self.backend.take_notices()
    }

    /// The device's passes since the last call of this, for profiles. Empty where it has no clock.
    pub fn take_passes(&mut self) -> Vec<PassTime> {
        self.backend.take_passes()
    }

    /// The film with everything rendered so far; `None` before the first picture.
    ///
    /// # Errors
    /// When the device fails.
    pub fn film(&mut self) -> Result<Option<&Film>, BackendError> {
        self.backend.film()
    }
}

/// How many samples to make before looking at the limits again.
fn next_pass(done: &Summary, limits: &Limits, elapsed: Duration) -> u32 {
    let left = limits.spp - done.spp;
    let mut pass = left;
    if limits.noise.is_some() {
        // Looking costs a walk over the film: every quarter of what is done is often enough.
        pass = pass.min((done.spp / 4).clamp(8, 64));
    }
    if let Some(time) = limits.time {
        let rate = f64::from(done.spp) / elapsed.as_secs_f64().max(1e-6);
        let affordable = rate * time.saturating_sub(elapsed).as_secs_f64();
        let cautious = if done.spp == 0 { 1 } else { (affordable * 0.5) as u32 };
        pass = pass.min(cautious.clamp(1, 64));
    }
    pass.max(1)
}

pub(crate) fn check_view(view: &View) -> Result<(), BackendError> {
    check_camera(&view.camera).map_err(|reason| BackendError::View { reason })
}

/// Says what is wrong with a camera.
fn check_camera(camera: &CameraFrame) -> Result<(), String> {
    let numbers = [camera.origin, camera.right, camera.up, camera.forward];
    if numbers.iter().any(|v| !v.to_array().iter().all(|x| x.is_finite())) {
        return Err("the camera's position and direction must be finite".into());
    }
    if !(camera.half_size.x > 0.0 && camera.half_size.y > 0.0 && camera.half_size.x.is_finite()) {
        let size = camera.half_size;
        return Err(format!("the camera's field of view is impossible ({size:?} at distance 1)"));
    }
    let lens = camera.distortion;
    let numbers = [lens.radial.to_array(), lens.rest.to_array(), [lens.skew, lens.limit, 0.0, 0.0]];
    if !numbers.as_flattened().iter().all(|x| x.is_finite()) {
        return Err(format!("the coefficients of the lens must be finite ({lens:?})"));
    }
    let positive = camera.lens_radius >= 0.0 && camera.focus_distance > 0.0;
    if !positive {
        return Err("lens radius and focus distance must be positive".into());
    }
    Ok(())
}
