//! Three ways to find what a ray hits.
//!
//! Every tracer implements the same two WGSL functions, `trace_closest` and `trace_any` (see `shaders/scene.wgsl`), so
//! every kernel runs on every tracer.

pub mod bvh;
pub mod query;
pub mod upper;

use crate::shader::Linkage;
use crate::{Gpu, GpuError, GpuScene};
use scene::tables::SceneTables;
use wgpu::Features;

/// Which way rays are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TracerKind {
    /// Our own bounding volume hierarchy, walked in a compute shader: every device.
    Bvh,
    /// The driver's acceleration structures, asked from a compute shader.
    Query,
    /// The driver's ray tracing pipeline with a shader binding table. The loop over a path's vertices stays in the ray
    /// generation shader, so that the recursion is bounded: there is no wavefront.
    Pipeline,
}

/// What is known of a scene's instances when its structures are built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instances {
    /// They stay where they are, so that structures may be made of all of them together. If they are moved all the same, structures
    /// are built again.
    StandStill,
    /// They will be moved.
    Move,
}

impl Instances {
    /// What a scene says of its instances.
    pub fn of(tables: &SceneTables) -> Self {
        if tables.has_dynamic_instances { Self::Move } else { Self::StandStill }
    }
}

impl TracerKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Bvh, Self::Query, Self::Pipeline];

    /// What users call the back end that traces so.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "gpu-bvh",
            Self::Query => "gpu-query",
            Self::Pipeline => "gpu-pipeline",
        }
    }

    /// Device features without which it cannot work.
    pub fn required_features(self) -> Features {
        match self {
            Self::Bvh => Features::empty(),
            Self::Query => Features::EXPERIMENTAL_RAY_QUERY,
            Self::Pipeline => Features::EXPERIMENTAL_RAY_TRACING_PIPELINES,
        }
    }

    /// Names of the required features that are not among `features`.
    pub fn missing(self, features: Features) -> Vec<String> {
        (self.required_features() - features).iter_names().map(|(name, _)| name.to_owned()).collect()
    }

    /// Whether `gpu` can trace so.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`], which names what is missing.
    pub fn check(self, gpu: &Gpu) -> Result<(), GpuError> {
        let missing = self.missing(gpu.features);
        if missing.is_empty() {
            return Ok(());
        }
        let (adapter, missing) = (gpu.info.name.clone(), missing.join(", "));
        Err(GpuError::Unsupported { adapter, tracer: self.name(), missing })
    }

    /// The fastest way on a device with these features. Software drivers walk our own hierarchy faster than theirs.
    pub fn best(features: Features, software: bool) -> Self {
        if !software && Self::Query.missing(features).is_empty() { Self::Query } else { Self::Bvh }
    }
}

/// A tracer for compute shaders, with its structures for one scene on the device.
pub trait Tracer: Send {
    /// Which way it is.
    fn kind(&self) -> TracerKind;

    /// What modules are linked with that import `tracer`.
    fn linkage(&self) -> Linkage;

    /// The same for modules that import `tracer_bvh_below`, walks that may begin below the root, where the tracer can do that.
    fn linkage_below(&self) -> Option<Linkage> {
        None
    }

    /// The same for modules that import `tracer_bvh_packets`, subgroup packet traversal, where tracer and device can do that.
    fn linkage_packets(&self) -> Option<Linkage> {
        None
    }

    /// Layout of bind group 1.
    fn layout(&self) -> &wgpu::BindGroupLayout;

    /// Bind group 1.
    fn bind_group(&self) -> &wgpu::BindGroup;

    /// Builds the upper level again after instances have moved. Returns whether that was possible within the memory and
    /// bindings that there are; if not, everything is built again.
    ///
    /// # Errors
    /// When the device fails.
    fn move_instances(&mut self, _gpu: &Gpu, _scene: &GpuScene) -> Result<bool, GpuError> {
        Ok(false)
    }

    /// Bytes of its structures on the device.
    fn memory_bytes(&self) -> u64;
}
