//! Sampling textures.

use crate::surface::TexCoords;
use scene::tables::{SceneTables, TextureRecord};
use std::sync::LazyLock;

/// Linear values of the 256 bytes: as they are (row 0) and decoded from sRGB (row 1). Looking up in one of two rows
/// needs no branch on the format.
static DECODE: LazyLock<[[f32; 256]; 2]> = LazyLock::new(|| {
    let linear = std::array::from_fn(|i| i as f32 / 255.0);
    let srgb = std::array::from_fn(|i| optics::tonemap::srgb_decode_channel(i as f32 / 255.0));
    [linear, srgb]
});

/// The linear RGBA value of texture slot `slot` at the given coordinates. RGB is decoded as the texture says; alpha is
/// always linear.
pub(crate) fn sample(tables: &SceneTables, slot: u32, coords: &TexCoords) -> [f32; 4] {
    let slot = &tables.texture_slots[slot as usize];
    let texture = &tables.textures[slot.texture as usize];
    let [u, v] = coords.sets[(slot.uv_set & 1) as usize];
    let m = &slot.transform;
    let x = (m[0] * u + m[1] * v + m[2]) * texture.width as f32;
    let y = (m[3] * u + m[4] * v + m[5]) * texture.height as f32;
    if !(x.abs() < 1e9 && y.abs() < 1e9) {
        return texel(tables, texture, 0, 0);
    }
    if !texture.is_bilinear() {
        return texel(tables, texture, x.floor() as i32, y.floor() as i32);
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (xi, yi) = (x0 as i32, y0 as i32);
    let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| texel(tables, texture, xi + dx, yi + dy));
    let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
    std::array::from_fn(|c| (0..4).map(|i| corners[i][c] * weights[i]).sum())
}

#[inline]
fn texel(tables: &SceneTables, texture: &TextureRecord, x: i32, y: i32) -> [f32; 4] {
    let (x, y) = texture.wrap(x, y);
    let [r, g, b, a] = tables.texels[(texture.first_texel + y * texture.width + x) as usize];
    let table = &DECODE[usize::from(texture.srgb)];
    let decode = |byte: u8| table[usize::from(byte)];
    [decode(r), decode(g), decode(b), f32::from(a) * (1.0 / 255.0)]
}
