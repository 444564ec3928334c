//! The G-buffer: which surface each pixel sees, for renderers that go on from there.
//!
//! ```text
//! cull ─▶ draw ─▶ resolve ─┬─▶ a record for each pixel
//!      (or: camera rays) ──┘
//! ```
//!
//! A frame is one sample of every pixel, at the same place in each, so that frames add up to an antialiased picture with depth
//! of field. Vertices are pulled by number from the scene's buffers; what was drawn is an item and a primitive for each pixel, 32
//! bits, from which `resolve` makes the hit that a ray would have made.
//!
//! Deferred attributes: Burns and Hunt, "The Visibility Buffer: A Cache-Friendly Approach to Deferred Shading", JCGT 2(2), 2013.

mod buffers;
mod frame;
mod items;
mod passes;
mod projection;
mod raster;
mod targets;

pub use frame::HybridFrame;
pub(crate) use frame::{SLICES, tiles};
pub(crate) use passes::{linkage, slots};
pub use projection::{Picture, Projection};
pub use targets::HybridPixel;

use crate::film::FilmBuffers;
use crate::pass::{self, Dispatch, groups_of_64};
use crate::scene::records::LightRecord;
use crate::scene::upload::write_buffer;
use crate::shader::Variant;
use crate::shader::variant::sampler_kind;
use crate::timing::PassClock;
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use backend::Visibility;
use buffers::{DrawSize, FrameBuffers};
use frame::FrameInput;
use items::{DrawClass, Items, MOST_ITEMS};
use optics::camera::CameraFrame;
use passes::{GBufferPass, frame_pass};
use raster::CompiledDraws;
use targets::Targets;

/// Most passes of a frame of the G-buffer.
pub(crate) const GBUFFER_PASSES: usize = 3;

/// First hits, frame after frame.
pub(crate) struct GBuffer {
    passes: Vec<pass::Pass>,
    draws: CompiledDraws,
    buffers: FrameBuffers,
    /// Without its lists, which the device has.
    items: Items,
    item_count: u32,
    light_words: u32,
    bounding_sphere: [f32; 4],
    targets: Option<Targets>,
    previous_camera: Option<CameraFrame>,
}

/// What a frame is to be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameRequest {
    /// How first hits are found, where a rasteriser can draw the view.
    pub visibility: Visibility,
    /// Where rays go through the pixels.
    pub sample: u32,
    /// The first row of the window and the number of rows.
    pub rows: (u32, u32),
    /// Whether lights count only within their reach.
    pub culls_lights: bool,
}

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
    rasters: bool,
    first_row: u32,
    pub row_count: u32,
    /// Whether clusters tell which lights count where.
    pub clustered: bool,
    pub projections: Projections,
}

impl GBuffer {
    /// The passes that find first hits. The first frame that needs one compiles it.
    ///
    /// # Errors
    /// When the driver refuses a shader, or the scene has more to draw than a pixel can name.
    pub fn new(gpu: &Gpu, variant: Variant, scene: &GpuScene, tracer: &dyn Tracer) -> Result<Self, GpuError> {
        let mut items = Items::new(&scene.tables);
        let item_count = items.items.len() as u64;
        if item_count > MOST_ITEMS {
            let (adapter, limit) = (gpu.info.name.clone(), "pieces of geometry to draw");
            return Err(GpuError::Limit { adapter, limit, needed: item_count, offered: MOST_ITEMS });
        }
        let buffers = FrameBuffers::new(gpu, scene, &items)?;
        (items.items, items.parts) = (Vec::new(), Vec::new());
        let compile = |pass| frame_pass(gpu, pass, variant, scene, tracer);
        let gbuffer = Self {
            passes: GBufferPass::ALL.into_iter().map(compile).collect::<Result<_, GpuError>>()?,
            draws: CompiledDraws::new(gpu, variant, scene)?,
            buffers,
            items,
            item_count: item_count as u32,
            light_words: light_words(scene),
            bounding_sphere: scene.tables.bounding_sphere,
            targets: None,
            previous_camera: None,
        };
        gpu.guarded(|| gbuffer.submit_alone(gpu, |encoder| gbuffer.keep_instances(encoder)))
            .map_err(|reason| GpuError::Device { doing: "copying instances", reason })?;
        Ok(gbuffer)
    }

    fn submit_alone(&self, gpu: &Gpu, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        record(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
    }

    /// Where instances are now is where they were in the next frame's past.
    pub fn keep_instances(&self, encoder: &mut wgpu::CommandEncoder) {
        let (from, to) = (&self.buffers.instances, &self.buffers.previous_instances);
        encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
    }

    /// Compiles what finds first hits by rasterising or by rays, unless that was done.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    fn compile(&mut self, gpu: &Gpu, rasters: bool) -> Result<(), GpuError> {
        pass::compile(gpu, self.passes(rasters))
    }

    /// The passes that find first hits by rasterising or by rays, to be compiled together with others.
    pub fn passes(&mut self, rasters: bool) -> impl Iterator<Item = &mut pass::Pass> {
        let wanted: &[GBufferPass] =
            if rasters { &[GBufferPass::Cull, GBufferPass::Resolve] } else { &[GBufferPass::CameraRays] };
        let is_wanted = |number: usize| wanted.iter().any(|&pass| pass as usize == number);
        let passes = self.passes.iter_mut().enumerate().filter(move |(number, _)| is_wanted(*number));
        passes.map(|(_, pass)| pass)
    }

    /// Makes what depends on the picture's size, and binds the film, unless that was done. Returns whether that was made anew.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn prepare(&mut self, gpu: &Gpu, film: &FilmBuffers) -> Result<bool, GpuError> {
        let is_new = self.targets.as_ref().is_none_or(|t| !t.is_for(film));
        if is_new {
            self.targets = None;
            self.targets = Some(Targets::new(gpu, film, &self.buffers, &self.passes, &self.draws)?);
        }
        Ok(is_new)
    }

    /// Writes the uniform of the next frame, and compiles what it needs and no frame before it needed.
    ///
    /// # Errors
    /// When there is no memory for the copy, or the driver refuses a shader.
    pub fn begin(
        &mut self,
        gpu: &Gpu,
        film: &FilmBuffers,
        request: FrameRequest,
    ) -> Result<BegunFrame, GpuError> {
        let (frame, rasters) = self.frame_of(film, request);
        self.compile(gpu, rasters)?;
        write_buffer(gpu, "the frame", &self.buffers.frame, bytemuck::bytes_of(&frame))?;
        let HybridFrame { clip_from_world, previous_clip_from_world, eye, previous_eye, clustered, .. } =
            frame;
        let projections = Projections { clip_from_world, previous_clip_from_world, eye, previous_eye };
        let (first_row, row_count) = request.rows;
        Ok(BegunFrame { rasters, first_row, row_count, clustered: clustered != 0, projections })
    }

    /// The uniform of a frame, and whether a rasteriser draws it.
    fn frame_of(&self, film: &FilmBuffers, request: FrameRequest) -> (HybridFrame, bool) {
        let input = FrameInput {
            camera: film.camera,
            previous_camera: self.previous_camera.unwrap_or(film.camera),
            picture: film.contents.picture(),
            sampler: sampler_kind(film.sampler),
            sample: request.sample,
            seed: film.contents.seed(),
            bounding_sphere: self.bounding_sphere,
            culls_lights: request.culls_lights,
        };
        let (frame, linear) = HybridFrame::new(&input, &self.items, self.light_words);
        let frame = HybridFrame { item_count: self.item_count, ..frame };
        (frame, request.visibility == Visibility::Raster && linear)
    }

    /// Records the passes. Afterwards [`GBuffer::pixels`] has the first hits.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, clock: &mut dyn PassClock, frame: &BegunFrame) {
        let Some(targets) = &self.targets else { return };
        let rows = Dispatch::Groups([targets.size[0].div_ceil(8), frame.row_count.div_ceil(8)]);
        if frame.rasters {
            let draws = &self.buffers.draws;
            encoder.copy_buffer_to_buffer(&self.buffers.no_draws, 0, draws, 0, draws.size());
            let items = Dispatch::Groups(groups_of_64(u64::from(self.item_count)));
            self.run(encoder, clock, targets, GBufferPass::Cull, items);
            self.draw(encoder, clock, targets, frame);
            self.run(encoder, clock, targets, GBufferPass::Resolve, rows);
        } else {
            self.run(encoder, clock, targets, GBufferPass::CameraRays, rows);
        }
    }

    fn run(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        targets: &Targets,
        pass: GBufferPass,
        size: Dispatch<'_>,
    ) {
        // What a frame needs was compiled before it is recorded.
        self.passes[pass as usize].record(encoder, clock, &targets.passes[pass as usize], size);
    }

    /// Draws the items that were found to be seen: which primitive is behind each pixel.
    fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        targets: &Targets,
        frame: &BegunFrame,
    ) {
        let slot = clock.slot("draw");
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("draw"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &targets.ids,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    // All bits set: nothing.
                    load: wgpu::LoadOp::Clear(wgpu::Color { r: f64::from(u32::MAX), ..wgpu::Color::BLACK }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: slot.map(|s| s.render()),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_scissor_rect(0, frame.first_row, targets.size[0], frame.row_count);
        pass.set_bind_group(0, &self.draws.scene, &[]);
        pass.set_bind_group(2, targets.draws.film.as_ref(), &[]);
        pass.set_bind_group(3, targets.draws.own.as_ref(), &[]);
        for class in DrawClass::ALL {
            let next = self.items.class_first.get(class as usize + 1).copied().unwrap_or(self.item_count);
            if self.items.class_first[class as usize] < next {
                pass.set_pipeline(&self.draws.pipelines[class as usize]);
                pass.draw_indirect(&self.buffers.draws, (class as usize * size_of::<DrawSize>()) as u64);
            }
        }
    }

    /// Ends a frame: where camera and instances are now is the next one's past.
    pub fn end(&mut self, encoder: &mut wgpu::CommandEncoder, camera: CameraFrame) {
        self.keep_instances(encoder);
        self.previous_camera = Some(camera);
    }

    /// The camera of the frame before.
    pub fn previous_camera(&self) -> Option<CameraFrame> {
        self.previous_camera
    }

    /// Says which camera the frame before had; `None` if there is to be no frame before.
    pub fn set_previous_camera(&mut self, camera: Option<CameraFrame>) {
        self.previous_camera = camera;
    }

    /// The scene has changed: how large it is now.
    pub fn set_bounding_sphere(&mut self, sphere: [f32; 4]) {
        self.bounding_sphere = sphere;
    }

    /// Words of a mask with a bit for each light that the scene has room for.
    pub fn light_words(&self) -> u32 {
        self.light_words
    }

    /// The uniform of the frame.
    pub fn frame(&self) -> &wgpu::Buffer {
        &self.buffers.frame
    }

    /// The instances of the frame before.
    pub fn previous_instances(&self) -> &wgpu::Buffer {
        &self.buffers.previous_instances
    }

    /// The first hits, once [`GBuffer::prepare`] has made room for them.
    pub fn pixels(&self) -> Option<&wgpu::Buffer> {
        self.targets.as_ref().map(|t| &t.pixels)
    }
}

/// Words of a mask with a bit for each light that the scene's buffer has room for.
fn light_words(scene: &GpuScene) -> u32 {
    let lights = scene.buffers.lights.size() / size_of::<LightRecord>() as u64;
    lights.div_ceil(32).max(1) as u32
}
