//! The pipelines of a frame's passes.

use super::items::DrawClass;
use super::passes::{DEPTH_FORMAT, ID_FORMAT, Pass, RASTER_BINDINGS, raster_text, slot_layout};
use crate::bindings::film_layout;
use crate::shader::Variant;
use crate::tracer::Tracer;
use crate::{Gpu, GpuError, GpuScene};
use wgpu::ShaderStages;

/// A compute pass, ready but for its buffers. It is compiled when a frame first needs it: no frame needs them all.
pub struct CompiledPass {
    pass: Pass,
    name: String,
    text: String,
    scene_layout: wgpu::BindGroupLayout,
    tracer_layout: Option<wgpu::BindGroupLayout>,
    pipeline: Option<wgpu::ComputePipeline>,
    pub(super) film_layout: wgpu::BindGroupLayout,
    pub(super) layout: wgpu::BindGroupLayout,
}

impl CompiledPass {
    /// A pass for a scene and a tracer, not compiled yet.
    ///
    /// # Errors
    /// When the device cannot bind what it needs.
    pub fn new(
        gpu: &Gpu,
        pass: Pass,
        variant: Variant,
        scene: &GpuScene,
        tracer: &dyn Tracer,
    ) -> Result<Self, GpuError> {
        // Whoever finishes the frame records first hits: the others need not be compiled twice.
        let variant = Variant { aovs: variant.aovs && pass == Pass::Compose, ..variant };
        let (film_layout, layout) = gpu
            .guarded(|| {
                let film = film_layout(gpu, pass.film_bindings(), ShaderStages::COMPUTE);
                (film, slot_layout(gpu, pass.bindings(), ShaderStages::COMPUTE))
            })
            .map_err(|reason| GpuError::Device { doing: "binding a frame", reason })?;
        Ok(Self {
            pass,
            name: format!("hybrid {} on {}", pass.name(), tracer.kind().name()),
            text: pass.text(&tracer.text(), variant),
            scene_layout: scene.layout.clone(),
            tracer_layout: pass.traces().then(|| tracer.layout().clone()),
            pipeline: None,
            film_layout,
            layout,
        })
    }

    /// Compiles it, unless that was done.
    ///
    /// # Errors
    /// When the driver refuses the shader.
    pub fn compile(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        if self.pipeline.is_none() {
            let groups = [
                Some(&self.scene_layout),
                self.tracer_layout.as_ref(),
                Some(&self.film_layout),
                Some(&self.layout),
            ];
            let text = gpu.shader_text(&self.name, self.text.clone());
            self.pipeline = Some(text.pipeline(self.pass.entry_point(), &groups)?);
        }
        Ok(())
    }

    /// The pipeline, once it is compiled.
    pub fn pipeline(&self) -> Option<&wgpu::ComputePipeline> {
        self.pipeline.as_ref()
    }
}

/// The rasteriser's pipelines, by class, and what they bind.
pub struct CompiledDraws {
    pub(super) pipelines: Vec<wgpu::RenderPipeline>,
    pub(super) scene: wgpu::BindGroup,
    pub(super) film_layout: wgpu::BindGroupLayout,
    pub(super) layout: wgpu::BindGroupLayout,
}

impl CompiledDraws {
    /// Compiles them for a scene.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    pub fn new(gpu: &Gpu, variant: Variant, scene: &GpuScene) -> Result<Self, GpuError> {
        let variant = Variant { aovs: false, ..variant };
        let module = gpu.shader_module("hybrid raster", &raster_text(variant))?;
        let (scene_layout, scene) = scene.raster_group(gpu)?;
        let refused = |reason| GpuError::Shader { shader: "hybrid raster".into(), reason };
        let (film_layout, layout, pipeline_layout) = gpu
            .guarded(|| {
                let film = film_layout(gpu, &[], ShaderStages::VERTEX_FRAGMENT);
                let own = slot_layout(gpu, RASTER_BINDINGS, ShaderStages::VERTEX_FRAGMENT);
                let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some("hybrid raster"),
                    bind_group_layouts: &[Some(&scene_layout), None, Some(&film), Some(&own)],
                    immediate_size: 0,
                });
                (film, own, layout)
            })
            .map_err(refused)?;
        let make = |class| draw_pipeline(gpu, &module, &pipeline_layout, class);
        let pipelines = gpu.guarded(|| DrawClass::ALL.map(make).to_vec()).map_err(refused)?;
        Ok(Self { pipelines, scene, film_layout, layout })
    }
}

fn draw_pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    class: DrawClass,
) -> wgpu::RenderPipeline {
    let (vertex, fragment) = match class {
        DrawClass::Few | DrawClass::Many => ("triangle_corner", "opaque_triangle"),
        DrawClass::FewHoled | DrawClass::ManyHoled => ("triangle_corner", "holed_triangle"),
        DrawClass::Sphere => ("sphere_corner", "sphere"),
    };
    let constants = [("DRAW_CLASS", f64::from(class as u32))];
    let of_vertex = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..wgpu::PipelineCompilationOptions::default()
    };
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(vertex),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: of_vertex,
            buffers: &[],
        },
        // Surfaces have two sides.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(ID_FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
