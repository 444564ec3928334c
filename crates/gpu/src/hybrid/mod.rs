//! The hybrid renderer: a rasteriser finds the first surface behind each pixel, rays do the rest of the frame, pass by pass.
//!
//! ```text
//! cull ─▶ draw ─▶ resolve ─┬▶ direct lights ───────────────┬▶ ambient occlusion ─▶ reflections ─▶ compose ─▶ film
//!      (or: camera rays) ──┤  (or: tile bounds ─▶ shafts ─▶ shadow rays ─▶ lit surfaces)
//!           cluster lights ┘
//! ```
//!
//! A frame is one sample of every pixel, at the same place in each, so that frames add up to an antialiased picture with depth
//! of field. Vertices are pulled by number from the scene's buffers; what was drawn is an item and a primitive for each pixel, 32
//! bits, from which `resolve` makes the hit that a ray would have made. From there on the text is that of the integrator
//! `direct` (`shaders/direct.wgsl`), and so is the expected picture.
//!
//! Deferred attributes: Burns and Hunt, "The Visibility Buffer: A Cache-Friendly Approach to Deferred Shading", JCGT 2(2), 2013.
//! Clusters: Olsson, Billeter and Assarsson, "Clustered Deferred and Forward Shading", HPG 2012.

mod compiled;
mod frame;
mod gbuffer;
mod items;
mod live;
mod passes;
mod projection;
mod shafts;
mod targets;

pub use frame::HybridFrame;
pub(crate) use gbuffer::{BegunFrame, GBUFFER_PASSES, GBuffer, Projections};
pub use live::{LiveScene, Motion};
pub use passes::Pass;
#[cfg(test)]
pub(crate) use passes::linkage;
pub(crate) use passes::slots;
pub use projection::{Picture, Projection};
#[cfg(test)]
pub(crate) use shafts::linkage as shafts_linkage;
pub use targets::HybridPixel;

use crate::batch::{Batch, BatchPixels};
use crate::film::FilmBuffers;
use crate::kernel::Kernel;
use crate::pass::{self, Dispatch};
use crate::scene::records::LightRecord;
use crate::scene::upload::{empty_buffer, storage_buffer, write_buffer};
use crate::shader::Variant;
use crate::shader::variant::sampler_kind;
use crate::timing::{PassClock, Timer};
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use backend::{HybridSettings, Integrator, Visibility};
use compiled::{CompiledDraws, frame_pass};
use frame::{FrameInput, SLICES, tiles};
use items::{DrawClass, Items, MOST_ITEMS};
use optics::camera::CameraFrame;
use shafts::Shafts;
use targets::{LightWords, REFLECTING_HEAD, Targets};
use wgpu::BufferUsages;

/// Most passes of a frame.
const FRAME_PASSES: usize = 13;

/// Lights from which on all are asked for before they shade. Fewer are traced where they are shaded, because a pass more takes longer
/// than it saves with one light: see docs/performance.md.
const MANY_LIGHTS: u32 = 4;

/// Most words that say which lights are hidden from a pixel: 256 lights, or 64 with four samples each. More lights take more time
/// than the two passes save, and more memory than they are worth.
const MOST_HIDDEN_WORDS: u32 = 8;

/// Workgroups of a row of the dispatch for reflections: with 65,535 rows, more pixels than a picture can have.
const REFLECTION_ROW: u32 = 256;

/// The size of a draw, as the driver reads it.
type DrawSize = [u32; 4];

/// The hybrid renderer of a scene on a device.
pub struct HybridKernel {
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
    /// Whether clusters tell which lights count where, rather than each pixel by itself. Tests compare both.
    clusters_lights: bool,
    /// Lights of the scene.
    light_count: u32,
    /// Whether a pass asks which lights are hidden before another shades; by their number unless tests say it.
    asks_lights_first: Option<bool>,
    /// Where shadow rays begin their walk, if not at the root.
    shafts: Option<Shafts>,
}

/// What a scene has in group 3, whatever the picture's size.
struct FrameBuffers {
    frame: wgpu::Buffer,
    items: wgpu::Buffer,
    parts: wgpu::Buffer,
    seen_items: wgpu::Buffer,
    draws: wgpu::Buffer,
    /// The size of the dispatch for reflections.
    reflection_groups: wgpu::Buffer,
    /// The head of the list of reflecting pixels when it is empty.
    no_reflections: wgpu::Buffer,
    /// [`FrameBuffers::draws`] before anything was found to be seen.
    no_draws: wgpu::Buffer,
    instances: wgpu::Buffer,
    previous_instances: wgpu::Buffer,
}

impl FrameBuffers {
    fn new(gpu: &Gpu, scene: &GpuScene, items: &Items) -> Result<Self, GpuError> {
        let sizes: Vec<DrawSize> = DrawClass::ALL.map(|class| [class.vertices(), 0, 0, 0]).to_vec();
        let item_words = (items.items.len().max(1) * size_of::<u32>()) as u64;
        let draw_bytes = size_of_val(&sizes[..]) as u64;
        let instances = &scene.buffers.instances;
        let uniform = size_of::<HybridFrame>() as u64;
        let drawn = BufferUsages::STORAGE | BufferUsages::INDIRECT;
        Ok(Self {
            frame: empty_buffer(gpu, "the frame", uniform, BufferUsages::UNIFORM)?,
            items: storage_buffer(gpu, "items to draw", &items.items, BufferUsages::empty())?,
            parts: storage_buffer(gpu, "parts to draw", &items.parts, BufferUsages::empty())?,
            seen_items: empty_buffer(gpu, "items that are seen", item_words, BufferUsages::STORAGE)?,
            draws: empty_buffer(gpu, "sizes of draws", draw_bytes, drawn)?,
            no_draws: storage_buffer(gpu, "sizes of empty draws", &sizes, BufferUsages::COPY_SRC)?,
            reflection_groups: empty_buffer(
                gpu,
                "the size of a dispatch",
                REFLECTING_HEAD,
                BufferUsages::INDIRECT,
            )?,
            no_reflections: storage_buffer(
                gpu,
                "an empty list of reflections",
                &[REFLECTION_ROW, 0, 1, 0],
                BufferUsages::COPY_SRC,
            )?,
            instances: instances.clone(),
            previous_instances: empty_buffer(
                gpu,
                "previous instances",
                instances.size(),
                BufferUsages::STORAGE,
            )?,
        })
    }
}

/// What is switched on in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plan {
    rasters: bool,
    culls_lights: bool,
    shadows: bool,
    reflects: bool,
    first_row: u32,
    row_count: u32,
}

impl HybridKernel {
    /// Compiles what frames with `settings` need for a scene and a tracer. Other settings compile what else they need with their
    /// first frame.
    ///
    /// # Errors
    /// When the driver refuses a shader, or the scene has more to draw than a pixel can name.
    pub fn new(
        gpu: &Gpu,
        variant: Variant,
        scene: &GpuScene,
        tracer: &dyn Tracer,
        settings: &HybridSettings,
    ) -> Result<Self, GpuError> {
        let mut kernel = Self::with_passes(gpu, variant, scene, tracer, &Pass::ALL)?;
        let plan = Plan {
            rasters: settings.visibility == Visibility::Raster,
            culls_lights: settings.light_cutoff > 0.0,
            shadows: settings.shadows,
            reflects: settings.rays.max_depth > 1,
            first_row: 0,
            row_count: 0,
        };
        let lights = kernel.light_words_of([1, 1], u64::MAX, settings.rays.shadow_samples);
        kernel.compile_frame(gpu, plan, lights)?;
        Ok(kernel)
    }

    /// The first of the passes, without compiling any.
    fn with_passes(
        gpu: &Gpu,
        variant: Variant,
        scene: &GpuScene,
        tracer: &dyn Tracer,
        passes: &[Pass],
    ) -> Result<Self, GpuError> {
        let mut items = Items::new(&scene.tables);
        let item_count = items.items.len() as u64;
        if item_count > MOST_ITEMS {
            let (adapter, limit) = (gpu.info.name.clone(), "pieces of geometry to draw");
            return Err(GpuError::Limit { adapter, limit, needed: item_count, offered: MOST_ITEMS });
        }
        let buffers = FrameBuffers::new(gpu, scene, &items)?;
        (items.items, items.parts) = (Vec::new(), Vec::new());
        let shafts = Shafts::new(scene, tracer.linkage_below());
        let compile = |&pass| frame_pass(gpu, pass, variant, scene, tracer, shafts.as_ref());
        let kernel = Self {
            passes: passes.iter().map(compile).collect::<Result<_, GpuError>>()?,
            draws: CompiledDraws::new(gpu, variant, scene)?,
            buffers,
            items,
            item_count: item_count as u32,
            light_words: light_words(scene),
            bounding_sphere: scene.tables.bounding_sphere,
            targets: None,
            previous_camera: None,
            clusters_lights: true,
            light_count: scene.tables.lights.len() as u32,
            asks_lights_first: None,
            shafts,
        };
        gpu.guarded(|| kernel.submit_alone(gpu, |encoder| kernel.keep_instances(encoder)))
            .map_err(|reason| GpuError::Device { doing: "copying instances", reason })?;
        Ok(kernel)
    }

    fn submit_alone(&self, gpu: &Gpu, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        record(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
    }

    /// Where instances are now is where they were in the next frame's past.
    fn keep_instances(&self, encoder: &mut wgpu::CommandEncoder) {
        let (from, to) = (&self.buffers.instances, &self.buffers.previous_instances);
        encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
    }

    /// Makes what depends on the picture's size and on how many shadow rays a light gets, and binds the film, unless that was done.
    /// Returns how much it is for lights.
    fn prepare(&mut self, gpu: &Gpu, film: &FilmBuffers, light_samples: u32) -> Result<LightWords, GpuError> {
        let size = film.contents.picture().window_size;
        let lights = self.light_words_of(size, gpu.limits.max_storage_buffer_binding_size, light_samples);
        if self.targets.as_ref().is_none_or(|t| !t.is_for(film, lights)) {
            self.targets = None;
            self.targets = Some(Targets::new(gpu, film, &self.buffers, lights, &self.passes, &self.draws)?);
        }
        Ok(lights)
    }

    /// What a picture needs for its lights, where a buffer may have `most_bytes`.
    fn light_words_of(&self, size: [u32; 2], most_bytes: u64, light_samples: u32) -> LightWords {
        let [across, down] = tiles(size);
        let masks = u64::from(across) * u64::from(down) * u64::from(SLICES) * u64::from(self.light_words);
        let hidden = self.light_words.saturating_mul(light_samples);
        let shafts = self.shafts.as_ref().map_or(0, |shafts| shafts.words(size));
        let all = LightWords { masks, hidden, shafts };
        let fits = all.hidden <= MOST_HIDDEN_WORDS && all.bytes(size) <= most_bytes;
        let wanted = self.asks_lights_first.unwrap_or(self.light_count >= MANY_LIGHTS);
        if fits && wanted { all } else { LightWords { hidden: 0, shafts: 0, ..all } }
    }

    /// Compiles what a frame needs and no frame before it needed.
    fn compile_frame(&mut self, gpu: &Gpu, plan: Plan, lights: LightWords) -> Result<(), GpuError> {
        self.compile_first_hits(gpu, plan)?;
        self.compile(gpu, &Self::shading_passes(plan, lights))
    }

    /// The part of that until first hits are known.
    fn compile_first_hits(&mut self, gpu: &Gpu, plan: Plan) -> Result<(), GpuError> {
        let visible: &[Pass] = if plan.rasters { &[Pass::Cull, Pass::Resolve] } else { &[Pass::CameraRays] };
        let culls: &[Pass] = if plan.culls_lights { &[Pass::ClusterLights] } else { &[] };
        self.compile(gpu, &[visible, culls].concat())
    }

    fn compile(&mut self, gpu: &Gpu, wanted: &[Pass]) -> Result<(), GpuError> {
        let is_wanted = |number: usize| wanted.iter().any(|&pass| pass as usize == number);
        let passes = self.passes.iter_mut().enumerate().filter(|(number, _)| is_wanted(*number));
        pass::compile(gpu, passes.map(|(_, pass)| pass))
    }

    /// The passes of a frame after its first hits.
    fn shading_passes(plan: Plan, lights: LightWords) -> Vec<Pass> {
        let mut passes = match (lights.hidden > 0, plan.shadows) {
            (true, true) if lights.shafts > 0 => {
                vec![Pass::TileBounds, Pass::Shafts, Pass::ShadowRays, Pass::LitSurfaces]
            }
            (true, true) => vec![Pass::ShadowRays, Pass::LitSurfaces],
            (true, false) => vec![Pass::LitSurfaces],
            (false, _) => vec![Pass::DirectLights],
        };
        passes.push(Pass::AmbientOcclusion);
        if plan.reflects {
            passes.extend([Pass::ListReflecting, Pass::Reflections]);
        }
        passes.push(Pass::Compose);
        passes
    }

    /// The uniform of a frame, and what the frame consists of.
    fn plan(
        &self,
        film: &FilmBuffers,
        settings: &HybridSettings,
        sample: u32,
        (first_row, row_count): (u32, u32),
    ) -> (HybridFrame, Plan) {
        let culls_lights = settings.light_cutoff > 0.0 && self.clusters_lights;
        let input = FrameInput {
            camera: film.camera,
            previous_camera: self.previous_camera.unwrap_or(film.camera),
            picture: film.contents.picture(),
            sampler: sampler_kind(film.sampler),
            sample,
            seed: film.contents.seed(),
            bounding_sphere: self.bounding_sphere,
            culls_lights,
        };
        let (frame, linear) = HybridFrame::new(&input, &self.items, self.light_words);
        let frame = HybridFrame { item_count: self.item_count, ..frame };
        let plan = Plan {
            rasters: settings.visibility == Visibility::Raster && linear,
            culls_lights: frame.clustered != 0,
            shadows: settings.shadows,
            reflects: settings.rays.max_depth > 1,
            first_row,
            row_count,
        };
        (frame, plan)
    }

    /// Records all passes of a frame.
    fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        targets: &Targets,
        plan: Plan,
    ) {
        self.record_first_hits(encoder, clock, targets, plan);
        let rows = Dispatch::Groups([targets.size[0].div_ceil(8), plan.row_count.div_ceil(8)]);
        let (head, size) = (&targets.reflecting, &self.buffers.reflection_groups);
        for pass in Self::shading_passes(plan, targets.lights) {
            let size_of_pass = match pass {
                Pass::ListReflecting => {
                    encoder.copy_buffer_to_buffer(&self.buffers.no_reflections, 0, head, 0, REFLECTING_HEAD);
                    rows
                }
                Pass::Reflections => {
                    encoder.copy_buffer_to_buffer(head, 0, size, 0, REFLECTING_HEAD);
                    Dispatch::Indirect(size, 0)
                }
                Pass::TileBounds => Dispatch::Groups(Shafts::tiles([targets.size[0], plan.row_count])),
                Pass::Shafts => {
                    let lists = Shafts::lists([targets.size[0], plan.row_count], self.light_count);
                    Dispatch::Groups(groups_of_64(lists))
                }
                _ => rows,
            };
            self.run(encoder, clock, targets, pass, size_of_pass);
        }
    }

    /// Records the passes that find which surface each pixel sees.
    fn record_first_hits(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        targets: &Targets,
        plan: Plan,
    ) {
        let rows = Dispatch::Groups([targets.size[0].div_ceil(8), plan.row_count.div_ceil(8)]);
        if plan.culls_lights {
            let clusters = Dispatch::Groups(groups_of_64(targets.lights.masks));
            self.run(encoder, clock, targets, Pass::ClusterLights, clusters);
        }
        if plan.rasters {
            let draws = &self.buffers.draws;
            encoder.copy_buffer_to_buffer(&self.buffers.no_draws, 0, draws, 0, draws.size());
            let items = Dispatch::Groups(groups_of_64(u64::from(self.item_count)));
            self.run(encoder, clock, targets, Pass::Cull, items);
            self.draw(encoder, clock, targets, plan);
            self.run(encoder, clock, targets, Pass::Resolve, rows);
        } else {
            self.run(encoder, clock, targets, Pass::CameraRays, rows);
        }
    }

    fn run(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        targets: &Targets,
        pass: Pass,
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
        plan: Plan,
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
        pass.set_scissor_rect(0, plan.first_row, targets.size[0], plan.row_count);
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
}

/// Words of a mask with a bit for each light that the scene's buffer has room for.
fn light_words(scene: &GpuScene) -> u32 {
    let lights = scene.buffers.lights.size() / size_of::<LightRecord>() as u64;
    lights.div_ceil(32).max(1) as u32
}

/// Workgroups of 64 for so many invocations, as rows of a length that every device can start.
fn groups_of_64(invocations: u64) -> [u32; 2] {
    const ROW: u64 = 32_768;
    let groups = invocations.div_ceil(64).max(1);
    [groups.min(ROW) as u32, groups.div_ceil(ROW) as u32]
}

impl Kernel for HybridKernel {
    fn submit(
        &mut self,
        gpu: &Gpu,
        film: &mut FilmBuffers,
        batch: Batch,
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        let failed = |reason| GpuError::Device { doing: "starting a frame", reason };
        let Integrator::Hybrid(settings) = film.integrator else {
            return Err(failed("the film is for another integrator".into()));
        };
        let BatchPixels::Rows { first, count } = batch.pixels else {
            return Err(failed("frames are of whole rows, not of lists of pixels".into()));
        };
        let lights = self.prepare(gpu, film, settings.rays.shadow_samples)?;
        let mut last = None;
        for sample in batch.first_sample..batch.first_sample + batch.sample_count {
            film.set_batch(gpu, Batch { first_sample: sample, sample_count: 1, ..batch })?;
            let (frame, plan) = self.plan(film, &settings, sample, (first, count));
            self.compile_frame(gpu, plan, lights)?;
            write_buffer(gpu, "the frame", &self.buffers.frame, bytemuck::bytes_of(&frame))?;
            timer.reserve(gpu, FRAME_PASSES)?;
            let Some(targets) = &self.targets else {
                return Err(failed("there is nothing to draw to".into()));
            };
            let submit = || {
                let mut encoder =
                    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                self.record(&mut encoder, timer, targets, plan);
                self.keep_instances(&mut encoder);
                gpu.queue.submit([encoder.finish()])
            };
            last = Some(gpu.guarded(submit).map_err(failed)?);
            self.previous_camera = Some(film.camera);
        }
        last.ok_or_else(|| failed("the batch is empty".into()))
    }
}

#[cfg(test)]
mod tests;
