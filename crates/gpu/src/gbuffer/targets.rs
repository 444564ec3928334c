//! What depends on the picture's size: what is drawn to, a record for each pixel, and the bind groups with them.

use super::buffers::FrameBuffers;
use super::passes::{DEPTH_FORMAT, ID_FORMAT, slots};
use super::raster::CompiledDraws;
use crate::bindings::whole;
use crate::film::FilmBuffers;
use crate::pass::{Pass, PassGroups};
use crate::scene::upload::empty_buffer;
use crate::{Gpu, GpuError};
use wgpu::{BufferUsages, TextureFormat, TextureUsages};

/// Words of a pixel's record in each of its planes.
const PLANE_WORDS: usize = 4;
/// Planes of records, by their names in `shaders/hybrid_pixels.wgsl`.
const HIT: usize = 1;
const MOTION: usize = 2;
const PLANES: usize = 3;

/// What a frame knows of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct HybridPixel {
    instance: u32,
    motion: [f32; 2],
}

impl HybridPixel {
    /// The instance that is seen, unless it is the sky.
    pub fn instance(&self) -> Option<u32> {
        (self.instance != u32::MAX).then_some(self.instance)
    }

    /// From where the surface was in the frame before to where it is, in pixels to the right and down.
    pub fn motion(&self) -> [f32; 2] {
        self.motion
    }

    /// Bytes of the record of a pixel.
    const BYTES: u64 = (PLANES * PLANE_WORDS * size_of::<u32>()) as u64;

    /// What the words of all planes say, pixel by pixel.
    pub(crate) fn from_planes(words: &[u32]) -> Vec<Self> {
        let area = words.len() / (PLANES * PLANE_WORDS);
        let record = |plane: usize, at: usize| &words[(plane * area + at) * PLANE_WORDS..][..PLANE_WORDS];
        let pixel = |at| Self {
            instance: record(HIT, at)[3],
            motion: [2, 3].map(|i| f32::from_bits(record(MOTION, at)[i])),
        };
        (0..area).map(pixel).collect()
    }
}

/// For one film.
pub(super) struct Targets {
    /// The window, in pixels.
    pub size: [u32; 2],
    pub ids: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    pub pixels: wgpu::Buffer,
    /// By pass.
    pub passes: Vec<PassGroups>,
    pub draws: PassGroups,
    film: wgpu::Buffer,
}

impl Targets {
    /// Makes them for a film.
    ///
    /// # Errors
    /// When the picture is too large for the device, or there is no memory.
    pub fn new(
        gpu: &Gpu,
        film: &FilmBuffers,
        buffers: &FrameBuffers,
        passes: &[Pass],
        draws: &CompiledDraws,
    ) -> Result<Self, GpuError> {
        let size = film.contents.picture().window_size;
        let ids = target(gpu, "what is seen", size, ID_FORMAT, TextureUsages::TEXTURE_BINDING)?;
        let depth = target(gpu, "depth", size, DEPTH_FORMAT, TextureUsages::empty())?;
        let pixel_bytes = u64::from(size[0]) * u64::from(size[1]) * HybridPixel::BYTES;
        let pixels = empty_buffer(
            gpu,
            "the frame's pixels",
            pixel_bytes,
            BufferUsages::STORAGE | BufferUsages::COPY_SRC,
        )?;
        let own = [
            whole(slots::FRAME, &buffers.frame),
            whole(slots::ITEMS, &buffers.items),
            whole(slots::PARTS, &buffers.parts),
            whole(slots::SEEN_ITEMS, &buffers.seen_items),
            whole(slots::DRAWS, &buffers.draws),
            whole(slots::PIXELS, &pixels),
            whole(slots::PREVIOUS_INSTANCES, &buffers.previous_instances),
            (slots::IDS, wgpu::BindingResource::TextureView(&ids)),
        ];
        let of_film = film.resources();
        let passes = passes.iter().map(|pass| pass.bind(gpu, &of_film, &own)).collect::<Result<_, _>>()?;
        let draws = draws.bind(gpu, &of_film, &own)?;
        let film = film.pixels.clone();
        Ok(Self { size, ids, depth, pixels, passes, draws, film })
    }

    /// Whether they are for this film.
    pub fn is_for(&self, film: &FilmBuffers) -> bool {
        self.film == film.pixels
    }
}

/// A texture that is drawn to.
fn target(
    gpu: &Gpu,
    object: &'static str,
    [width, height]: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> Result<wgpu::TextureView, GpuError> {
    let limit = gpu.limits.max_texture_dimension_2d;
    if width > limit || height > limit {
        return Err(GpuError::TextureTooLarge { object, width, height, limit });
    }
    let descriptor = wgpu::TextureDescriptor {
        label: Some(object),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    };
    let bytes = u64::from(width) * u64::from(height) * 4;
    gpu.guarded(|| {
        gpu.device.create_texture(&descriptor).create_view(&wgpu::TextureViewDescriptor::default())
    })
    .map_err(|reason| GpuError::Allocation { object, bytes, reason })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::constant;
    use crate::shader::check;

    #[test]
    fn planes_are_those_of_the_shader() {
        let module = check::module("hybrid_resolve");
        for (name, plane) in [("PIXEL_HIT", HIT), ("PIXEL_MOTION", MOTION), ("PIXEL_PLANES", PLANES)] {
            assert_eq!(constant(&module, name) as usize, plane, "{name}");
        }
    }
}
