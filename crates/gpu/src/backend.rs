//! [`GpuBackend`]: the trait's implementation; film, batches, passes.

mod kernels;
mod picture;
mod round;
pub(crate) mod tracing;
mod views;

use crate::batch::Batch;
use crate::denoise::GpuNetwork;
use crate::film::{FOLD_SAMPLES, FilmBuffers, device_error};
use crate::kernel::{KernelKind, PathKernel, Tracing};
use crate::plan::{DispatchPlan, most_samples};
use crate::portions::portions;
use crate::scene::refuse_volumes;
use crate::scene::update::StagingRing;
use crate::timing::Timer;
use crate::tracer::{Instances, TracerKind};
use crate::view::MOST_CAMERA_SEGMENTS;
use crate::views::{ExactKernel, ExactWants, Views};
use crate::wavefront::Queues;
use crate::{Gpu, GpuError, GpuScene};
use backend::{
    AdaptiveRounds, Backend, BackendError, Control, Integrator, LoadStats, PassTime, PixelSamples, Stats,
    View, ViewBatch, ViewPictures, check_media, check_pixels, check_switches,
};
use film::{AovKind, Film, Image};
use kernels::{CompiledKernel, KernelKey};
use picture::Picture;
use post::NetworkInput;
use scene::tables::{Changes, SceneTables};
use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Batches under way at a time: the device need not wait for the host to think.
const IN_FLIGHT: usize = 2;
/// How long samples may gather on the device only: that many are lost if it is.
const FOLD_INTERVAL: Duration = Duration::from_secs(2);

/// Renders on a GPU.
pub struct GpuBackend {
    gpu: Gpu,
    /// How it was asked to trace; how the loaded scene is traced is [`GpuBackend::traced_by`].
    kind: TracerKind,
    /// Of the scene that is loaded.
    instances: Instances,
    scene: Option<Loaded>,
    picture: Option<Picture>,
    /// A picture that nobody wants any more. The next one takes over its memory, if that fits.
    old_picture: Option<Picture>,
    timer: Timer,
    ring: StagingRing,
    path_kernel: PathKernel,
    /// Whether path tracing has shaders that know only what is in their scene.
    specialises: bool,
    /// Paths that the wavefront has in flight; `None`: what suits the device.
    paths_in_flight: Option<u32>,
    /// Those of the wavefront, once it is used.
    queues: Option<Queues>,
    /// How the last call of `render` was spread over dispatches.
    taken: Option<&'static str>,
    /// Buffers of batches of views.
    views: Views,
    /// The denoiser's network, once it is used.
    network: Option<GpuNetwork>,
    notices: Vec<String>,
}

/// A scene on the device, with what was compiled for it.
struct Loaded {
    scene: GpuScene,
    tracing: Box<dyn Tracing>,
    kernels: HashMap<KernelKey, CompiledKernel>,
    /// Those that make exact layers of views.
    exact: HashMap<ExactWants, Box<dyn ExactKernel>>,
}

impl GpuBackend {
    /// A back end on an open device that traces in the given way.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] when the device cannot trace so.
    pub fn new(gpu: Gpu, kind: TracerKind) -> Result<Self, GpuError> {
        kind.check(&gpu)?;
        let timer = Timer::new(&gpu)?;
        let ring = StagingRing::new(&gpu);
        let specialises = !gpu.is_software();
        let views = Views::new(&gpu);
        Ok(Self {
            gpu,
            kind,
            instances: Instances::StandStill,
            scene: None,
            picture: None,
            old_picture: None,
            timer,
            ring,
            path_kernel: PathKernel::Auto,
            specialises,
            paths_in_flight: None,
            queues: None,
            taken: None,
            views,
            network: None,
            notices: Vec::new(),
        })
    }

    /// Chooses how path tracing is spread over dispatches from now on. Samples are the same, up to rounding.
    pub fn set_path_kernel(&mut self, kernel: PathKernel) {
        self.path_kernel = kernel;
    }

    /// Says whether path tracing has shaders that know only what is in their scene. They are faster, by a twentieth to a half;
    /// but scenes that share all else no longer share shaders, so software drivers, which compile one in half a
    /// minute, have none of them at first. Samples are the same, up to rounding.
    pub fn set_specialisation(&mut self, specialises: bool) {
        self.specialises = specialises;
    }

    /// Sets how many paths the wavefront has in flight, as far as the device has room, for measurements and for who is
    /// short of memory.
    pub fn set_paths_in_flight(&mut self, paths: u32) {
        (self.paths_in_flight, self.queues) = (Some(paths), None);
        if let Some(loaded) = &mut self.scene {
            loaded.kernels.retain(|key, _| !key.wavefront);
        }
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Bytes on the device, as far as they are known.
    pub fn memory_bytes(&self) -> u64 {
        let scene = self.scene.as_ref().map_or(0, |s| s.scene.memory_bytes() + s.tracing.memory_bytes());
        scene
            + self.queues.as_ref().map_or(0, Queues::memory_bytes)
            + self.picture.as_ref().map_or(0, Picture::memory_bytes)
            + self.views.memory_bytes()
    }

    /// The picture without its noise.
    fn denoise(&mut self, picture: &NetworkInput<'_>) -> Result<Image, GpuError> {
        let network = match self.network.take() {
            Some(network) => network,
            None => GpuNetwork::new(&self.gpu)?,
        };
        let filtered = network.denoise(&self.gpu, picture, &mut self.timer)?;
        self.timer.collect(&self.gpu)?;
        self.network = Some(network);
        Ok(filtered)
    }

    fn load_scene(&mut self, tables: Arc<SceneTables>) -> Result<LoadStats, GpuError> {
        // What the last scene takes is free before the next one needs it.
        (self.picture, self.old_picture, self.scene) = (None, None, None);
        let table_bytes = tables.memory_bytes();
        let scene = GpuScene::upload(&self.gpu, tables)?;
        let start = Instant::now();
        if scene.tables.motion.is_some() && self.kind != TracerKind::Bvh {
            let name = self.kind.name();
            self.notices.push(format!(
                "{name} knows no motion while the shutter is open: the hierarchy of gpu-bvh traces this scene"
            ));
        }
        let tracing = self.traced_by(&scene.tables).build(&self.gpu, &scene, self.instances)?;
        let stats = LoadStats {
            build: start.elapsed(),
            acceleration_bytes: tracing.memory_bytes() as usize,
            table_bytes,
            device_bytes: scene.memory_bytes() + tracing.memory_bytes(),
        };
        self.scene = Some(Loaded { scene, tracing, kernels: HashMap::new(), exact: HashMap::new() });
        Ok(stats)
    }

    /// How a scene is traced: the driver's structures know no motion.
    fn traced_by(&self, tables: &SceneTables) -> TracerKind {
        if tables.motion.is_some() { TracerKind::Bvh } else { self.kind }
    }

    fn update_scene(&mut self, tables: Arc<SceneTables>, changes: Changes) -> Result<LoadStats, GpuError> {
        self.give_up_picture();
        let start = Instant::now();
        if changes.vertices || changes.transforms {
            // What has moved will move again, whatever the scene says.
            self.instances = Instances::Move;
        }
        let Some(loaded) = &mut self.scene else { return self.load_scene(tables) };
        // wgpu cannot refit its structures: what deforms is uploaded and built again.
        if changes.vertices {
            return self.load_scene(tables);
        }
        if !loaded.scene.update(&self.gpu, &mut self.ring, &tables, changes)? {
            return self.load_scene(tables);
        }
        if !loaded.tracing.update(&self.gpu, &loaded.scene, changes)? {
            loaded.kernels.clear();
            loaded.exact.clear();
            let moves = loaded.scene.tables.motion.is_some();
            let kind = if moves { TracerKind::Bvh } else { self.kind };
            loaded.tracing = kind.build(&self.gpu, &loaded.scene, self.instances)?;
        }
        loaded.kernels.values_mut().for_each(|k| k.kernel.scene_changed());
        Ok(LoadStats {
            build: start.elapsed(),
            acceleration_bytes: loaded.tracing.memory_bytes() as usize,
            table_bytes: tables.memory_bytes(),
            device_bytes: loaded.scene.memory_bytes() + loaded.tracing.memory_bytes(),
        })
    }

    /// Makes the film for a view, or keeps the one that is being accumulated.
    fn prepare_film(&mut self, view: &View) -> Result<(), BackendError> {
        if self.picture.as_ref().is_some_and(|p| p.is_of(view)) {
            return Ok(());
        }
        self.give_up_picture();
        let failed = |error| device_error(self.kind.name(), error);
        if let Some(old) = self.old_picture.take().filter(|old| old.fits(view)) {
            self.picture = Some(old.begin_anew(&self.gpu, view).map_err(failed)?);
            return Ok(());
        }
        let film = Film::with_window(view.width, view.height, view.window, &view.aovs)?;
        let buffers = FilmBuffers::new(&self.gpu, view, film.wants_aovs()).map_err(failed)?;
        self.picture = Some(Picture::new(view, film, buffers));
        Ok(())
    }

    /// Nobody wants the picture any more.
    fn give_up_picture(&mut self) {
        self.old_picture = self.picture.take().or(self.old_picture.take());
    }

    fn render_samples(
        &mut self,
        view: &View,
        samples: u32,
        control: &Control,
        stats: &mut Stats,
    ) -> Result<(), GpuError> {
        let key = self.prepare_kernel(view, samples, KernelKind::of(&view.integrator))?;
        let (Some(scene), Some(picture)) = (&mut self.scene, &mut self.picture) else { return Ok(()) };
        let (gpu, timer) = (&self.gpu, &mut self.timer);
        picture.rays = 0;
        let missing = || GpuError::Device { doing: "looking up a kernel", reason: "it is gone".into() };
        let compiled = scene.kernels.get_mut(&key).ok_or_else(missing)?;
        compiled.kernel.set_path_kernel(self.path_kernel);
        let end = view.first_sample + samples;
        let mut plan = DispatchPlan::new(view.window.width, view.window.height, view.first_sample..end);
        let most = most_samples(gpu.is_software());
        let mut under_way = VecDeque::new();
        let mut last_done = Instant::now();
        loop {
            let room = FOLD_SAMPLES.saturating_sub(picture.pending);
            let fold = plan.is_even() && (room == 0 || picture.last_fold.elapsed() > FOLD_INTERVAL);
            let batch = if control.is_cancelled() || fold {
                None
            } else if compiled.kernel.makes_whole_frames() {
                plan.next_frame()
            } else {
                plan.next(&compiled.pace, room.min(most))
            };
            if let Some(batch) = batch {
                let submission = compiled.kernel.submit(gpu, &mut picture.buffers, batch, timer)?;
                under_way.push_back((submission, batch, Instant::now()));
                if plan.is_even() {
                    picture.pending += batch.sample_count;
                }
                if under_way.len() < IN_FLIGHT {
                    continue;
                }
            }
            if let Some((submission, batch, submitted)) = under_way.pop_front() {
                gpu.wait_for(Some(submission), "rendering")?;
                let done = samples_of(&batch, view.window.width);
                compiled.pace.learn(done, submitted.max(last_done).elapsed());
                last_done = Instant::now();
                stats.samples += done;
                control.advance(done);
            } else if fold && !control.is_cancelled() {
                picture.fold(gpu)?;
                add_time(stats, timer.collect(gpu)?);
            } else {
                break;
            }
            if timer.is_nearly_full() {
                add_time(stats, timer.collect(gpu)?);
            }
        }
        add_time(stats, timer.collect(gpu)?);
        if key.kind == KernelKind::Realtime {
            self.taken = Some(compiled.kernel.taken_kernel().name());
        }
        Ok(())
    }

    /// As `render_samples`, for some pixels.
    fn render_list(
        &mut self,
        view: &View,
        pixels: &[PixelSamples],
        control: &Control,
        stats: &mut Stats,
    ) -> Result<(), GpuError> {
        let all: u64 = pixels.iter().map(|p| u64::from(p.count)).sum();
        let mean = all.div_ceil(view.window.area().max(1) as u64);
        let mut run = self.begin_portions(view, mean)?;
        run.make_room(pixels.iter().map(|p| p.count).max().unwrap_or(0))?;
        for cut in portions([view.window.width, view.window.height], pixels) {
            if control.is_cancelled() {
                break;
            }
            run.picture.buffers.set_shares(run.gpu, &cut.shares)?;
            run.make(cut.samples, cut.count, control, stats)?;
        }
        run.finish(control, stats)
    }

    /// What all calls that render have in common: `work` does it.
    fn render_with(
        &mut self,
        view: &View,
        samples: u64,
        control: &Control,
        work: impl FnOnce(&mut Self, &mut Stats) -> Result<(), GpuError>,
    ) -> Result<Stats, BackendError> {
        let Some(loaded) = &self.scene else {
            return Err(BackendError::NoScene { backend: self.name() });
        };
        check_media(&loaded.scene.tables, view)?;
        check_boundaries(&loaded.scene.tables, view).map_err(|e| device_error(self.kind.name(), e))?;
        check_shutter(view)?;
        check_switches(view)?;
        self.prepare_film(view)?;
        let start = Instant::now();
        control.begin(samples);
        let mut stats = Stats::default();
        work(self, &mut stats).map_err(|e| device_error(self.kind.name(), e))?;
        if let Some(picture) = &mut self.picture {
            picture.count(&self.gpu).map_err(|e| device_error(self.kind.name(), e))?;
            stats.rays = picture.rays;
        }
        stats.cancelled = control.is_cancelled();
        stats.elapsed = start.elapsed();
        Ok(stats)
    }
}

/// Samples of all pixels of a batch, in a window of `width` pixels.
fn samples_of(batch: &Batch, width: u32) -> u64 {
    u64::from(batch.pixel_count(width)) * u64::from(batch.sample_count)
}

fn add_time(stats: &mut Stats, time: Option<Duration>) {
    if let Some(time) = time {
        *stats.device_time.get_or_insert_default() += time;
    }
}

impl Backend for GpuBackend {
    fn name(&self) -> &'static str {
        self.kind.name()
    }

    fn describe(&self) -> String {
        self.gpu.describe()
    }

    fn load(&mut self, tables: Arc<SceneTables>) -> Result<LoadStats, BackendError> {
        self.instances = Instances::of(&tables);
        self.load_scene(tables).map_err(|e| device_error(self.kind.name(), e))
    }

    fn update(&mut self, tables: Arc<SceneTables>, changes: Changes) -> Result<LoadStats, BackendError> {
        if self.scene.is_none() {
            return Err(BackendError::NoScene { backend: self.name() });
        }
        self.update_scene(tables, changes).map_err(|e| device_error(self.kind.name(), e))
    }

    fn render(&mut self, view: &View, samples: u32, control: &Control) -> Result<Stats, BackendError> {
        if view.first_sample.checked_add(samples).is_none() {
            return Err(BackendError::View { reason: format!("sample index beyond {}", u32::MAX) });
        }
        refuse_mattes(view)?;
        let all = u64::from(samples) * view.window.area() as u64;
        self.render_with(view, all, control, |this, stats| this.render_samples(view, samples, control, stats))
    }

    fn render_pixels(
        &mut self,
        view: &View,
        pixels: &[PixelSamples],
        control: &Control,
    ) -> Result<Stats, BackendError> {
        check_pixels(view, pixels)?;
        refuse_mattes(view)?;
        let all = pixels.iter().map(|p| u64::from(p.count)).sum();
        self.render_with(view, all, control, |this, stats| this.render_list(view, pixels, control, stats))
    }

    fn render_rounds(
        &mut self,
        view: &View,
        rounds: &AdaptiveRounds,
        control: &Control,
    ) -> Result<Option<Stats>, BackendError> {
        refuse_mattes(view)?;
        self.render_decided(view, rounds, control)
    }

    fn render_views(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
    ) -> Result<(ViewPictures, Stats), BackendError> {
        self.render_batch(batch, control)
    }

    fn relative_error(&mut self) -> Result<Option<f64>, BackendError> {
        self.error_on_device().map_err(|e| device_error(self.kind.name(), e))
    }

    fn restart(&mut self) {
        self.give_up_picture();
        if let Some(loaded) = &mut self.scene {
            loaded.kernels.values_mut().for_each(|k| k.kernel.forget());
        }
    }

    fn film(&mut self) -> Result<Option<&Film>, BackendError> {
        let Some(picture) = &mut self.picture else { return Ok(None) };
        // Of a lost device, what was moved before is what there is.
        if !self.gpu.is_lost() {
            picture.fold(&self.gpu).map_err(|e| device_error(self.kind.name(), e))?;
        }
        Ok(Some(picture.film.get()))
    }

    fn filter_noise(&mut self, picture: &NetworkInput<'_>) -> Option<Image> {
        // A device that computes on the CPU is no faster than that.
        if self.gpu.is_software() || self.gpu.is_lost() {
            return None;
        }
        match self.denoise(picture) {
            Ok(filtered) => Some(filtered),
            Err(error) => {
                self.notices.push(format!("the CPU denoises: {error}"));
                None
            }
        }
    }

    fn take_passes(&mut self) -> Vec<PassTime> {
        self.timer.take()
    }

    fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    fn kernel(&self) -> Option<&'static str> {
        self.taken
    }
}

/// Frames begin with a rasteriser, which draws what is no surface.
fn check_boundaries(tables: &SceneTables, view: &View) -> Result<(), GpuError> {
    if matches!(view.integrator, Integrator::Hybrid(_) | Integrator::Realtime(_)) {
        refuse_volumes(tables)?;
    }
    Ok(())
}

/// Refuses a camera that moves on a way of too many segments.
fn check_shutter(view: &View) -> Result<(), BackendError> {
    let segments = view.shutter.as_ref().map_or(0, |shutter| shutter.camera.len());
    if segments > MOST_CAMERA_SEGMENTS {
        let reason =
            format!("the camera's motion has {segments} segments; GPUs have room for {MOST_CAMERA_SEGMENTS}");
        return Err(BackendError::View { reason });
    }
    Ok(())
}

/// Kernels add up what samples see; whose share of a pixel how many of them are, they do not count.
fn refuse_mattes(view: &View) -> Result<(), BackendError> {
    match view.aovs.iter().find(|aov| aov.kind() == AovKind::Shares) {
        Some(matte) => Err(BackendError::View {
            reason: format!("GPUs do not make the layer `{matte}`; the back end `cpu` does"),
        }),
        None => Ok(()),
    }
}
