//! Draws a film on a texture: the mean of each pixel's samples as display values.

use crate::bindings::{buffer, entry};
use crate::film::FilmBuffers;
use crate::scene::upload::{empty_buffer, write_buffer};
use crate::shader::Linkage;
use crate::timing::PassClock;
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use optics::tonemap::{TONEMAP_NONE, TONEMAP_SRGB};
use wgpu::{BufferBindingType, ShaderStages};

/// See `shaders/screen.wgsl` for the fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct Shown {
    film_size: [u32; 2],
    screen_size: [u32; 2],
    mapper: u32,
    padding0: u32,
    padding1: u32,
    padding2: u32,
}

/// The pass, for textures of one format.
pub(super) struct ScreenPass {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
    mapper: u32,
    /// What the uniform says.
    shown: Shown,
    bound: Option<Bound>,
}

/// A film that is bound.
struct Bound {
    film: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl ScreenPass {
    /// Compiles it.
    ///
    /// # Errors
    /// When the driver refuses the shader, or there is no memory.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Result<Self, GpuError> {
        let module = gpu.shader_module("screen", &Linkage::default().text("screen")?)?;
        let (pipeline, layout) = gpu
            .guarded(|| {
                let layout = layout(gpu);
                (pipeline(gpu, &module, &layout, format), layout)
            })
            .map_err(|reason| GpuError::Shader { shader: "screen".into(), reason })?;
        let size = size_of::<Shown>() as u64;
        let uniform = empty_buffer(gpu, "what is shown", size, wgpu::BufferUsages::UNIFORM)?;
        // The format encodes by itself, or the curve does.
        let mapper = if format.is_srgb() { TONEMAP_NONE } else { TONEMAP_SRGB };
        Ok(Self { pipeline, layout, uniform, mapper, shown: Shown::default(), bound: None })
    }

    /// Records that a film is drawn on all of a texture.
    ///
    /// # Errors
    /// When the device fails.
    pub fn record(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut dyn PassClock,
        film: &FilmBuffers,
        texture: &wgpu::Texture,
    ) -> Result<(), GpuError> {
        let film_size = film.contents.picture().window_size;
        let screen_size = [texture.width(), texture.height()];
        let shown = Shown { film_size, screen_size, mapper: self.mapper, ..Shown::default() };
        if self.shown != shown {
            write_buffer(gpu, "what is shown", &self.uniform, bytemuck::bytes_of(&shown))?;
            self.shown = shown;
        }
        let group = self.bind(gpu, film)?;
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let slot = clock.slot("screen");
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("screen"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            timestamp_writes: slot.map(|s| s.render()),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        Ok(())
    }

    /// The bind group of a film.
    fn bind(&mut self, gpu: &Gpu, film: &FilmBuffers) -> Result<wgpu::BindGroup, GpuError> {
        if let Some(bound) = self.bound.as_ref().filter(|b| b.film == film.pixels) {
            return Ok(bound.group.clone());
        }
        let resources = [&self.uniform, &film.pixels];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
            .collect();
        let (label, layout) = (Some("screen"), &self.layout);
        let group = gpu
            .guarded(|| {
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries: &entries })
            })
            .map_err(|reason| GpuError::Device { doing: "binding the film", reason })?;
        self.bound = Some(Bound { film: film.pixels.clone(), group: group.clone() });
        Ok(group)
    }
}

fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let of = |binding, ty| entry(binding, ShaderStages::FRAGMENT, buffer(ty));
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("screen"),
        entries: &[of(0, BufferBindingType::Uniform), of(1, BufferBindingType::Storage { read_only: true })],
    })
}

fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("screen"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("screen"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("film_pixel"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests;
