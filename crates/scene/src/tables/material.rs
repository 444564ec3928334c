//! Records of materials and of their use of textures.

use super::SceneTables;
use crate::{
    AlphaMode, ColorSpace, Filter, ImageTexture, Material, Model, RenderDefaults, ShadowTerminator,
    TextureRef, Wrap,
};
use optics::constants::NONE;
use optics::image_texture::{
    TEXTURE_BILINEAR, TEXTURE_HALF, TEXTURE_HEIGHT, TEXTURE_SHARES, TEXTURE_SRGB, TEXTURE_UV1,
    TEXTURE_WRAP_U_SHIFT, TEXTURE_WRAP_V_SHIFT, WRAP_CLAMP, WRAP_MIRRORED_REPEAT, WRAP_REPEAT,
};
use optics::{vec2f, vec3f, vec4f};

pub use optics::image_texture::TextureUse;
pub use optics::material::{
    MATERIAL_ALPHA_BLEND, MATERIAL_ALPHA_MASK, MATERIAL_BODY, MATERIAL_CHECKERBOARD,
    MATERIAL_CHECKERBOARD_FADES, MATERIAL_CULLS_BACKS, MATERIAL_EMISSION_TWO_SIDED, MATERIAL_EMISSIVE,
    MATERIAL_GRAPHS, MATERIAL_SMOOTH_TERMINATOR, MATERIAL_TANGENTS, MATERIAL_TANGENTS_MIRRORED,
    MATERIAL_THIN, MaterialRecord, ModelTag,
};

/// What the numbers of a texture may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Range {
    /// Reflectances and other shares, of which there are none above 1.
    Shares,
    /// Anything that is not negative.
    Radiance,
}

/// Whether `material` needs the layered model.
pub(super) fn has_layers(material: &Material) -> bool {
    let may_have = match material.model {
        Model::MetallicRoughness | Model::Dielectric => true,
        Model::Lambert | Model::Mirror | Model::Unlit | Model::Boundary => false,
    };
    // A dielectric's own reflection is what its index says; what is stronger or weaker is a layered surface's.
    let scaled = material.specular != 1.0 && material.transmits();
    may_have && (material.layers.are_present() || scaled)
}

/// The bits of a material's record by which the scene says how rays meet its surfaces.
pub(super) fn rules_of(material: &Material, rules: &RenderDefaults) -> u32 {
    let culls = rules.cull_backs.unwrap_or(false) && material.may_lose_backs();
    let smooth = rules.shadow_terminator.unwrap_or_default() == ShadowTerminator::Smooth;
    let smooth = smooth && !material.transmits() && material.model != Model::Unlit;
    let set = |bit: u32, on: bool| if on { bit } else { 0 };
    set(MATERIAL_CULLS_BACKS, culls) | set(MATERIAL_SMOOTH_TERMINATOR, smooth)
}

impl SceneTables {
    /// The record of `material`, without its layers and its medium. The tables have their textures already.
    pub(super) fn material_record(&self, material: &Material) -> MaterialRecord {
        let texture = |texture: &Option<TextureRef>| self.texture_use(texture, Range::Shares);
        // What is emitted, or shown as it is, may be any number.
        let radiance = |texture: &Option<TextureRef>| self.texture_use(texture, Range::Radiance);
        let shown = material.model == Model::Unlit;
        let has_layers = has_layers(material);
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
        let emission = if boundary { [0.0; 3] } else { material.emission.to_array() };
        set(MATERIAL_EMISSIVE, emission.iter().any(|&e| e > 0.0));
        set(MATERIAL_BODY, material.refracts_into_body());
        set(MATERIAL_EMISSION_TWO_SIDED, material.emission_two_sided);
        set(MATERIAL_THIN, material.thin_walled);
        set(MATERIAL_TANGENTS, has_layers && material.layers.need_tangents());
        let tangents = material.tangent_coordinates().unwrap_or_default().1;
        set(MATERIAL_TANGENTS_MIRRORED, tangents.mirrors());
        set(MATERIAL_CHECKERBOARD, checker.is_some());
        set(MATERIAL_CHECKERBOARD_FADES, fade.is_some());
        let model = match material.model {
            _ if boundary => ModelTag::Boundary,
            Model::MetallicRoughness | Model::Dielectric if has_layers => ModelTag::Layered,
            Model::MetallicRoughness => ModelTag::MetallicRoughness,
            Model::Lambert => ModelTag::Lambert,
            Model::Dielectric => ModelTag::Dielectric,
            Model::Mirror => ModelTag::Mirror,
            Model::Unlit => ModelTag::Unlit,
            Model::Boundary => ModelTag::Boundary,
        };
        let [red, green, blue, alpha] = match subsurface {
            _ if boundary => [0.0; 4],
            // The inside has the colour.
            Some(_) => [1.0, 1.0, 1.0, material.base_color.w],
            None => material.base_color.to_array(),
        };
        let [even, odd] = checker.map_or([[0.0; 3]; 2], |c| c.colors.map(|c| c.to_array()));
        let [near, far] = fade.map_or([0.0; 2], |f| f.to_array());
        let absorption =
            if material.refracts_into_body() { material.interior.absorption().to_array() } else { [0.0; 3] };
        let rgb = |[x, y, z]: [f32; 3]| vec3f(x, y, z);
        MaterialRecord {
            base_color: vec4f(red, green, blue, alpha),
            emission: rgb(emission),
            model,
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
            flags,
            checkerboard_even: rgb(even),
            checkerboard_scale: checker.map_or(1.0, |c| 1.0 / c.size.max(1e-6)),
            checkerboard_odd: rgb(odd),
            tangent_turn: tangents.tangent_turn(),
            checkerboard_fade: vec2f(near, far),
            medium: NONE,
            priority: material.priority.unwrap_or(0),
            absorption: rgb(absorption),
            layers: NONE,
            // By `SLOT_…`.
            textures: [
                self.texture_use(
                    &material.base_color_texture,
                    if shown { Range::Radiance } else { Range::Shares },
                ),
                texture(&material.metallic_roughness_texture),
                texture(&material.transmission_texture),
                radiance(&material.emission_texture),
                self.normal_use(&material.normal_texture),
            ],
        }
    }

    /// The use of a texture for normals: a map of directions, or a graph of heights.
    pub(super) fn normal_use(&self, texture: &Option<TextureRef>) -> TextureUse {
        let map = self.texture_use(texture, Range::Shares);
        if !map.is_graph() {
            return map;
        }
        TextureUse { flags: map.flags & !TEXTURE_SHARES | TEXTURE_HEIGHT, ..map }
    }

    /// The use of a texture; none if the scene has no such texture.
    pub(super) fn texture_use(&self, texture: &Option<TextureRef>, range: Range) -> TextureUse {
        let Some(reference) = texture else { return TextureUse::default() };
        let Some(&image) = self.textures.get(reference.texture as usize) else {
            return TextureUse::default();
        };
        let ([u, v], offset) = (reference.transform.rows, reference.transform.offset);
        let set = |bit: u32, on: bool| if on { bit } else { 0 };
        // Bytes are shares already.
        let may_exceed = image.is_half() || image.is_graph();
        let shares = set(TEXTURE_SHARES, may_exceed && range == Range::Shares);
        TextureUse {
            row_u: vec3f(u.x, u.y, offset.x),
            row_v: vec3f(v.x, v.y, offset.y),
            flags: image.flags | shares | set(TEXTURE_UV1, reference.uv_set & 1 == 1),
            ..image
        }
    }
}

/// The `TEXTURE_…` bits of a texture and its pixels, but for those of its use. Half floats are linear, whatever the texture
/// says of bytes.
pub(super) fn texture_flags(texture: &ImageTexture, half: bool) -> u32 {
    let sampler = texture.sampler;
    let wrap = |mode: Wrap| match mode {
        Wrap::Repeat => WRAP_REPEAT,
        Wrap::MirroredRepeat => WRAP_MIRRORED_REPEAT,
        Wrap::ClampToEdge => WRAP_CLAMP,
    };
    let filter = match sampler.filter {
        Filter::Linear => TEXTURE_BILINEAR,
        Filter::Nearest => 0,
    };
    let encoding = if texture.color_space == ColorSpace::Srgb { TEXTURE_SRGB } else { 0 };
    filter
        | if half { TEXTURE_HALF } else { encoding }
        | wrap(sampler.wrap_u) << TEXTURE_WRAP_U_SHIFT
        | wrap(sampler.wrap_v) << TEXTURE_WRAP_V_SHIFT
}
