//! Layouts of bind groups that passes of frames have in common.

use crate::Gpu;
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
