//! Reading buffers back: from the device to the host.

use crate::{Gpu, GpuError};

/// Maps the first `size` bytes of a buffer, shows them to `read`, and unmaps it.
///
/// # Errors
/// When the device fails.
pub(crate) fn read_mapped<T>(
    gpu: &Gpu,
    buffer: &wgpu::Buffer,
    size: u64,
    doing: &'static str,
    read: impl FnOnce(&[u8]) -> T,
) -> Result<T, GpuError> {
    let (sender, receiver) = std::sync::mpsc::channel();
    let slice = buffer.slice(..size);
    slice.map_async(wgpu::MapMode::Read, move |result| {
        let _ = sender.send(result); // nobody waits any more if the device is gone
    });
    gpu.wait(doing)?;
    let failed = |reason: String| GpuError::Device { doing, reason };
    let mapped = receiver.try_recv().map_err(|e| failed(e.to_string()))?;
    mapped.map_err(|e| failed(e.to_string()))?;
    let view = slice.get_mapped_range().map_err(|e| failed(e.to_string()))?;
    let value = read(&view);
    drop(view);
    buffer.unmap();
    Ok(value)
}

/// For tests: all of a buffer.
#[cfg(test)]
pub(crate) fn read_all<T: bytemuck::Pod>(gpu: &Gpu, buffer: &wgpu::Buffer) -> Vec<T> {
    let mapped = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let staging = crate::scene::upload::empty_buffer(gpu, "a test", buffer.size(), mapped).expect("memory");
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    let all = |bytes: &[u8]| bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect();
    read_mapped(gpu, &staging, buffer.size(), "a test", all).expect("a device")
}
