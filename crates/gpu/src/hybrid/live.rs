//! A scene that is drawn frame after frame: the hybrid renderer with frames in flight and instances that move.

use super::{FRAME_PASSES, HybridKernel};
use crate::film::{Batch, BatchPixels, FilmBuffers};
use crate::frames::Frames;
use crate::scene::update::StagingRing;
use crate::scene::upload::write_buffer;
use crate::tracer::bvh::BvhTracer;
use crate::tracer::query::QueryTracer;
use crate::tracer::upper::{Place, UpperBuilder, UpperUpdate};
use crate::tracer::{Tracer, TracerKind};
use crate::{Gpu, GpuError, GpuScene};
use backend::{HybridSettings, Integrator, View};
use scene::tables::{Changes, SceneTables};
use std::sync::Arc;

/// A scene on a device, ready for frames.
pub struct LiveScene {
    gpu: Gpu,
    frames: Frames,
    kernel: HybridKernel,
    film: FilmBuffers,
    upper: Option<UpperBuilder>,
    scene: GpuScene,
    ring: StagingRing,
    tracer_bytes: u64,
    /// Whether the device has built the upper level yet: a refit needs an order.
    is_built: bool,
}

/// Where the instances of a frame stand, and how the upper level follows them.
pub type Motion<'a> = (&'a [Place], UpperUpdate);

impl LiveScene {
    /// Loads a scene for frames of the integrator `hybrid`; `depth` frames may be in flight.
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
        let scene = GpuScene::upload_with_room(&gpu, tables, more_lights)?;
        let (tracer, upper): (Box<dyn Tracer>, _) = match kind {
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
        let kernel = HybridKernel::new(&gpu, scene.variant(), &scene, &*tracer)?;
        let film = FilmBuffers::new(&gpu, view, false)?;
        let frames = Frames::new(&gpu, depth)?;
        let tracer_bytes = tracer.memory_bytes();
        let ring = StagingRing::new(&gpu);
        Ok(Self { gpu, frames, kernel, film, upper, scene, ring, tracer_bytes, is_built: false })
    }

    /// Brings lights, materials and environment to another version of the scene, for the frames that are started from now on;
    /// frames in flight keep what they began with. Instances stand where frames put them. Returns whether that was possible:
    /// other geometry, more lights than there is room for, or instances that move where none can by itself need a new scene,
    /// and nothing is done.
    ///
    /// # Errors
    /// When the device fails.
    pub fn update(&mut self, tables: &Arc<SceneTables>) -> Result<bool, GpuError> {
        let Some(changes) = Changes::between(&self.scene.tables, tables) else { return Ok(false) };
        if changes.vertices || (changes.transforms && self.upper.is_none()) {
            return Ok(false);
        }
        let changes = Changes { transforms: false, ..changes };
        let was_possible = self.scene.take(&self.gpu, &mut self.ring, tables, changes)?;
        if was_possible {
            self.kernel.bounding_sphere = tables.bounding_sphere;
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

    /// Waits until the device is done with all frames.
    ///
    /// # Errors
    /// When the device fails.
    pub fn finish(&mut self) -> Result<(), GpuError> {
        self.frames.finish(&self.gpu)
    }

    /// Number of instances that [`LiveScene::frame`] takes places of; 0 where nothing can move by itself.
    pub fn moving_instances(&self) -> u32 {
        self.upper.as_ref().map_or(0, UpperBuilder::count)
    }

    /// Bytes on the device, as far as they are known.
    pub fn memory_bytes(&self) -> u64 {
        self.scene.memory_bytes()
            + self.tracer_bytes
            + self.film.memory_bytes()
            + self.upper.as_ref().map_or(0, UpperBuilder::memory_bytes)
    }

    /// Starts a frame of a view, whose sample is `view.first_sample`. Waits only if as many frames are in flight as may be.
    ///
    /// # Errors
    /// When the view is of another integrator, instances are to move that cannot, or the device fails.
    pub fn frame(&mut self, view: &View, motion: Option<Motion<'_>>) -> Result<u64, GpuError> {
        let doing = "starting a frame";
        let failed = |reason: String| GpuError::Device { doing, reason };
        let Integrator::Hybrid(settings) = view.integrator else {
            return Err(failed(format!("`{}` is no real-time integrator", view.integrator.name())));
        };
        if !self.film.set_view(view) {
            self.film = FilmBuffers::new(&self.gpu, view, false)?;
        }
        let slot = self.frames.begin(&self.gpu)?;
        let encoder = self.record(slot, &settings, view.first_sample, motion)?;
        self.frames.submit(&self.gpu, slot, encoder)
    }

    fn record(
        &mut self,
        slot: usize,
        settings: &HybridSettings,
        sample: u32,
        motion: Option<Motion<'_>>,
    ) -> Result<wgpu::CommandEncoder, GpuError> {
        let gpu = &self.gpu;
        let failed = |reason: String| GpuError::Device { doing: "starting a frame", reason };
        let rows = self.film.contents.picture().window_size[1];
        let pixels = BatchPixels::Rows { first: 0, count: rows };
        let batch = Batch { pixels, first_sample: sample, sample_count: 1 };
        self.film.set_batch(gpu, batch)?;
        self.kernel.prepare(gpu, &self.film)?;
        let (frame, plan) = self.kernel.plan(&self.film, settings, sample, (0, rows));
        write_buffer(gpu, "the frame", &self.kernel.buffers.frame, bytemuck::bytes_of(&frame))?;
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
        let Some(targets) = &self.kernel.targets else {
            return Err(failed("there is nothing to draw to".into()));
        };
        // A frame is a picture of its own: nothing accumulates.
        encoder.clear_buffer(&self.film.pixels, 0, None);
        self.kernel.record(&mut encoder, clock, targets, plan);
        self.kernel.keep_instances(&mut encoder);
        self.kernel.previous_camera = Some(self.film.camera);
        Ok(encoder)
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
    pub fn read_pixels(&mut self) -> Result<Vec<super::HybridPixel>, GpuError> {
        let doing = "reading a frame's pixels";
        self.frames.finish(&self.gpu)?;
        let Some(targets) = &self.kernel.targets else {
            return Err(GpuError::Device { doing, reason: "no frame was drawn".into() });
        };
        let gpu = &self.gpu;
        let size = targets.pixels.size();
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let readable = crate::scene::upload::empty_buffer(gpu, "pixels to read", size, usage)?;
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&targets.pixels, 0, &readable, 0, size);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing, reason })?;
        crate::film::read_mapped(gpu, &readable, size, doing, bytemuck::pod_collect_to_vec)
    }
}

/// Passes of a frame with motion.
const _: () = assert!(FRAME_PASSES < 24, "a frame's clock has room for so many passes");
