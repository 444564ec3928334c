//! A GPU that runs a function on a buffer.

use gpu::{Gpu, GpuError, GpuOptions};
use testkit::Exclusive;
use wgpu::BufferUsages;
use wgpu::util::DeviceExt;

/// Invocations of a workgroup, as the shaders say.
const WORKGROUP: usize = 64;

pub struct Device(Exclusive<Gpu>);

impl Device {
    /// A device, or `None` and a visible skip.
    pub fn open(test: &str) -> Option<Self> {
        let opened = Exclusive::new(gpu::has_hardware(), || Gpu::open(&GpuOptions::default()));
        if let Err(GpuError::NoAdapter { found }) = &*opened {
            testkit::skip_without_gpu(test, found);
            return None;
        }
        Some(Self(opened.map(|gpu| gpu.unwrap_or_else(|error| panic!("{test}: {error}")))))
    }

    /// Runs a shader on `inputs` and returns `count` words; the number of inputs is a multiple of the workgroup's size.
    pub fn run(&self, name: &str, shader: &str, inputs: &[u32], count: usize) -> Vec<u32> {
        let Self(gpu) = self;
        let device = &gpu.device;
        // A binding cannot be empty.
        let inputs = if inputs.is_empty() { &[0][..] } else { inputs };
        let source = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(name),
            contents: bytemuck::cast_slice(inputs),
            usage: BufferUsages::STORAGE,
        });
        let buffer = |usage| {
            let size = 4 * count as u64;
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(name),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let results = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let back = buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(shader.into()),
        });
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(name),
            entries: &[true, false].map(|read_only| wgpu::BindGroupLayoutEntry {
                binding: u32::from(!read_only),
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(name),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            })),
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(name),
            layout: &layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: source.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: results.as_entire_binding() },
            ],
        });
        let mut encoder =
            device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(name) });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((crate::INPUTS / WORKGROUP) as u32, 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&results, 0, &back, 0, results.size());
        gpu.queue.submit([encoder.finish()]);
        back.map_async(wgpu::MapMode::Read, .., |result| result.expect("map"));
        gpu.wait("running an optics function").unwrap_or_else(|e| panic!("{name}: {e}"));
        gpu.check("running an optics function").unwrap_or_else(|e| panic!("{name}: {e}"));
        bytemuck::pod_collect_to_vec(&back.get_mapped_range(..).expect("mapped"))
    }
}
