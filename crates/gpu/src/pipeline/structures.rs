//! The driver's acceleration structures of a scene: a bottom-level structure of every mesh, and one of all instances.

mod compact;
mod geometry;

use super::memory::{Memory, Reach};
use super::vulkan::{Limits, Vulkan, failed};
use crate::GpuError;
use ash::vk;
use compact::compact;
use geometry::{Geometries, Input, geometries_of, instances_geometry, opaque_geometries};
use scene::tables::{InstanceRecord, SceneTables};
use std::sync::Arc;

/// Structures begin at multiples of this in their memory: Vulkan's rule.
const STORAGE_ALIGNMENT: u64 = 256;

/// Builds that run at the same time share this much scratch memory; a larger build has its own.
const SCRATCH_BUDGET: u64 = 64 << 20;

/// Instances and records are numbered with so many bits in the driver's instances.
const INSTANCE_BITS: u32 = 24;

/// The acceleration structures of a scene on the device.
pub(super) struct Structures {
    vulkan: Arc<Vulkan>,
    bottom: Vec<vk::AccelerationStructureKHR>,
    top: vk::AccelerationStructureKHR,
    // What the structures stand in; fields are dropped after `drop` has destroyed those.
    memory: Vec<Memory>,
}

impl Structures {
    /// Builds the structures. `offsets` has the first record of each instance in the shader binding table. Waits for the
    /// device.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if the scene has more than the device can number, [`GpuError::Allocation`].
    pub fn build(vulkan: &Arc<Vulkan>, tables: &SceneTables, offsets: &[u32]) -> Result<Self, GpuError> {
        check_limits(&vulkan.adapter, &vulkan.limits, tables, offsets)?;
        let mut made = Self {
            vulkan: vulkan.clone(),
            bottom: Vec::new(),
            top: vk::AccelerationStructureKHR::null(),
            memory: Vec::new(),
        };
        made.build_all(tables, offsets)?;
        Ok(made)
    }

    /// The structure of all instances.
    pub fn top(&self) -> vk::AccelerationStructureKHR {
        self.top
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.memory.iter().map(Memory::size).sum()
    }

    fn build_all(&mut self, tables: &SceneTables, offsets: &[u32]) -> Result<(), GpuError> {
        let vulkan = self.vulkan.clone();
        let input = Input::new(&vulkan, tables)?;
        let opaque = opaque_geometries(tables);
        let geometries: Vec<_> = tables.blas.iter().map(|b| input.geometries(tables, b, &opaque)).collect();
        let builds: Vec<_> = geometries.iter().map(|g| Build::bottom(&vulkan, g)).collect();
        let object = "bottom-level structures";
        self.bottom = self.run(&builds, object)?;
        if !self.bottom.is_empty() {
            let (compacted, memory) = compact(&vulkan, &self.bottom, object)?;
            destroy(&vulkan, &std::mem::replace(&mut self.bottom, compacted));
            self.memory = vec![memory];
        }

        let instances = self.instances(tables, offsets)?;
        let geometry = [instances_geometry(&instances)];
        let top = self.run(&[Build::top(&vulkan, &geometry, tables)], "the top-level structure")?;
        self.top = top.first().copied().unwrap_or_default();
        Ok(())
    }

    /// Builds the top-level structure again, where it is, after instances have moved. There must be as many as before, of
    /// the same structures with the same records. Waits for the device.
    ///
    /// # Errors
    /// [`GpuError::Allocation`], or when the device fails.
    pub fn move_instances(&self, tables: &SceneTables, offsets: &[u32]) -> Result<(), GpuError> {
        self.vulkan.wait()?;
        let instances = self.instances(tables, offsets)?;
        let geometry = [instances_geometry(&instances)];
        self.execute(&[Build::top(&self.vulkan, &geometry, tables)], &[self.top], "moved instances")
    }

    /// Makes structures and builds them on the device.
    fn run(
        &mut self,
        builds: &[Build<'_>],
        object: &'static str,
    ) -> Result<Vec<vk::AccelerationStructureKHR>, GpuError> {
        let vulkan = self.vulkan.clone();
        let Some(kind) = builds.first().map(|b| b.kind) else { return Ok(Vec::new()) };
        let sizes: Vec<_> = builds.iter().map(|b| b.size).collect();
        let (made, storage) = place_structures(&vulkan, &sizes, kind, object)?;
        self.memory.push(storage);
        self.execute(builds, &made, object).inspect_err(|_| destroy(&vulkan, &made))?;
        Ok(made)
    }

    /// Builds structures on the device, as many at a time as share the scratch memory. Waits for the device.
    fn execute(
        &self,
        builds: &[Build<'_>],
        made: &[vk::AccelerationStructureKHR],
        object: &'static str,
    ) -> Result<(), GpuError> {
        let vulkan = &self.vulkan;
        let alignment = vulkan.limits.scratch_alignment;
        let largest = builds.iter().map(|b| b.scratch).max().unwrap_or(0);
        let total: u64 = builds.iter().map(|b| b.scratch.next_multiple_of(alignment)).sum();
        let budget = total.min(SCRATCH_BUDGET).max(largest);
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let scratch =
            Memory::new(vulkan, "scratch memory of builds", budget + alignment, usage, Reach::Device)?;
        let base = scratch.address.next_multiple_of(alignment);

        let mut next = 0;
        while next < builds.len() {
            let (mut used, mut infos, mut ranges) = (0, Vec::new(), Vec::new());
            while let (Some(build), Some(&structure)) = (builds.get(next), made.get(next)) {
                let end = (used + build.scratch).next_multiple_of(alignment);
                if !infos.is_empty() && used + build.scratch > budget {
                    break;
                }
                infos.push(build.info(structure, base + used));
                ranges.push(&build.ranges[..]);
                (used, next) = (end, next + 1);
            }
            vulkan.submit(object, |commands| {
                // SAFETY: the geometries' addresses, the structures and the scratch memory live until the device is done,
                // and builds of one batch have places of their own. The barriers of `submit` separate batches.
                unsafe { vulkan.structures.cmd_build_acceleration_structures(commands, &infos, &ranges) };
            });
        }
        // The scratch memory goes when this returns.
        vulkan.wait()
    }

    /// The driver's records of instances, in memory.
    fn instances(&self, tables: &SceneTables, offsets: &[u32]) -> Result<Memory, GpuError> {
        let addresses: Vec<_> = self.bottom.iter().map(|&b| address(&self.vulkan, b)).collect();
        let records: Vec<u8> = (0..)
            .zip(tables.instances.iter().zip(offsets))
            .flat_map(|(index, (instance, &offset))| {
                instance_bytes(index, instance, offset, addresses[instance.blas as usize])
            })
            .collect();
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        let size = records.len() as u64;
        let memory = Memory::new(&self.vulkan, "instances", size, usage, Reach::Host)?;
        memory.write(&records)?;
        Ok(memory)
    }
}

/// Makes structures of these sizes, without content, one after the other in memory of their own.
fn place_structures(
    vulkan: &Arc<Vulkan>,
    sizes: &[u64],
    kind: vk::AccelerationStructureTypeKHR,
    object: &'static str,
) -> Result<(Vec<vk::AccelerationStructureKHR>, Memory), GpuError> {
    let mut end = 0;
    let places: Vec<u64> = sizes.iter().map(|&size| take(&mut end, size, STORAGE_ALIGNMENT)).collect();
    let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR;
    let storage = Memory::new(vulkan, object, end, usage, Reach::Device)?;
    let mut made = Vec::new();
    for (&size, place) in sizes.iter().zip(places) {
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(storage.buffer())
            .offset(place)
            .size(size)
            .ty(kind);
        // SAFETY: the place in the buffer is free, aligned and large enough, and the buffer was made for this.
        let structure = unsafe { vulkan.structures.create_acceleration_structure(&info, None) };
        match structure {
            Ok(structure) => made.push(structure),
            Err(result) => {
                destroy(vulkan, &made);
                return Err(failed("creating an acceleration structure")(result));
            }
        }
    }
    Ok((made, storage))
}

impl Drop for Structures {
    fn drop(&mut self) {
        // A device that is lost has nothing under way either.
        let _ = self.vulkan.wait();
        destroy(&self.vulkan, &self.bottom);
        destroy(&self.vulkan, &[self.top]);
    }
}

fn destroy(vulkan: &Vulkan, structures: &[vk::AccelerationStructureKHR]) {
    for &structure in structures {
        // SAFETY: the device is done with it, and nobody else knows the handle; null is allowed.
        unsafe { vulkan.structures.destroy_acceleration_structure(structure, None) };
    }
}

fn address(vulkan: &Vulkan, structure: vk::AccelerationStructureKHR) -> vk::DeviceAddress {
    let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(structure);
    // SAFETY: the structure is alive.
    unsafe { vulkan.structures.get_acceleration_structure_device_address(&info) }
}

/// `VkAccelerationStructureInstanceKHR`: 64 bytes.
fn instance_bytes(index: u32, instance: &InstanceRecord, offset: u32, blas: vk::DeviceAddress) -> [u8; 64] {
    let mask = 0xff;
    // Surfaces have two sides for rays.
    let flags = vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw();
    let mut bytes = [0; 64];
    bytes[..48].copy_from_slice(bytemuck::bytes_of(&instance.object_to_world));
    bytes[48..52].copy_from_slice(&(index | mask << INSTANCE_BITS).to_ne_bytes());
    bytes[52..56].copy_from_slice(&(offset | flags << INSTANCE_BITS).to_ne_bytes());
    bytes[56..].copy_from_slice(&blas.to_ne_bytes());
    bytes
}

fn check_limits(
    adapter: &str,
    limits: &Limits,
    tables: &SceneTables,
    offsets: &[u32],
) -> Result<(), GpuError> {
    let check = |limit: &'static str, needed: u64, offered: u64| {
        let adapter = adapter.to_owned();
        if needed <= offered { Ok(()) } else { Err(GpuError::Limit { adapter, limit, needed, offered }) }
    };
    let numbers = 1 << INSTANCE_BITS;
    check("instances", tables.instances.len() as u64, limits.max_instances.min(numbers))?;
    let records = offsets.iter().max().map_or(0, |&o| u64::from(o) + 1);
    check("records of the shader binding table", records, numbers)?;
    for blas in &tables.blas {
        let geometries = geometries_of(tables, blas);
        check("geometries of a structure", geometries.len() as u64, limits.max_geometries)?;
        let primitives = geometries.iter().map(|g| u64::from(g.primitive_count)).sum();
        check("primitives of a structure", primitives, limits.max_primitives)?;
    }
    Ok(())
}

/// The next place for `size` bytes.
fn take(offset: &mut u64, size: u64, alignment: u64) -> u64 {
    let place = offset.next_multiple_of(alignment);
    *offset = place + size;
    place
}

/// What a structure is built from, its sizes and its parts.
struct Build<'a> {
    kind: vk::AccelerationStructureTypeKHR,
    geometries: &'a [vk::AccelerationStructureGeometryKHR<'a>],
    ranges: Vec<vk::AccelerationStructureBuildRangeInfoKHR>,
    size: u64,
    scratch: u64,
}

impl<'a> Build<'a> {
    fn bottom(vulkan: &Vulkan, (geometries, counts): &'a Geometries) -> Self {
        let ranges = counts.iter().map(|&count| range(0, count)).collect();
        Self::new(vulkan, vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, geometries, ranges)
    }

    fn top(
        vulkan: &Vulkan,
        instances: &'a [vk::AccelerationStructureGeometryKHR<'a>],
        tables: &SceneTables,
    ) -> Self {
        let ranges = vec![range(0, tables.instances.len() as u32)];
        Self::new(vulkan, vk::AccelerationStructureTypeKHR::TOP_LEVEL, instances, ranges)
    }

    fn new(
        vulkan: &Vulkan,
        kind: vk::AccelerationStructureTypeKHR,
        geometries: &'a [vk::AccelerationStructureGeometryKHR<'a>],
        ranges: Vec<vk::AccelerationStructureBuildRangeInfoKHR>,
    ) -> Self {
        let mut build = Self { kind, geometries, ranges, size: 0, scratch: 0 };
        let counts: Vec<u32> = build.ranges.iter().map(|r| r.primitive_count).collect();
        let info = build.info(vk::AccelerationStructureKHR::null(), 0);
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: one count for each geometry; addresses in the geometries are not looked at.
        unsafe {
            vulkan.structures.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &info,
                &counts,
                &mut sizes,
            );
        }
        (build.size, build.scratch) = (sizes.acceleration_structure_size, sizes.build_scratch_size);
        build
    }

    fn flags(&self) -> vk::BuildAccelerationStructureFlagsKHR {
        let fast = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE;
        // The top level is small.
        let is_bottom = self.kind == vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        if is_bottom { fast | vk::BuildAccelerationStructureFlagsKHR::ALLOW_COMPACTION } else { fast }
    }

    fn info(
        &self,
        structure: vk::AccelerationStructureKHR,
        scratch: vk::DeviceAddress,
    ) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
        vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(self.kind)
            .flags(self.flags())
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(self.geometries)
            .dst_acceleration_structure(structure)
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch })
    }
}

fn range(first_byte: u32, count: u32) -> vk::AccelerationStructureBuildRangeInfoKHR {
    vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_offset(first_byte).primitive_count(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_device_cannot_number_is_named() {
        let tables = SceneTables::build(&testkit::scenes::cornell());
        let rules = super::super::table::TableRules {
            handle_size: 32,
            handle_alignment: 32,
            base_alignment: 64,
            max_stride: 4096,
        };
        let enough = Limits {
            table: rules,
            scratch_alignment: 128,
            max_instances: 1 << 24,
            max_geometries: 1 << 24,
            max_primitives: 1 << 29,
            max_rays: 1 << 30,
        };
        check_limits("some GPU", &enough, &tables, &[0]).expect("fits");
        for (limits, offset, name) in [
            (Limits { max_instances: 0, ..enough }, 0, "1 instances"),
            (Limits { max_geometries: 1, ..enough }, 0, "geometries of a structure"),
            (Limits { max_primitives: 7, ..enough }, 0, "7 primitives of a structure"),
            (enough, 1 << 24, "16777216 records of the shader binding table"),
        ] {
            let error =
                check_limits("some GPU", &limits, &tables, &[offset]).expect_err("does not fit").to_string();
            assert!(error.contains("some GPU") && error.contains(name.trim_start_matches("1 ")), "{error}");
        }
    }

    /// The driver's record is what the Vulkan headers say.
    #[test]
    fn instances_are_laid_out_as_vulkan_says() {
        assert_eq!(size_of::<vk::AccelerationStructureInstanceKHR>(), 64);
        let instance = InstanceRecord {
            object_to_world: [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 10.0, 11.0, 12.0]],
            world_to_object: [[0.0; 4]; 3],
            blas: 0,
            first_binding: 0,
            identity: false,
        };
        let culling = vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw() as u8;
        let expected = vk::AccelerationStructureInstanceKHR {
            transform: vk::TransformMatrixKHR { matrix: std::array::from_fn(|i| i as f32 + 1.0) },
            instance_custom_index_and_mask: vk::Packed24_8::new(7, 0xff),
            instance_shader_binding_table_record_offset_and_flags: vk::Packed24_8::new(0x123456, culling),
            acceleration_structure_reference: vk::AccelerationStructureReferenceKHR {
                device_handle: 0xabcdef,
            },
        };
        let actual = instance_bytes(7, &instance, 0x123456, 0xabcdef);
        // SAFETY: both are 64 bytes of plain numbers without padding.
        let expected: [u8; 64] = unsafe { std::mem::transmute(expected) };
        assert_eq!(actual, expected);
    }
}
