//! Materials and their use of textures, from the tables to the shaders' records.

use super::records::{
    MATERIAL_EMISSIVE, Material, TEXTURE_BILINEAR, TEXTURE_SRGB, TEXTURE_UV1, TEXTURE_WRAP_U_SHIFT,
    TEXTURE_WRAP_V_SHIFT, TextureUse,
};
use super::texels::{ImagePlace, images};
use super::words::Words;
use scene::tables::{MaterialRecord, NONE, SceneTables};
use scene::{Filter, Wrap};

/// All materials.
pub(super) fn materials(tables: &SceneTables, words: &Words) -> Vec<Material> {
    let images = images(tables);
    let record = |m: &MaterialRecord| Material {
        layers: words.layers_of(m),
        medium: words.medium(m.medium),
        ..material(tables, &images, m)
    };
    tables.materials.iter().map(record).collect()
}

fn material(tables: &SceneTables, images: &[ImagePlace], m: &MaterialRecord) -> Material {
    let slots =
        [m.base_color_slot, m.metallic_roughness_slot, m.transmission_slot, m.emission_slot, m.normal_slot];
    Material {
        base_color: m.base_color,
        emission: m.emission,
        model: m.model as u32,
        metallic: m.metallic,
        roughness: m.roughness,
        specular: m.specular,
        ior: m.ior,
        transmission: m.transmission,
        normal_scale: m.normal_scale,
        alpha_cutoff: m.alpha_cutoff,
        flags: m.flags | if m.is_emissive() { MATERIAL_EMISSIVE } else { 0 },
        checkerboard_even: m.checkerboard_colors[0],
        checkerboard_scale: m.checkerboard_scale,
        checkerboard_odd: m.checkerboard_colors[1],
        checkerboard_fade: m.checkerboard_fade,
        absorption: m.absorption,
        priority: m.priority,
        textures: slots.map(|slot| texture_use(tables, images, slot)),
        ..Material::default()
    }
}

/// What a slot says; `slot`: its index, or `NONE`. `images`: see [`images`].
pub(super) fn texture_use(tables: &SceneTables, images: &[ImagePlace], slot: u32) -> TextureUse {
    if slot == NONE {
        return TextureUse { first_texel: NONE, ..TextureUse::default() };
    }
    let slot = &tables.texture_slots[slot as usize];
    let texture = &tables.textures[slot.texture as usize];
    let [a, b, c, d, e, f] = slot.transform;
    let flag = |bit: u32, on: bool| if on { bit } else { 0 };
    let wrap = |mode: Wrap| match mode {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    };
    TextureUse {
        row_u: [a, b, c],
        first_texel: texture.first_texel,
        row_v: [d, e, f],
        flags: flag(TEXTURE_UV1, slot.uv_set & 1 == 1)
            | flag(TEXTURE_BILINEAR, texture.sampler.filter == Filter::Linear)
            | flag(TEXTURE_SRGB, texture.srgb)
            | wrap(texture.sampler.wrap_u) << TEXTURE_WRAP_U_SHIFT
            | wrap(texture.sampler.wrap_v) << TEXTURE_WRAP_V_SHIFT,
        width: texture.width,
        height: texture.height,
        image: images.binary_search(&ImagePlace::of(texture)).unwrap_or(0) as u32,
        padding: 0,
    }
}
