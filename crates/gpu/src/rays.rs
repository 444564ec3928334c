//! Rays as a list: what each of them hits, by any tracer, without shading.

use crate::film::read_mapped;
use crate::scene::upload::{empty_buffer, storage_buffer, write_buffer};
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
    /// The same of rays of which neighbours go nearly the same way, such as those through one pixel. Tracers that gain nothing
    /// by that take them for any others.
    ClosestTogether,
    /// Whether there is any. Then `instance` alone tells, and says no more than that.
    Any,
}

impl RayQuestion {
    /// The same question of rays that may go anywhere.
    pub(crate) fn of_any_rays(self) -> Self {
        if self == Self::ClosestTogether { Self::Closest } else { self }
    }

    /// What is behind the kernel's WGSL.
    fn asking_text(self) -> &'static str {
        match self {
            Self::Closest => include_str!("shaders/rays_closest.wgsl"),
            Self::ClosestTogether => include_str!("shaders/rays_together.wgsl"),
            Self::Any => include_str!("shaders/rays_any.wgsl"),
        }
    }

    /// The kernel's WGSL without an entry point; see `shaders/kernel_rays.wgsl`.
    fn text(self) -> String {
        [include_str!("shaders/kernel_rays.wgsl"), self.asking_text()].join("\n")
    }

    /// The kernel's WGSL with an entry point for compute shaders.
    pub fn compute_text(self) -> String {
        let entry = "@compute @workgroup_size(8, 8)
            fn main(@builtin(global_invocation_id) id: vec3u) { answer_ray(id.xy); }";
        [&self.text(), entry].join("\n")
    }

    /// The kernel's WGSL with an entry point for ray tracing pipelines.
    pub fn pipeline_text(self) -> String {
        let entry = "@ray_generation
            fn main(@builtin(ray_invocation_id) id: vec3u) { answer_ray(id.xy); }";
        [&self.text(), entry].join("\n")
    }
}

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
    /// Layout of bind group 2.
    pub layout: wgpu::BindGroupLayout,
    /// Bind group 2.
    pub bind_group: wgpu::BindGroup,
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
        let (layout, bind_group) = gpu
            .guarded(|| bind(gpu, [&list, &rays, &hits]))
            .map_err(|reason| GpuError::Device { doing: "binding rays", reason })?;
        Ok(Self { list, rays, hits, layout, bind_group, staging, shape })
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

fn bind(gpu: &Gpu, [list, rays, hits]: [&wgpu::Buffer; 3]) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
    let uniform = wgpu::BufferBindingType::Uniform;
    let entries = [entry(0, uniform), entry(1, storage(true)), entry(2, storage(false))];
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("rays"),
        entries: &entries,
    });
    let entries: Vec<_> = (0..)
        .zip([list, rays, hits])
        .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
        .collect();
    let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("rays"),
        layout: &layout,
        entries: &entries,
    });
    (layout, bind_group)
}

#[cfg(test)]
mod tests;
