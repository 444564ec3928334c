//! Records of materials and textures.

use super::NONE;
use crate::{AlphaMode, ColorSpace, Filter, Material, Model, Sampler, Scene, TextureRef, Wrap};

/// Alpha below the cutoff is a hole.
pub const MATERIAL_ALPHA_MASK: u32 = 1;
/// Alpha is coverage.
pub const MATERIAL_ALPHA_BLEND: u32 = 2;
/// Both sides emit.
pub const MATERIAL_EMISSION_TWO_SIDED: u32 = 4;
/// A dielectric without thickness.
pub const MATERIAL_THIN: u32 = 8;
/// A checkerboard replaces the base colour.
pub const MATERIAL_CHECKERBOARD: u32 = 16;
/// The checkerboard's coverage falls with distance.
pub const MATERIAL_CHECKERBOARD_FADES: u32 = 32;

/// Shading needs a frame along the texture coordinates. (64 is the GPU's own.)
pub const MATERIAL_TANGENTS: u32 = 128;
/// Light passes through the surface into a body.
pub const MATERIAL_BODY: u32 = 256;

/// [`Model`] as a number that shaders know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum ModelTag {
    /// See [`Model::MetallicRoughness`].
    MetallicRoughness = 0,
    /// See [`Model::Lambert`].
    Lambert = 1,
    /// See [`Model::Dielectric`].
    Dielectric = 2,
    /// See [`Model::Mirror`].
    Mirror = 3,
    /// See [`Model::Unlit`].
    Unlit = 4,
    /// [`Model::MetallicRoughness`] or [`Model::Dielectric`] with [`crate::Layers`] that do something.
    Layered = 5,
    /// See [`Model::Boundary`].
    Boundary = 6,
}

/// One material. Texture fields index `texture_slots` or are [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialRecord {
    /// The scattering model.
    pub model: ModelTag,
    /// `MATERIAL_…` bits.
    pub flags: u32,
    /// Linear base colour and alpha.
    pub base_color: [f32; 4],
    /// Emitted radiance; for unlit materials filled in from the base colour when shading.
    pub emission: [f32; 3],
    /// Metalness.
    pub metallic: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Strength of the dielectric reflection.
    pub specular: f32,
    /// Index of refraction.
    pub ior: f32,
    /// Share of refracted light.
    pub transmission: f32,
    /// Scale of the normal map.
    pub normal_scale: f32,
    /// Alpha below this is a hole.
    pub alpha_cutoff: f32,
    /// Base colour texture.
    pub base_color_slot: u32,
    /// Metallic-roughness texture.
    pub metallic_roughness_slot: u32,
    /// Transmission texture.
    pub transmission_slot: u32,
    /// Emission texture.
    pub emission_slot: u32,
    /// Normal map.
    pub normal_slot: u32,
    /// Colours of the checkerboard.
    pub checkerboard_colors: [[f32; 3]; 2],
    /// 1 / side of a square.
    pub checkerboard_scale: f32,
    /// Distances between which coverage falls from 1 to 0.
    pub checkerboard_fade: [f32; 2],
    /// Index into `layers` if the model is [`ModelTag::Layered`], else [`NONE`].
    pub layers: u32,
    /// Absorption coefficient of what is inside, m⁻¹; zero where nothing is, or where light does not get inside.
    pub absorption: [f32; 3],
    /// Index into `media` of what is inside, or [`NONE`].
    pub medium: u32,
    /// Which body is there where bodies overlap; see [`Material::priority`].
    pub priority: i32,
}

/// The use of a texture by a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureSlot {
    /// Index into `textures`.
    pub texture: u32,
    /// Which texture coordinates: 0 or 1.
    pub uv_set: u32,
    /// `uv' = (m₀₀ u + m₀₁ v + o₀, m₁₀ u + m₁₁ v + o₁)`, as `[m₀₀, m₀₁, o₀, m₁₀, m₁₁, o₁]`.
    pub transform: [f32; 6],
}

/// An image in `texels` and how it is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRecord {
    /// Index of the first texel.
    pub first_texel: u32,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Wrapping and filtering.
    pub sampler: Sampler,
    /// Whether RGB is sRGB-encoded.
    pub srgb: bool,
}

impl MaterialRecord {
    /// The record of `material`; its texture uses are appended to `slots`.
    pub(super) fn new(material: &Material, scene: &Scene, slots: &mut Vec<TextureSlot>) -> Self {
        let mut slot = |texture: &Option<TextureRef>| TextureSlot::place(texture, scene, slots);
        let has_layers = Self::has_layers(material);
        let layered_glass = has_layers && material.model == Model::Dielectric;
        let checker = material.checkerboard;
        let fade = checker.and_then(|c| c.fade);
        let mut flags = 0;
        let mut set = |bit: u32, on: bool| flags |= if on { bit } else { 0 };
        // To all but paths through media, a boundary is one big hole.
        let subsurface = material.subsurface.filter(|_| material.model == Model::Dielectric);
        // Where nothing is bent there is no surface either.
        let matched = subsurface.is_some() && !has_layers && material.ior <= 1.0001;
        let boundary = material.model == Model::Boundary || matched;
        set(MATERIAL_ALPHA_MASK, boundary || matches!(material.alpha_mode, AlphaMode::Mask(_)));
        set(MATERIAL_ALPHA_BLEND, !boundary && material.alpha_mode == AlphaMode::Blend);
        set(MATERIAL_BODY, material.refracts_into_body());
        set(MATERIAL_EMISSION_TWO_SIDED, material.emission_two_sided);
        set(MATERIAL_THIN, material.thin_walled);
        set(MATERIAL_TANGENTS, has_layers && material.layers.need_tangents());
        set(MATERIAL_CHECKERBOARD, checker.is_some());
        set(MATERIAL_CHECKERBOARD_FADES, fade.is_some());
        Self {
            model: match material.model {
                _ if boundary => ModelTag::Boundary,
                Model::MetallicRoughness | Model::Dielectric if has_layers => ModelTag::Layered,
                Model::MetallicRoughness => ModelTag::MetallicRoughness,
                Model::Lambert => ModelTag::Lambert,
                Model::Dielectric => ModelTag::Dielectric,
                Model::Mirror => ModelTag::Mirror,
                Model::Unlit => ModelTag::Unlit,
                Model::Boundary => ModelTag::Boundary,
            },
            flags,
            base_color: match subsurface {
                _ if boundary => [0.0; 4],
                // The inside has the colour.
                Some(_) => [1.0, 1.0, 1.0, material.base_color.w],
                None => material.base_color.to_array(),
            },
            emission: if boundary { [0.0; 3] } else { material.emission.to_array() },
            metallic: if layered_glass { 0.0 } else { material.metallic },
            roughness: material.roughness,
            specular: material.specular,
            ior: if boundary { 1.0 } else { material.ior.max(1.0) },
            transmission: if layered_glass { 1.0 } else { material.transmission },
            normal_scale: material.normal_scale,
            alpha_cutoff: match material.alpha_mode {
                _ if boundary => 1.0,
                AlphaMode::Mask(cutoff) => cutoff,
                AlphaMode::Opaque | AlphaMode::Blend => 0.0,
            },
            base_color_slot: slot(&material.base_color_texture),
            metallic_roughness_slot: slot(&material.metallic_roughness_texture),
            transmission_slot: slot(&material.transmission_texture),
            emission_slot: slot(&material.emission_texture),
            normal_slot: slot(&material.normal_texture),
            checkerboard_colors: checker.map_or([[0.0; 3]; 2], |c| c.colors.map(|c| c.to_array())),
            checkerboard_scale: checker.map_or(1.0, |c| 1.0 / c.size.max(1e-6)),
            checkerboard_fade: fade.map_or([0.0; 2], |f| f.to_array()),
            layers: NONE,
            absorption: if material.refracts_into_body() {
                material.interior.absorption().to_array()
            } else {
                [0.0; 3]
            },
            medium: NONE,
            priority: material.priority.unwrap_or(0),
        }
    }

    /// Whether `material` needs the layered model.
    pub(super) fn has_layers(material: &Material) -> bool {
        let may_have = match material.model {
            Model::MetallicRoughness | Model::Dielectric => true,
            Model::Lambert | Model::Mirror | Model::Unlit | Model::Boundary => false,
        };
        may_have && material.layers.are_present()
    }

    /// Whether light that passes through what is behind the surface becomes less.
    pub fn absorbs(&self) -> bool {
        self.absorption != [0.0; 3]
    }

    /// Whether rays may pass through the surface by its alpha.
    pub fn has_alpha(&self) -> bool {
        self.flags & (MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND | MATERIAL_CHECKERBOARD_FADES) != 0
    }

    /// Whether any texture modulates it.
    pub fn is_textured(&self) -> bool {
        let slots = [
            self.base_color_slot,
            self.metallic_roughness_slot,
            self.transmission_slot,
            self.emission_slot,
            self.normal_slot,
        ];
        // Layers are not asked: their surfaces have everything.
        self.layers != NONE || slots.iter().any(|&slot| slot != NONE)
    }

    /// Whether the surface emits. An unlit one does not: it has the colour that is seen.
    pub fn is_emissive(&self) -> bool {
        self.emission.iter().any(|&e| e > 0.0)
    }

    /// Whether a path may find light on it: it emits, or is unlit.
    pub fn shines(&self) -> bool {
        self.is_emissive() || self.model == ModelTag::Unlit
    }
}

impl TextureSlot {
    /// Appends the use of a texture; its index, or [`NONE`] if there is no such texture.
    pub(super) fn place(texture: &Option<TextureRef>, scene: &Scene, slots: &mut Vec<Self>) -> u32 {
        match texture {
            Some(t) if (t.texture as usize) < scene.textures.len() => {
                slots.push(Self::new(t));
                slots.len() as u32 - 1
            }
            _ => NONE,
        }
    }

    fn new(t: &TextureRef) -> Self {
        let ([r0, r1], o) = (t.transform.rows, t.transform.offset);
        Self { texture: t.texture, uv_set: t.uv_set, transform: [r0.x, r0.y, o.x, r1.x, r1.y, o.y] }
    }
}

impl TextureRecord {
    /// Integer texel coordinates of `(x, y)` with the wrap modes applied.
    pub fn wrap(&self, x: i32, y: i32) -> (u32, u32) {
        (wrap(x, self.width, self.sampler.wrap_u), wrap(y, self.height, self.sampler.wrap_v))
    }

    /// Whether to interpolate.
    pub fn is_bilinear(&self) -> bool {
        self.sampler.filter == Filter::Linear
    }

    /// Whether RGB is sRGB-encoded.
    pub(super) fn is_srgb(color_space: ColorSpace) -> bool {
        color_space == ColorSpace::Srgb
    }
}

fn wrap(i: i32, size: u32, mode: Wrap) -> u32 {
    let n = size as i32;
    let wrapped = match mode {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::MirroredRepeat => {
            let period = i.rem_euclid(2 * n);
            if period < n { period } else { 2 * n - 1 - period }
        }
        Wrap::ClampToEdge => i.clamp(0, n - 1),
    };
    wrapped as u32
}
