//! Decoded images and how textures sample them.

use crate::ids::{ImageId, TextureId};
use elementary::sin_cos;
use glam::Vec2;
use optics::tonemap::srgb_decode_channel;
use serde::{Deserialize, Serialize};

/// A decoded picture, row 0 at the top.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Image {
    /// File name or glTF name, for messages.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// `width × height` pixels.
    pub pixels: Pixels,
}

/// Pixel data of an [`Image`], row 0 at the top.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Pixels {
    /// Eight bits a channel, as stored in the file; [`ImageTexture::color_space`] says what they mean.
    Rgba8(Vec<[u8; 4]>),
    /// Linear floating point (HDR and EXR files).
    Rgb32F(Vec<[f32; 3]>),
    /// Linear floating point with an alpha channel; colours are not multiplied by it.
    Rgba32F(Vec<[f32; 4]>),
}

impl Pixels {
    /// The stored numbers of a pixel, bytes as fractions of 255; alpha is 1 where there is none.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn stored(&self, index: usize) -> [f32; 4] {
        match self {
            Self::Rgba8(pixels) => pixels[index].map(|byte| f32::from(byte) / 255.0),
            Self::Rgb32F(pixels) => {
                let [r, g, b] = pixels[index];
                [r, g, b, 1.0]
            }
            Self::Rgba32F(pixels) => pixels[index],
        }
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        match self {
            Self::Rgba8(pixels) => pixels.len(),
            Self::Rgb32F(pixels) => pixels.len(),
            Self::Rgba32F(pixels) => pixels.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes that they take.
    pub fn memory_bytes(&self) -> usize {
        match self {
            Self::Rgba8(pixels) => size_of_val(pixels.as_slice()),
            Self::Rgb32F(pixels) => size_of_val(pixels.as_slice()),
            Self::Rgba32F(pixels) => size_of_val(pixels.as_slice()),
        }
    }

    /// Whether they are floating-point numbers, which are linear.
    pub fn is_float(&self) -> bool {
        !matches!(self, Self::Rgba8(_))
    }

    /// Linear colours without alpha; bytes are decoded from sRGB.
    pub fn into_linear(self) -> Vec<[f32; 3]> {
        match self {
            Self::Rgba8(pixels) => {
                let table: Vec<f32> = (0..256).map(|v| srgb_decode_channel(v as f32 / 255.0)).collect();
                pixels.iter().map(|p| [p[0], p[1], p[2]].map(|byte| table[usize::from(byte)])).collect()
            }
            Self::Rgb32F(pixels) => pixels,
            Self::Rgba32F(pixels) => pixels.iter().map(|p| [p[0], p[1], p[2]]).collect(),
        }
    }
}

/// What the numbers of an eight-bit image mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ColorSpace {
    /// RGB is sRGB-encoded, alpha is linear.
    #[default]
    Srgb,
    /// All channels are linear data.
    Linear,
}

/// What happens outside `[0, 1]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, mirrored every other time.
    MirroredRepeat,
    /// The border pixel goes on.
    ClampToEdge,
}

impl Wrap {
    /// The pixel of a row of `size` that a coordinate lies in.
    fn pixel(self, x: f32, size: u32) -> u32 {
        let within = match self {
            Self::Repeat => x - x.floor(),
            Self::MirroredRepeat => 1.0 - (x.rem_euclid(2.0) - 1.0).abs(),
            Self::ClampToEdge => x.clamp(0.0, 1.0),
        };
        ((within * size as f32) as u32).min(size.saturating_sub(1))
    }
}

/// How values between pixel centres are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Filter {
    /// Bilinear interpolation.
    #[default]
    Linear,
    /// The nearest pixel.
    Nearest,
}

/// Wrapping and filtering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sampler {
    /// Wrapping along u.
    pub wrap_u: Wrap,
    /// Wrapping along v.
    pub wrap_v: Wrap,
    /// Filtering.
    pub filter: Filter,
}

/// An image and how it is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageTexture {
    /// Index into [`crate::Scene::images`].
    pub image: ImageId,
    /// Wrapping and filtering.
    pub sampler: Sampler,
    /// Meaning of the stored numbers.
    pub color_space: ColorSpace,
}

impl ImageTexture {
    /// The pixel of its image that texture coordinates lie in, linear RGB and alpha: what a preview shows. White where
    /// `image` has no pixels.
    pub fn pixel_at(&self, image: &Image, uv: Vec2) -> [f32; 4] {
        let column = self.sampler.wrap_u.pixel(uv.x, image.width);
        let row = self.sampler.wrap_v.pixel(uv.y, image.height);
        let index = row as usize * image.width as usize + column as usize;
        if index >= image.pixels.len() {
            return [1.0; 4];
        }
        let [r, g, b, a] = image.pixels.stored(index);
        if image.pixels.is_float() || self.color_space == ColorSpace::Linear {
            return [r, g, b, a];
        }
        let [r, g, b] = [r, g, b].map(srgb_decode_channel);
        [r, g, b, a]
    }
}

/// Affine map of texture coordinates: `uv' = matrix · uv + offset` (`KHR_texture_transform`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UvTransform {
    /// Rows of the 2×2 matrix.
    pub rows: [Vec2; 2],
    /// Added afterwards.
    pub offset: Vec2,
}

impl Default for UvTransform {
    fn default() -> Self {
        Self { rows: [Vec2::X, Vec2::Y], offset: Vec2::ZERO }
    }
}

impl UvTransform {
    /// Scale, then rotate counter-clockwise as seen with v downwards, then move; `rotation` in radians.
    ///
    /// The text and the example of `KHR_texture_transform` turn (u, v) into (u cos + v sin, v cos − u sin), as common
    /// viewers do; the matrix in its GLSL snippet is the inverse rotation.
    pub fn new(offset: Vec2, rotation: f32, scale: Vec2) -> Self {
        let (sin, cos) = sin_cos(rotation);
        Self { rows: [Vec2::new(cos, sin) * scale, Vec2::new(-sin, cos) * scale], offset }
    }

    /// The transformed coordinates.
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        Vec2::new(self.rows[0].dot(uv), self.rows[1].dot(uv)) + self.offset
    }

    /// Whether the transform mirrors images.
    pub fn mirrors(&self) -> bool {
        self.rows[0].perp_dot(self.rows[1]) < 0.0
    }

    /// The direction in the coordinates before the transform in which u grows after it and v does not, in turns from u
    /// towards v. 0 where there is no such direction.
    pub fn tangent_turn(&self) -> f32 {
        let [along, across] = self.rows;
        let determinant = along.perp_dot(across);
        if determinant == 0.0 || !determinant.is_finite() {
            return 0.0;
        }
        // A column of the inverse.
        let direction = Vec2::new(across.y, -across.x) * determinant.signum();
        direction.to_angle() / std::f32::consts::TAU
    }
}

/// The use of a texture by a material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureRef {
    /// Index into [`crate::Scene::textures`].
    pub texture: TextureId,
    /// Which set of texture coordinates: 0 or 1.
    pub uv_set: u32,
    /// Applied to the coordinates before sampling.
    pub transform: UvTransform,
}

impl TextureRef {
    /// The texture on the first set of coordinates, untransformed.
    pub fn new(texture: TextureId) -> Self {
        Self { texture, uv_set: 0, transform: UvTransform::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_wrapped_and_decoded() {
        let pixels = Pixels::Rgba8(vec![[0, 0, 0, 255], [255, 255, 255, 128]]);
        let image = Image { name: "two".into(), width: 2, height: 1, pixels };
        let read = |wrap_u, color_space, u| {
            let sampler = Sampler { wrap_u, ..Sampler::default() };
            ImageTexture { image: 0, sampler, color_space }.pixel_at(&image, Vec2::new(u, 0.5))[0]
        };
        let row = |wrap| [-0.25, 0.25, 0.75, 1.25].map(|u| read(wrap, ColorSpace::Srgb, u));
        assert_eq!(row(Wrap::Repeat), [1.0, 0.0, 1.0, 0.0]);
        assert_eq!(row(Wrap::MirroredRepeat), [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(row(Wrap::ClampToEdge), [0.0, 0.0, 1.0, 1.0]);
        let grey = Image { pixels: Pixels::Rgba8(vec![[51, 51, 51, 255]]), width: 1, ..image.clone() };
        let texture = ImageTexture { image: 0, sampler: Sampler::default(), color_space: ColorSpace::Linear };
        assert_eq!(texture.pixel_at(&grey, Vec2::NAN)[0], 0.2);
        let decoded = ImageTexture { color_space: ColorSpace::Srgb, ..texture };
        assert!(decoded.pixel_at(&grey, Vec2::ZERO)[0] < 0.1);
    }

    #[test]
    fn tangents_are_where_the_transformed_u_grows() {
        let transforms = [
            UvTransform::default(),
            UvTransform::new(Vec2::ZERO, 0.7, Vec2::new(2.0, 3.0)),
            UvTransform::new(Vec2::ONE, -2.0, Vec2::new(1.0, -0.5)),
            UvTransform::new(Vec2::ONE, 1.0, Vec2::new(-1.0, -0.5)),
        ];
        assert_eq!(transforms.map(|t| t.mirrors()), [false, false, true, false]);
        assert_eq!(transforms[0].tangent_turn(), 0.0);
        for transform in transforms {
            let step = Vec2::from_angle(transform.tangent_turn() * std::f32::consts::TAU);
            let moved = transform.apply(step) - transform.apply(Vec2::ZERO);
            assert!(moved.x > 0.1 && moved.y.abs() < 1e-5, "{transform:?}: {moved}");
        }
        let flat = UvTransform::new(Vec2::ZERO, 0.3, Vec2::new(0.0, 1.0));
        assert_eq!((flat.tangent_turn(), flat.mirrors()), (0.0, false));
    }
}
