//! Textures: images and graphs.

use crate::ids::ImageId;
use crate::image::{ColorSpace, ImageTexture, Sampler};
use crate::texture_graph::TextureGraph;
use serde::{Deserialize, Serialize};

/// A value that differs from place to place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Texture {
    /// An image and how it is sampled.
    Image(ImageTexture),
    /// A graph of nodes, which may show images.
    Graph(TextureGraph),
}

impl Texture {
    /// A texture of an image.
    pub fn image(image: ImageId, sampler: Sampler, color_space: ColorSpace) -> Self {
        Self::Image(ImageTexture { image, sampler, color_space })
    }

    /// The image, if it is one.
    pub fn as_image(&self) -> Option<&ImageTexture> {
        match self {
            Self::Image(texture) => Some(texture),
            Self::Graph(_) => None,
        }
    }

    /// The image, if it is one.
    pub fn as_image_mut(&mut self) -> Option<&mut ImageTexture> {
        match self {
            Self::Image(texture) => Some(texture),
            Self::Graph(_) => None,
        }
    }

    /// Renumbers what it refers to: images by `images`, textures that a graph shows by `textures`.
    pub fn shift_references(&mut self, images: u32, textures: u32) {
        match self {
            Self::Image(texture) => texture.image += images,
            Self::Graph(graph) => graph.images_mut().for_each(|shown| shown.texture += textures),
        }
    }
}
