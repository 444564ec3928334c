//! A scene that is drawn frame after frame: a real-time renderer with frames in flight and instances that move.

use crate::batch::{Batch, BatchPixels};
use crate::film::FilmBuffers;
use crate::frames::Frames;
use crate::gbuffer::HybridPixel;
use crate::hybrid::{self, HybridKernel};
use crate::realtime::{self, RealtimeKernel};
use crate::scene::refuse_volumes;
use crate::scene::update::StagingRing;
use crate::screen::Screen;
use crate::shader::Variant;
use crate::tracer::bvh::BvhTracer;
use crate::tracer::query::QueryTracer;
use crate::tracer::upper::{Place, UpperBuilder, UpperUpdate};
use crate::tracer::{Instances, Tracer, TracerKind};
use crate::{Gpu, GpuError, GpuScene};
use backend::{Integrator, View};
use scene::tables::{Changes, SceneTables};
use std::collections::VecDeque;
use std::sync::Arc;

/// A scene on a device, ready for frames.
pub struct LiveScene {
    gpu: Gpu,
    frames: Frames,
    kernel: FrameKernel,
    film: FilmBuffers,
    upper: Option<UpperBuilder>,
    scene: GpuScene,
    ring: StagingRing,
    tracer_bytes: u64,
    /// Whether the device has built the upper level yet: a refit needs an order.
    is_built: bool,
    /// Number and samples of frames whose times are still to be learned from.
    planned: VecDeque<(u64, u32)>,
}

/// What renders the frames.
enum FrameKernel {
    Hybrid(Box<HybridKernel>),
    Realtime(Box<RealtimeKernel>),
}

/// Where the instances of a frame stand, and how the upper level follows them.
pub type Motion<'a> = (&'a [Place], UpperUpdate);

impl LiveScene {
    /// Loads a scene for frames of the integrator `hybrid` or `realtime`, which the view's is; `depth` frames may be in flight.
    /// Frames can move instances if one of them says that it will be moved ([`scene::Instance::dynamic`]).
    ///
    /// # Errors
    /// When the device cannot trace so, the scene is too large for it, or the view is of another integrator.
    pub fn new(
        gpu: Gpu,
        tables: Arc<SceneTables>,
        kind: TracerKind,
        view: &View,
        depth: usize,
    ) -> Result<Self, GpuError> {
        Self::with_room(gpu, tables, kind, view, depth, 0)
    }

    /// As [`LiveScene::new`], with room for so many more lights than the scene has at first.
    ///
    /// # Errors
    /// As [`LiveScene::new`].
    pub fn with_room(
        gpu: Gpu,
        tables: Arc<SceneTables>,
        kind: TracerKind,
        view: &View,
        depth: usize,
        more_lights: u32,
    ) -> Result<Self, GpuError> {
        kind.check(&gpu)?;
        refuse_volumes(&tables)?;
        let instances = Instances::of(&tables);
        let scene = GpuScene::upload_with_room(&gpu, tables, more_lights)?;
        let (tracer, upper): (Box<dyn Tracer>, _) = match kind {
            TracerKind::Bvh if instances == Instances::StandStill => {
                (Box::new(BvhTracer::new(&gpu, &scene, instances)?), None)
            }
            TracerKind::Bvh => {
                let (tracer, upper) = BvhTracer::dynamic(&gpu, &scene)?;
                (Box::new(tracer), upper)
            }
            TracerKind::Query => (Box::new(QueryTracer::new(&gpu, &scene)?), None),
            TracerKind::Pipeline => {
                let (adapter, tracer) = (gpu.info.name.clone(), kind.name());
                let missing = "rays from compute shaders, which the hybrid renderer's passes are".into();
                return Err(GpuError::Unsupported { adapter, tracer, missing });
            }
        };
        // All frames draw random numbers as the first view does; their cameras may be others.
        let variant = Variant { lens_distortion: true, ..scene.variant().for_view(view) };
        let kernel = match view.integrator {
            Integrator::Realtime(settings) => {
                let pixels = view.window.area() as u32;
                let kernel = RealtimeKernel::new(&gpu, variant, &scene, &*tracer, &settings, pixels)?;
                FrameKernel::Realtime(Box::new(kernel))
            }
            other => {
                // Frames of another integrator are refused when they come.
                let settings =
                    if let Integrator::Hybrid(settings) = other { settings } else { Default::default() };
                let kernel = HybridKernel::new(&gpu, variant, &scene, &*tracer, &settings)?;
                FrameKernel::Hybrid(Box::new(kernel))
            }
        };
        let film = FilmBuffers::new(&gpu, view, false)?;
        let frames = Frames::new(&gpu, depth)?;
        let tracer_bytes = tracer.memory_bytes();
        let ring = StagingRing::new(&gpu);
        Ok(Self {
            gpu,
            frames,
            kernel,
            film,
            upper,
            scene,
            ring,
            tracer_bytes,
            is_built: false,
            planned: VecDeque::new(),
        })
    }

    /// Brings lights, materials and environment to another version of the scene, for the frames that are started from now on;
    /// frames in flight keep what they began with. Instances stand where frames put them. Returns whether that was possible:
    /// other geometry, more lights than there is room for, or instances that move where none can by itself need a new scene,
    /// and nothing is done.
    ///
    /// # Errors
    /// When the device fails.
    pub fn update(&mut self, tables: &Arc<SceneTables>) -> Result<bool, GpuError> {
        refuse_volumes(tables)?;
        let Some(changes) = Changes::between(&self.scene.tables, tables) else { return Ok(false) };
        if changes.vertices || (changes.transforms && self.upper.is_none()) {
            return Ok(false);
        }
        let changes = Changes { transforms: false, ..changes };
        let was_possible = self.scene.take(&self.gpu, &mut self.ring, tables, changes)?;
        if was_possible {
            match &mut self.kernel {
                FrameKernel::Hybrid(kernel) => {
                    kernel.set_changed(tables.bounding_sphere, tables.lights.len() as u32);
                }
                FrameKernel::Realtime(kernel) => kernel.set_changed(Some(tables.bounding_sphere)),
            }
        }
        Ok(was_possible)
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The frames in flight: their number, reports and spans.
    pub fn frames(&mut self) -> &mut Frames {
        &mut self.frames
    }

    /// Forgets what frames before have found; the next one begins without a past.
    pub fn forget(&mut self) {
        match &mut self.kernel {
            FrameKernel::Hybrid(kernel) => kernel.forget_past(),
            FrameKernel::Realtime(kernel) => kernel.forget_past(),
        }
    }

    /// Waits until the device is done with all frames.
    ///
    /// # Errors
    /// When the device fails.
    pub fn finish(&mut self) -> Result<(), GpuError> {
        self.frames.finish(&self.gpu)
    }

    /// Number of instances that [`LiveScene::frame`] takes places of; 0 where none can be moved.
    pub fn moving_instances(&self) -> u32 {
        self.upper.as_ref().map_or(0, UpperBuilder::count)
    }

    /// Bytes on the device, as far as they are known.
    pub fn memory_bytes(&self) -> u64 {
        self.scene.memory_bytes()
            + self.tracer_bytes
            + self.film.memory_bytes()
            + self.upper.as_ref().map_or(0, UpperBuilder::memory_bytes)
            + match &self.kernel {
                FrameKernel::Hybrid(_) => 0,
                FrameKernel::Realtime(kernel) => kernel.memory_bytes(),
            }
    }

    /// Starts a frame of a view, whose sample is `view.first_sample`. Waits only if as many frames are in flight as may be.
    ///
    /// # Errors
    /// When the view is of another integrator, instances are to move that cannot, or the device fails.
    pub fn frame(&mut self, view: &View, motion: Option<Motion<'_>>) -> Result<u64, GpuError> {
        self.start(view, motion, None)
    }

    /// As [`LiveScene::frame`], and shows the frame on the window that this scene's device was opened with. Waits for the window
    /// before the host's work begins; a frame that the window cannot show is made nevertheless.
    ///
    /// # Errors
    /// As [`LiveScene::frame`].
    pub fn show(
        &mut self,
        view: &View,
        motion: Option<Motion<'_>>,
        screen: &mut Screen,
    ) -> Result<u64, GpuError> {
        self.start(view, motion, Some(screen))
    }

    fn start(
        &mut self,
        view: &View,
        motion: Option<Motion<'_>>,
        mut screen: Option<&mut Screen>,
    ) -> Result<u64, GpuError> {
        if !self.film.set_view(view) {
            self.film = FilmBuffers::new(&self.gpu, view, false)?;
        }
        let picture = match &mut screen {
            Some(screen) => screen.acquire(&self.gpu, self.frames.depth())?,
            None => None,
        };
        let slot = self.frames.begin(&self.gpu)?;
        self.learn();
        let (mut encoder, samples) = self.record(slot, view, motion)?;
        if let (Some(screen), Some(picture)) = (&mut screen, &picture) {
            screen.record(&self.gpu, &mut encoder, self.frames.clock(slot), &self.film, picture)?;
        }
        let frame = self.frames.submit(&self.gpu, slot, encoder)?;
        if let (Some(screen), Some(picture)) = (screen, picture) {
            screen.present(&self.gpu, picture)?;
        }
        if samples > 0 {
            self.planned.push_back((frame, samples));
        }
        Ok(frame)
    }

    /// What the last frame that is done took says how many samples the next one can afford.
    fn learn(&mut self) {
        let FrameKernel::Realtime(kernel) = &mut self.kernel else { return };
        let Some(report) = self.frames.last_report() else { return };
        while self.planned.front().is_some_and(|p| p.0 < report.frame) {
            self.planned.pop_front();
        }
        if let Some((_, samples)) = self.planned.pop_front_if(|p| p.0 == report.frame) {
            let passes: Vec<_> = report.passes.iter().map(|p| (p.name, p.duration)).collect();
            kernel.learn(&passes, u64::from(samples));
        }
    }

    /// Records a frame. Returns how many samples it can afford, 0 for any number.
    fn record(
        &mut self,
        slot: usize,
        view: &View,
        motion: Option<Motion<'_>>,
    ) -> Result<(wgpu::CommandEncoder, u32), GpuError> {
        let gpu = &self.gpu;
        let failed = |reason: String| GpuError::Device { doing: "starting a frame", reason };
        let sample = view.first_sample;
        let rows = self.film.contents.picture().window_size[1];
        let pixels = BatchPixels::Rows { first: 0, count: rows };
        self.film.set_batch(gpu, Batch { pixels, first_sample: sample, sample_count: 1 })?;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let clock = self.frames.clock(slot);
        if let Some((places, update)) = motion {
            let Some(upper) = &self.upper else {
                return Err(failed("this scene's instances cannot move from frame to frame".into()));
            };
            upper.set_places(gpu, places)?;
            upper.record(&mut encoder, clock, if self.is_built { update } else { UpperUpdate::Rebuild });
            self.is_built = true;
        }
        // A frame is a picture of its own: nothing accumulates.
        encoder.clear_buffer(&self.film.pixels, 0, None);
        match (&mut self.kernel, view.integrator) {
            (FrameKernel::Hybrid(kernel), Integrator::Hybrid(settings)) => {
                let frame = kernel.prepare(gpu, &self.film, &settings, sample, (0, rows))?;
                kernel.record(&mut encoder, clock, &frame);
                kernel.end(&mut encoder, self.film.camera);
                Ok((encoder, 0))
            }
            (FrameKernel::Realtime(kernel), Integrator::Realtime(settings)) => {
                if motion.is_some() {
                    kernel.set_changed(None);
                }
                let frame = kernel.prepare(gpu, &self.film, settings, sample, true)?;
                kernel.record(&mut encoder, clock, &frame);
                Ok((encoder, frame.affordable))
            }
            (_, integrator) => {
                Err(failed(format!("the scene was not loaded for frames of `{}`", integrator.name())))
            }
        }
    }

    /// Waits for all frames and copies the last one back.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read(&mut self, view: &View) -> Result<film::Film, GpuError> {
        self.frames.finish(&self.gpu)?;
        let failed =
            |e: film::FilmError| GpuError::Device { doing: "reading a frame", reason: e.to_string() };
        let mut film = film::Film::with_window(view.width, view.height, view.window, &[]).map_err(failed)?;
        self.film.fold_into(&self.gpu, &mut film)?;
        Ok(film)
    }

    /// What the last frame knows of each pixel.
    ///
    /// # Errors
    /// When the device fails, or no frame was drawn.
    pub fn read_pixels(&mut self) -> Result<Vec<HybridPixel>, GpuError> {
        let doing = "reading a frame's pixels";
        self.frames.finish(&self.gpu)?;
        let pixels = match &self.kernel {
            FrameKernel::Hybrid(kernel) => kernel.first_hits(),
            FrameKernel::Realtime(kernel) => kernel.first_hits(),
        };
        let Some(pixels) = pixels else {
            return Err(GpuError::Device { doing, reason: "no frame was drawn".into() });
        };
        let gpu = &self.gpu;
        let size = pixels.size();
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let readable = crate::scene::upload::empty_buffer(gpu, "pixels to read", size, usage)?;
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(pixels, 0, &readable, 0, size);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing, reason })?;
        let words = crate::readback::read_mapped(gpu, &readable, size, doing, bytemuck::pod_collect_to_vec)?;
        Ok(HybridPixel::from_planes(&words))
    }
}

/// Passes of a frame with motion.
const _: () = assert!(hybrid::FRAME_PASSES < 24, "a frame's clock has room for so many passes");
const _: () = assert!(realtime::FRAME_PASSES < 24, "a frame's clock has room for so many passes");
