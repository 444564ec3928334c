//! The hybrid renderer's first half by itself: which surface each pixel sees, for who goes on in another way.

use super::frame::HybridFrame;
use super::passes::Pass;
use super::{HybridKernel, Plan};
use crate::film::FilmBuffers;
use crate::scene::upload::write_buffer;
use crate::shader::Variant;
use crate::timing::PassClock;
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use backend::{HybridSettings, Visibility};
use optics::camera::CameraFrame;

/// Passes of a frame of the G-buffer.
pub(crate) const GBUFFER_PASSES: usize = 3;

/// First hits, frame after frame.
pub(crate) struct GBuffer(HybridKernel);

/// How a frame's camera and the one before project.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projections {
    pub clip_from_world: [[f32; 4]; 4],
    pub previous_clip_from_world: [[f32; 4]; 4],
    pub eye: [f32; 3],
    pub previous_eye: [f32; 3],
}

/// A frame that was begun.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BegunFrame {
    plan: Plan,
    pub projections: Projections,
}

impl GBuffer {
    /// The passes that find first hits. The first frame that needs one compiles it.
    ///
    /// # Errors
    /// As [`HybridKernel::new`].
    pub fn new(gpu: &Gpu, variant: Variant, scene: &GpuScene, tracer: &dyn Tracer) -> Result<Self, GpuError> {
        // Passes are found by their numbers: these are the first ones.
        const FIRST: &[Pass] = &[Pass::Cull, Pass::ClusterLights, Pass::Resolve, Pass::CameraRays];
        HybridKernel::with_passes(gpu, variant, scene, tracer, FIRST).map(Self)
    }

    /// Makes what depends on the picture's size. Returns whether that was made anew.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn prepare(&mut self, gpu: &Gpu, film: &FilmBuffers) -> Result<bool, GpuError> {
        let before = self.pixels().cloned();
        self.0.prepare(gpu, film, 0)?;
        Ok(self.pixels() != before.as_ref())
    }

    /// Writes the uniform of the next frame; `sample` says where rays go through the pixels.
    ///
    /// # Errors
    /// When there is no memory for the copy.
    pub fn begin(
        &mut self,
        gpu: &Gpu,
        film: &FilmBuffers,
        visibility: Visibility,
        sample: u32,
    ) -> Result<BegunFrame, GpuError> {
        let settings = HybridSettings { visibility, ..HybridSettings::default() };
        let rows = film.contents.picture().window_size[1];
        let (frame, plan) = self.0.plan(film, &settings, sample, (0, rows));
        self.0.compile_first_hits(gpu, plan)?;
        write_buffer(gpu, "the frame", &self.0.buffers.frame, bytemuck::bytes_of(&frame))?;
        let HybridFrame { clip_from_world, previous_clip_from_world, eye, previous_eye, .. } = frame;
        let projections = Projections { clip_from_world, previous_clip_from_world, eye, previous_eye };
        Ok(BegunFrame { plan, projections })
    }

    /// Records the passes. Afterwards [`GBuffer::pixels`] has the first hits.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, clock: &mut dyn PassClock, frame: &BegunFrame) {
        if let Some(targets) = &self.0.targets {
            self.0.record_first_hits(encoder, clock, targets, frame.plan);
        }
    }

    /// Ends a frame: where camera and instances are now is the next one's past.
    pub fn end(&mut self, encoder: &mut wgpu::CommandEncoder, camera: CameraFrame) {
        self.0.keep_instances(encoder);
        self.0.previous_camera = Some(camera);
    }

    /// The camera of the frame before.
    pub fn previous_camera(&self) -> Option<CameraFrame> {
        self.0.previous_camera
    }

    /// The scene has changed: how large it is now.
    pub fn set_bounding_sphere(&mut self, sphere: [f32; 4]) {
        self.0.bounding_sphere = sphere;
    }

    /// The uniform of the frame.
    pub fn frame(&self) -> &wgpu::Buffer {
        &self.0.buffers.frame
    }

    /// The instances of the frame before.
    pub fn previous_instances(&self) -> &wgpu::Buffer {
        &self.0.buffers.previous_instances
    }

    /// The first hits, once [`GBuffer::prepare`] has made room for them.
    pub fn pixels(&self) -> Option<&wgpu::Buffer> {
        self.0.targets.as_ref().map(|t| &t.pixels)
    }
}
