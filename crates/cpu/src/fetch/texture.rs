//! Fetching texels. Which ones a lookup reads, and how they are mixed, is the optics' `image_texture`.

use half::f16;
use optics::image_texture::{
    decode_texel, mix_texels, texel_column, texel_footprint, texel_place, texel_row,
};
use optics::texture_point::TexturePoint;
use optics::{Vec4f, vec4f};
use scene::tables::{SceneTables, TextureUse};
use std::sync::LazyLock;

/// Linear values of the 256 bytes: as they are (row 0) and decoded from sRGB (row 1). Looking up in one of two rows
/// needs no branch on the format.
static DECODE: LazyLock<[[f32; 256]; 2]> = LazyLock::new(|| {
    let linear = std::array::from_fn(|i| i as f32 / 255.0);
    let srgb = std::array::from_fn(|i| optics::tonemap::srgb_decode_channel(i as f32 / 255.0));
    [linear, srgb]
});

/// The linear RGBA value of a texture at the given coordinates of both sets; ones where there is no texture. RGB is
/// decoded as the texture says; alpha is always linear. `point`: what graphs ask.
#[inline]
pub(crate) fn sample(
    tables: &SceneTables,
    texture: &TextureUse,
    coords: Vec4f,
    point: impl FnOnce() -> TexturePoint,
) -> Vec4f {
    if !texture.is_some() {
        return vec4f(1.0, 1.0, 1.0, 1.0);
    }
    if texture.is_graph() {
        return graph(tables, texture, &point());
    }
    image(tables, texture, coords)
}

/// Out of line: images pay nothing for graphs.
#[inline(never)]
fn graph(tables: &SceneTables, texture: &TextureUse, point: &TexturePoint) -> Vec4f {
    tables.evaluate_graph(texture, point, |shown, coords| {
        if shown.is_some() { image(tables, shown, coords) } else { vec4f(1.0, 1.0, 1.0, 1.0) }
    })
}

/// The value of an image.
fn image(tables: &SceneTables, texture: &TextureUse, coords: Vec4f) -> Vec4f {
    let f = texel_footprint(*texture, coords);
    let at = |right: i32, below: i32| texel(tables, texture, f.x + right, f.y + below);
    if f.bilinear { mix_texels(f, at(0, 0), at(1, 0), at(0, 1), at(1, 1)) } else { at(0, 0) }
}

#[inline]
fn texel(tables: &SceneTables, texture: &TextureUse, x: i32, y: i32) -> Vec4f {
    let place = texel_place(*texture, texel_column(*texture, x), texel_row(*texture, y)) as usize;
    if texture.is_half() {
        return half_texel(tables, texture, place);
    }
    let [r, g, b, a] = tables.texels[place];
    let table = &DECODE[usize::from(texture.is_srgb())];
    let decode = |byte: u8| table[usize::from(byte)];
    vec4f(decode(r), decode(g), decode(b), f32::from(a) * (1.0 / 255.0))
}

/// The value of a texel of half floats, which takes two places.
///
/// Out of line: images of bytes pay nothing for it.
#[inline(never)]
fn half_texel(tables: &SceneTables, texture: &TextureUse, place: usize) -> Vec4f {
    let [[r0, r1, g0, g1], [b0, b1, a0, a1]] = [tables.texels[place], tables.texels[place + 1]];
    let [r, g, b, a] = [[r0, r1], [g0, g1], [b0, b1], [a0, a1]].map(|half| f16::from_le_bytes(half).to_f32());
    decode_texel(*texture, vec4f(r, g, b, a))
}
