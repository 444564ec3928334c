//! Rays as a list: what each of them hits, by any tracer, without shading.

use crate::bindings::{PassBinding, Resource, whole};
use crate::readback::read_mapped;
use crate::scene::upload::{empty_buffer, storage_buffer, write_buffer};
use crate::shader::{Linkage, Variant};
use crate::timing::Timer;
use crate::{Gpu, GpuError};
use accel::Ray;
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages;

/// What of a ray's hits is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RayQuestion {
    /// The nearest.
    Closest,
    /// The same of rays of which neighbours go nearly the same way, such as those through one pixel: by subgroup packet traversal,
    /// where the tracer has that.
    ClosestPacket,
    /// Whether there is any. Then `instance` alone tells, and says no more than that.
    Any,
}

impl RayQuestion {
    /// The same question of rays that may go anywhere.
    pub(crate) fn of_any_rays(self) -> Self {
        if self == Self::ClosestPacket { Self::Closest } else { self }
    }

    /// What modules are linked with that import `ray_list`.
    pub fn linkage(self, variant: Variant) -> Linkage {
        let question = match self {
            Self::Closest => "rays_closest",
            Self::ClosestPacket => "rays_closest_packet",
            Self::Any => "rays_any",
        };
        Linkage::of(variant).bind("question", question)
    }
}

/// What a pass that answers rays binds of group 2.
pub(crate) const RAY_LIST: &[PassBinding] =
    &[PassBinding::Uniform(0), PassBinding::Read(1), PassBinding::Write(2)];

/// What a ray hit, as shaders write it (`Hit` of `shaders/scene.wgsl`).
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RayHit {
    /// Distance in units of the direction's length. Means nothing for a miss.
    pub t: f32,
    /// Barycentric weight of the second vertex; zero on spheres.
    pub u: f32,
    /// Barycentric weight of the third vertex; zero on spheres.
    pub v: f32,
    /// Number of the instance, or `u32::MAX` for a miss.
    pub instance: u32,
    /// Number of the geometry within the instance's bottom-level structure.
    pub geometry: u32,
    /// Number of the primitive within the bottom-level structure, all geometries counted.
    pub primitive: u32,
}

impl RayHit {
    /// Whether nothing was hit.
    pub fn is_miss(&self) -> bool {
        self.instance == u32::MAX
    }
}

/// The list's shape, as shaders read it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct RayList {
    count: u32,
    width: u32,
}

/// Rays and their hits on a device: bind group 2 of a kernel that answers them.
pub struct RayBuffers {
    /// Binding 0: the list's shape, uniform.
    pub list: wgpu::Buffer,
    /// Binding 1: [`Ray`]s.
    pub rays: wgpu::Buffer,
    /// Binding 2: [`RayHit`]s.
    pub hits: wgpu::Buffer,
    staging: wgpu::Buffer,
    shape: RayList,
}

impl RayBuffers {
    /// Copies rays to the device. `width` is how many of them make a row where they belong to the pixels of a picture, which
    /// is faster; any other number changes no hit. Zero counts as 1.
    ///
    /// # Errors
    /// When there are more rays than the device has room for.
    pub fn new(gpu: &Gpu, rays: &[Ray], width: u32) -> Result<Self, GpuError> {
        let count = u32::try_from(rays.len()).map_err(|_| GpuError::BufferTooLarge {
            object: "rays",
            bytes: size_of_val(rays) as u64,
            limit: gpu.limits.max_buffer_size,
        })?;
        let shape = RayList { count, width: width.clamp(1, count.max(1)) };
        let list = empty_buffer(gpu, "the ray list", size_of::<RayList>() as u64, BufferUsages::UNIFORM)?;
        write_buffer(gpu, "the ray list", &list, bytemuck::bytes_of(&shape))?;
        let hit_bytes = (rays.len().max(1) * size_of::<RayHit>()) as u64;
        let readable = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let rays = storage_buffer(gpu, "rays", rays, BufferUsages::empty())?;
        let hits = empty_buffer(gpu, "hits", hit_bytes, readable)?;
        let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = empty_buffer(gpu, "reading hits", hit_bytes, usage)?;
        Ok(Self { list, rays, hits, staging, shape })
    }

    /// All of the group, for a pass to bind.
    pub(crate) fn resources(&self) -> [Resource<'_>; 3] {
        [whole(0, &self.list), whole(1, &self.rays), whole(2, &self.hits)]
    }

    /// Rays in a row and rows, the last of which may not be full.
    pub fn size(&self) -> [u32; 2] {
        [self.shape.width, self.shape.count.div_ceil(self.shape.width)]
    }

    /// Waits for the device and copies the hits back, one for each ray.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read_hits(&self, gpu: &Gpu) -> Result<Vec<RayHit>, GpuError> {
        let doing = "reading hits";
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&self.hits, 0, &self.staging, 0, self.hits.size());
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing, reason })?;
        let bytes = self.shape.count as usize * size_of::<RayHit>();
        read_mapped(gpu, &self.staging, self.hits.size(), doing, |all| {
            bytemuck::pod_collect_to_vec(&all[..bytes])
        })
    }
}

/// A compiled way to answer lists of rays on one scene.
pub trait RayKernel: Send {
    /// Submits the work for all rays of a list.
    ///
    /// # Errors
    /// When the device fails at once; most failures come out when somebody waits.
    fn submit(&mut self, gpu: &Gpu, rays: &RayBuffers, timer: &mut Timer) -> Result<(), GpuError>;
}

#[cfg(test)]
mod tests;
