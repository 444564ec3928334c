//! What acceleration structures are built from, in the driver's words: triangles, boxes around spheres, instances.

use crate::GpuError;
use crate::pipeline::memory::Memory;
use crate::pipeline::vulkan::Vulkan;
use ash::vk;
use scene::tables::{BlasRecord, GeometryKind, GeometryRecord, SceneTables};
use std::sync::Arc;

/// Geometries of a bottom-level structure, and their ranges of primitives.
pub(super) type Geometries = (Vec<vk::AccelerationStructureGeometryKHR<'static>>, Vec<u32>);

/// Vertices, indices and boxes on the device while structures are built.
pub(super) struct Input {
    memory: Memory,
    indices: u64,
    boxes: u64,
}

impl Input {
    /// Brings what a scene has to the device.
    ///
    /// # Errors
    /// [`GpuError::Allocation`].
    pub fn new(vulkan: &Arc<Vulkan>, tables: &SceneTables) -> Result<Self, GpuError> {
        let boxes: Vec<[f32; 6]> = tables.spheres.iter().map(sphere_box).collect();
        let positions: Vec<[f32; 3]> = tables.positions.iter().map(active_vertex).collect();
        let mut bytes: Vec<u8> = bytemuck::cast_slice(&positions).to_vec();
        let mut append = |part: &[u8]| {
            bytes.resize(bytes.len().next_multiple_of(16), 0);
            let at = bytes.len() as u64;
            bytes.extend_from_slice(part);
            at
        };
        let indices = append(bytemuck::cast_slice(&tables.indices));
        let boxes = append(bytemuck::cast_slice(&boxes));
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        let memory = Memory::with_bytes(vulkan, "geometry to build structures from", &bytes, usage)?;
        Ok(Self { memory, indices, boxes })
    }

    /// The geometries of a structure in the driver's words, and how many primitives each has. `opaque` says of every
    /// geometry of the scene that no any-hit shader has to be asked.
    pub fn geometries(&self, tables: &SceneTables, blas: &BlasRecord, opaque: &[bool]) -> Geometries {
        let geometries = geometries_of(tables, blas);
        let describe = |(index, g): (usize, &GeometryRecord)| match g.kind {
            GeometryKind::Triangles => self.triangles(g, opaque[index]),
            GeometryKind::Spheres => self.spheres(g),
        };
        let described = (blas.first_geometry as usize..).zip(geometries).map(describe).collect();
        (described, geometries.iter().map(|g| g.primitive_count).collect())
    }

    fn triangles(&self, g: &GeometryRecord, opaque: bool) -> vk::AccelerationStructureGeometryKHR<'static> {
        let vertices = self.memory.address + u64::from(g.first_vertex) * size_of::<[f32; 3]>() as u64;
        let indices =
            self.memory.address + self.indices + u64::from(g.first_primitive) * size_of::<[u32; 3]>() as u64;
        let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
            .vertex_format(vk::Format::R32G32B32_SFLOAT)
            .vertex_data(vk::DeviceOrHostAddressConstKHR { device_address: vertices })
            .vertex_stride(size_of::<[f32; 3]>() as u64)
            .max_vertex(g.vertex_count.saturating_sub(1))
            .index_type(vk::IndexType::UINT32)
            .index_data(vk::DeviceOrHostAddressConstKHR { device_address: indices });
        let data = vk::AccelerationStructureGeometryDataKHR { triangles };
        geometry(vk::GeometryTypeKHR::TRIANGLES, data, opaque)
    }

    fn spheres(&self, g: &GeometryRecord) -> vk::AccelerationStructureGeometryKHR<'static> {
        let boxes =
            self.memory.address + self.boxes + u64::from(g.first_primitive) * size_of::<[f32; 6]>() as u64;
        let aabbs = vk::AccelerationStructureGeometryAabbsDataKHR::default()
            .data(vk::DeviceOrHostAddressConstKHR { device_address: boxes })
            .stride(size_of::<[f32; 6]>() as u64);
        let data = vk::AccelerationStructureGeometryDataKHR { aabbs };
        geometry(vk::GeometryTypeKHR::AABBS, data, true)
    }
}

/// The only geometry of the top-level structure.
pub(super) fn instances_geometry(instances: &Memory) -> vk::AccelerationStructureGeometryKHR<'static> {
    let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default()
        .data(vk::DeviceOrHostAddressConstKHR { device_address: instances.address });
    let data = vk::AccelerationStructureGeometryDataKHR { instances };
    geometry(vk::GeometryTypeKHR::INSTANCES, data, false)
}

fn geometry(
    kind: vk::GeometryTypeKHR,
    data: vk::AccelerationStructureGeometryDataKHR<'static>,
    opaque: bool,
) -> vk::AccelerationStructureGeometryKHR<'static> {
    let flags = if opaque { vk::GeometryFlagsKHR::OPAQUE } else { vk::GeometryFlagsKHR::empty() };
    vk::AccelerationStructureGeometryKHR::default().geometry_type(kind).geometry(data).flags(flags)
}

/// For each geometry of the scene, whether none of its instances may have holes there.
pub(super) fn opaque_geometries(tables: &SceneTables) -> Vec<bool> {
    let mut opaque = vec![true; tables.geometries.len()];
    for instance in &tables.instances {
        let blas = &tables.blas[instance.blas as usize];
        for g in 0..blas.geometry_count {
            let binding = &tables.bindings[(instance.first_binding + g) as usize];
            let holes = tables.materials[binding.material as usize].has_alpha();
            opaque[(blas.first_geometry + g) as usize] &= !holes;
        }
    }
    opaque
}

/// A vertex as the driver may see it. Its triangles are left out if its x is NaN, which is how Vulkan has it; about
/// other numbers that are not finite it promises nothing.
fn active_vertex(position: &[f32; 3]) -> [f32; 3] {
    if position.iter().all(|x| x.is_finite()) { *position } else { [f32::NAN; 3] }
}

/// Corners of a box around a sphere, with a margin for the rounding of the corners themselves. NaN, which leaves the sphere
/// out, if it is none.
fn sphere_box(&[x, y, z, radius]: &[f32; 4]) -> [f32; 6] {
    if ![x, y, z, radius].iter().all(|x| x.is_finite()) || radius <= 0.0 {
        return [f32::NAN; 6];
    }
    let side = |center: f32| {
        let half = radius + (radius + center.abs()) * 4.0 * f32::EPSILON;
        [center - half, center + half]
    };
    let [x, y, z] = [x, y, z].map(side);
    [x[0], y[0], z[0], x[1], y[1], z[1]]
}

/// The geometries of a bottom-level structure.
pub(super) fn geometries_of<'a>(tables: &'a SceneTables, blas: &BlasRecord) -> &'a [GeometryRecord] {
    &tables.geometries[blas.first_geometry as usize..][..blas.geometry_count as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_hold_their_spheres() {
        for (center, radius) in [(0.0, 1.0), (1e6, 0.01), (-3.7, 1e-3), (0.1, 1e5)] {
            let b = sphere_box(&[center, -center, 0.0, radius]);
            let (low, high) = (f64::from(center) - f64::from(radius), f64::from(center) + f64::from(radius));
            assert!(f64::from(b[0]) <= low && f64::from(b[3]) >= high, "{center} {radius} {b:?}");
            assert!(f64::from(b[1]) <= -high && f64::from(b[4]) >= -low, "{center} {radius} {b:?}");
        }
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        for bad in [[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [0.0, 0.0, f32::NAN]] {
            assert!(active_vertex(&bad)[0].is_nan());
            assert!(sphere_box(&[bad[0], bad[1], bad[2], 1.0])[0].is_nan());
        }
        assert_eq!(active_vertex(&[1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
        for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(sphere_box(&[0.0, 0.0, 0.0, radius])[0].is_nan(), "{radius}");
        }
    }
}
