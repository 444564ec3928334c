//! The real-time path tracer: few paths for each pixel, what frames before have found, and a filter.
//!
//! ```text
//! G-buffer ─▶ surfaces ─▶ reproject ─┬─────────────────────────────────────────▶ samples ─▶ accumulate ─▶ filter × 5
//!                                    └▶ noise ─▶ blur ─▶ choose ─▶ list (adaptive) ─▲                         │
//!                                                         film ◀─ compose ◀─ antialias ◀─ recombine ◀─────────┘
//! ```
//!
//! First hits are those of the hybrid renderer, too (`gbuffer/`). From there on paths are those of `path`
//! (`shaders/path_vertex.wgsl`), with the light of the first surface's diffuse lobe kept apart from that of the others and both freed of
//! the surface's colour. The two signals are reprojected, accumulated and filtered by themselves. How many samples a pixel gets is decided by frames before only,
//! so a frame's own samples are an unbiased estimate; without the filter they go to the film as they are, and the mean of
//! frames is what `path` shows. First surfaces may look at lights that squares of pixels have chosen together (`presample lights`).
//!
//! Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017.

mod budget;
mod buffers;
mod choice;
mod frame;
mod learned;
mod passes;
mod waves;

#[cfg(test)]
pub(crate) use passes::planes;

pub use budget::BudgetController;

use crate::batch::{Batch, BatchPixels};
use crate::film::FilmBuffers;
use crate::frames::FrameClock;
use crate::gbuffer::{BegunFrame, FrameRequest, GBUFFER_PASSES, GBuffer};
use crate::kernel::{Kernel, PathKernel};
use crate::pass::{self, Dispatch, begin};
use crate::scene::upload::write_buffer;
use crate::shader::Variant;
use crate::timing::{PassClock, Timer};
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use backend::{FrameSamples, FrameView, Integrator, RealtimeSettings, SpatialFilter, Visibility};
use buffers::{Bindings, Buffers, DISPATCHES};
use frame::{FrameState, RealtimeFrame, frame_samples, light_candidates};
use learned::Learned;
use passes::{MOST_FILTER_PASSES, RealtimePass, frame_pass};
use std::time::Duration;
use waves::Waves;

/// Most passes of a frame that are timed.
pub const FRAME_PASSES: usize = GBUFFER_PASSES + 10 + MOST_FILTER_PASSES as usize;

/// The real-time path tracer of a scene on a device.
pub struct RealtimeKernel {
    gbuffer: GBuffer,
    passes: Vec<pass::Pass>,
    waves: Waves,
    learned: Option<Learned>,
    path_kernel: PathKernel,
    /// How the last frame's paths were followed.
    taken: PathKernel,
    buffers: Option<Buffers>,
    bindings: Option<Bindings>,
    budget: BudgetController,
    /// Frames since the past was forgotten.
    number: u32,
    /// Frames on the film.
    on_film: u32,
    has_changed: bool,
}

/// A frame that was prepared: what [`RealtimeKernel::record`] needs to know.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedFrame {
    begun: BegunFrame,
    settings: RealtimeSettings,
    /// 0 or 1: which of the buffers are this frame's.
    odd: usize,
    camera: optics::camera::CameraFrame,
    /// Longest path, if samples are waves.
    waves: Option<u32>,
    /// Samples that it can afford in all; 0: any number.
    pub affordable: u32,
}

impl RealtimeKernel {
    /// Compiles what frames of `pixels` pixels with `settings` need for a scene and a tracer. Other frames compile what else they
    /// need with the first of them.
    ///
    /// # Errors
    /// When the driver refuses a shader, or the scene has more to draw than a pixel can name.
    pub fn new(
        gpu: &Gpu,
        variant: Variant,
        scene: &GpuScene,
        tracer: &dyn Tracer,
        settings: &RealtimeSettings,
        pixels: u32,
    ) -> Result<Self, GpuError> {
        let make = |pass| frame_pass(gpu, pass, variant, scene, tracer);
        let mut kernel = Self {
            gbuffer: GBuffer::new(gpu, variant, scene, tracer)?,
            passes: RealtimePass::all().map(make).collect::<Result<_, GpuError>>()?,
            waves: Waves::new(gpu, variant, scene, tracer)?,
            learned: None,
            path_kernel: PathKernel::Auto,
            taken: PathKernel::Megakernel,
            buffers: None,
            bindings: None,
            budget: BudgetController::default(),
            number: 0,
            on_film: 0,
            has_changed: false,
        };
        if kernel.wants_waves(settings, pixels) {
            kernel.taken = PathKernel::Wavefront;
        }
        kernel.compile_frame(gpu, settings)?;
        Ok(kernel)
    }

    /// Compiles what a frame needs and no frame before it needed, with its paths followed as [`RealtimeKernel::taken`] says.
    fn compile_frame(&mut self, gpu: &Gpu, settings: &RealtimeSettings) -> Result<(), GpuError> {
        let has_waves = self.taken == PathKernel::Wavefront;
        let adapts = !frame_samples(settings).is_fixed();
        let passes = RealtimePass::of_frame(adapts, light_candidates(settings) > 0, filter_passes(settings));
        let is_wanted = |number| {
            let is_wanted = |&&pass: &&RealtimePass| !(has_waves && pass == RealtimePass::Sample);
            passes.iter().filter(is_wanted).any(|pass| pass.index() == number)
        };
        let made = self.passes.iter_mut().enumerate().filter(|(number, _)| is_wanted(*number));
        let waves = self.waves.steps().filter(|_| has_waves);
        let first_hits = self.gbuffer.passes(settings.visibility == Visibility::Raster);
        pass::compile(gpu, made.map(|(_, pass)| pass).chain(waves).chain(first_hits))?;
        if is_learned(settings) && self.learned.is_none() {
            self.learned = Some(Learned::new(gpu)?);
        }
        Ok(())
    }

    /// Bytes on the device that depend on the picture's size.
    pub fn memory_bytes(&self) -> u64 {
        let learned = self.learned.as_ref().map_or(0, Learned::memory_bytes);
        self.buffers.as_ref().map_or(0, Buffers::memory_bytes) + self.waves.memory_bytes() + learned
    }

    /// The first hits of the last frame, if there is one.
    pub(crate) fn first_hits(&self) -> Option<&wgpu::Buffer> {
        self.gbuffer.pixels()
    }

    /// Learns what a frame took, by pass.
    pub fn learn(&mut self, passes: &[(&'static str, Duration)], samples: u64) {
        let of = |sampling: bool| -> Duration {
            passes.iter().filter(|p| (p.0 == SAMPLES) == sampling).map(|p| p.1).sum()
        };
        self.budget.learn(of(true), of(false), samples);
    }

    /// The scene has moved or changed, and how large it is now.
    pub(crate) fn set_changed(&mut self, bounding_sphere: Option<[f32; 4]>) {
        self.has_changed = true;
        if let Some(sphere) = bounding_sphere {
            self.gbuffer.set_bounding_sphere(sphere);
        }
    }

    /// Forgets all frames so far.
    pub(crate) fn forget_past(&mut self) {
        self.number = 0;
        self.on_film = 0;
    }

    /// Makes what depends on the picture's size, and binds the film, unless that is done.
    fn prepare_buffers(&mut self, gpu: &Gpu, film: &FilmBuffers) -> Result<(), GpuError> {
        let size = film.contents.picture().window_size;
        let is_new = self.gbuffer.prepare(gpu, film)?;
        if !is_new && self.bindings.as_ref().is_some_and(|b| b.is_for(film)) {
            return Ok(());
        }
        self.bindings = None;
        self.waves.unbind();
        self.learned.iter_mut().for_each(Learned::unbind);
        if self.buffers.as_ref().is_none_or(|b| b.size != size) {
            self.buffers = None;
            self.buffers = Some(Buffers::new(gpu, size, size_of::<RealtimeFrame>() as u64)?);
            self.number = 0;
        }
        if let Some(buffers) = &self.buffers {
            self.bindings = Some(Bindings::new(gpu, buffers, &self.gbuffer, film, &self.passes)?);
        }
        // A new film has none of the frames.
        self.on_film = 0;
        Ok(())
    }

    /// Writes the uniforms of the next frame. `sample` says where rays go through the pixels; `begins`: the film is empty.
    ///
    /// # Errors
    /// When there is no memory.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        film: &FilmBuffers,
        settings: RealtimeSettings,
        sample: u32,
        begins: bool,
    ) -> Result<PreparedFrame, GpuError> {
        self.prepare_buffers(gpu, film)?;
        self.prepare_samples(gpu, &settings, film)?;
        self.compile_frame(gpu, &settings)?;
        if let Some((learned, buffers)) = self.learned.as_mut().zip(self.buffers.as_ref())
            && is_learned(&settings)
        {
            learned.prepare(gpu, buffers)?;
        }
        if begins {
            self.on_film = 0;
        }
        self.on_film += 1;
        let stands_still = self.gbuffer.previous_camera() == Some(film.camera) && !self.has_changed;
        self.has_changed = false;
        let [width, height] = film.contents.picture().window_size;
        let (visibility, rows) = (settings.visibility, (0, height));
        let request = FrameRequest { visibility, sample, rows, culls_lights: false };
        let begun = self.gbuffer.begin(gpu, film, request)?;
        let area = width * height;
        let samples = frame_samples(&settings);
        let affordable = match settings.budget {
            // A sample for each pixel in four, if nothing else, so that pictures go on.
            Some(budget) if !samples.is_fixed() => self.budget.affordable(budget, area.div_ceil(4)),
            _ => 0,
        };
        let state = FrameState {
            projections: begun.projections,
            number: self.number,
            stands_still,
            affordable,
            on_film: self.on_film,
            sample,
        };
        let uniform = RealtimeFrame::new(&settings, film, &state);
        if let Some(buffers) = &self.buffers {
            write_buffer(gpu, "the frame", &buffers.realtime, bytemuck::bytes_of(&uniform))?;
        }
        let odd = self.number as usize % 2;
        self.number = self.number.wrapping_add(1).max(1);
        let waves = (self.taken == PathKernel::Wavefront).then(|| film.contents.max_depth());
        Ok(PreparedFrame { begun, settings, odd, camera: film.camera, waves, affordable })
    }

    /// Submits a frame with a budget and waits for it: its time says how many samples the next one can afford.
    fn submit_and_learn(
        &mut self,
        gpu: &Gpu,
        frame: &PreparedFrame,
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        let doing = "timing a frame";
        let mut clock = FrameClock::new(gpu)?;
        let submit = || {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.record(&mut encoder, &mut clock, frame);
            clock.resolve(&mut encoder);
            gpu.queue.submit([encoder.finish()])
        };
        let submission = gpu.guarded(submit).map_err(|reason| GpuError::Device { doing, reason })?;
        clock.request();
        gpu.wait_for(Some(submission.clone()), doing)?;
        let period = f64::from(gpu.queue.get_timestamp_period());
        let time = |ticks: u64| Duration::from_nanos((ticks as f64 * period) as u64);
        let ticks = clock.take(gpu)?;
        timer.add(&ticks);
        let passes = ticks.iter().map(|t| (t.name, time(t.end.saturating_sub(t.begin))));
        self.learn(&passes.collect::<Vec<_>>(), u64::from(frame.affordable));
        Ok(submission)
    }

    /// Records all passes of a frame.
    pub(crate) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        frame: &PreparedFrame,
    ) {
        self.gbuffer.record(encoder, clock, &frame.begun);
        if let (Some(buffers), Some(bindings)) = (&self.buffers, &self.bindings) {
            let mut recorder = Recorder { kernel: self, encoder, clock, bindings, buffers, odd: frame.odd };
            recorder.frame(&frame.settings, frame.waves);
        }
        self.gbuffer.end(encoder, frame.camera);
    }
}

/// Name of the pass of all samples in profiles.
const SAMPLES: &str = "samples";

/// Records the passes of one frame.
struct Recorder<'a> {
    kernel: &'a RealtimeKernel,
    encoder: &'a mut wgpu::CommandEncoder,
    clock: &'a mut dyn PassClock,
    bindings: &'a Bindings,
    buffers: &'a Buffers,
    odd: usize,
}

impl Recorder<'_> {
    fn frame(&mut self, settings: &RealtimeSettings, waves: Option<u32>) {
        let samples = frame_samples(settings);
        self.run("surfaces", &[RealtimePass::Surfaces]);
        self.run("reproject", &[RealtimePass::Reproject]);
        let filter_passes = filter_passes(settings);
        if !samples.is_fixed() {
            self.encoder.clear_buffer(&self.buffers.work, 0, None);
            self.run("noise", &RealtimePass::NOISE);
            self.run("allocation", &RealtimePass::ALLOCATION);
        }
        if light_candidates(settings) > 0 {
            self.run("presample lights", &[RealtimePass::Presample]);
        }
        match waves {
            Some(max_depth) => self.sample_waves(samples, max_depth),
            None => self.sample(samples),
        }
        self.run("accumulate", &[RealtimePass::Accumulate]);
        match &self.kernel.learned {
            Some(learned) if is_learned(settings) => {
                learned.record(&mut begin(self.encoder, self.clock, "filter"));
            }
            _ => {
                for level in 0..filter_passes {
                    self.run("filter", &[RealtimePass::Filter(level)]);
                }
                self.recombine(filter_passes);
            }
        }
        self.run("antialias", &[RealtimePass::Antialias]);
        self.run("compose", &[RealtimePass::Compose]);
    }

    /// Workgroups of eight by eight for the window.
    fn groups(&self) -> [u32; 2] {
        self.buffers.size.map(|n| n.div_ceil(8))
    }

    /// Runs passes over the window one after the other, timed together.
    fn run(&mut self, name: &'static str, passes: &[RealtimePass]) {
        let window = self.groups();
        let mut recorded = begin(self.encoder, self.clock, name);
        for &pass in passes {
            let groups = if pass == RealtimePass::LayOut { [1, 1] } else { window };
            let bound = &self.bindings.passes[self.odd][pass.index()];
            self.kernel.passes[pass.index()].dispatch(&mut recorded, bound, Dispatch::Groups(groups));
        }
    }

    fn recombine(&mut self, filter_passes: u32) {
        let size = Dispatch::Groups(self.groups());
        let bound = &self.bindings.recombine[self.odd][filter_passes as usize % 2];
        self.kernel.passes[RealtimePass::Recombine.index()].record(self.encoder, self.clock, bound, size);
    }

    /// Wave after wave, a sample of each pixel; of adaptive ones, as [`Self::sample`] has it.
    fn sample_waves(&mut self, samples: FrameSamples, max_depth: u32) {
        let window = self.groups();
        let mut recorded = begin(self.encoder, self.clock, SAMPLES);
        for sample in 0..samples.most {
            self.kernel.waves.record(
                &mut recorded,
                sample_size(samples, sample, window, self.buffers),
                max_depth,
            );
        }
    }

    /// Dispatch after dispatch, a sample of each pixel; adaptive ones work on the list's beginning, which pixels leave when
    /// they have what they want.
    fn sample(&mut self, samples: FrameSamples) {
        let window = self.groups();
        let bound = &self.bindings.passes[self.odd][RealtimePass::Sample.index()];
        let mut recorded = begin(self.encoder, self.clock, SAMPLES);
        if self.kernel.passes[RealtimePass::Sample.index()].set(&mut recorded, bound) {
            for sample in 0..samples.most {
                sample_size(samples, sample, window, self.buffers).record(&mut recorded);
            }
        }
    }
}

/// The size of the dispatch that takes a sample of each pixel of a window of so many workgroups; of adaptive ones, of each pixel at the
/// beginning of the list.
fn sample_size(samples: FrameSamples, sample: u32, window: [u32; 2], buffers: &Buffers) -> Dispatch<'_> {
    match samples.is_fixed() {
        true => Dispatch::Groups(window),
        false => Dispatch::Indirect(&buffers.work, dispatch_of(sample)),
    }
}

/// Where in `Work` the size of the dispatch is that takes a sample of each pixel that wants more than `sample` of them.
fn dispatch_of(sample: u32) -> u64 {
    DISPATCHES + 16 * u64::from(sample)
}

/// Passes of the filter by edges in a frame. Of the unfiltered picture nothing but noise and samples depends on the past.
fn filter_passes(settings: &RealtimeSettings) -> u32 {
    let by_edges = settings.filter && settings.spatial == SpatialFilter::Edges;
    if by_edges { settings.filter_passes.min(MOST_FILTER_PASSES) } else { 0 }
}

/// Whether the network filters a frame. What is shown of what goes on before it is not filtered.
fn is_learned(settings: &RealtimeSettings) -> bool {
    settings.filter && settings.spatial == SpatialFilter::Learned && settings.show == FrameView::Picture
}

impl Kernel for RealtimeKernel {
    fn submit(
        &mut self,
        gpu: &Gpu,
        film: &mut FilmBuffers,
        batch: Batch,
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        let failed = |reason| GpuError::Device { doing: "starting a frame", reason };
        let Integrator::Realtime(settings) = film.integrator else {
            return Err(failed("the film is for another integrator".into()));
        };
        let height = film.contents.picture().window_size[1];
        if batch.pixels != (BatchPixels::Rows { first: 0, count: height }) {
            return Err(failed("frames are whole pictures".into()));
        }
        let mut last = None;
        for sample in batch.first_sample..batch.first_sample + batch.sample_count {
            film.set_batch(gpu, Batch { first_sample: sample, sample_count: 1, ..batch })?;
            let frame = self.prepare(gpu, film, settings, sample, false)?;
            if frame.affordable > 0 {
                last = Some(self.submit_and_learn(gpu, &frame, timer)?);
                continue;
            }
            timer.reserve(gpu, FRAME_PASSES)?;
            let submit = || {
                let mut encoder =
                    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                self.record(&mut encoder, timer, &frame);
                gpu.queue.submit([encoder.finish()])
            };
            last = Some(gpu.guarded(submit).map_err(failed)?);
        }
        last.ok_or_else(|| failed("the batch is empty".into()))
    }

    fn makes_whole_frames(&self) -> bool {
        true
    }

    fn scene_changed(&mut self) {
        self.set_changed(None);
    }

    fn forget(&mut self) {
        self.forget_past();
    }

    fn set_path_kernel(&mut self, kernel: PathKernel) {
        self.path_kernel = kernel;
    }

    fn taken_kernel(&self) -> PathKernel {
        self.taken
    }
}

#[cfg(test)]
mod tests;
