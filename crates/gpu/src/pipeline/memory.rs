//! Device memory with addresses, which builds and shader binding tables need and wgpu does not give.

use super::vulkan::Vulkan;
use crate::GpuError;
use ash::vk;
use std::sync::Arc;

/// A buffer with memory of its own. The device must be done with it when it is dropped.
pub(super) struct Memory {
    vulkan: Arc<Vulkan>,
    object: &'static str,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    size: u64,
    /// Where the device finds it.
    pub address: vk::DeviceAddress,
}

/// Who can reach the memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reach {
    /// The device alone, fast.
    Device,
    /// The host, too.
    Host,
}

impl Memory {
    /// Allocates `size` bytes; `object` says what for.
    ///
    /// # Errors
    /// [`GpuError::Allocation`].
    pub fn new(
        vulkan: &Arc<Vulkan>,
        object: &'static str,
        size: u64,
        usage: vk::BufferUsageFlags,
        reach: Reach,
    ) -> Result<Self, GpuError> {
        let size = size.max(16);
        let refused = |result: vk::Result| match result {
            vk::Result::ERROR_DEVICE_LOST => GpuError::Lost { reason: format!("while allocating {object}") },
            other => GpuError::Allocation { object, bytes: size, reason: other.to_string() },
        };
        let usage = usage | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the device is alive and has buffer device addresses, which its ray tracing extensions need.
        let buffer = unsafe { vulkan.raw.create_buffer(&info, None) }.map_err(refused)?;
        // From here on dropping frees what there is.
        let mut made = Self {
            vulkan: vulkan.clone(),
            object,
            buffer,
            memory: vk::DeviceMemory::null(),
            size,
            address: 0,
        };
        // SAFETY: the buffer was just made on this device.
        let needs = unsafe { vulkan.raw.get_buffer_memory_requirements(buffer) };
        let properties = match reach {
            Reach::Device => vk::MemoryPropertyFlags::DEVICE_LOCAL,
            Reach::Host => vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT,
        };
        let kind = vulkan.memory_type(needs.memory_type_bits, properties);
        let kind = kind.ok_or_else(|| refused(vk::Result::ERROR_FEATURE_NOT_PRESENT))?;
        let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needs.size)
            .memory_type_index(kind)
            .push_next(&mut flags);
        // SAFETY: size and type are those that the buffer asked for.
        made.memory = unsafe { vulkan.raw.allocate_memory(&info, None) }.map_err(refused)?;
        // SAFETY: the buffer has no memory yet; the memory is as large as it needs and is used for nothing else.
        unsafe { vulkan.raw.bind_buffer_memory(buffer, made.memory, 0) }.map_err(refused)?;
        let info = vk::BufferDeviceAddressInfo::default().buffer(buffer);
        // SAFETY: the buffer has memory and was made for having an address.
        made.address = unsafe { vulkan.raw.get_buffer_device_address(&info) };
        Ok(made)
    }

    /// Device memory that holds `bytes`. Waits for the device.
    pub fn with_bytes(
        vulkan: &Arc<Vulkan>,
        object: &'static str,
        bytes: &[u8],
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, GpuError> {
        let usage = usage | vk::BufferUsageFlags::TRANSFER_DST;
        let device = Self::new(vulkan, object, bytes.len() as u64, usage, Reach::Device)?;
        device.upload(bytes, 0)?;
        Ok(device)
    }

    /// As [`Memory::with_bytes`], with `address` moved to a multiple of `alignment`, where the bytes begin.
    pub fn with_bytes_at(
        vulkan: &Arc<Vulkan>,
        object: &'static str,
        bytes: &[u8],
        usage: vk::BufferUsageFlags,
        alignment: u64,
    ) -> Result<Self, GpuError> {
        let usage = usage | vk::BufferUsageFlags::TRANSFER_DST;
        let mut device = Self::new(vulkan, object, bytes.len() as u64 + alignment, usage, Reach::Device)?;
        let padding = device.address.next_multiple_of(alignment) - device.address;
        device.upload(bytes, padding)?;
        device.address += padding;
        Ok(device)
    }

    /// Copies `bytes` into device memory, `offset` bytes from its beginning. Waits for the device.
    fn upload(&self, bytes: &[u8], offset: u64) -> Result<(), GpuError> {
        if bytes.is_empty() {
            return Ok(());
        }
        let (vulkan, size) = (&self.vulkan, bytes.len() as u64);
        let staging = Self::new(vulkan, self.object, size, vk::BufferUsageFlags::TRANSFER_SRC, Reach::Host)?;
        staging.write(bytes)?;
        let region = vk::BufferCopy::default().dst_offset(offset).size(size);
        vulkan.submit("upload", |commands| {
            // SAFETY: both buffers have `size` bytes there and live until the wait below is over.
            unsafe { vulkan.raw.cmd_copy_buffer(commands, staging.buffer, self.buffer, &[region]) };
        });
        vulkan.wait()
    }

    /// Writes to the beginning of memory that the host can reach.
    pub fn write(&self, bytes: &[u8]) -> Result<(), GpuError> {
        let size = self.size.min(bytes.len() as u64);
        let raw = &self.vulkan.raw;
        let flags = vk::MemoryMapFlags::empty();
        let refused = |result: vk::Result| GpuError::Allocation {
            object: self.object,
            bytes: self.size,
            reason: format!("the memory cannot be written: {result}"),
        };
        // SAFETY: the memory is at least `self.size` bytes long and not mapped; mapping memory of the device is an error
        // that the driver reports.
        let mapped = unsafe { raw.map_memory(self.memory, 0, vk::WHOLE_SIZE, flags) }.map_err(refused)?;
        // SAFETY: `size` bytes are readable in `bytes` and writable in the mapping, and the two do not overlap. The memory
        // is coherent, so unmapping is all that is left to do.
        unsafe {
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), mapped.cast::<u8>(), size as usize);
            raw.unmap_memory(self.memory);
        }
        Ok(())
    }

    /// The buffer.
    pub fn buffer(&self) -> vk::Buffer {
        self.buffer
    }

    /// Bytes.
    pub fn size(&self) -> u64 {
        self.size
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: who owns this has waited until the device is done with it; null handles are allowed.
        unsafe {
            self.vulkan.raw.destroy_buffer(self.buffer, None);
            self.vulkan.raw.free_memory(self.memory, None);
        }
    }
}
