//! What passes bind, and the layouts and groups that come of it.

use crate::{Gpu, GpuError};
use wgpu::{BindingResource, BindingType, BufferBindingType, ShaderStages};

/// Something that a pass binds in one of its groups, by the number of the binding, and what its shader does with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PassBinding {
    /// A uniform buffer.
    Uniform(u32),
    /// A storage buffer that is only read.
    Read(u32),
    /// A storage buffer that may be written.
    Write(u32),
    /// A texture of whole numbers.
    Texture(u32),
}

impl PassBinding {
    /// Its number in its group.
    pub fn number(self) -> u32 {
        match self {
            Self::Uniform(number) | Self::Read(number) | Self::Write(number) | Self::Texture(number) => {
                number
            }
        }
    }

    fn entry(self, visibility: ShaderStages) -> wgpu::BindGroupLayoutEntry {
        let ty = match self {
            Self::Uniform(_) => buffer(BufferBindingType::Uniform),
            Self::Read(_) => buffer(BufferBindingType::Storage { read_only: true }),
            Self::Write(_) => buffer(BufferBindingType::Storage { read_only: false }),
            Self::Texture(_) => BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
        };
        entry(self.number(), visibility, ty)
    }
}

/// A resource and the number that it is bound at.
pub(crate) type Resource<'a> = (u32, BindingResource<'a>);

/// A whole buffer to be bound at a number.
pub(crate) fn whole(number: u32, buffer: &wgpu::Buffer) -> Resource<'_> {
    (number, buffer.as_entire_binding())
}

/// An entry of a layout.
pub(crate) fn entry(binding: u32, visibility: ShaderStages, ty: BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// A buffer of any size, bound as a whole.
pub(crate) fn buffer(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// The layout of a group. To be called where errors are caught.
pub(crate) fn layout(
    gpu: &Gpu,
    label: &str,
    bindings: &[PassBinding],
    visibility: ShaderStages,
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = bindings.iter().map(|binding| binding.entry(visibility)).collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
    gpu.device.create_bind_group_layout(&descriptor)
}

/// A group of some of `resources`, those that have a binding.
///
/// # Errors
/// When the device fails, or a binding has no resource.
pub(crate) fn group(
    gpu: &Gpu,
    label: &'static str,
    layout: &wgpu::BindGroupLayout,
    bindings: &[PassBinding],
    resources: &[Resource<'_>],
) -> Result<wgpu::BindGroup, GpuError> {
    let failed = |reason| GpuError::Device { doing: label, reason };
    let entry = |binding: &PassBinding| {
        let binding = binding.number();
        let found = resources.iter().find(|(number, _)| *number == binding);
        let (_, resource) = found.ok_or_else(|| failed(format!("nothing is there for binding {binding}")))?;
        Ok::<_, GpuError>(wgpu::BindGroupEntry { binding, resource: resource.clone() })
    };
    let entries = bindings.iter().map(entry).collect::<Result<Vec<_>, _>>()?;
    let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries };
    gpu.guarded(|| gpu.device.create_bind_group(&descriptor)).map_err(failed)
}
