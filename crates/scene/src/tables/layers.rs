//! Records of what lies on the base of layered materials.

use super::TextureSlot;
use crate::{Material, Scene};

/// Alpha of the specular colour's texture is glossiness.
pub const LAYERS_GLOSSINESS: u32 = 1;

/// Places in [`LayersRecord::slots`], in the order of the fields that they modulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LayerSlot {
    /// R.
    Coat = 0,
    /// G.
    CoatRoughness = 1,
    /// Tangent-space normal map.
    CoatNormal = 2,
    /// RGB.
    SheenColor = 3,
    /// A.
    SheenRoughness = 4,
    /// R.
    Iridescence = 5,
    /// G, between both thicknesses.
    FilmThickness = 6,
    /// R and G: direction. B: strength.
    Anisotropy = 7,
    /// A.
    DiffuseTransmission = 8,
    /// RGB.
    DiffuseTransmissionColor = 9,
    /// A.
    Specular = 10,
    /// RGB.
    SpecularColor = 11,
}

/// Number of [`LayerSlot`]s.
pub const LAYER_SLOTS: usize = 12;

/// The layers of one material; see [`crate::Layers`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayersRecord {
    /// Linear colour of the dielectric's reflection.
    pub specular_color: [f32; 3],
    /// Index of refraction that the dielectric's reflectance follows from: that of the material, or 0.
    pub reflectance_ior: f32,
    /// Share of the surface that the coat covers.
    pub coat: f32,
    /// Perceptual roughness of the coat.
    pub coat_roughness: f32,
    /// Scale of the coat's normal map.
    pub coat_normal_scale: f32,
    /// 20 / Abbe number.
    pub dispersion: f32,
    /// Linear colour of the fibres.
    pub sheen_color: [f32; 3],
    /// Perceptual roughness of the sheen.
    pub sheen_roughness: f32,
    /// Share of the surface that the film covers.
    pub iridescence: f32,
    /// Index of refraction of the film.
    pub film_ior: f32,
    /// Thickness of the film in nanometres, for texels of 0 and 1.
    pub film_thickness: [f32; 2],
    /// Strength of the anisotropy.
    pub anisotropy: f32,
    /// Cosine and sine of the angle between tangent and the longer axis.
    pub anisotropy_direction: [f32; 2],
    /// `LAYERS_…` bits.
    pub flags: u32,
    /// Share of the diffuse light that leaves on the other side.
    pub diffuse_transmission: f32,
    /// Its linear colour.
    pub diffuse_transmission_color: [f32; 3],
    /// Textures, by [`LayerSlot`]; index `texture_slots`.
    pub slots: [u32; LAYER_SLOTS],
}

impl LayersRecord {
    /// The record of a material's layers; its texture uses are appended to `slots`.
    pub(super) fn new(material: &Material, scene: &Scene, slots: &mut Vec<TextureSlot>) -> Self {
        let l = &material.layers;
        let (coat, sheen, film) = (&l.clearcoat, &l.sheen, &l.iridescence);
        let (grain, through) = (&l.anisotropy, &l.diffuse_transmission);
        let mut place = |texture| TextureSlot::place(texture, scene, slots);
        let (sin, cos) = grain.rotation.sin_cos();
        Self {
            specular_color: l.specular_color.to_array(),
            reflectance_ior: if l.specular_is_reflectance { 0.0 } else { material.ior.max(1.0) },
            coat: coat.strength,
            coat_roughness: coat.roughness,
            coat_normal_scale: coat.normal_scale,
            dispersion: l.dispersion,
            sheen_color: sheen.color.to_array(),
            sheen_roughness: sheen.roughness,
            iridescence: film.strength,
            film_ior: film.ior.max(1.0),
            film_thickness: film.thickness,
            anisotropy: grain.strength,
            anisotropy_direction: [cos, sin],
            flags: if l.glossiness { LAYERS_GLOSSINESS } else { 0 },
            diffuse_transmission: through.strength,
            diffuse_transmission_color: through.color.to_array(),
            slots: [
                place(&coat.texture),
                place(&coat.roughness_texture),
                place(&coat.normal_texture),
                place(&sheen.color_texture),
                place(&sheen.roughness_texture),
                place(&film.texture),
                place(&film.thickness_texture),
                place(&grain.texture),
                place(&through.texture),
                place(&through.color_texture),
                place(&l.specular_texture),
                place(&l.specular_color_texture),
            ],
        }
    }

    /// The texture of a slot, or [`super::NONE`].
    #[inline(always)]
    pub fn slot(&self, slot: LayerSlot) -> u32 {
        self.slots[slot as usize]
    }
}
