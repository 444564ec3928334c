//! Vulkan ray tracing pipelines on wgpu's own device.
//!
//! wgpu opens devices with the extension but has no pipelines of this kind, so what stands here talks to Vulkan itself:
//! acceleration structures, a shader binding table, pipelines with ray generation, miss, closest-hit, any-hit and
//! intersection shaders. The kernels are the same WGSL as everywhere; their ray generation shader calls the same
//! `trace_closest` and `trace_any`, which trace here (`shaders/tracer_pipeline.wgsl`).
//!
//! Start at [`table`]: which shaders run where, and with what data. Then `program.rs` and `structures.rs`.

mod memory;
mod program;
pub mod spirv;
mod structures;
pub mod table;
mod vulkan;

#[cfg(test)]
mod tests;

use crate::batch::{Batch, BatchPixels};
use crate::film::FilmBuffers;
use crate::kernel::{Kernel, KernelKind, Tracing};
use crate::rays::{RayBuffers, RayKernel, RayQuestion};
use crate::shader::constants::numbers;
use crate::shader::{Linkage, ModuleError, Variant};
use crate::timing::{Timer, TimerSlot};
use crate::views::{ExactBuffers, ExactKernel, ExactWants};
use crate::{Gpu, GpuError, GpuScene};
use program::{Program, Resource};
use scene::tables::Changes;
use spirv::RayShaders;
use std::sync::Arc;
use structures::Structures;
use table::{HitTable, MaterialClass, RayType};
use vulkan::Vulkan;

/// Numbers that shaders and the table share.
fn constants() -> String {
    numbers([
        ("RAY_RADIANCE", RayType::Radiance as u32),
        ("RAY_SHADOW", RayType::Shadow as u32),
        ("RAY_TYPE_SHIFT", spirv::RAY_TYPE_SHIFT),
        ("CLASS_REFLECTING", MaterialClass::Reflecting as u32),
        ("CLASS_DIELECTRIC", MaterialClass::Dielectric as u32),
        ("CLASS_EMISSIVE", MaterialClass::Emissive as u32),
    ])
}

/// What modules are linked with that trace by a ray tracing pipeline.
pub fn linkage() -> Linkage {
    Linkage::default().bind("tracer", "tracer_pipeline").generate("pipeline_numbers", constants())
}

/// The text of the miss, closest-hit, any-hit and intersection shaders.
///
/// # Errors
/// When modules are missing.
pub fn hits_text(variant: Variant) -> Result<String, ModuleError> {
    Linkage::of(variant).with(&linkage()).text("pipeline_hits")
}

/// The text of the ray generation shader of an integrator.
///
/// # Errors
/// When modules are missing.
pub fn kernel_text(kind: KernelKind, variant: Variant) -> Result<String, ModuleError> {
    kind.linkage(variant).with(&linkage()).text("entry_pipeline")
}

/// What of a scene all pipelines on it share: acceleration structures, hit shaders and the records of the shader binding
/// table.
pub struct PipelineTracing {
    vulkan: Arc<Vulkan>,
    structures: Arc<Structures>,
    table: HitTable,
    hits: RayShaders,
}

impl PipelineTracing {
    /// Builds the structures on the device and waits for it.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] without Vulkan ray tracing pipelines, [`GpuError::Limit`] and [`GpuError::Allocation`] if
    /// the scene is too large.
    pub fn build(gpu: &Gpu, scene: &GpuScene) -> Result<Self, GpuError> {
        let vulkan = Vulkan::new(gpu)?;
        let table = HitTable::new(&scene.tables);
        let structures = Structures::build(&vulkan, &scene.tables, &table.instance_offsets)?;
        let hits = RayShaders::new("hit shaders", &hits_text(scene.variant())?)?;
        gpu.check("building acceleration structures")?;
        Ok(Self { vulkan, structures: Arc::new(structures), table, hits })
    }

    /// Compiles a pipeline whose ray generation shader is the only entry point of `text`.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    fn program(&self, name: &str, text: &str, hits: &RayShaders) -> Result<Program, GpuError> {
        let generation = RayShaders::new(name, text)?;
        let mut program = Program::new(&self.vulkan, &generation, hits, self.structures.clone())?;
        program.set_table(&self.table)?;
        Ok(program)
    }
}

impl Tracing for PipelineTracing {
    fn kernel(
        &self,
        _gpu: &Gpu,
        kind: KernelKind,
        variant: Variant,
        scene: &GpuScene,
        _film: &FilmBuffers,
    ) -> Result<Box<dyn Kernel>, GpuError> {
        // A ray generation shader does all of a frame at once.
        let text = kernel_text(kind, variant)?;
        let program = if variant.volumes {
            // Only paths that know what they are in see the boundaries of media.
            let hits = RayShaders::new("hit shaders of media", &hits_text(variant)?)?;
            self.program(kind.name(), &text, &hits)?
        } else {
            self.program(kind.name(), &text, &self.hits)?
        };
        Ok(Box::new(PipelineKernel { name: kind.name(), program, scene: scene_resources(scene), film: None }))
    }

    fn ray_kernel(
        &self,
        _gpu: &Gpu,
        question: RayQuestion,
        scene: &GpuScene,
    ) -> Result<Box<dyn RayKernel>, GpuError> {
        let text =
            question.of_any_rays().linkage(scene.variant()).with(&linkage()).text("entry_rays_pipeline")?;
        let program = self.program("rays", &text, &self.hits)?;
        Ok(Box::new(PipelineRays { program, scene: scene_resources(scene), hits: None }))
    }

    fn exact_kernel(
        &self,
        _gpu: &Gpu,
        wants: ExactWants,
        scene: &GpuScene,
    ) -> Result<Box<dyn ExactKernel>, GpuError> {
        let text = wants.linkage(scene.variant()).with(&linkage()).text("entry_views_pipeline")?;
        let program = self.program("views", &text, &self.hits)?;
        Ok(Box::new(PipelineExact { program, scene: scene_resources(scene), values: None }))
    }

    fn update(&mut self, _: &Gpu, scene: &GpuScene, changes: Changes) -> Result<bool, GpuError> {
        // Of materials the table has only which is where, and of what class: colours may change.
        if (changes.materials || changes.lights) && HitTable::new(&scene.tables) != self.table {
            return Ok(false);
        }
        if changes.transforms {
            self.structures.move_instances(&scene.tables, &self.table.instance_offsets)?;
        }
        Ok(true)
    }

    fn memory_bytes(&self) -> u64 {
        self.structures.memory_bytes()
    }
}

/// A buffer or texture at a binding of a group.
type Bound = ((u32, u32), Resource);

/// Bind group 0.
fn scene_resources(scene: &GpuScene) -> Vec<Bound> {
    let b = &scene.buffers;
    let buffers = [&b.info, &b.instances, &b.bindings, &b.materials, &b.lights, &b.vertices, &b.words];
    let buffers = buffers.into_iter().map(|b| Resource::Buffer(b.clone()));
    let texels = Resource::Textures(scene.texel_views().into_iter().cloned().collect());
    let textures = scene.textures.table_views().into_iter().map(|v| Resource::Textures(vec![v.clone()]));
    (0..)
        .zip(buffers.chain([texels]).chain(textures))
        .map(|(binding, resource)| ((0, binding), resource))
        .collect()
}

/// Bind group 2.
fn film_resources(film: &FilmBuffers) -> Vec<Bound> {
    let buffers = [&film.view, &film.pixels, &film.counters, &film.aovs];
    let resources = buffers.into_iter().map(|b| Resource::Buffer(b.clone()));
    (0..).zip(resources).map(|(binding, resource)| ((2, binding), resource)).collect()
}

/// The kernel of an integrator: every pixel is a ray generation shader.
struct PipelineKernel {
    name: &'static str,
    program: Program,
    scene: Vec<Bound>,
    /// The pixels of the film that is bound.
    film: Option<wgpu::Buffer>,
}

impl PipelineKernel {
    /// Binds a film, if it is not the one that is bound.
    fn bind(&mut self, gpu: &Gpu, film: &FilmBuffers) -> Result<(), GpuError> {
        if self.film.as_ref() == Some(&film.pixels) {
            return Ok(());
        }
        clear(gpu, &[&film.pixels, &film.counters, &film.aovs])?;
        let resources: Vec<_> = self.scene.iter().cloned().chain(film_resources(film)).collect();
        // Of a lost device all handles are gone, which is not the shaders' fault.
        self.program.bind(resources).map_err(|error| gpu.wait("binding the film").err().unwrap_or(error))?;
        self.film = Some(film.pixels.clone());
        Ok(())
    }
}

impl Kernel for PipelineKernel {
    fn submit(
        &mut self,
        gpu: &Gpu,
        film: &mut FilmBuffers,
        batch: Batch,
        timer: &mut Timer,
    ) -> Result<wgpu::SubmissionIndex, GpuError> {
        self.bind(gpu, film)?;
        film.set_batch(gpu, batch)?;
        let size = match batch.pixels {
            BatchPixels::Rows { count, .. } => [film.contents.window_width(), count, 1],
            BatchPixels::Portions { count, .. } => [count, 1, 1],
        };
        submit_timed(gpu, &self.program, size, self.name, timer.slot(self.name))
    }
}

/// Fills buffers that a pipeline writes with zeros: wgpu does not see what pipelines write, and what it has never cleared, it
/// would clear when it reads it.
fn clear(gpu: &Gpu, buffers: &[&wgpu::Buffer]) -> Result<(), GpuError> {
    gpu.guarded(|| {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        buffers.iter().for_each(|buffer| encoder.clear_buffer(buffer, 0, None));
        gpu.queue.submit([encoder.finish()]);
    })
    .map_err(|reason| GpuError::Device { doing: "clearing what a pipeline writes", reason })
}

/// Submits one ray generation shader for each of `size`, with the times before and after.
fn submit_timed(
    gpu: &Gpu,
    program: &Program,
    size: [u32; 3],
    label: &'static str,
    slot: Option<TimerSlot<'_>>,
) -> Result<wgpu::SubmissionIndex, GpuError> {
    let encoder = || gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    // Raw commands and wgpu's must not share an encoder: passes without work take the times.
    let stamp = |begin: bool| {
        let mut encoder = encoder();
        if let Some(slot) = slot {
            let writes = wgpu::ComputePassTimestampWrites {
                query_set: slot.queries,
                beginning_of_pass_write_index: begin.then_some(slot.begin),
                end_of_pass_write_index: (!begin).then_some(slot.begin + 1),
            };
            let timestamp_writes = Some(writes);
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes });
        }
        encoder.finish()
    };
    gpu.guarded(|| {
        let mut tracing = encoder();
        program.trace(&mut tracing, size)?;
        Ok(gpu.queue.submit([stamp(true), tracing.finish(), stamp(false)]))
    })
    .map_err(|reason| GpuError::Device { doing: "starting a pass", reason })?
}

/// A pipeline that answers rays.
struct PipelineRays {
    program: Program,
    scene: Vec<Bound>,
    /// The hits of the list that is bound.
    hits: Option<wgpu::Buffer>,
}

impl RayKernel for PipelineRays {
    fn submit(&mut self, gpu: &Gpu, rays: &RayBuffers, timer: &mut Timer) -> Result<(), GpuError> {
        if self.hits.as_ref() != Some(&rays.hits) {
            clear(gpu, &[&rays.hits])?;
            let buffers = [&rays.list, &rays.rays, &rays.hits];
            let list = buffers.into_iter().map(|b| Resource::Buffer(b.clone()));
            let list = (0..).zip(list).map(|(binding, resource)| ((2, binding), resource));
            self.program.bind(self.scene.iter().cloned().chain(list).collect())?;
            self.hits = Some(rays.hits.clone());
        }
        let [width, height] = rays.size();
        submit_timed(gpu, &self.program, [width, height, 1], "rays", timer.slot("rays")).map(|_| ())
    }
}

/// A pipeline that makes exact layers of views.
struct PipelineExact {
    program: Program,
    scene: Vec<Bound>,
    /// The values that are bound.
    values: Option<wgpu::Buffer>,
}

impl ExactKernel for PipelineExact {
    fn submit(
        &mut self,
        gpu: &Gpu,
        buffers: &ExactBuffers,
        [width, height]: [u32; 2],
        timer: &mut Timer,
    ) -> Result<(), GpuError> {
        if self.values.as_ref() != Some(&buffers.values) {
            clear(gpu, &[&buffers.values])?;
            let bound = [&buffers.task, &buffers.cameras, &buffers.values];
            let bound = bound.into_iter().map(|b| Resource::Buffer(b.clone()));
            let bound = (0..).zip(bound).map(|(binding, resource)| ((2, binding), resource));
            self.program.bind(self.scene.iter().cloned().chain(bound).collect())?;
            self.values = Some(buffers.values.clone());
        }
        submit_timed(gpu, &self.program, [width, height, 1], "views", timer.slot("views")).map(|_| ())
    }
}
