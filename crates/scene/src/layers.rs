//! What lies on the base of a material, and beside its base colour in it.

use crate::image::TextureRef;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A clear coat of lacquer (`KHR_materials_clearcoat`), index of refraction 1.5.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Clearcoat {
    /// Share of the surface that it covers, in `[0, 1]`.
    pub strength: f32,
    /// Linear texture: strength in R.
    pub texture: Option<TextureRef>,
    /// Perceptual roughness in `[0, 1]`.
    pub roughness: f32,
    /// Linear texture: roughness in G.
    pub roughness_texture: Option<TextureRef>,
    /// Tangent-space normal map of the coat; without one it lies smooth over the base's normal map.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
}

/// Fibres of a cloth (`KHR_materials_sheen`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sheen {
    /// Linear colour in `[0, 1]`; black is none.
    pub color: Vec3,
    /// sRGB texture multiplied into `color`.
    pub color_texture: Option<TextureRef>,
    /// Perceptual roughness in `[0, 1]`; less than 0.1 counts as that.
    pub roughness: f32,
    /// Linear texture: roughness in A.
    pub roughness_texture: Option<TextureRef>,
}

/// A thin film whose colour depends on the angle (`KHR_materials_iridescence`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Iridescence {
    /// Share of the surface that it covers, in `[0, 1]`.
    pub strength: f32,
    /// Linear texture: strength in R.
    pub texture: Option<TextureRef>,
    /// Index of refraction of the film, in `[1, 10]`.
    pub ior: f32,
    /// Thickness in nanometres where the texture is 0 and where it is 1; without a texture it is
    /// the second. Renderers take what is beyond [`Iridescence::MOST_THICKNESS`] as that.
    pub thickness: [f32; 2],
    /// Linear texture: thickness in G.
    pub thickness_texture: Option<TextureRef>,
}

impl Iridescence {
    /// A millimetre, in nanometres: colours have been grey for long.
    pub const MOST_THICKNESS: f32 = 1e6;
    /// Beyond any transparent substance.
    pub const MOST_IOR: f32 = 10.0;
}

impl Default for Iridescence {
    fn default() -> Self {
        Self { strength: 0.0, texture: None, ior: 1.3, thickness: [100.0, 400.0], thickness_texture: None }
    }
}

/// Highlights that are longer in one direction (`KHR_materials_anisotropy`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anisotropy {
    /// In `[0, 1]`; 0 is none.
    pub strength: f32,
    /// Direction of the longer axis, in radians counter-clockwise from the tangent.
    pub rotation: f32,
    /// Linear texture: direction in R and G, strength in B.
    pub texture: Option<TextureRef>,
}

/// Diffuse light that leaves on the other side (`KHR_materials_diffuse_transmission`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiffuseTransmission {
    /// Share of the diffuse light, in `[0, 1]`.
    pub strength: f32,
    /// Linear texture: strength in A.
    pub texture: Option<TextureRef>,
    /// Linear colour in `[0, 1]`.
    pub color: Vec3,
    /// sRGB texture multiplied into `color`.
    pub color_texture: Option<TextureRef>,
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self { strength: 0.0, texture: None, color: Vec3::ONE, color_texture: None }
    }
}

/// What metallic-roughness and dielectric materials may have besides their base. Names and meanings
/// are those of the glTF extensions; how the parts work together is told in `optics`, in `layered`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layers {
    /// A coat of lacquer over everything else.
    pub clearcoat: Clearcoat,
    /// Fibres on the base.
    pub sheen: Sheen,
    /// A film on the base.
    pub iridescence: Iridescence,
    /// Stretched highlights of the base.
    pub anisotropy: Anisotropy,
    /// Light that shines through paper and leaves.
    pub diffuse_transmission: DiffuseTransmission,
    /// Linear texture multiplied into [`Material::specular`](crate::Material::specular): A.
    pub specular_texture: Option<TextureRef>,
    /// Linear colour of the dielectric's reflection at normal incidence, ≥ 0.
    pub specular_color: Vec3,
    /// sRGB texture multiplied into `specular_color`.
    pub specular_color_texture: Option<TextureRef>,
    /// Whether alpha of `specular_color_texture` is glossiness: it is multiplied into 1 − roughness
    /// (`KHR_materials_pbrSpecularGlossiness`).
    pub glossiness: bool,
    /// Whether the dielectric reflects `specular_color` itself, whatever the index of refraction:
    /// an `ior` of 0 in glTF.
    pub specular_is_reflectance: bool,
    /// Roughness of the diffuse reflection in `[0, 1]`: 0 is Lambert's surface, 1 the roughest of
    /// Oren and Nayar's.
    pub diffuse_roughness: f32,
    /// 20 / Abbe number: how far the indices of refraction of blue and red are apart; 0 is not at
    /// all.
    pub dispersion: f32,
}

impl Default for Layers {
    fn default() -> Self {
        Self {
            clearcoat: Clearcoat::default(),
            sheen: Sheen::default(),
            iridescence: Iridescence::default(),
            anisotropy: Anisotropy::default(),
            diffuse_transmission: DiffuseTransmission::default(),
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            glossiness: false,
            specular_is_reflectance: false,
            diffuse_roughness: 0.0,
            dispersion: 0.0,
        }
    }
}

impl Layers {
    /// Whether they change anything, so that the material needs the layered model.
    pub fn are_present(&self) -> bool {
        self.clearcoat.strength > 0.0
            || self.sheen.color.max_element() > 0.0
            || self.iridescence.strength > 0.0
            || self.anisotropy.strength > 0.0
            || self.diffuse_transmission.strength > 0.0
            || self.diffuse_roughness > 0.0
            || self.dispersion > 0.0
            || self.specular_texture.is_some()
            || self.specular_color_texture.is_some()
            || self.specular_color != Vec3::ONE
            || self.specular_is_reflectance
    }

    /// Whether a frame along the texture coordinates is needed.
    pub fn need_tangents(&self) -> bool {
        let coat = self.clearcoat.strength > 0.0 && self.clearcoat.normal_texture.is_some();
        self.anisotropy.strength > 0.0 || coat
    }
}

/// A number of [`Layers`] that users set by its name.
#[derive(Clone, Copy, Debug)]
pub struct LayerNumber {
    /// As scene files write it; Python writes `_` for `-`.
    pub name: &'static str,
    /// The least and the greatest value.
    pub range: [f32; 2],
    /// Where it is.
    pub of: fn(&mut Layers) -> &mut f32,
}

/// All of them. Scene files and Python know them from here.
pub const LAYER_NUMBERS: &[LayerNumber] = &[
    share("clearcoat", |l| &mut l.clearcoat.strength),
    share("clearcoat-roughness", |l| &mut l.clearcoat.roughness),
    share("sheen-roughness", |l| &mut l.sheen.roughness),
    share("iridescence", |l| &mut l.iridescence.strength),
    LayerNumber {
        name: "iridescence-ior",
        range: [1.0, Iridescence::MOST_IOR],
        of: |l| &mut l.iridescence.ior,
    },
    share("anisotropy", |l| &mut l.anisotropy.strength),
    share("diffuse-transmission", |l| &mut l.diffuse_transmission.strength),
    share("diffuse-roughness", |l| &mut l.diffuse_roughness),
    LayerNumber { name: "dispersion", range: [0.0, 20.0], of: |l| &mut l.dispersion },
];

/// A number in `[0, 1]`.
const fn share(name: &'static str, of: fn(&mut Layers) -> &mut f32) -> LayerNumber {
    LayerNumber { name, range: [0.0, 1.0], of }
}
