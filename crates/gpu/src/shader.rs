//! Putting shaders together.
//!
//! One text for all: `enable` directives, optics, constants, scene, tracer, kernel. Nothing here needs a device, so
//! every combination is parsed, validated and translated in tests without one.

use crate::tracer::TracerText;
use crate::{Gpu, GpuError};
use optics::albedo::DielectricAlbedo;
use scene::tables::{
    MATERIAL_ALPHA_BLEND, MATERIAL_ALPHA_MASK, MATERIAL_CHECKERBOARD, MATERIAL_CHECKERBOARD_FADES,
    MATERIAL_EMISSION_TWO_SIDED, MATERIAL_THIN, ModelTag,
};
use std::fmt::Write;

/// What is decided when a shader is put together, because a branch at run time would cost registers or time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Whether any surface of the scene has holes.
    pub alpha: bool,
    /// Whether first hits are recorded.
    pub aovs: bool,
}

impl Variant {
    /// All variants.
    pub const ALL: [Self; 4] = [
        Self { alpha: false, aovs: false },
        Self { alpha: true, aovs: false },
        Self { alpha: false, aovs: true },
        Self { alpha: true, aovs: true },
    ];
}

/// The optics, the constants and the scene: everything that is in front of a tracer.
pub fn scene_text(variant: Variant) -> String {
    [
        &optics::wgsl::all(),
        &constants(variant),
        include_str!("shaders/scene.wgsl"),
        include_str!("shaders/texture.wgsl"),
        include_str!("shaders/surface.wgsl"),
        include_str!("shaders/material.wgsl"),
        include_str!("shaders/lights.wgsl"),
    ]
    .join("\n")
}

/// A whole shader.
pub fn assemble(tracer: TracerText, kernel: &str, variant: Variant) -> String {
    [tracer.enables, &scene_text(variant), tracer.text, kernel].join("\n")
}

/// Constants that Rust decides.
fn constants(variant: Variant) -> String {
    let numbers = [
        ("MODEL_METALLIC_ROUGHNESS", ModelTag::MetallicRoughness as u32),
        ("MODEL_LAMBERT", ModelTag::Lambert as u32),
        ("MODEL_DIELECTRIC", ModelTag::Dielectric as u32),
        ("MODEL_MIRROR", ModelTag::Mirror as u32),
        ("MODEL_UNLIT", ModelTag::Unlit as u32),
        ("MATERIAL_ALPHA_MASK", MATERIAL_ALPHA_MASK),
        ("MATERIAL_ALPHA_BLEND", MATERIAL_ALPHA_BLEND),
        ("MATERIAL_EMISSION_TWO_SIDED", MATERIAL_EMISSION_TWO_SIDED),
        ("MATERIAL_THIN", MATERIAL_THIN),
        ("MATERIAL_CHECKERBOARD", MATERIAL_CHECKERBOARD),
        ("MATERIAL_CHECKERBOARD_FADES", MATERIAL_CHECKERBOARD_FADES),
        ("MATERIAL_EMISSIVE", crate::scene::records::MATERIAL_EMISSIVE),
        ("DIELECTRIC_ALBEDO_HEIGHT", DielectricAlbedo::SIZE[1] as u32),
    ];
    let mut text = String::new();
    for (name, value) in numbers {
        let _ = writeln!(text, "const {name}: u32 = {value}u;"); // writing to a string cannot fail
    }
    let _ = writeln!(text, "const SCENE_HAS_ALPHA: bool = {};", variant.alpha);
    let _ = writeln!(text, "const WANTS_AOVS: bool = {};", variant.aovs);
    text
}

impl Gpu {
    /// Compiles a shader module.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn shader_module(&self, name: &str, text: &str) -> Result<wgpu::ShaderModule, GpuError> {
        let descriptor =
            wgpu::ShaderModuleDescriptor { label: Some(name), source: wgpu::ShaderSource::Wgsl(text.into()) };
        self.guarded(|| self.device.create_shader_module(descriptor))
            .map_err(|reason| GpuError::Shader { shader: name.to_owned(), reason })
    }

    /// Makes a compute pipeline of the entry point `main`.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the compiler's words.
    pub fn compute_pipeline(
        &self,
        name: &str,
        text: &str,
        groups: &[&wgpu::BindGroupLayout],
    ) -> Result<wgpu::ComputePipeline, GpuError> {
        let module = self.shader_module(name, text)?;
        let groups: Vec<_> = groups.iter().copied().map(Some).collect();
        self.guarded(|| {
            let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(name),
                bind_group_layouts: &groups,
                immediate_size: 0,
            });
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(&layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    // Every kernel writes its workgroup variables before it reads them.
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            })
        })
        .map_err(|reason| GpuError::Shader { shader: name.to_owned(), reason })
    }
}

/// For tests: the module of a text.
#[cfg(test)]
pub(crate) fn parse(text: &str) -> naga::Module {
    naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)))
}

/// For tests: the validated module of a text.
#[cfg(test)]
pub(crate) fn validate(name: &str, text: &str) -> (naga::Module, naga::valid::ModuleInfo) {
    let module = parse(text);
    let flags = naga::valid::ValidationFlags::all();
    let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::all())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    (module, info)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scene_is_valid_in_every_variant() {
        for variant in Variant::ALL {
            validate(&format!("{variant:?}"), &scene_text(variant));
        }
    }

    #[test]
    #[should_panic(expected = "no definition in scope")]
    fn an_unknown_name_is_noticed() {
        validate("broken", &(scene_text(Variant::default()) + "fn f() -> f32 { return lightt(); }"));
    }
}
