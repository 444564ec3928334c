//! Giving back the memory that structures asked for in case, and did not need.

use super::{destroy, place_structures};
use crate::GpuError;
use crate::pipeline::memory::Memory;
use crate::pipeline::vulkan::{Vulkan, failed};
use ash::vk;
use std::sync::Arc;

/// Copies structures, whose builds allowed it, to memory that just holds them. The device must be done with the builds;
/// the structures given stay as they are. Waits for the device.
///
/// # Errors
/// When there is no memory for the copies while the originals are there, or the device fails.
pub(super) fn compact(
    vulkan: &Arc<Vulkan>,
    structures: &[vk::AccelerationStructureKHR],
    object: &'static str,
) -> Result<(Vec<vk::AccelerationStructureKHR>, Memory), GpuError> {
    let sizes = compacted_sizes(vulkan, structures)?;
    let kind = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
    let (copies, memory) = place_structures(vulkan, &sizes, kind, object)?;
    vulkan.submit("compaction", |commands| {
        for (&from, &to) in structures.iter().zip(&copies) {
            let info = vk::CopyAccelerationStructureInfoKHR::default()
                .src(from)
                .dst(to)
                .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
            // SAFETY: both are alive until the wait below, the source was built to be compacted, and the copy is as large as
            // the device said.
            unsafe { vulkan.structures.cmd_copy_acceleration_structure(commands, &info) };
        }
    });
    vulkan.wait().inspect_err(|_| destroy(vulkan, &copies))?;
    Ok((copies, memory))
}

/// The bytes that each structure needs.
fn compacted_sizes(
    vulkan: &Vulkan,
    structures: &[vk::AccelerationStructureKHR],
) -> Result<Vec<u64>, GpuError> {
    let kind = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
    let count = structures.len() as u32;
    let info = vk::QueryPoolCreateInfo::default().query_type(kind).query_count(count);
    // SAFETY: the count is not zero, and the type belongs to an extension that the device has.
    let pool = unsafe { vulkan.raw.create_query_pool(&info, None) };
    let pool = pool.map_err(failed("creating a query pool"))?;
    vulkan.submit("compacted sizes", |commands| {
        // SAFETY: pool and structures live until the wait below, and the pool has a query for each structure.
        unsafe {
            vulkan.raw.cmd_reset_query_pool(commands, pool, 0, count);
            vulkan
                .structures
                .cmd_write_acceleration_structures_properties(commands, structures, kind, pool, 0);
        }
    });
    let waited = vulkan.wait();
    let mut sizes = vec![0u64; structures.len()];
    let flags = vk::QueryResultFlags::TYPE_64;
    // SAFETY: there is a word for each query.
    let read = unsafe { vulkan.raw.get_query_pool_results(pool, 0, &mut sizes, flags) };
    // SAFETY: the device is done with the pool.
    unsafe { vulkan.raw.destroy_query_pool(pool, None) };
    waited?;
    read.map_err(failed("reading the sizes of acceleration structures"))?;
    Ok(sizes)
}
