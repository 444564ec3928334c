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

pub use program::{Bound, Resource};

use crate::shader::{Variant, scene_text};
use crate::{Gpu, GpuError, GpuScene};
use program::Program;
use spirv::RayShaders;
use std::sync::Arc;
use structures::Structures;
use table::{HitTable, MaterialClass, RayType};
use vulkan::Vulkan;

/// Directives in front of all shaders of a pipeline.
const ENABLES: &str = "enable wgpu_ray_tracing_pipeline;\nenable primitive_index;";

/// Numbers that shaders and the table share.
fn constants() -> String {
    [
        ("RAY_RADIANCE", RayType::Radiance as u32),
        ("RAY_SHADOW", RayType::Shadow as u32),
        ("RAY_TYPE_SHIFT", spirv::RAY_TYPE_SHIFT),
        ("CLASS_REFLECTING", MaterialClass::Reflecting as u32),
        ("CLASS_DIELECTRIC", MaterialClass::Dielectric as u32),
        ("CLASS_EMISSIVE", MaterialClass::Emissive as u32),
    ]
    .map(|(name, value)| format!("const {name}: u32 = {value}u;"))
    .join("\n")
}

/// The text of a ray generation shader: scene, tracer and `kernel`, which has the entry point.
pub fn generation_text(kernel: &str, variant: Variant) -> String {
    let payload = include_str!("../shaders/pipeline_payload.wgsl");
    let tracer = include_str!("../shaders/tracer_pipeline.wgsl");
    [ENABLES, &scene_text(variant), &constants(), payload, tracer, kernel].join("\n")
}

/// The text of the miss, closest-hit, any-hit and intersection shaders.
pub fn hits_text(variant: Variant) -> String {
    let payload = include_str!("../shaders/pipeline_payload.wgsl");
    let hits = include_str!("../shaders/pipeline_hits.wgsl");
    [ENABLES, &scene_text(variant), &constants(), payload, hits].join("\n")
}

/// What of a scene all pipelines on it share: acceleration structures and the records of the shader binding table.
pub struct PipelineScene {
    vulkan: Arc<Vulkan>,
    structures: Arc<Structures>,
    table: HitTable,
    hits: RayShaders,
    variant: Variant,
}

impl PipelineScene {
    /// Builds the structures on the device and waits for it.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] without Vulkan ray tracing pipelines, [`GpuError::Limit`] and [`GpuError::Allocation`] if
    /// the scene is too large.
    pub fn build(gpu: &Gpu, scene: &GpuScene, variant: Variant) -> Result<Self, GpuError> {
        let vulkan = Vulkan::new(gpu)?;
        let table = HitTable::new(&scene.tables);
        let structures = Structures::build(&vulkan, &scene.tables, &table.instance_offsets)?;
        let hits = RayShaders::new("hit shaders", &hits_text(variant))?;
        gpu.check("building acceleration structures")?;
        Ok(Self { vulkan, structures: Arc::new(structures), table, hits, variant })
    }

    /// Bytes of the acceleration structures on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.structures.memory_bytes()
    }
}

/// A kernel that traces through a ray tracing pipeline.
pub struct PipelineKernel {
    program: Program,
    // What the program's sets point to.
    structures: Arc<Structures>,
}

impl PipelineKernel {
    /// Compiles `kernel`, whose ray generation entry point is its only one.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn new(name: &str, kernel: &str, scene: &PipelineScene, checks: bool) -> Result<Self, GpuError> {
        let generation = RayShaders::new(name, &generation_text(kernel, scene.variant))?;
        let mut program = Program::new(&scene.vulkan, &generation, &scene.hits, checks)?;
        program.set_table(&scene.table)?;
        Ok(Self { program, structures: scene.structures.clone() })
    }

    /// Makes the shaders see the scene (group 0) and `resources` (group 2). Waits for the device.
    ///
    /// # Errors
    /// [`GpuError::Shader`] if a binding of the shaders gets nothing.
    pub fn bind(&mut self, scene: &GpuScene, resources: &[Bound<'_>]) -> Result<(), GpuError> {
        let b = &scene.buffers;
        let buffers = [&b.info, &b.instances, &b.bindings, &b.materials, &b.lights, &b.vertices, &b.words];
        let buffers = buffers.into_iter().map(Resource::Buffer);
        let all = buffers.chain(scene.textures.views().into_iter().map(Resource::Texture));
        let numbered = (0..).zip(all).map(|(binding, resource)| Bound { group: 0, binding, resource });
        let others =
            resources.iter().map(|b| Bound { group: b.group, binding: b.binding, resource: b.resource });
        self.program.bind(&self.structures, &numbered.chain(others).collect::<Vec<_>>())
    }

    /// Records one ray generation shader for each of `size` into `encoder`, which must be used for nothing else.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if those are more than the device can start at once.
    pub fn trace(&self, encoder: &mut wgpu::CommandEncoder, size: [u32; 3]) -> Result<(), GpuError> {
        self.program.trace(encoder, size)
    }
}
