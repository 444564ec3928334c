//! What a scene has on the device for its first hits, whatever the picture's size.

use super::frame::HybridFrame;
use super::items::{DrawClass, Items};
use crate::scene::upload::{empty_buffer, storage_buffer};
use crate::{Gpu, GpuError, GpuScene};
use wgpu::BufferUsages;

/// The size of a draw, as the driver reads it.
pub(super) type DrawSize = [u32; 4];

/// What a scene has in group 3, whatever the picture's size.
pub(super) struct FrameBuffers {
    pub frame: wgpu::Buffer,
    pub items: wgpu::Buffer,
    pub parts: wgpu::Buffer,
    pub seen_items: wgpu::Buffer,
    pub draws: wgpu::Buffer,
    /// [`FrameBuffers::draws`] before anything was found to be seen.
    pub no_draws: wgpu::Buffer,
    pub instances: wgpu::Buffer,
    pub previous_instances: wgpu::Buffer,
}

impl FrameBuffers {
    /// Makes them for a scene and what of it is to be drawn.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn new(gpu: &Gpu, scene: &GpuScene, items: &Items) -> Result<Self, GpuError> {
        let sizes: Vec<DrawSize> = DrawClass::ALL.map(|class| [class.vertices(), 0, 0, 0]).to_vec();
        let item_words = (items.items.len().max(1) * size_of::<u32>()) as u64;
        let draw_bytes = size_of_val(&sizes[..]) as u64;
        let instances = &scene.buffers.instances;
        let uniform = size_of::<HybridFrame>() as u64;
        let drawn = BufferUsages::STORAGE | BufferUsages::INDIRECT;
        Ok(Self {
            frame: empty_buffer(gpu, "the frame", uniform, BufferUsages::UNIFORM)?,
            items: storage_buffer(gpu, "items to draw", &items.items, BufferUsages::empty())?,
            parts: storage_buffer(gpu, "parts to draw", &items.parts, BufferUsages::empty())?,
            seen_items: empty_buffer(gpu, "items that are seen", item_words, BufferUsages::STORAGE)?,
            draws: empty_buffer(gpu, "sizes of draws", draw_bytes, drawn)?,
            no_draws: storage_buffer(gpu, "sizes of empty draws", &sizes, BufferUsages::COPY_SRC)?,
            instances: instances.clone(),
            previous_instances: empty_buffer(
                gpu,
                "previous instances",
                instances.size(),
                BufferUsages::STORAGE,
            )?,
        })
    }
}
