//! Image textures: which texels a lookup reads, and how they are mixed. Back ends fetch the texels.

use super::record::wgsl_records;
use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod image_texture {
    use crate::constants::*;
    use crate::tonemap::*;
    use wgsl_rs::std::*;

    /// Flag of a [`TextureUse`]: it is looked up by the second set of texture coordinates.
    pub const TEXTURE_UV1: u32 = 1u32;
    /// Flag of a [`TextureUse`]: four texels are interpolated.
    pub const TEXTURE_BILINEAR: u32 = 2u32;
    /// Flag of a [`TextureUse`]: RGB is sRGB-encoded. Alpha is always linear.
    pub const TEXTURE_SRGB: u32 = 4u32;
    /// Flag of a [`TextureUse`]: texels are four half floats, which take two places each; else four bytes.
    pub const TEXTURE_HALF: u32 = 8u32;
    /// The two bits of a [`TextureUse`]'s flags from here on are the wrap mode of u.
    pub const TEXTURE_WRAP_U_SHIFT: u32 = 4u32;
    /// The two bits of a [`TextureUse`]'s flags from here on are the wrap mode of v.
    pub const TEXTURE_WRAP_V_SHIFT: u32 = 6u32;
    /// Flag of a [`TextureUse`]: the texture stands for shares, of which there are none above 1. Half floats above that
    /// count as 1.
    pub const TEXTURE_SHARES: u32 = 256u32;
    /// Flag of a [`TextureUse`]: it is a graph of `width` nodes, the first of which is node `first_texel`; on a device, where
    /// that begins in `words`.
    pub const TEXTURE_GRAPH: u32 = 512u32;
    /// Flag of a graph's [`TextureUse`]: its value is a height in metres, and `row_u.x` the step that slopes are taken over.
    pub const TEXTURE_HEIGHT: u32 = 1024u32;
    /// The image repeats.
    pub const WRAP_REPEAT: u32 = 0u32;
    /// The image repeats, every second time mirrored.
    pub const WRAP_MIRRORED_REPEAT: u32 = 1u32;
    /// The texels at the edge continue.
    pub const WRAP_CLAMP: u32 = 2u32;

    /// The use of an image by a parameter of a material.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[repr(C)]
    pub struct TextureUse {
        /// First row of the affine map of texture coordinates: `u' = dot(row_u, (u, v, 1))`.
        pub row_u: Vec3f,
        /// Index of the image's first place of four bytes among all texels, or `NONE` for no texture.
        pub first_texel: u32,
        /// Second row: `v' = dot(row_v, (u, v, 1))`.
        pub row_v: Vec3f,
        /// `TEXTURE_…` bits and wrap modes.
        pub flags: u32,
        /// Width of the image, pixels.
        pub width: u32,
        /// Height of the image, pixels.
        pub height: u32,
        /// Index of the texture in the tables; on a device with binding arrays, of the image.
        pub image: u32,
        /// Fills 16 bytes.
        pub padding: u32,
    }

    /// The texels that a lookup reads: `(x, y)` alone, or with its three neighbours at x + 1 and y + 1.
    #[derive(Clone, Copy, Debug)]
    pub struct TexelFootprint {
        /// Column, before wrapping.
        pub x: i32,
        /// Row, before wrapping; row 0 is the top.
        pub y: i32,
        /// Weight of the neighbours in x, in `[0, 1)`.
        pub right: f32,
        /// Weight of the neighbours in y, in `[0, 1)`.
        pub below: f32,
        /// Whether there are four texels to be mixed.
        pub bilinear: bool,
    }

    /// A use of no image.
    pub fn no_texture() -> TextureUse {
        TextureUse {
            row_u: vec3f(1.0, 0.0, 0.0),
            first_texel: NONE,
            row_v: vec3f(0.0, 1.0, 0.0),
            flags: 0u32,
            width: 0u32,
            height: 0u32,
            image: 0u32,
            padding: 0u32,
        }
    }

    /// A texel's index along one side of an image of `size` texels, wrap mode `mode` applied.
    pub fn wrap_texel(i: i32, size: u32, mode: u32) -> u32 {
        let n = i32(size);
        if mode == WRAP_CLAMP {
            return u32(max(min(i, n - 1), 0));
        }
        // The remainder of a negative number is negative.
        let period = select(n, 2 * n, mode == WRAP_MIRRORED_REPEAT);
        let r = ((i % period) + period) % period;
        u32(select(2 * n - 1 - r, r, r < n))
    }

    /// A texel's index among those of its image, row by row.
    pub fn texel_column(t: TextureUse, x: i32) -> u32 {
        wrap_texel(x, t.width, (t.flags >> TEXTURE_WRAP_U_SHIFT) & 3u32)
    }

    /// A texel's row in its image.
    pub fn texel_row(t: TextureUse, y: i32) -> u32 {
        wrap_texel(y, t.height, (t.flags >> TEXTURE_WRAP_V_SHIFT) & 3u32)
    }

    /// Index of a texel's first place of four bytes among all texels.
    pub fn texel_place(t: TextureUse, column: u32, row: u32) -> u32 {
        let texel = row * t.width + column;
        t.first_texel + select(texel, 2u32 * texel, (t.flags & TEXTURE_HALF) != 0u32)
    }

    /// Four half floats whose bytes, low ones first, were read as fractions of 255. `rg`, `ba`: of two channels each.
    pub fn half_texel(rg: Vec4f, ba: Vec4f) -> Vec4f {
        let low = unpack2x16float(pack4x8unorm(rg));
        let high = unpack2x16float(pack4x8unorm(ba));
        vec4f(low.x, low.y, high.x, high.y)
    }

    /// The linear value of a stored texel: bytes as fractions of 255, half floats as they are.
    pub fn decode_texel(t: TextureUse, stored: Vec4f) -> Vec4f {
        if (t.flags & TEXTURE_SHARES) != 0u32 {
            return min(stored, vec4f(1.0, 1.0, 1.0, 1.0));
        }
        decode_bytes(t, stored)
    }

    /// As [`decode_texel`], of bytes.
    pub fn decode_bytes(t: TextureUse, stored: Vec4f) -> Vec4f {
        if (t.flags & TEXTURE_SRGB) != 0u32 {
            let linear = srgb_decode(vec3f(stored.x, stored.y, stored.z));
            return vec4f(linear.x, linear.y, linear.z, stored.w);
        }
        stored
    }

    /// Where a lookup reads. `coords`: both sets of texture coordinates, (u₀, v₀, u₁, v₁).
    pub fn texel_footprint(t: TextureUse, coords: Vec4f) -> TexelFootprint {
        let second = (t.flags & TEXTURE_UV1) != 0u32;
        let uv = vec3f(select(coords.x, coords.z, second), select(coords.y, coords.w, second), 1.0);
        let x = dot(t.row_u, uv) * f32(t.width);
        let y = dot(t.row_v, uv) * f32(t.height);
        let mut footprint = TexelFootprint { x: 0, y: 0, right: 0.0, below: 0.0, bilinear: false };
        // Coordinates that are no numbers, or that integers cannot count, read the first texel.
        if !(abs(x) < 1e9 && abs(y) < 1e9) {
            return footprint;
        }
        footprint.bilinear = (t.flags & TEXTURE_BILINEAR) != 0u32;
        let shift = select(0.0, 0.5, footprint.bilinear);
        let left = floor(x - shift);
        let top = floor(y - shift);
        footprint.x = i32(left);
        footprint.y = i32(top);
        footprint.right = x - shift - left;
        footprint.below = y - shift - top;
        footprint
    }

    /// Interpolates between four texels: `(x, y)`, `(x + 1, y)`, `(x, y + 1)` and `(x + 1, y + 1)`.
    pub fn mix_texels(f: TexelFootprint, t00: Vec4f, t10: Vec4f, t01: Vec4f, t11: Vec4f) -> Vec4f {
        t00 * ((1.0 - f.right) * (1.0 - f.below))
            + t10 * (f.right * (1.0 - f.below))
            + t01 * ((1.0 - f.right) * f.below)
            + t11 * (f.right * f.below)
    }
}

use image_texture::TextureUse;

wgsl_records!(TextureUse);

impl Default for TextureUse {
    fn default() -> Self {
        image_texture::no_texture()
    }
}

impl TextureUse {
    /// Whether RGB is sRGB-encoded.
    #[inline(always)]
    pub fn is_srgb(&self) -> bool {
        self.flags & image_texture::TEXTURE_SRGB != 0
    }

    /// Whether texels are half floats.
    #[inline(always)]
    pub fn is_half(&self) -> bool {
        self.flags & image_texture::TEXTURE_HALF != 0
    }

    /// Whether it is a graph of nodes.
    #[inline(always)]
    pub fn is_graph(&self) -> bool {
        self.flags & image_texture::TEXTURE_GRAPH != 0
    }

    /// Whether it is a graph whose value is a height.
    #[inline(always)]
    pub fn is_height(&self) -> bool {
        self.flags & image_texture::TEXTURE_HEIGHT != 0
    }

    /// Whether there is an image or a graph.
    #[inline(always)]
    pub fn is_some(&self) -> bool {
        self.first_texel != crate::constants::NONE
    }
}

#[cfg(test)]
mod tests {
    use super::image_texture::*;
    use wgsl_rs::std::*;

    #[test]
    fn texels_wrap_as_their_mode_says() {
        let wrapped = |mode| [-5, -4, -1, 0, 3, 4, 7, 8].map(|i| wrap_texel(i, 4, mode));
        assert_eq!(wrapped(WRAP_REPEAT), [3, 0, 3, 0, 3, 0, 3, 0]);
        assert_eq!(wrapped(WRAP_MIRRORED_REPEAT), [3, 3, 0, 0, 3, 3, 0, 0]);
        assert_eq!(wrapped(WRAP_CLAMP), [0, 0, 0, 0, 3, 3, 3, 3]);
    }

    #[test]
    fn half_floats_take_two_places_and_keep_their_values() {
        let mut t = TextureUse { width: 5, height: 4, first_texel: 7, ..no_texture() };
        assert_eq!(texel_place(t, 2, 3), 7 + 17);
        t.flags = TEXTURE_HALF;
        assert_eq!(texel_place(t, 2, 3), 7 + 34);
        // 8, 0.25, 65504 and 1, low bytes first.
        let bytes = |b: [u8; 4]| {
            let [x, y, z, w] = b.map(|b| f32::from(b) / 255.0);
            vec4f(x, y, z, w)
        };
        let texel = half_texel(bytes([0x00, 0x48, 0x00, 0x34]), bytes([0xff, 0x7b, 0x00, 0x3c]));
        assert_eq!(texel.to_array(), [8.0, 0.25, 65504.0, 1.0]);
        assert_eq!(decode_texel(t, texel).to_array(), texel.to_array());
        t.flags |= TEXTURE_SHARES;
        assert_eq!(decode_texel(t, texel).to_array(), [1.0, 0.25, 1.0, 1.0]);
    }

    #[test]
    fn footprints_follow_the_map_of_coordinates() {
        let mut t = TextureUse { width: 8, height: 4, first_texel: 0, ..no_texture() };
        let f = texel_footprint(t, vec4f(0.3, 0.6, 0.9, 0.1));
        assert_eq!((f.x, f.y, f.bilinear), (2, 2, false));
        t.flags = TEXTURE_UV1 | TEXTURE_BILINEAR;
        t.row_u = vec3f(0.5, 0.0, 0.25);
        let f = texel_footprint(t, vec4f(0.3, 0.6, 0.9, 0.5));
        // 8 · (0.45 + 0.25) − 0.5 = 5.1 and 4 · 0.5 − 0.5 = 1.5.
        assert_eq!((f.x, f.y, f.bilinear), (5, 1, true));
        assert!((f.right - 0.1).abs() < 1e-5 && (f.below - 0.5).abs() < 1e-5, "{f:?}");
        let f = texel_footprint(t, vec4f(0.0, 0.0, f32::NAN, 0.0));
        assert_eq!((f.x, f.y, f.bilinear), (0, 0, false));
    }
}
