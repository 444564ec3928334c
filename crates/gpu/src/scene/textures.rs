//! Texels, environment and albedo tables as textures.
//!
//! Shaders filter by themselves (see `shaders/texture.wgsl`), so every texture here is only a large array with its own
//! cache: no samplers, no mip levels, no binding arrays.

use super::upload::{TextureShape, empty_texture, write_rows};
use crate::{Gpu, GpuError};
use optics::albedo::{DielectricAlbedo, GgxAlbedo};
use scene::tables::{EnvironmentTable, SceneTables};
use wgpu::TextureFormat;

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

    fn width(&self) -> u32 {
        1 << self.width_log2
    }
}

/// One texture and its only view.
pub struct SceneTexture {
    /// The texture.
    pub texture: wgpu::Texture,
    /// All of it.
    pub view: wgpu::TextureView,
}

/// The textures of bind group 0.
pub struct SceneTextures {
    /// Binding 7.
    pub texels: SceneTexture,
    /// Binding 8.
    pub environment: SceneTexture,
    /// Binding 9.
    pub environment_alias: SceneTexture,
    /// Binding 10.
    pub ggx_albedo: SceneTexture,
    /// Binding 11.
    pub dielectric_albedo: SceneTexture,
}

impl SceneTextures {
    /// Copies all pictures of the tables to the device.
    pub(super) fn upload(gpu: &Gpu, tables: &SceneTables, layers: &TexelLayers) -> Result<Self, GpuError> {
        let environment = &tables.environment;
        let [width, height] = GgxAlbedo::SIZE.map(|n| n as u32);
        let ggx: &[u8] = bytemuck::cast_slice(GgxAlbedo::shared().texels());
        let [dielectric_width, plane, planes] = DielectricAlbedo::SIZE.map(|n| n as u32);
        let dielectric: &[u8] = bytemuck::cast_slice(DielectricAlbedo::shared().texels());
        Ok(Self {
            texels: texel_layers(gpu, &tables.texels, layers)?,
            environment: picture(
                gpu,
                "the environment image",
                [environment.width, environment.height],
                TextureFormat::Rgba32Float,
                bytemuck::cast_slice(&environment_pixels(environment)),
            )?,
            environment_alias: picture(
                gpu,
                "the environment's sampling table",
                [environment.width, environment.height],
                TextureFormat::Rg32Uint,
                bytemuck::cast_slice(&environment_aliases(environment)),
            )?,
            ggx_albedo: picture(gpu, "the albedo table", [width, height], TextureFormat::Rg32Float, ggx)?,
            dielectric_albedo: picture(
                gpu,
                "the dielectric albedo table",
                [dielectric_width, plane * planes],
                TextureFormat::R32Float,
                dielectric,
            )?,
        })
    }

    /// All views, from binding 7 on.
    pub fn views(&self) -> [&wgpu::TextureView; 5] {
        self.all().map(|t| &t.view)
    }

    fn all(&self) -> [&SceneTexture; 5] {
        [&self.texels, &self.environment, &self.environment_alias, &self.ggx_albedo, &self.dielectric_albedo]
    }

    /// Bytes on the device.
    pub(super) fn memory_bytes(&self) -> u64 {
        let bytes = |t: &SceneTexture| {
            let (size, format) = (t.texture.size(), t.texture.format());
            let texels =
                u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers);
            texels * u64::from(format.block_copy_size(None).unwrap_or(16))
        };
        self.all().map(bytes).iter().sum()
    }
}

fn texel_layers(gpu: &Gpu, texels: &[[u8; 4]], layers: &TexelLayers) -> Result<SceneTexture, GpuError> {
    let shape = TextureShape {
        object: "the textures",
        width: layers.width(),
        height: layers.height,
        layers: layers.layers,
        format: TextureFormat::Rgba8Unorm,
        array: true,
    };
    let (texture, view) = empty_texture(gpu, shape)?;
    let width = layers.width() as usize;
    for (layer, part) in (0..).zip(texels.chunks(width * layers.height as usize)) {
        let full = part.len() / width * width;
        write_rows(gpu, shape, &texture, layer, 0, layers.width(), bytemuck::cast_slice(&part[..full]))?;
        let rest = &part[full..];
        let row = (full / width) as u32;
        write_rows(gpu, shape, &texture, layer, row, rest.len() as u32, bytemuck::cast_slice(rest))?;
    }
    Ok(SceneTexture { texture, view })
}

/// A texture of `size` texels; one texel of zeros if that is nothing.
fn picture(
    gpu: &Gpu,
    object: &'static str,
    [width, height]: [u32; 2],
    format: TextureFormat,
    bytes: &[u8],
) -> Result<SceneTexture, GpuError> {
    let (width, height) = (width.max(1), height.max(1));
    let shape = TextureShape { object, width, height, layers: 1, format, array: false };
    let (texture, view) = empty_texture(gpu, shape)?;
    write_rows(gpu, shape, &texture, 0, 0, width, bytes)?;
    Ok(SceneTexture { texture, view })
}

fn environment_pixels(table: &EnvironmentTable) -> Vec<[f32; 4]> {
    table.texels.iter().zip(&table.alias).map(|([r, g, b], e)| [*r, *g, *b, e.probability]).collect()
}

fn environment_aliases(table: &EnvironmentTable) -> Vec<[u32; 2]> {
    table.alias.iter().map(|e| [e.threshold.to_bits(), e.alias]).collect()
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
}
