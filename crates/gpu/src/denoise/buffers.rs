//! The buffers of tiles.

use super::products::Numbers;
use super::steps::{LEVELS, Memory, PLANES, Step};
use super::weights::DeviceWeights;
use crate::bindings::{Resource, whole};
use crate::scene::upload::{empty_buffer, write_buffer};
use crate::{Gpu, GpuError};
use post::{PREPARED_VALUES, Tile};
use wgpu::BufferUsages;

/// Bytes from one step's uniform to the next's: what every device can bind.
const STEP_BYTES: u64 = 256;
/// Most steps of a tile.
const MOST_STEPS: u64 = 64;
/// Bytes of a pixel of a level of the filter.
const LEVEL_BYTES: u64 = 32;
/// Bytes of a pixel of the result.
const RESULT_BYTES: u64 = 12;

/// The buffers of tiles up to a size.
pub struct TileBuffers {
    told: wgpu::Buffer,
    picture: wgpu::Buffer,
    planes: Vec<wgpu::Buffer>,
    trusted: Vec<wgpu::Buffer>,
    filtered: Vec<wgpu::Buffer>,
    result: wgpu::Buffer,
    /// Where the host reads the result.
    pub readable: wgpu::Buffer,
}

/// The most pixels of a tile on a device: no buffer is larger than it can bind, and all of them
/// together take 1.1 GB at most (1.6 GB with 32-bit numbers).
pub fn most_pixels(gpu: &Gpu, numbers: Numbers) -> usize {
    const MOST: usize = 4_000_000;
    bindable_pixels(gpu, numbers).min(MOST)
}

/// The most pixels of which a device can bind each buffer.
pub fn bindable_pixels(gpu: &Gpu, numbers: Numbers) -> usize {
    let picture = (PREPARED_VALUES * size_of::<f32>()) as u64;
    let planes =
        PLANES.iter().map(|&(level, channels)| (channels as u64 * numbers.bytes()) >> (2 * level + 2));
    let largest = planes.fold(picture, u64::max);
    let limit = gpu.limits.max_storage_buffer_binding_size.min(gpu.limits.max_buffer_size);
    (limit / largest) as usize
}

impl TileBuffers {
    /// Buffers for all of `tiles`.
    ///
    /// # Errors
    /// When there is no memory for them.
    pub fn new(gpu: &Gpu, tiles: &[Tile], numbers: Numbers) -> Result<Self, GpuError> {
        let most = |area: fn(&Tile) -> usize| tiles.iter().map(area).max().unwrap_or_default() as u64;
        let pixels = most(|tile| tile.region.width * tile.region.height);
        let kept = most(|tile| tile.core.width * tile.core.height);
        let storage = |object, bytes| empty_buffer(gpu, object, bytes, BufferUsages::STORAGE);
        let levels = |object| {
            (0..LEVELS)
                .map(|level| storage(object, (pixels >> (2 * level)) * LEVEL_BYTES))
                .collect::<Result<Vec<_>, _>>()
        };
        let plane = |&(level, channels): &(usize, usize)| {
            storage("what layers hand on", (pixels >> (2 * level + 2)) * channels as u64 * numbers.bytes())
        };
        let result_usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let readable_usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        Ok(Self {
            told: empty_buffer(gpu, "a tile's steps", STEP_BYTES * MOST_STEPS, BufferUsages::UNIFORM)?,
            picture: storage("a tile of a picture", pixels * (PREPARED_VALUES * size_of::<f32>()) as u64)?,
            planes: PLANES.iter().map(plane).collect::<Result<_, _>>()?,
            trusted: levels("levels of a picture")?,
            filtered: levels("filtered levels")?,
            result: empty_buffer(gpu, "a filtered tile", kept * RESULT_BYTES, result_usage)?,
            readable: empty_buffer(gpu, "reading a filtered tile", kept * RESULT_BYTES, readable_usage)?,
        })
    }

    /// Moves a tile's pixels, unless there are none, and what its steps are told to the device.
    ///
    /// # Errors
    /// When there is no memory for the way there.
    pub fn write(
        &self,
        gpu: &Gpu,
        pixels: &[[f32; PREPARED_VALUES]],
        steps: &[Step],
    ) -> Result<(), GpuError> {
        let mut told = vec![0; STEP_BYTES as usize * steps.len()];
        for (to, step) in told.chunks_exact_mut(STEP_BYTES as usize).zip(steps) {
            to[..size_of_val(&step.told)].copy_from_slice(bytemuck::bytes_of(&step.told));
        }
        write_buffer(gpu, "a tile's steps", &self.told, &told)?;
        if pixels.is_empty() {
            return Ok(());
        }
        write_buffer(gpu, "a tile of a picture", &self.picture, bytemuck::cast_slice(pixels))
    }

    /// What is filtered, and the result, for passes before and behind.
    pub fn ends(&self) -> [&wgpu::Buffer; 2] {
        [&self.picture, &self.result]
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        let several = self.planes.iter().chain(&self.trusted).chain(&self.filtered);
        several.chain([&self.told, &self.picture, &self.result, &self.readable]).map(|b| b.size()).sum()
    }

    /// What step number `number` binds.
    pub fn resources<'a>(
        &'a self,
        weights: &'a DeviceWeights,
        number: usize,
        step: &Step,
    ) -> Vec<Resource<'a>> {
        let told = wgpu::BufferBinding {
            buffer: &self.told,
            offset: STEP_BYTES * number as u64,
            size: std::num::NonZeroU64::new(size_of_val(&step.told) as u64),
        };
        let own = step.binds.iter().map(|&(binding, memory)| whole(binding, self.buffer(weights, memory)));
        [(0, wgpu::BindingResource::Buffer(told))].into_iter().chain(own).collect()
    }

    fn buffer<'a>(&'a self, weights: &'a DeviceWeights, memory: Memory) -> &'a wgpu::Buffer {
        match memory {
            Memory::Picture => &self.picture,
            Memory::Plane(plane) => &self.planes[plane],
            Memory::Trusted(level) => &self.trusted[level],
            Memory::Filtered(level) => &self.filtered[level],
            Memory::Result => &self.result,
            Memory::Weights(layer) => &weights.convolutions[layer].weights,
            Memory::Bias(layer) => &weights.convolutions[layer].bias,
            Memory::HeadWeights(level) => &weights.heads[level].weights,
            Memory::HeadBias(level) => &weights.heads[level].bias,
            Memory::TrustWeights => &weights.trust,
        }
    }

    /// Records that `bytes` of the result be brought where the host can read them.
    pub fn copy_result(&self, encoder: &mut wgpu::CommandEncoder, bytes: u64) {
        encoder.copy_buffer_to_buffer(&self.result, 0, &self.readable, 0, bytes);
    }
}
