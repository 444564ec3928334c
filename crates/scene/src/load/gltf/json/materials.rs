//! Materials with their extensions, and textures.

use super::list::Uri;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

/// Extensions that are not read, by name.
pub type Others = BTreeMap<String, IgnoredAny>;

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Material {
    pub name: Option<String>,
    pub pbr_metallic_roughness: Option<MetallicRoughness>,
    pub normal_texture: Option<TextureInfo>,
    pub emissive_texture: Option<TextureInfo>,
    pub emissive_factor: Option<[f32; 3]>,
    pub alpha_mode: Option<String>,
    pub alpha_cutoff: Option<f32>,
    #[serde(default)]
    pub double_sided: bool,
    #[serde(default)]
    pub extensions: MaterialExtensions,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct MetallicRoughness {
    pub base_color_factor: Option<[f32; 4]>,
    pub base_color_texture: Option<TextureInfo>,
    pub metallic_factor: Option<f32>,
    pub roughness_factor: Option<f32>,
    pub metallic_roughness_texture: Option<TextureInfo>,
}

impl MetallicRoughness {
    /// Whether it says nothing: some writers leave an empty object beside another description of the material.
    pub fn is_empty(&self) -> bool {
        self.base_color_factor.is_none()
            && self.base_color_texture.is_none()
            && self.metallic_factor.is_none()
            && self.roughness_factor.is_none()
            && self.metallic_roughness_texture.is_none()
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct TextureInfo {
    pub index: u32,
    #[serde(default)]
    pub tex_coord: u32,
    /// Only normal textures have it.
    pub scale: Option<f32>,
    #[serde(default)]
    pub extensions: TextureInfoExtensions,
}

#[derive(Default, Deserialize)]
pub struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct TextureTransform {
    pub offset: Option<[f32; 2]>,
    pub rotation: Option<f32>,
    pub scale: Option<[f32; 2]>,
    pub tex_coord: Option<u32>,
}

#[derive(Default, Deserialize)]
pub struct MaterialExtensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_ior")]
    pub ior: Option<Ior>,
    #[serde(rename = "KHR_materials_transmission")]
    pub transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_volume")]
    pub volume: Option<Volume>,
    #[serde(rename = "KHR_materials_unlit")]
    pub unlit: Option<IgnoredAny>,
    #[serde(rename = "KHR_materials_specular")]
    pub specular: Option<Specular>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub specular_glossiness: Option<SpecularGlossiness>,
    #[serde(rename = "KHR_materials_clearcoat")]
    pub clearcoat: Option<Clearcoat>,
    #[serde(rename = "KHR_materials_sheen")]
    pub sheen: Option<Sheen>,
    #[serde(rename = "KHR_materials_iridescence")]
    pub iridescence: Option<Iridescence>,
    #[serde(rename = "KHR_materials_anisotropy")]
    pub anisotropy: Option<Anisotropy>,
    #[serde(rename = "KHR_materials_dispersion")]
    pub dispersion: Option<Dispersion>,
    #[serde(rename = "KHR_materials_diffuse_transmission")]
    pub diffuse_transmission: Option<DiffuseTransmission>,
    #[serde(flatten)]
    pub others: Others,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct EmissiveStrength {
    pub emissive_strength: Option<f32>,
}

#[derive(Deserialize)]
pub struct Ior {
    pub ior: Option<f32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Transmission {
    pub transmission_factor: Option<f32>,
    pub transmission_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Volume {
    pub thickness_factor: Option<f32>,
    pub attenuation_distance: Option<f32>,
    pub attenuation_color: Option<[f32; 3]>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Specular {
    pub specular_factor: Option<f32>,
    pub specular_texture: Option<TextureInfo>,
    pub specular_color_factor: Option<[f32; 3]>,
    pub specular_color_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Clearcoat {
    pub clearcoat_factor: Option<f32>,
    pub clearcoat_texture: Option<TextureInfo>,
    pub clearcoat_roughness_factor: Option<f32>,
    pub clearcoat_roughness_texture: Option<TextureInfo>,
    pub clearcoat_normal_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Sheen {
    pub sheen_color_factor: Option<[f32; 3]>,
    pub sheen_color_texture: Option<TextureInfo>,
    pub sheen_roughness_factor: Option<f32>,
    pub sheen_roughness_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Iridescence {
    pub iridescence_factor: Option<f32>,
    pub iridescence_texture: Option<TextureInfo>,
    pub iridescence_ior: Option<f32>,
    pub iridescence_thickness_minimum: Option<f32>,
    pub iridescence_thickness_maximum: Option<f32>,
    pub iridescence_thickness_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Anisotropy {
    pub anisotropy_strength: Option<f32>,
    pub anisotropy_rotation: Option<f32>,
    pub anisotropy_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
pub struct Dispersion {
    pub dispersion: Option<f32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct DiffuseTransmission {
    pub diffuse_transmission_factor: Option<f32>,
    pub diffuse_transmission_texture: Option<TextureInfo>,
    pub diffuse_transmission_color_factor: Option<[f32; 3]>,
    pub diffuse_transmission_color_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SpecularGlossiness {
    pub diffuse_factor: Option<[f32; 4]>,
    pub diffuse_texture: Option<TextureInfo>,
    pub specular_factor: Option<[f32; 3]>,
    pub glossiness_factor: Option<f32>,
    pub specular_glossiness_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
pub struct Texture {
    pub sampler: Option<u32>,
    pub source: Option<u32>,
    #[serde(default)]
    pub extensions: TextureExtensions,
}

#[derive(Default, Deserialize)]
pub struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    pub webp: Option<TextureSource>,
    #[serde(rename = "MSFT_texture_dds")]
    pub dds: Option<TextureSource>,
    #[serde(rename = "KHR_texture_basisu")]
    pub basisu: Option<TextureSource>,
    #[serde(flatten)]
    pub others: Others,
}

#[derive(Deserialize)]
pub struct TextureSource {
    pub source: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Image<'a> {
    pub name: Option<String>,
    #[serde(borrow)]
    pub uri: Option<Uri<'a>>,
    pub buffer_view: Option<u32>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Sampler {
    pub mag_filter: Option<u32>,
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
}
