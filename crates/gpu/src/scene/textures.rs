//! Texels, environment and albedo tables as textures.
//!
//! Shaders filter by themselves (see `shaders/texture.wgsl`), so every texture here is only a large array with its own
//! cache: no samplers, no mip levels.

use super::texels::{ImagePlace, TexelLayers, TexelPlaces};
use super::upload::{TextureShape, empty_texture, write_rows};
use crate::{Gpu, GpuError};
use optics::albedo::{DielectricAlbedo, GgxAlbedo};
use scene::tables::{EnvironmentTable, SceneTables};
use wgpu::TextureFormat;

/// One texture and its only view.
pub struct SceneTexture {
    /// The texture.
    pub texture: wgpu::Texture,
    /// All of it.
    pub view: wgpu::TextureView,
}

/// The textures of bind group 0.
pub struct SceneTextures {
    /// Binding 7: the layers of all texels, or a texture for each image.
    pub texels: Vec<SceneTexture>,
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
    pub(super) fn upload(gpu: &Gpu, tables: &SceneTables, places: &TexelPlaces) -> Result<Self, GpuError> {
        let environment = &tables.environment;
        let [width, height] = GgxAlbedo::SIZE.map(|n| n as u32);
        let ggx: &[u8] = bytemuck::cast_slice(GgxAlbedo::shared().texels());
        let [dielectric_width, plane, planes] = DielectricAlbedo::SIZE.map(|n| n as u32);
        let dielectric: &[u8] = bytemuck::cast_slice(DielectricAlbedo::shared().texels());
        Ok(Self {
            texels: match places {
                TexelPlaces::Layers(layers) => vec![texel_layers(gpu, &tables.texels, layers)?],
                TexelPlaces::Images(images) => {
                    images.iter().map(|i| image(gpu, &tables.texels, i)).collect::<Result<_, _>>()?
                }
            },
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

    /// The views of binding 7, `slots` of them if it is an array: the first image stands in where there is none.
    pub(super) fn texel_views(&self, slots: u32) -> Vec<&wgpu::TextureView> {
        let first = self.texels.iter().take(1).cycle();
        self.texels.iter().chain(first).map(|t| &t.view).take(slots.max(1) as usize).collect()
    }

    /// The views from binding 8 on.
    pub fn table_views(&self) -> [&wgpu::TextureView; 4] {
        self.tables().map(|t| &t.view)
    }

    fn tables(&self) -> [&SceneTexture; 4] {
        [&self.environment, &self.environment_alias, &self.ggx_albedo, &self.dielectric_albedo]
    }

    /// Bytes on the device.
    pub(super) fn memory_bytes(&self) -> u64 {
        let bytes = |t: &SceneTexture| {
            let (size, format) = (t.texture.size(), t.texture.format());
            let texels =
                u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers);
            texels * u64::from(format.block_copy_size(None).unwrap_or(16))
        };
        self.texels.iter().chain(self.tables()).map(bytes).sum()
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

/// An image as a texture of its own.
fn image(gpu: &Gpu, texels: &[[u8; 4]], place: &ImagePlace) -> Result<SceneTexture, GpuError> {
    let first = place.first_texel as usize;
    let texels = &texels[first..first + place.places()];
    let size = [place.width, place.height];
    let format = if place.half { TextureFormat::Rgba16Float } else { TextureFormat::Rgba8Unorm };
    picture(gpu, "a texture", size, format, bytemuck::cast_slice(texels))
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
