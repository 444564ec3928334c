//! Path tracing as wavefronts: instead of one kernel that follows a path to its end, a kernel for each thing that happens
//! at a vertex, with queues between them. All paths of a wave take a step before any takes the next, so invocations that
//! run side by side do the same.
//!
//! Method: Laine, Karras and Aila, "Megakernels Considered Harmful: Wavefront Path Tracing on GPUs", HPG 2013.
//!
//! What happens at a vertex is the same text as the megakernel's (`shaders/path_vertex.wgsl`) with the same random numbers,
//! so both make the same samples, up to rounding.

pub mod choice;
pub(crate) mod queues;
pub mod stage;

pub use queues::Queues;

use crate::bindings;
use crate::film::{Batch, FilmBuffers};
use crate::kernel::Kernel;
use crate::shader::Variant;
use crate::timing::Timer;
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use queues::{Dispatches, GROUP};
use stage::{Stage, shading_text, tracing_text};
use wgpu::BufferBindingType;

/// The compiled stages for a scene and a tracer.
pub struct WavefrontKernel {
    /// By stage.
    stages: Vec<CompiledStage>,
    scene: wgpu::BindGroup,
    tracer: wgpu::BindGroup,
    queues: Queues,
    wants_aovs: bool,
    /// The pixels of the film that is bound.
    film: Option<wgpu::Buffer>,
}

struct CompiledStage {
    pipeline: wgpu::ComputePipeline,
    queues: wgpu::BindGroup,
    film_layout: wgpu::BindGroupLayout,
    film: Option<wgpu::BindGroup>,
}

/// How many workgroups a stage gets.
#[derive(Clone, Copy)]
enum Work {
    /// Enough for this many invocations.
    Invocations(u32),
    /// As many as the device has written there.
    Counted(u64),
}

impl WavefrontKernel {
    /// Compiles the stages.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    pub fn new(
        gpu: &Gpu,
        variant: Variant,
        scene: &GpuScene,
        tracer: &dyn Tracer,
        queues: Queues,
    ) -> Result<Self, GpuError> {
        let name = format!("wavefront on {}", tracer.kind().name());
        let tracing = gpu.shader_text(&name, tracing_text(&tracer.text(), variant));
        let shading = gpu.shader_text("wavefront", shading_text(variant));
        let compile = |stage: Stage| {
            let (queue_layout, film_layout) = gpu
                .guarded(|| {
                    let queues = layout(gpu, stage.queue_bindings(), false);
                    (queues, layout(gpu, stage.film_bindings(), true))
                })
                .map_err(|reason| GpuError::Device { doing: "binding the queues", reason })?;
            let (text, tracer_layout) =
                if stage.traces() { (&tracing, Some(tracer.layout())) } else { (&shading, None) };
            let groups = [Some(&scene.layout), tracer_layout, Some(&film_layout), Some(&queue_layout)];
            let pipeline = text.pipeline(stage.name(), &groups)?;
            let buffers = stage.queue_bindings().iter().map(|&b| (b, queues.buffer(b)));
            let queues = bind(gpu, "queues", &queue_layout, buffers)?;
            Ok(CompiledStage { pipeline, queues, film_layout, film: None })
        };
        let stages = Stage::ALL.into_iter().map(compile).collect::<Result<_, GpuError>>()?;
        let (scene, tracer) = (scene.bind_group.clone(), tracer.bind_group().clone());
        Ok(Self { stages, scene, tracer, queues, wants_aovs: variant.aovs, film: None })
    }

    /// Binds a film, if it is not the one that is bound.
    fn bind_film(&mut self, gpu: &Gpu, film: &FilmBuffers) -> Result<(), GpuError> {
        if self.film.as_ref() == Some(&film.pixels) {
            return Ok(());
        }
        let buffers = [&film.view, &film.pixels, &film.counters, &film.aovs];
        for (stage, compiled) in Stage::ALL.into_iter().zip(&mut self.stages) {
            let bound = stage.film_bindings().iter().chain(&[0]).map(|&b| (b, buffers[b as usize]));
            compiled.film = Some(bind(gpu, "film", &compiled.film_layout, bound)?);
        }
        self.film = Some(film.pixels.clone());
        Ok(())
    }

    /// Records one pass of some stages, one after the other.
    fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &mut Timer,
        name: &'static str,
        work: &[(Stage, Work)],
    ) {
        let slot = timer.slot(name);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(name),
            timestamp_writes: slot.map(|s| s.compute()),
        });
        pass.set_bind_group(0, &self.scene, &[]);
        for &(stage, work) in work {
            let compiled = &self.stages[stage as usize];
            pass.set_pipeline(&compiled.pipeline);
            pass.set_bind_group(1, stage.traces().then_some(&self.tracer), &[]);
            pass.set_bind_group(2, &compiled.film, &[]);
            pass.set_bind_group(3, &compiled.queues, &[]);
            match work {
                Work::Invocations(n) => pass.dispatch_workgroups(n.div_ceil(GROUP), 1, 1),
                Work::Counted(at) => pass.dispatch_workgroups_indirect(self.queues.dispatches(), at),
            }
        }
    }

    /// Records all passes of a wave of `paths` camera paths.
    fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &mut Timer,
        paths: u32,
        pixels: u32,
        branches: u32,
        max_depth: u32,
    ) {
        let arriving = Work::Counted(Dispatches::PATHS);
        let prepare = (Stage::Prepare, Work::Invocations(1));
        let connect = (Stage::Connect, Work::Counted(Dispatches::SHADOW_RAYS));
        let mut pass = |stage: Stage, work: &[(Stage, Work)]| self.pass(encoder, timer, stage.name(), work);
        pass(Stage::Generate, &[(Stage::Generate, Work::Invocations(paths))]);
        for depth in 1..=max_depth {
            // The host knows how many paths there are only at the first vertex.
            let first = depth == 1;
            let extend = if first { Work::Invocations(paths) } else { arriving };
            let shade = if first { Work::Invocations(paths * branches) } else { arriving };
            let extending = Stage::extending(depth, max_depth);
            pass(Stage::Extend, &[(extending, extend)]);
            if first && self.wants_aovs {
                pass(Stage::Record, &[(Stage::Record, extend)]);
            }
            pass(Stage::Shade, &[(Stage::Shade, shade)]);
            // From the last vertex no path goes on, and no light is asked.
            if depth < max_depth {
                pass(Stage::Connect, &[prepare, connect]);
            }
        }
        pass(Stage::Accumulate, &[(Stage::Accumulate, Work::Invocations(pixels))]);
    }
}

/// Passes of a wave.
fn pass_count(max_depth: u32) -> usize {
    3 + 3 * max_depth as usize
}

/// The parts in which `pixels` pixels go through queues that hold `most` at a time: as few as possible, of equal size.
fn waves(pixels: u32, most: u32) -> impl Iterator<Item = (u32, u32)> {
    let count = pixels.div_ceil(most.max(1)).max(1);
    let size = pixels.div_ceil(count).max(1);
    (0..pixels).step_by(size as usize).map(move |first| (first, size.min(pixels - first)))
}

impl Kernel for WavefrontKernel {
    fn submit(
        &mut self,
        gpu: &Gpu,
        film: &mut FilmBuffers,
        batch: Batch,
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        self.bind_film(gpu, film)?;
        let (branches, max_depth) = (film.contents.splitting(), film.contents.max_depth());
        let capacity = self.queues.capacity() / branches;
        if capacity == 0 {
            let (adapter, limit) = (gpu.info.name.clone(), "paths in flight");
            let (needed, offered) = (u64::from(branches), u64::from(self.queues.capacity()));
            return Err(GpuError::Limit { adapter, limit, needed, offered });
        }
        // Layers are sums over a pixel's samples: two samples of one pixel at a time would get in each other's way.
        let most_samples = if self.wants_aovs { 1 } else { capacity };
        let end = batch.first_sample + batch.sample_count;
        let pixels = batch.pixel_count(film.contents.window_width());
        let failed = |reason| GpuError::Device { doing: "starting a wave", reason };
        let mut last = None;
        for first_sample in (batch.first_sample..end).step_by(most_samples as usize) {
            let sample_count = most_samples.min(end - first_sample);
            film.set_batch(gpu, Batch { first_sample, sample_count, ..batch })?;
            for (first_pixel, pixel_count) in waves(pixels, capacity / sample_count) {
                let paths = pixel_count * sample_count;
                self.queues.begin(gpu, first_pixel, pixel_count, paths)?;
                timer.reserve(gpu, pass_count(max_depth))?;
                let submit = || {
                    let mut encoder =
                        gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                    self.record(&mut encoder, timer, paths, pixel_count, branches, max_depth);
                    gpu.queue.submit([encoder.finish()])
                };
                last = Some(gpu.guarded(submit).map_err(failed)?);
            }
        }
        last.ok_or_else(|| failed("the batch is empty".into()))
    }
}

/// Layout of a group of storage buffers at some bindings, with the view at binding 0 if `view`.
fn layout(gpu: &Gpu, bindings: &[u32], view: bool) -> wgpu::BindGroupLayout {
    let entry = |binding: u32, ty: BufferBindingType| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let storage = bindings.iter().map(|&b| entry(b, BufferBindingType::Storage { read_only: false }));
    let uniform = view.then(|| entry(0, BufferBindingType::Uniform));
    let entries: Vec<_> = uniform.into_iter().chain(storage).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// A group of whole buffers.
fn bind<'a>(
    gpu: &Gpu,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: impl Iterator<Item = (u32, &'a wgpu::Buffer)>,
) -> Result<wgpu::BindGroup, GpuError> {
    gpu.guarded(|| bindings::group(gpu, label, layout, buffers))
        .map_err(|reason| GpuError::Device { doing: "binding the queues", reason })
}

#[cfg(test)]
mod tests;
