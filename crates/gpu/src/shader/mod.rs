//! Shaders: their texts are linked from modules ([`modules`], [`variant`]), and pipelines are made of texts.
//!
//! Linking needs no device, so every module and every combination is parsed, validated and translated in tests without one.

pub mod abstract_modules;
#[cfg(test)]
mod arithmetic;
#[cfg(test)]
pub(crate) mod check;
pub(crate) mod constants;
pub mod modules;
#[cfg(test)]
mod tests;
pub mod variant;

pub use modules::{Linkage, ModuleError};
pub use variant::Variant;

use crate::pipeline_store::PipelineStore;
use crate::{Gpu, GpuError};
use std::sync::{Mutex, PoisonError};

impl Gpu {
    /// Compiles a shader module.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn shader_module(&self, name: &str, text: &str) -> Result<wgpu::ShaderModule, GpuError> {
        let descriptor =
            wgpu::ShaderModuleDescriptor { label: Some(name), source: wgpu::ShaderSource::Wgsl(text.into()) };
        // A counter in every loop, against compilers that take endless ones for unreachable, costs 4 to 8 % of a path.
        let checks =
            wgpu::ShaderRuntimeChecks { force_loop_bounding: false, ..wgpu::ShaderRuntimeChecks::checked() };
        // SAFETY: the only check that is left out is that loops end. The texts are our own. Their loops count up to a bound
        // (samples, segments of a path, lights, bits of a word), halve a range, or walk a tree of a depth that the encoder
        // limits, each node of which is visited once: a broken tree is none that it writes, and memory is still checked.
        self.guarded(|| unsafe { self.device.create_shader_module_trusted(descriptor, checks) })
            .map_err(|reason| GpuError::Shader { shader: name.to_owned(), reason })
    }

    /// Makes a compute pipeline of the entry point `main`; see [`ShaderText::pipeline`].
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn compute_pipeline(
        &self,
        name: &str,
        text: &str,
        groups: &[&wgpu::BindGroupLayout],
    ) -> Result<wgpu::ComputePipeline, GpuError> {
        let groups: Vec<_> = groups.iter().copied().map(Some).collect();
        self.shader_text(name, text.to_owned()).pipeline("main", &groups)
    }

    /// A text of which pipelines are made; `name` is for messages.
    pub fn shader_text(&self, name: &str, text: String) -> ShaderText<'_> {
        ShaderText { gpu: self, name: name.to_owned(), text, module: Mutex::default() }
    }
}

/// A shader's text, compiled when the first pipeline is made of it that is not known already.
pub struct ShaderText<'a> {
    gpu: &'a Gpu,
    name: String,
    text: String,
    module: Mutex<Option<wgpu::ShaderModule>>,
}

impl ShaderText<'_> {
    /// Threads that want it while one makes it wait for that one.
    fn module(&self) -> Result<wgpu::ShaderModule, GpuError> {
        let mut made = self.module.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(module) = &*made {
            return Ok(module.clone());
        }
        let module = self.gpu.shader_module(&self.name, &self.text)?;
        Ok(made.insert(module).clone())
    }

    /// Makes the compute pipeline of an entry point, or finds the one that was made before of the same text. Equal texts
    /// have equal bindings, so any bind groups of the one fit the other.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn pipeline(
        &self,
        entry_point: &str,
        groups: &[Option<&wgpu::BindGroupLayout>],
    ) -> Result<wgpu::ComputePipeline, GpuError> {
        /// More than that belong to scenes that are long gone.
        const KEPT: usize = 64;
        let Self { gpu, name, text, .. } = self;
        let key = [entry_point, text].join("\n");
        let known = || gpu.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = known().get(&key) {
            return Ok(pipeline.clone());
        }
        let module = self.module()?;
        let pipeline = gpu
            .guarded(|| {
                let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some(name),
                    bind_group_layouts: groups,
                    immediate_size: 0,
                });
                gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(name),
                    layout: Some(&layout),
                    module: &module,
                    entry_point: Some(entry_point),
                    compilation_options: wgpu::PipelineCompilationOptions {
                        // Every kernel writes its workgroup variables before it reads them.
                        zero_initialize_workgroup_memory: false,
                        ..Default::default()
                    },
                    cache: gpu.store.as_ref().map(PipelineStore::cache),
                })
            })
            .map_err(|reason| GpuError::Shader { shader: name.clone(), reason })?;
        let mut known = known();
        if known.len() >= KEPT {
            known.clear();
        }
        known.insert(key, pipeline.clone());
        Ok(pipeline)
    }
}
