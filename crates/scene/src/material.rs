//! Materials as files describe them: a model, its parameters and the textures that modulate them.

use crate::image::TextureRef;
use glam::{Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Which scattering model a material uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// glTF 2.0 metallic-roughness (Appendix B), with `transmission` mixing in a dielectric.
    #[default]
    MetallicRoughness,
    /// Ideal diffuse reflection of `base_color`.
    Lambert,
    /// Clear or rough dielectric boundary of index `ior`, tinted by `base_color`; smooth where `roughness` is 0.
    Dielectric,
    /// Ideal specular reflection of `base_color`.
    Mirror,
    /// Not lit: shows `base_color` as if it were emitted (`KHR_materials_unlit`), reflects nothing.
    Unlit,
}

/// How the alpha channel of the base colour is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Surfaces exist where alpha ≥ the cutoff.
    Mask(f32),
    /// Alpha is coverage: light passes straight through with probability 1 − alpha.
    Blend,
}

/// A procedural checkerboard in the object's x–z plane that replaces the base colour, box-filtered over the ray's
/// footprint, and optionally fades to transparent with the distance from the object's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkerboard {
    /// Linear colours of the even and odd squares.
    pub colors: [Vec3; 2],
    /// Side of a square, in object units.
    pub size: f32,
    /// Distances from the object's origin between which coverage falls from 1 to 0; `None`: no fading.
    pub fade: Option<Vec2>,
}

/// A material: its model, factors, and textures multiplied into them.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name from the file, for messages and overrides.
    pub name: String,
    /// The scattering model.
    pub model: Model,
    /// Linear base colour and alpha, each in `[0, 1]`.
    pub base_color: Vec4,
    /// sRGB texture multiplied into `base_color` (alpha is linear).
    pub base_color_texture: Option<TextureRef>,
    /// Procedural pattern in place of a base colour texture.
    pub checkerboard: Option<Checkerboard>,
    /// Metalness in `[0, 1]`.
    pub metallic: f32,
    /// Perceptual roughness in `[0, 1]`; GGX width alpha is its square.
    pub roughness: f32,
    /// Linear texture: roughness in G, metalness in B.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Strength of the dielectric specular reflection, in `[0, 1]` (`KHR_materials_specular`).
    pub specular: f32,
    /// Index of refraction, ≥ 1; 1.5 unless a file says otherwise.
    pub ior: f32,
    /// Share of light that is refracted instead of diffusely reflected, in `[0, 1]`.
    pub transmission: f32,
    /// Linear texture: transmission in R.
    pub transmission_texture: Option<TextureRef>,
    /// An infinitely thin wall: transmitted light goes straight on instead of being refracted.
    pub thin_walled: bool,
    /// Emitted radiance, linear, W·sr⁻¹·m⁻². Triangles emit on their front side only unless `double_sided`
    /// and `emission_two_sided` are both set.
    pub emission: Vec3,
    /// sRGB texture multiplied into `emission`.
    pub emission_texture: Option<TextureRef>,
    /// Whether both sides emit.
    pub emission_two_sided: bool,
    /// Tangent-space normal map (linear).
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Use of the alpha channel.
    pub alpha_mode: AlphaMode,
    /// Whether the back side is shaded. A single-sided surface is invisible from behind to no ray (it blocks light);
    /// the flag only matters for loaders and raster passes that cull.
    pub double_sided: bool,
}

impl Default for Material {
    /// Neutral grey, half rough, non-metallic.
    fn default() -> Self {
        Self {
            name: "default".into(),
            model: Model::MetallicRoughness,
            base_color: Vec4::new(0.8, 0.8, 0.8, 1.0),
            base_color_texture: None,
            checkerboard: None,
            metallic: 0.0,
            roughness: 0.5,
            metallic_roughness_texture: None,
            specular: 1.0,
            ior: 1.5,
            transmission: 0.0,
            transmission_texture: None,
            thin_walled: false,
            emission: Vec3::ZERO,
            emission_texture: None,
            emission_two_sided: false,
            normal_texture: None,
            normal_scale: 1.0,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

impl Material {
    /// Whether the surface emits light anywhere.
    pub fn is_emissive(&self) -> bool {
        self.emission.max_element() > 0.0
    }
}
