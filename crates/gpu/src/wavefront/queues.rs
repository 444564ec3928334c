//! The paths in flight and the queues between stages, on the device: bind group 3 of the stages.

use crate::bindings::{PassBinding, Resource, whole};
use crate::scene::upload::{empty_buffer, write_buffer};
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages;

/// Invocations of a workgroup, as in `shaders/wavefront.wgsl`.
pub const GROUP: u32 = 64;
/// The same of the stage that shades. Measured: with 64 it takes up to a tenth longer, while the others prefer 64.
pub const SHADE_GROUP: u32 = 128;

/// Bindings of the queues in group 3: behind those of passes that have others, too.
pub(crate) const WAVE: PassBinding = PassBinding::Write(30);
pub(crate) const PATHS: PassBinding = PassBinding::Write(31);
pub(crate) const HITS: PassBinding = PassBinding::Write(32);
pub(crate) const SHADOW_RAYS: PassBinding = PassBinding::Write(33);
pub(crate) const GATHERED: PassBinding = PassBinding::Write(34);
pub(crate) const DISPATCHES: PassBinding = PassBinding::Write(35);

/// Workgroups that every device can start at a time in one dimension.
const MOST_GROUPS: u64 = 65_535;

/// Paths in flight on a GPU. Each dispatch waits for its slowest ray, which must not count among the others.
const PATHS_ON_GPU: u64 = 1 << 22;

/// Paths in flight on a processor, whose caches they should not leave.
const PATHS_ON_CPU: u64 = 1 << 14;

/// Bytes of a plane of records: four words of each; see `shaders/wavefront.wgsl` for this and the following.
const PLANE: u64 = 16;

/// Planes of a path on its way to the next vertex, of where it arrives, and of a shadow ray.
const PATH_PLANES: u64 = 4;
const HIT_PLANES: u64 = 2;
const SHADOW_PLANES: u64 = 3;

/// Bytes of both places of a path.
const PATH_BYTES: u64 = 2 * PATH_PLANES * PLANE;

/// Paths for which there can be queues on a device.
pub(crate) fn most_paths(gpu: &Gpu) -> u64 {
    let limit = gpu.limits.max_storage_buffer_binding_size.min(gpu.limits.max_buffer_size);
    (limit / PATH_BYTES).min(MOST_GROUPS * u64::from(GROUP))
}

/// Paths in flight that suit a device.
pub fn suitable_paths(gpu: &Gpu) -> u64 {
    most_paths(gpu).min(if gpu.is_software() { PATHS_ON_CPU } else { PATHS_ON_GPU })
}

/// Where a wave is.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Wave {
    first_pixel: u32,
    pixel_count: u32,
    capacity: u32,
    depth: u32,
    path_count: u32,
    shadow_rays: u32,
    next_path_count: u32,
    casting: u32,
}

/// Workgroups of the next dispatches.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Dispatches {
    paths: [u32; 3],
    shading: [u32; 3],
    shadow_rays: [u32; 3],
}

impl Dispatches {
    /// Where the size of dispatches for paths is.
    pub const PATHS: u64 = std::mem::offset_of!(Self, paths) as u64;
    /// Where the size of dispatches that shade is.
    pub const SHADING: u64 = std::mem::offset_of!(Self, shading) as u64;
    /// Where the size of dispatches for shadow rays is.
    pub const SHADOW_RAYS: u64 = std::mem::offset_of!(Self, shadow_rays) as u64;
}

/// Buffers for a number of paths.
#[derive(Clone)]
pub struct Queues {
    /// Paths that may be in flight.
    capacity: u32,
    /// The wave, paths, hits, shadow rays, gathered radiance, and sizes of dispatches.
    buffers: [wgpu::Buffer; 6],
}

impl Queues {
    /// Queues for `paths` paths, or as many as suit the device; never more than fit.
    ///
    /// # Errors
    /// When there is no memory for them.
    pub fn new(gpu: &Gpu, paths: Option<u32>) -> Result<Self, GpuError> {
        let capacity = paths.map_or(suitable_paths(gpu), |paths| u64::from(paths).min(most_paths(gpu)));
        let capacity = capacity.max(1);
        let none = BufferUsages::empty();
        let buffer = |object, bytes, usage| empty_buffer(gpu, object, bytes, BufferUsages::STORAGE | usage);
        let buffers = [
            buffer("the wave", size_of::<Wave>() as u64, none)?,
            buffer("the paths in flight", capacity * PATH_BYTES, none)?,
            buffer("hits", capacity * HIT_PLANES * PLANE, none)?,
            buffer("shadow rays", capacity * SHADOW_PLANES * PLANE, none)?,
            buffer("gathered radiance", capacity * PLANE, none)?,
            buffer("sizes of dispatches", size_of::<Dispatches>() as u64, BufferUsages::INDIRECT)?,
        ];
        Ok(Self { capacity: capacity as u32, buffers })
    }

    /// Paths that may be in flight.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// All of them, for passes to bind what they need.
    pub fn resources(&self) -> [Resource<'_>; 6] {
        let bindings = [WAVE, PATHS, HITS, SHADOW_RAYS, GATHERED, DISPATCHES];
        std::array::from_fn(|i| whole(bindings[i].number(), &self.buffers[i]))
    }

    /// Sizes of dispatches, at the offsets that `Dispatches` names.
    pub fn dispatches(&self) -> &wgpu::Buffer {
        &self.buffers[5]
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.buffers.iter().map(wgpu::Buffer::size).sum()
    }

    /// Tells the stages that the next wave begins with `paths` paths from `pixel_count` pixels of the batch from
    /// `first_pixel` on. What was submitted before still sees the wave before.
    ///
    /// # Errors
    /// When there is no memory for the copy.
    pub fn begin(&self, gpu: &Gpu, first_pixel: u32, pixel_count: u32, paths: u32) -> Result<(), GpuError> {
        let wave = Wave {
            first_pixel,
            pixel_count,
            capacity: self.capacity,
            depth: 1,
            path_count: paths,
            ..Wave::default()
        };
        write_buffer(gpu, "the wave", &self.buffers[0], bytemuck::bytes_of(&wave))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{assert_layout, constant};

    #[test]
    fn layouts_match_the_shader() {
        let module = crate::shader::check::module("wavefront");
        assert_layout!(
            module,
            Wave {
                first_pixel,
                pixel_count,
                capacity,
                depth,
                path_count,
                shadow_rays,
                next_path_count,
                casting
            }
        );
        assert_layout!(module, Dispatches { paths, shading, shadow_rays });
        assert_eq!(constant(&module, "GROUP"), GROUP);
        assert_eq!(constant(&module, "SHADE_GROUP"), SHADE_GROUP);
        let planes =
            [("PATH_PLANES", PATH_PLANES), ("HIT_PLANES", HIT_PLANES), ("SHADOW_PLANES", SHADOW_PLANES)];
        for (name, count) in planes {
            assert_eq!(u64::from(constant(&module, name)), count, "{name}");
        }
    }

    #[test]
    fn queues_fit_the_device() {
        let caps = crate::LimitCaps { storage_binding_bytes: 1 << 16, ..crate::LimitCaps::default() };
        let options = crate::GpuOptions { limits: Some(caps), ..crate::GpuOptions::default() };
        let Some(gpu) = crate::open_for_test("queues_fit_the_device", &options) else { return };
        let queues = Queues::new(&gpu, Some(u32::MAX)).expect("they fit");
        assert_eq!(queues.capacity(), 512);
        assert_eq!(queues.memory_bytes(), 512 * (128 + 32 + 48 + 16) + 32 + 36);
        assert_eq!(Queues::new(&gpu, Some(100)).expect("they fit").capacity(), 100);
    }
}
