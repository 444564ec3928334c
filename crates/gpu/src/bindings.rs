//! Layouts of bind groups that passes of frames have in common.

use crate::{Gpu, GpuError};
use wgpu::{BindingType, BufferBindingType, ShaderStages};

/// An entry of a layout.
pub(crate) fn entry(binding: u32, visibility: ShaderStages, ty: BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// A buffer of any size, bound as a whole.
pub(crate) fn buffer(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// Layout of the film's group with the view and some of its buffers.
pub(crate) fn film_layout(gpu: &Gpu, bindings: &[u32], visibility: ShaderStages) -> wgpu::BindGroupLayout {
    let view = entry(0, visibility, buffer(BufferBindingType::Uniform));
    let storage = |&b: &u32| entry(b, visibility, buffer(BufferBindingType::Storage { read_only: false }));
    let entries: Vec<_> = std::iter::once(view).chain(bindings.iter().map(storage)).collect();
    gpu.device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("film"), entries: &entries })
}

/// A group of whole buffers, each at its binding.
pub(crate) fn group<'a>(
    gpu: &Gpu,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    buffers: impl Iterator<Item = (u32, &'a wgpu::Buffer)>,
) -> wgpu::BindGroup {
    let entries: Vec<_> = buffers
        .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
        .collect();
    let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries };
    gpu.device.create_bind_group(&descriptor)
}

/// A group for compute shaders of whole buffers, which are bound from 0 on; the first is a uniform, the others are written unless they
/// are among `read`. And its layout.
///
/// # Errors
/// When the device has no place for it.
pub(crate) fn whole_buffers(
    gpu: &Gpu,
    label: &'static str,
    buffers: &[&wgpu::Buffer],
    read: &[u32],
) -> Result<(wgpu::BindGroupLayout, wgpu::BindGroup), GpuError> {
    let ty = |binding: u32| match binding {
        0 => BufferBindingType::Uniform,
        _ => BufferBindingType::Storage { read_only: read.contains(&binding) },
    };
    let bind = || {
        let entries: Vec<_> =
            (0..buffers.len() as u32).map(|b| entry(b, ShaderStages::COMPUTE, buffer(ty(b)))).collect();
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        });
        let group = group(gpu, label, &layout, (0..).zip(buffers.iter().copied()));
        (layout, group)
    };
    gpu.guarded(bind).map_err(|reason| GpuError::Device { doing: label, reason })
}
