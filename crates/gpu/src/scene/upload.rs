//! Moving arrays to the device.

use crate::{Gpu, GpuError};
use bytemuck::NoUninit;
use wgpu::{BufferUsages, Extent3d, TextureFormat, TextureUsages};

/// A buffer that shaders read as an array, filled with `data`. An empty array gets one element of zeros, because a
/// binding cannot be empty.
///
/// # Errors
/// [`GpuError::BufferTooLarge`] or [`GpuError::Allocation`], which name `object`.
pub fn storage_buffer<T: NoUninit>(
    gpu: &Gpu,
    object: &'static str,
    data: &[T],
    extra_usage: BufferUsages,
) -> Result<wgpu::Buffer, GpuError> {
    roomy_buffer(gpu, object, data, 0, extra_usage)
}

/// As [`storage_buffer`], with room for so many bytes more.
///
/// # Errors
/// As [`storage_buffer`].
pub fn roomy_buffer<T: NoUninit>(
    gpu: &Gpu,
    object: &'static str,
    data: &[T],
    room: u64,
    extra_usage: BufferUsages,
) -> Result<wgpu::Buffer, GpuError> {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let size = (bytes.len().max(size_of::<T>()) as u64 + room).next_multiple_of(4);
    let buffer = empty_buffer(gpu, object, size, BufferUsages::STORAGE | extra_usage)?;
    write_buffer(gpu, object, &buffer, bytes)?;
    Ok(buffer)
}

/// A buffer of `size` bytes that is filled later.
///
/// # Errors
/// As [`storage_buffer`].
pub fn empty_buffer(
    gpu: &Gpu,
    object: &'static str,
    size: u64,
    usage: BufferUsages,
) -> Result<wgpu::Buffer, GpuError> {
    let mut limit = gpu.limits.max_buffer_size;
    if usage.contains(BufferUsages::STORAGE) {
        limit = limit.min(gpu.limits.max_storage_buffer_binding_size);
    }
    if size > limit {
        return Err(GpuError::BufferTooLarge { object, bytes: size, limit });
    }
    let usage = usage | if usage.contains(BufferUsages::MAP_READ) { usage } else { BufferUsages::COPY_DST };
    let descriptor = wgpu::BufferDescriptor { label: Some(object), size, usage, mapped_at_creation: false };
    gpu.guarded(|| gpu.device.create_buffer(&descriptor)).map_err(|reason| GpuError::Allocation {
        object,
        bytes: size,
        reason,
    })
}

/// Replaces a buffer's beginning.
///
/// # Errors
/// [`GpuError::Allocation`] when there is no memory for the way there.
pub fn write_buffer(
    gpu: &Gpu,
    object: &'static str,
    buffer: &wgpu::Buffer,
    bytes: &[u8],
) -> Result<(), GpuError> {
    write_buffer_at(gpu, object, buffer, 0, bytes)
}

/// As [`write_buffer`], from byte `offset` on, a multiple of four.
///
/// # Errors
/// When there is no memory for the copy.
pub fn write_buffer_at(
    gpu: &Gpu,
    object: &'static str,
    buffer: &wgpu::Buffer,
    offset: u64,
    bytes: &[u8],
) -> Result<(), GpuError> {
    // Copies go through staging memory as large as the copy: pieces keep that small.
    const PIECE: usize = 16 << 20;
    let whole = bytes.len() & !3;
    for (i, piece) in bytes[..whole].chunks(PIECE).enumerate() {
        gpu.guarded(|| gpu.queue.write_buffer(buffer, offset + (i * PIECE) as u64, piece))
            .map_err(|reason| GpuError::Allocation { object, bytes: piece.len() as u64, reason })?;
        if bytes.len() > PIECE {
            gpu.queue.submit([]);
        }
    }
    Ok(())
}

/// What a texture holds.
#[derive(Clone, Copy, Debug)]
pub struct TextureShape {
    /// For messages.
    pub object: &'static str,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Number of layers.
    pub layers: u32,
    /// Of a texel.
    pub format: TextureFormat,
    /// Whether shaders see an array even if there is one layer.
    pub array: bool,
}

/// A texture for `textureLoad` and its view, without contents.
///
/// # Errors
/// [`GpuError::TextureTooLarge`] or [`GpuError::Allocation`].
pub fn empty_texture(gpu: &Gpu, shape: TextureShape) -> Result<(wgpu::Texture, wgpu::TextureView), GpuError> {
    let TextureShape { object, width, height, layers, format, array } = shape;
    let limit = gpu.limits.max_texture_dimension_2d;
    if width > limit || height > limit || layers > gpu.limits.max_texture_array_layers {
        return Err(GpuError::TextureTooLarge { object, width, height, limit });
    }
    let bytes = u64::from(width) * u64::from(height) * u64::from(layers) * texel_bytes(format);
    let descriptor = wgpu::TextureDescriptor {
        label: Some(object),
        size: Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let dimension = if array { wgpu::TextureViewDimension::D2Array } else { wgpu::TextureViewDimension::D2 };
    gpu.guarded(|| {
        let texture = gpu.device.create_texture(&descriptor);
        let view = texture
            .create_view(&wgpu::TextureViewDescriptor { dimension: Some(dimension), ..Default::default() });
        (texture, view)
    })
    .map_err(|reason| GpuError::Allocation { object, bytes, reason })
}

/// Writes rows of texels into one layer from row `first_row` on; `width` texels each.
///
/// # Errors
/// [`GpuError::Allocation`] when there is no memory for the way there.
pub fn write_rows(
    gpu: &Gpu,
    shape: TextureShape,
    texture: &wgpu::Texture,
    layer: u32,
    first_row: u32,
    width: u32,
    texels: &[u8],
) -> Result<(), GpuError> {
    let row_bytes = width * texel_bytes(shape.format) as u32;
    if texels.is_empty() || row_bytes == 0 {
        return Ok(());
    }
    // As with buffers: pieces keep the staging memory small.
    let rows_a_piece = ((16 << 20) / row_bytes).max(1);
    let pieces = texels.chunks(rows_a_piece as usize * row_bytes as usize);
    for (piece, row) in pieces.zip((first_row..).step_by(rows_a_piece as usize)) {
        let rows = piece.len() as u32 / row_bytes;
        gpu.guarded(|| {
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: 0, y: row, z: layer },
                    aspect: wgpu::TextureAspect::All,
                },
                piece,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
                Extent3d { width, height: rows, depth_or_array_layers: 1 },
            );
        })
        .map_err(|reason| GpuError::Allocation {
            object: shape.object,
            bytes: piece.len() as u64,
            reason,
        })?;
    }
    Ok(())
}

/// Bytes of a texel of the formats used here.
fn texel_bytes(format: TextureFormat) -> u64 {
    u64::from(format.block_copy_size(None).unwrap_or(16))
}
