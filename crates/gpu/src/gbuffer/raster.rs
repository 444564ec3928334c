//! The rasteriser: a pipeline for each class of what is drawn.

use super::items::DrawClass;
use super::passes::{DEPTH_FORMAT, ID_FORMAT, RASTER_BINDINGS, linkage};
use crate::bindings::{Resource, group, layout};
use crate::film::VIEW;
use crate::pass::PassGroups;
use crate::shader::Variant;
use crate::{Gpu, GpuError, GpuScene};
use rayon::prelude::*;
use wgpu::ShaderStages;

/// The rasteriser's pipelines, by class, and what they bind.
pub(super) struct CompiledDraws {
    pub(super) pipelines: Vec<wgpu::RenderPipeline>,
    pub(super) scene: wgpu::BindGroup,
    film_layout: wgpu::BindGroupLayout,
    layout: wgpu::BindGroupLayout,
}

impl CompiledDraws {
    /// Compiles them for a scene.
    ///
    /// # Errors
    /// When the driver refuses a shader.
    pub fn new(gpu: &Gpu, variant: Variant, scene: &GpuScene) -> Result<Self, GpuError> {
        let variant = Variant { aovs: false, ..variant };
        let module = gpu.shader_module("hybrid raster", &linkage(variant).text("hybrid_raster")?)?;
        let (scene_layout, scene) = scene.raster_group(gpu)?;
        let refused = |reason| GpuError::Shader { shader: "hybrid raster".into(), reason };
        let (film_layout, own_layout, pipeline_layout) = gpu
            .guarded(|| {
                let film = layout(gpu, "film", &[VIEW], ShaderStages::VERTEX_FRAGMENT);
                let own = layout(gpu, "hybrid raster", RASTER_BINDINGS, ShaderStages::VERTEX_FRAGMENT);
                let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some("hybrid raster"),
                    bind_group_layouts: &[Some(&scene_layout), None, Some(&film), Some(&own)],
                    immediate_size: 0,
                });
                (film, own, layout)
            })
            .map_err(refused)?;
        let make = |class| draw_pipeline(gpu, &module, &pipeline_layout, class);
        let make = |class| gpu.guarded(|| make(class)).map_err(refused);
        let pipelines = DrawClass::ALL.into_par_iter().map(make).collect::<Result<_, _>>()?;
        Ok(Self { pipelines, scene, film_layout, layout: own_layout })
    }

    /// Binds what draws need.
    ///
    /// # Errors
    /// When the device fails.
    pub fn bind(
        &self,
        gpu: &Gpu,
        film: &[Resource<'_>],
        own: &[Resource<'_>],
    ) -> Result<PassGroups, GpuError> {
        const DOING: &str = "binding the rasteriser";
        Ok(PassGroups {
            film: Some(group(gpu, DOING, &self.film_layout, &[VIEW], film)?),
            own: Some(group(gpu, DOING, &self.layout, RASTER_BINDINGS, own)?),
        })
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
