//! The hybrid renderer: a rasteriser finds the first surface behind each pixel, rays do the rest of the frame, pass by pass.
//!
//! ```text
//!       G-buffer ─┬▶ direct lights ───────────────┬▶ ambient occlusion ─▶ reflections ─▶ compose ─▶ film
//! cluster lights ─┘  (or: tile bounds ─▶ shafts ─▶ shadow rays ─▶ lit surfaces)
//! ```
//!
//! A frame is one sample of every pixel. From the first hits on (`gbuffer/`) the text is that of the integrator `direct`
//! (`shaders/direct.wgsl`), and so is the expected picture.
//!
//! Clusters: Olsson, Billeter and Assarsson, "Clustered Deferred and Forward Shading", HPG 2012.

mod passes;
mod shafts;
mod targets;

pub use crate::gbuffer::{HybridFrame, HybridPixel, Picture, Projection};
pub use passes::HybridPass;
#[cfg(test)]
pub(crate) use shafts::linkage as shafts_linkage;

use crate::batch::{Batch, BatchPixels};
use crate::film::FilmBuffers;
use crate::gbuffer::{BegunFrame, FrameRequest, GBuffer, SLICES, tiles};
use crate::kernel::Kernel;
use crate::pass::{self, Dispatch, groups_of_64};
use crate::scene::upload::{empty_buffer, storage_buffer};
use crate::shader::Variant;
use crate::timing::{PassClock, Timer};
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use backend::{HybridSettings, Integrator, Visibility};
use optics::camera::CameraFrame;
use passes::frame_pass;
use shafts::Shafts;
use targets::{LightWords, REFLECTING_HEAD, Targets};
use wgpu::BufferUsages;

/// Most passes of a frame.
pub(crate) const FRAME_PASSES: usize = 13;

/// Lights from which on all are asked for before they shade. Fewer are traced where they are shaded, because a pass more takes longer
/// than it saves with one light: see docs/performance.md.
const MANY_LIGHTS: u32 = 4;

/// Most words that say which lights are hidden from a pixel: 256 lights, or 64 with four samples each. More lights take more time
/// than the two passes save, and more memory than they are worth.
const MOST_HIDDEN_WORDS: u32 = 8;

/// Workgroups of a row of the dispatch for reflections: with 65,535 rows, more pixels than a picture can have.
const REFLECTION_ROW: u32 = 256;

/// The hybrid renderer of a scene on a device.
pub struct HybridKernel {
    gbuffer: GBuffer,
    passes: Vec<pass::Pass>,
    reflections: ReflectionBuffers,
    targets: Option<Targets>,
    /// Whether clusters tell which lights count where, rather than each pixel by itself. Tests compare both.
    clusters_lights: bool,
    /// Lights of the scene.
    light_count: u32,
    /// Whether a pass asks which lights are hidden before another shades; by their number unless tests say it.
    asks_lights_first: Option<bool>,
    /// Where shadow rays begin their walk, if not at the root.
    shafts: Option<Shafts>,
}

/// What the dispatch for reflections is sized by.
struct ReflectionBuffers {
    /// The size of the dispatch for reflections.
    groups: wgpu::Buffer,
    /// The head of the list of reflecting pixels when it is empty.
    none: wgpu::Buffer,
}

impl ReflectionBuffers {
    fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let size = "the size of a dispatch";
        let empty = [REFLECTION_ROW, 0, 1, 0];
        Ok(Self {
            groups: empty_buffer(gpu, size, REFLECTING_HEAD, BufferUsages::INDIRECT)?,
            none: storage_buffer(gpu, "an empty list of reflections", &empty, BufferUsages::COPY_SRC)?,
        })
    }
}

/// A frame that was prepared: what [`HybridKernel::record`] needs to know.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedFrame {
    begun: BegunFrame,
    shading: Shading,
}

/// What is switched on in a frame after its first hits.
#[derive(Clone, Copy, Debug)]
struct Shading {
    shadows: bool,
    reflects: bool,
}

impl Shading {
    fn of(settings: &HybridSettings) -> Self {
        Self { shadows: settings.shadows, reflects: settings.rays.max_depth > 1 }
    }
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
        let gbuffer = GBuffer::new(gpu, variant, scene, tracer)?;
        let shafts = Shafts::new(scene, tracer.linkage_below());
        let make = |pass| frame_pass(gpu, pass, variant, scene, tracer, shafts.as_ref());
        let mut kernel = Self {
            gbuffer,
            passes: HybridPass::ALL.into_iter().map(make).collect::<Result<_, GpuError>>()?,
            reflections: ReflectionBuffers::new(gpu)?,
            targets: None,
            clusters_lights: true,
            light_count: scene.tables.lights.len() as u32,
            asks_lights_first: None,
            shafts,
        };
        let lights = kernel.light_words_of([1, 1], u64::MAX, settings.rays.shadow_samples);
        let shading = Self::own_passes(settings.light_cutoff > 0.0, Shading::of(settings), lights);
        let first_hits = kernel.gbuffer.passes(settings.visibility == Visibility::Raster);
        pass::compile(gpu, wanted_passes(&mut kernel.passes, &shading).chain(first_hits))?;
        Ok(kernel)
    }

    /// Makes what depends on the picture's size and on how many shadow rays a light gets, and binds the film, unless that was done.
    /// Returns how much it is for lights.
    fn prepare_targets(
        &mut self,
        gpu: &Gpu,
        film: &FilmBuffers,
        light_samples: u32,
    ) -> Result<LightWords, GpuError> {
        let size = film.contents.picture().window_size;
        let lights = self.light_words_of(size, gpu.limits.max_storage_buffer_binding_size, light_samples);
        if self.targets.as_ref().is_none_or(|t| !t.is_for(film, lights)) {
            self.targets = None;
            self.gbuffer.prepare(gpu, film)?;
            self.targets = Some(Targets::new(gpu, film, &self.gbuffer, lights, &self.passes)?);
        }
        Ok(lights)
    }

    /// What a picture needs for its lights, where a buffer may have `most_bytes`.
    fn light_words_of(&self, size: [u32; 2], most_bytes: u64, light_samples: u32) -> LightWords {
        let [across, down] = tiles(size);
        let masks =
            u64::from(across) * u64::from(down) * u64::from(SLICES) * u64::from(self.gbuffer.light_words());
        let hidden = self.gbuffer.light_words().saturating_mul(light_samples);
        let shafts = self.shafts.as_ref().map_or(0, |shafts| shafts.words(size));
        let all = LightWords { masks, hidden, shafts };
        let fits = all.hidden <= MOST_HIDDEN_WORDS && all.bytes(size) <= most_bytes;
        let wanted = self.asks_lights_first.unwrap_or(self.light_count >= MANY_LIGHTS);
        if fits && wanted { all } else { LightWords { hidden: 0, shafts: 0, ..all } }
    }

    /// All passes of a frame but those of its first hits.
    fn own_passes(culls_lights: bool, shading: Shading, lights: LightWords) -> Vec<HybridPass> {
        let mut passes = Self::shading_passes(shading, lights);
        if culls_lights {
            passes.push(HybridPass::ClusterLights);
        }
        passes
    }

    /// The passes of a frame after its first hits.
    fn shading_passes(shading: Shading, lights: LightWords) -> Vec<HybridPass> {
        let mut passes = match (lights.hidden > 0, shading.shadows) {
            (true, true) if lights.shafts > 0 => {
                vec![
                    HybridPass::TileBounds,
                    HybridPass::Shafts,
                    HybridPass::ShadowRays,
                    HybridPass::LitSurfaces,
                ]
            }
            (true, true) => vec![HybridPass::ShadowRays, HybridPass::LitSurfaces],
            (true, false) => vec![HybridPass::LitSurfaces],
            (false, _) => vec![HybridPass::DirectLights],
        };
        passes.push(HybridPass::AmbientOcclusion);
        if shading.reflects {
            passes.extend([HybridPass::ListReflecting, HybridPass::Reflections]);
        }
        passes.push(HybridPass::Compose);
        passes
    }

    /// Writes the uniform of the next frame, and compiles what it needs; `sample` says where rays go through the pixels, `rows` are the
    /// first row and the number of rows.
    ///
    /// # Errors
    /// When the driver refuses a shader, or there is no memory.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        film: &FilmBuffers,
        settings: &HybridSettings,
        sample: u32,
        rows: (u32, u32),
    ) -> Result<PreparedFrame, GpuError> {
        let lights = self.prepare_targets(gpu, film, settings.rays.shadow_samples)?;
        let culls_lights = settings.light_cutoff > 0.0 && self.clusters_lights;
        let request = FrameRequest { visibility: settings.visibility, sample, rows, culls_lights };
        let begun = self.gbuffer.begin(gpu, film, request)?;
        let shading = Shading::of(settings);
        let own = Self::own_passes(begun.clustered, shading, lights);
        pass::compile(gpu, wanted_passes(&mut self.passes, &own))?;
        Ok(PreparedFrame { begun, shading })
    }

    /// Records all passes of a frame.
    pub(crate) fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        frame: &PreparedFrame,
    ) {
        let Some(targets) = &self.targets else { return };
        let PreparedFrame { begun, shading } = frame;
        if begun.clustered {
            let clusters = Dispatch::Groups(groups_of_64(targets.lights.masks));
            self.run(encoder, clock, targets, HybridPass::ClusterLights, clusters);
        }
        self.gbuffer.record(encoder, clock, begun);
        let rows = Dispatch::Groups([targets.size[0].div_ceil(8), begun.row_count.div_ceil(8)]);
        let (head, size) = (&targets.reflecting, &self.reflections.groups);
        for pass in Self::shading_passes(*shading, targets.lights) {
            let size_of_pass = match pass {
                HybridPass::ListReflecting => {
                    encoder.copy_buffer_to_buffer(&self.reflections.none, 0, head, 0, REFLECTING_HEAD);
                    rows
                }
                HybridPass::Reflections => {
                    encoder.copy_buffer_to_buffer(head, 0, size, 0, REFLECTING_HEAD);
                    Dispatch::Indirect(size, 0)
                }
                HybridPass::TileBounds => Dispatch::Groups(Shafts::tiles([targets.size[0], begun.row_count])),
                HybridPass::Shafts => {
                    let lists = Shafts::lists([targets.size[0], begun.row_count], self.light_count);
                    Dispatch::Groups(groups_of_64(lists))
                }
                _ => rows,
            };
            self.run(encoder, clock, targets, pass, size_of_pass);
        }
    }

    fn run(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        targets: &Targets,
        pass: HybridPass,
        size: Dispatch<'_>,
    ) {
        // What a frame needs was compiled before it is recorded.
        self.passes[pass as usize].record(encoder, clock, &targets.passes[pass as usize], size);
    }

    /// Ends a frame: where camera and instances are now is the next one's past.
    pub(crate) fn end(&mut self, encoder: &mut wgpu::CommandEncoder, camera: CameraFrame) {
        self.gbuffer.end(encoder, camera);
    }

    /// Forgets all frames so far.
    pub(crate) fn forget_past(&mut self) {
        self.gbuffer.set_previous_camera(None);
    }

    /// The scene has changed: how large it is now, and how many lights it has.
    pub(crate) fn set_changed(&mut self, bounding_sphere: [f32; 4], light_count: u32) {
        self.gbuffer.set_bounding_sphere(bounding_sphere);
        self.light_count = light_count;
    }

    /// The first hits of the last frame, if there is one.
    pub(crate) fn first_hits(&self) -> Option<&wgpu::Buffer> {
        self.gbuffer.pixels()
    }
}

/// Some of all passes.
fn wanted_passes<'a>(
    passes: &'a mut [pass::Pass],
    wanted: &'a [HybridPass],
) -> impl Iterator<Item = &'a mut pass::Pass> {
    let is_wanted = |number: usize| wanted.iter().any(|&pass| pass as usize == number);
    let passes = passes.iter_mut().enumerate().filter(move |(number, _)| is_wanted(*number));
    passes.map(|(_, pass)| pass)
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
        let mut last = None;
        for sample in batch.first_sample..batch.first_sample + batch.sample_count {
            film.set_batch(gpu, Batch { first_sample: sample, sample_count: 1, ..batch })?;
            let frame = self.prepare(gpu, film, &settings, sample, (first, count))?;
            timer.reserve(gpu, FRAME_PASSES)?;
            let submit = || {
                let mut encoder =
                    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                self.record(&mut encoder, timer, &frame);
                self.gbuffer.keep_instances(&mut encoder);
                gpu.queue.submit([encoder.finish()])
            };
            last = Some(gpu.guarded(submit).map_err(failed)?);
            self.gbuffer.set_previous_camera(Some(film.camera));
        }
        last.ok_or_else(|| failed("the batch is empty".into()))
    }
}

#[cfg(test)]
mod tests;
