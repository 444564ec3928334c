//! Where on the device the texels of images are.

use crate::{Gpu, STORAGE_BUFFERS};
use scene::tables::{SceneTables, TextureUse};
use wgpu::Features;

/// What shaders need to choose a texture of a binding array by a number that differs between neighbours.
pub const BINDING_ARRAYS: Features = Features::TEXTURE_BINDING_ARRAY
    .union(Features::SAMPLED_TEXTURE_AND_STORAGE_BUFFER_ARRAY_NON_UNIFORM_INDEXING);

/// How shaders find the texels of images.
#[derive(Clone, Debug)]
pub(super) enum TexelPlaces {
    /// All one after the other, folded into the layers of one array texture: any device can do that.
    Layers(TexelLayers),
    /// Each image is a texture of its own, in a binding array: neighbours of a texel are near it in memory, too.
    Images(Vec<ImagePlace>),
}

impl TexelPlaces {
    /// The best way that the device has.
    pub fn new(gpu: &Gpu, tables: &SceneTables) -> Self {
        let side = gpu.limits.max_texture_dimension_2d;
        let images = images(tables);
        let fits = |i: &ImagePlace| (1..=side).contains(&i.width) && (1..=side).contains(&i.height);
        // Other bindings of the shader count, too.
        let room = gpu.limits.max_binding_array_elements_per_shader_stage.saturating_sub(8);
        // Beside a binding array, `scene` is a storage buffer, too.
        let buffers = gpu.limits.max_storage_buffers_per_shader_stage > STORAGE_BUFFERS;
        let possible = buffers && gpu.features.contains(BINDING_ARRAYS) && images.iter().all(fits);
        if images.is_empty() || !possible || slots(images.len()) > room {
            return Self::Layers(TexelLayers::new(tables.texels.len(), side));
        }
        Self::Images(images)
    }

    /// Elements of the binding array; 0 if there is none. Powers of two, so that scenes share shaders.
    pub fn slots(&self) -> u32 {
        match self {
            Self::Layers(_) => 0,
            Self::Images(images) => slots(images.len()),
        }
    }

    /// How a line of texels is folded, if it is.
    pub fn folding(&self) -> Option<&TexelLayers> {
        match self {
            Self::Layers(layers) => Some(layers),
            Self::Images(_) => None,
        }
    }
}

fn slots(images: usize) -> u32 {
    u32::try_from(images).unwrap_or(1 << 31).next_power_of_two().max(16)
}

/// An image among all texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ImagePlace {
    pub first_texel: u32,
    pub width: u32,
    pub height: u32,
    /// Whether its texels are half floats, two places each.
    pub half: bool,
}

impl ImagePlace {
    /// Of a texture's image.
    pub fn of(texture: &TextureUse) -> Self {
        let TextureUse { first_texel, width, height, .. } = *texture;
        Self { first_texel, width, height, half: texture.is_half() }
    }

    /// Places of four bytes that it takes.
    pub fn places(&self) -> usize {
        let texels = self.width as usize * self.height as usize;
        if self.half { 2 * texels } else { texels }
    }
}

/// The images of all textures that materials use, each once and sorted. Others have no texels.
pub(super) fn images(tables: &SceneTables) -> Vec<ImagePlace> {
    let of_materials = tables.materials.iter().flat_map(|m| &m.textures);
    let of_layers = tables.layer_textures.iter().flatten();
    let all = of_materials.chain(of_layers).chain(&tables.graph_textures);
    let used = all.filter(|texture| texture.is_some() && !texture.is_graph());
    let mut images: Vec<_> = used.map(ImagePlace::of).collect();
    images.sort_unstable();
    images.dedup();
    images
}

/// How a line of texels is folded into the layers of an array texture.
#[derive(Clone, Copy, Debug)]
pub(super) struct TexelLayers {
    pub width_log2: u32,
    pub height: u32,
    pub layers: u32,
}

impl TexelLayers {
    /// For `count` texels in textures of at most `max_side` texels a side.
    pub fn new(count: usize, max_side: u32) -> Self {
        let width_log2 = max_side.clamp(1, 4096).ilog2();
        let lines = (count as u64).div_ceil(1 << width_log2).max(1);
        let layers = lines.div_ceil(u64::from(max_side.max(1)));
        let height = lines.div_ceil(layers);
        Self { width_log2, height: height as u32, layers: layers.min(u64::from(u32::MAX)) as u32 }
    }

    pub fn width(&self) -> u32 {
        1 << self.width_log2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texel_has_a_place() {
        for (count, side) in
            [(0, 2048), (1, 2048), (4096, 8192), (4097, 8192), (5_000_000, 1000), (1 << 27, 16384)]
        {
            let l = TexelLayers::new(count, side);
            assert!(l.width() <= side && l.height <= side && l.height > 0, "{count} {side}: {l:?}");
            let room = u64::from(l.width()) * u64::from(l.height) * u64::from(l.layers);
            assert!(room >= count as u64, "{count} {side}: {l:?}");
            // Folding wastes less than a line and a layer's rounding.
            let waste = u64::from(l.width()) * (1 + u64::from(l.layers));
            assert!(room <= count as u64 + waste, "{count} {side}: {l:?}");
        }
    }

    #[test]
    fn scenes_with_almost_as_many_images_share_shaders() {
        assert_eq!([1, 16, 17, 100].map(slots), [16, 16, 32, 128]);
    }
}
