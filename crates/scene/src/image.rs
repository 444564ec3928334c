//! Decoded images and how textures sample them.

use crate::{ImageId, TextureId};
use glam::Vec2;
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
    /// Eight bits a channel, as stored in the file; [`Texture::color_space`] says what they mean.
    Rgba8(Vec<[u8; 4]>),
    /// Linear floating point (HDR and EXR files).
    Rgb32F(Vec<[f32; 3]>),
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
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Texture {
    /// Index into [`crate::Scene::images`].
    pub image: ImageId,
    /// Wrapping and filtering.
    pub sampler: Sampler,
    /// Meaning of the stored numbers.
    pub color_space: ColorSpace,
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
        let (sin, cos) = rotation.sin_cos();
        Self { rows: [Vec2::new(cos, sin) * scale, Vec2::new(-sin, cos) * scale], offset }
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
