//! wgpu's Vulkan device, and what of ray tracing wgpu does not show.

use super::table::TableRules;
use crate::{Gpu, GpuError};
use ash::vk;
use std::sync::Arc;
use wgpu::hal::api::Vulkan as Api;

/// What a device demands and allows of ray tracing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub table: TableRules,
    /// Scratch memory of builds begins at multiples of this.
    pub scratch_alignment: u64,
    pub max_instances: u64,
    pub max_geometries: u64,
    pub max_primitives: u64,
    /// Rays of one dispatch.
    pub max_rays: u64,
}

/// The raw device with its ray tracing functions.
///
/// Everything made from it holds an `Arc` of this, and this holds wgpu's device: so the raw device outlives them all.
pub(super) struct Vulkan {
    pub raw: ash::Device,
    pub structures: ash::khr::acceleration_structure::Device,
    pub pipelines: ash::khr::ray_tracing_pipeline::Device,
    pub limits: Limits,
    pub adapter: String,
    memory: vk::PhysicalDeviceMemoryProperties,
    device: wgpu::Device,
    queue: wgpu::Queue,
}

impl Vulkan {
    /// The Vulkan device of an open GPU.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] if it is not on Vulkan or was opened without ray tracing pipelines.
    pub fn new(gpu: &Gpu) -> Result<Arc<Self>, GpuError> {
        crate::tracer::TracerKind::Pipeline.check(gpu)?;
        let unsupported = || GpuError::Unsupported {
            adapter: gpu.info.name.clone(),
            tracer: crate::tracer::TracerKind::Pipeline.name(),
            missing: "Vulkan".into(),
        };
        // SAFETY: the hal device is only read, and its handles are not destroyed: `device` below keeps it alive.
        let hal = unsafe { gpu.device.as_hal::<Api>() }.ok_or_else(unsupported)?;
        let instance = hal.shared_instance().raw_instance();
        let physical = hal.raw_physical_device();
        let raw = hal.raw_device().clone();
        // SAFETY: `physical` is the physical device of this instance.
        let memory = unsafe { instance.get_physical_device_memory_properties(physical) };
        Ok(Arc::new(Self {
            structures: ash::khr::acceleration_structure::Device::new(instance, &raw),
            pipelines: ash::khr::ray_tracing_pipeline::Device::new(instance, &raw),
            limits: limits(instance, physical),
            raw,
            adapter: gpu.info.name.clone(),
            memory,
            device: gpu.device.clone(),
            queue: gpu.queue.clone(),
        }))
    }

    /// The index of a memory type among `allowed` (a bit for each) that has all of `wanted`.
    pub fn memory_type(&self, allowed: u32, wanted: vk::MemoryPropertyFlags) -> Option<u32> {
        let types = (0..).zip(self.memory.memory_types_as_slice());
        let fits =
            |&(i, t): &(u32, &vk::MemoryType)| allowed & (1 << i) != 0 && t.property_flags.contains(wanted);
        types.into_iter().find(fits).map(|(i, _)| i)
    }

    /// Records raw commands between full barriers into an encoder of its own, as raw and wgpu's commands must not share
    /// one, and submits it.
    pub fn submit(&self, label: &'static str, record: impl FnOnce(vk::CommandBuffer)) {
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) });
        self.record(&mut encoder, record);
        self.queue.submit([encoder.finish()]);
    }

    /// Records raw commands between full barriers. `encoder` must be used for nothing else.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, record: impl FnOnce(vk::CommandBuffer)) {
        // SAFETY: the hal encoder is only asked for its handle, and is not ended or reset.
        unsafe {
            encoder.as_hal_mut::<Api, _, _>(|hal| {
                // Without one the device is lost, and the submission will say so.
                let Some(hal) = hal else { return };
                let commands = hal.raw_handle();
                self.full_barrier(commands);
                record(commands);
                self.full_barrier(commands);
            });
        }
    }

    /// Brings textures into the layout in which shaders read them.
    pub fn make_readable<'a>(&self, textures: impl Iterator<Item = &'a wgpu::Texture>) {
        let label = Some("textures for ray tracing");
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        let readable = textures.map(|texture| wgpu::TextureTransition {
            texture,
            selector: None,
            state: wgpu::TextureUses::RESOURCE,
        });
        encoder.transition_resources(std::iter::empty(), readable);
        self.queue.submit([encoder.finish()]);
    }

    /// Everything before is done and seen by everything after.
    pub fn full_barrier(&self, commands: vk::CommandBuffer) {
        let everything = vk::PipelineStageFlags::ALL_COMMANDS;
        let access = vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE;
        let barrier = vk::MemoryBarrier::default().src_access_mask(access).dst_access_mask(access);
        // SAFETY: `commands` is being recorded on this device, outside of a render pass.
        unsafe {
            self.raw.cmd_pipeline_barrier(
                commands,
                everything,
                everything,
                vk::DependencyFlags::empty(),
                &[barrier],
                &[],
                &[],
            );
        }
    }

    /// Waits until the device has done all that was submitted.
    pub fn wait(&self) -> Result<(), GpuError> {
        let done = self.device.poll(wgpu::PollType::wait_indefinitely());
        done.map(|_| ()).map_err(|e| GpuError::Lost { reason: e.to_string() })
    }
}

fn limits(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Limits {
    let mut structures = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut pipelines = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
    let mut properties =
        vk::PhysicalDeviceProperties2::default().push_next(&mut structures).push_next(&mut pipelines);
    // SAFETY: `physical` belongs to `instance`; the chained structures belong to extensions that the device has.
    unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
    Limits {
        table: TableRules {
            handle_size: pipelines.shader_group_handle_size,
            handle_alignment: pipelines.shader_group_handle_alignment,
            base_alignment: pipelines.shader_group_base_alignment,
            max_stride: pipelines.max_shader_group_stride,
        },
        scratch_alignment: u64::from(structures.min_acceleration_structure_scratch_offset_alignment).max(1),
        max_instances: structures.max_instance_count,
        max_geometries: structures.max_geometry_count,
        max_primitives: structures.max_primitive_count,
        max_rays: u64::from(pipelines.max_ray_dispatch_invocation_count),
    }
}

/// The reason that a Vulkan function gives, as an error about what was being done.
pub(super) fn failed(doing: &'static str) -> impl Fn(vk::Result) -> GpuError {
    move |result| match result {
        vk::Result::ERROR_DEVICE_LOST => GpuError::Lost { reason: format!("while {doing}") },
        other => GpuError::Device { doing, reason: other.to_string() },
    }
}
