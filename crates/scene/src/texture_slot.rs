//! The places of a material that take a texture.

use crate::{ColorSpace, Material, TextureRef};
use serde::{Deserialize, Serialize};

/// A parameter of a material that a texture can drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs, reason = "each is a field of Material or Layers")]
pub enum TextureSlot {
    BaseColor,
    Normal,
    MetallicRoughness,
    Emission,
    Transmission,
    Clearcoat,
    ClearcoatRoughness,
    ClearcoatNormal,
    SheenColor,
    SheenRoughness,
    Iridescence,
    IridescenceThickness,
    Anisotropy,
    DiffuseTransmission,
    DiffuseTransmissionColor,
    Specular,
    SpecularColor,
}

impl TextureSlot {
    /// All of them.
    pub const ALL: [Self; 17] = [
        Self::BaseColor,
        Self::Normal,
        Self::MetallicRoughness,
        Self::Emission,
        Self::Transmission,
        Self::Clearcoat,
        Self::ClearcoatRoughness,
        Self::ClearcoatNormal,
        Self::SheenColor,
        Self::SheenRoughness,
        Self::Iridescence,
        Self::IridescenceThickness,
        Self::Anisotropy,
        Self::DiffuseTransmission,
        Self::DiffuseTransmissionColor,
        Self::Specular,
        Self::SpecularColor,
    ];

    /// What an eight-bit picture in it means, by glTF 2.0.
    pub fn color_space(self) -> ColorSpace {
        match self {
            Self::BaseColor
            | Self::Emission
            | Self::SheenColor
            | Self::SpecularColor
            | Self::DiffuseTransmissionColor => ColorSpace::Srgb,
            _ => ColorSpace::Linear,
        }
    }

    /// The channels that drive the parameter, by glTF 2.0.
    pub fn channels(self) -> &'static str {
        match self {
            Self::BaseColor => "RGB, alpha in A",
            Self::MetallicRoughness => "roughness in G, metallic in B",
            Self::Anisotropy => "direction in RG, strength in B",
            Self::Transmission | Self::Clearcoat | Self::Iridescence => "R",
            Self::ClearcoatRoughness | Self::IridescenceThickness => "G",
            Self::SheenRoughness | Self::DiffuseTransmission | Self::Specular => "A",
            _ => "RGB",
        }
    }
}

impl Material {
    /// The texture in a slot.
    pub fn texture(&self, slot: TextureSlot) -> Option<TextureRef> {
        match slot {
            TextureSlot::BaseColor => self.base_color_texture,
            TextureSlot::Normal => self.normal_texture,
            TextureSlot::MetallicRoughness => self.metallic_roughness_texture,
            TextureSlot::Emission => self.emission_texture,
            TextureSlot::Transmission => self.transmission_texture,
            TextureSlot::Clearcoat => self.layers.clearcoat.texture,
            TextureSlot::ClearcoatRoughness => self.layers.clearcoat.roughness_texture,
            TextureSlot::ClearcoatNormal => self.layers.clearcoat.normal_texture,
            TextureSlot::SheenColor => self.layers.sheen.color_texture,
            TextureSlot::SheenRoughness => self.layers.sheen.roughness_texture,
            TextureSlot::Iridescence => self.layers.iridescence.texture,
            TextureSlot::IridescenceThickness => self.layers.iridescence.thickness_texture,
            TextureSlot::Anisotropy => self.layers.anisotropy.texture,
            TextureSlot::DiffuseTransmission => self.layers.diffuse_transmission.texture,
            TextureSlot::DiffuseTransmissionColor => self.layers.diffuse_transmission.color_texture,
            TextureSlot::Specular => self.layers.specular_texture,
            TextureSlot::SpecularColor => self.layers.specular_color_texture,
        }
    }

    /// As [`Material::texture`], to change it.
    pub fn texture_mut(&mut self, slot: TextureSlot) -> &mut Option<TextureRef> {
        match slot {
            TextureSlot::BaseColor => &mut self.base_color_texture,
            TextureSlot::Normal => &mut self.normal_texture,
            TextureSlot::MetallicRoughness => &mut self.metallic_roughness_texture,
            TextureSlot::Emission => &mut self.emission_texture,
            TextureSlot::Transmission => &mut self.transmission_texture,
            TextureSlot::Clearcoat => &mut self.layers.clearcoat.texture,
            TextureSlot::ClearcoatRoughness => &mut self.layers.clearcoat.roughness_texture,
            TextureSlot::ClearcoatNormal => &mut self.layers.clearcoat.normal_texture,
            TextureSlot::SheenColor => &mut self.layers.sheen.color_texture,
            TextureSlot::SheenRoughness => &mut self.layers.sheen.roughness_texture,
            TextureSlot::Iridescence => &mut self.layers.iridescence.texture,
            TextureSlot::IridescenceThickness => &mut self.layers.iridescence.thickness_texture,
            TextureSlot::Anisotropy => &mut self.layers.anisotropy.texture,
            TextureSlot::DiffuseTransmission => &mut self.layers.diffuse_transmission.texture,
            TextureSlot::DiffuseTransmissionColor => &mut self.layers.diffuse_transmission.color_texture,
            TextureSlot::Specular => &mut self.layers.specular_texture,
            TextureSlot::SpecularColor => &mut self.layers.specular_color_texture,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texture_of_a_material_has_one_slot() {
        let mut material = Material::default();
        for (number, slot) in TextureSlot::ALL.into_iter().enumerate() {
            *material.texture_mut(slot) = Some(TextureRef::new(number as u32));
        }
        let there = TextureSlot::ALL.map(|slot| material.texture(slot).map(|t| t.texture));
        assert!(there.into_iter().eq((0..17).map(Some)), "{there:?}");
        let mut all: Vec<_> = material.textures_mut().iter().filter_map(|t| t.map(|t| t.texture)).collect();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..17));
    }
}
