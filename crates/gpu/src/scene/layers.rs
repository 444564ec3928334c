//! The layers of materials as the shaders read them, word by word.

#![allow(missing_docs, reason = "the fields are explained at `LayersRecord`")]

use super::materials::texture_use;
use super::records::TextureUse;
use super::texels::images;
use bytemuck::{Pod, Zeroable};
use optics::albedo::SheenAlbedo;
use scene::tables::{LAYER_SLOTS, LAYERS_GLOSSINESS, LayerSlot, LayersRecord, SceneTables};

/// The layers of a material, in `words`; see [`scene::tables::LayersRecord`] for the fields.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Layers {
    pub specular_color: [f32; 3],
    pub reflectance_ior: f32,
    pub coat: f32,
    pub coat_roughness: f32,
    pub coat_normal_scale: f32,
    pub dispersion: f32,
    pub sheen_color: [f32; 3],
    pub sheen_roughness: f32,
    pub iridescence: f32,
    pub film_ior: f32,
    pub film_thickness: [f32; 2],
    pub anisotropy: f32,
    pub anisotropy_direction: [f32; 2],
    pub flags: u32,
    pub diffuse_transmission: f32,
    pub diffuse_transmission_color: [f32; 3],
    pub textures: [TextureUse; LAYER_SLOTS],
}

/// Names that shaders have for the places of the fields, and of slots, with their values in words.
pub fn layer_constants() -> impl Iterator<Item = (&'static str, u32)> {
    macro_rules! places {
        ($($name:literal: $field:ident),* $(,)?) => {
            [$(($name, (std::mem::offset_of!(Layers, $field) / 4) as u32)),*]
        };
    }
    let fields = places! {
        "LAYERS_SPECULAR_COLOR": specular_color,
        "LAYERS_REFLECTANCE_IOR": reflectance_ior,
        "LAYERS_COAT": coat,
        "LAYERS_COAT_ROUGHNESS": coat_roughness,
        "LAYERS_COAT_NORMAL_SCALE": coat_normal_scale,
        "LAYERS_DISPERSION": dispersion,
        "LAYERS_SHEEN_COLOR": sheen_color,
        "LAYERS_SHEEN_ROUGHNESS": sheen_roughness,
        "LAYERS_IRIDESCENCE": iridescence,
        "LAYERS_FILM_IOR": film_ior,
        "LAYERS_FILM_THICKNESS": film_thickness,
        "LAYERS_ANISOTROPY": anisotropy,
        "LAYERS_ANISOTROPY_DIRECTION": anisotropy_direction,
        "LAYERS_FLAGS": flags,
        "LAYERS_DIFFUSE_TRANSMISSION": diffuse_transmission,
        "LAYERS_DIFFUSE_TRANSMISSION_COLOR": diffuse_transmission_color,
        "LAYERS_TEXTURES": textures,
    };
    let others = [
        ("LAYERS_TEXTURE_WORDS", (size_of::<TextureUse>() / 4) as u32),
        ("LAYERS_GLOSSINESS", LAYERS_GLOSSINESS),
        ("LAYER_SLOT_COAT", LayerSlot::Coat as u32),
        ("LAYER_SLOT_COAT_ROUGHNESS", LayerSlot::CoatRoughness as u32),
        ("LAYER_SLOT_COAT_NORMAL", LayerSlot::CoatNormal as u32),
        ("LAYER_SLOT_SHEEN_COLOR", LayerSlot::SheenColor as u32),
        ("LAYER_SLOT_SHEEN_ROUGHNESS", LayerSlot::SheenRoughness as u32),
        ("LAYER_SLOT_IRIDESCENCE", LayerSlot::Iridescence as u32),
        ("LAYER_SLOT_FILM_THICKNESS", LayerSlot::FilmThickness as u32),
        ("LAYER_SLOT_ANISOTROPY", LayerSlot::Anisotropy as u32),
        ("LAYER_SLOT_DIFFUSE_TRANSMISSION", LayerSlot::DiffuseTransmission as u32),
        ("LAYER_SLOT_DIFFUSE_TRANSMISSION_COLOR", LayerSlot::DiffuseTransmissionColor as u32),
        ("LAYER_SLOT_SPECULAR", LayerSlot::Specular as u32),
        ("LAYER_SLOT_SPECULAR_COLOR", LayerSlot::SpecularColor as u32),
        ("SHEEN_ALBEDO_WIDTH", SheenAlbedo::SIZE[0] as u32),
        ("SHEEN_ALBEDO_HEIGHT", SheenAlbedo::SIZE[1] as u32),
    ];
    fields.into_iter().chain(others)
}

/// All layers.
pub(super) fn layers(tables: &SceneTables) -> Vec<Layers> {
    let images = images(tables);
    let record = |l: &LayersRecord| Layers {
        specular_color: l.specular_color,
        reflectance_ior: l.reflectance_ior,
        coat: l.coat,
        coat_roughness: l.coat_roughness,
        coat_normal_scale: l.coat_normal_scale,
        dispersion: l.dispersion,
        sheen_color: l.sheen_color,
        sheen_roughness: l.sheen_roughness,
        iridescence: l.iridescence,
        film_ior: l.film_ior,
        film_thickness: l.film_thickness,
        anisotropy: l.anisotropy,
        anisotropy_direction: l.anisotropy_direction,
        flags: l.flags,
        diffuse_transmission: l.diffuse_transmission,
        diffuse_transmission_color: l.diffuse_transmission_color,
        textures: l.slots.map(|slot| texture_use(tables, &images, slot)),
    };
    tables.layers.iter().map(record).collect()
}
