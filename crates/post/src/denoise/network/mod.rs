//! Removing noise with a learned filter.
//!
//! A small network looks at the picture, its albedo and its normals at half the resolution, and
//! says for each pixel and each level of a pyramid what the kernel of 5×5 pixels is that filters
//! it, how far the pixel can be trusted, and how the levels are put together. `features.rs` is what
//! it sees, `unet.rs` how it thinks, `filter.rs` what it decides about; `convolution.rs` is where
//! the time goes. The training is in `training/denoiser`.

mod convolution;
mod features;
mod filter;
mod input;
mod kernels;
#[allow(unsafe_code, reason = "vector instructions; each has a scalar twin that tests compare it with")]
mod lanes;
mod prepared;
mod tiles;
mod unet;
mod weights;

pub use input::{NetworkInput, SizesDiffer};
pub use prepared::{PREPARED_VALUES, Prepared};
pub use tiles::{Region, Tile};
pub use weights::{NetworkWeights, Plain as LayerWeights, WeightsError};

use features::Scaled;
use film::Image;
use lanes::InstructionSet;
use std::sync::LazyLock;
use weights::Layers;

/// The learned denoiser: a network with its weights.
#[derive(Clone, Debug)]
pub struct Network {
    layers: Layers,
}

impl Network {
    /// The network that was trained for this renderer; `training/denoiser/README.md` says how.
    #[must_use]
    pub fn trained() -> &'static Self {
        static TRAINED: LazyLock<Network> = LazyLock::new(|| {
            Network::from_bytes(weights::TRAINED).expect("a test reads the weights that are compiled in")
        });
        &TRAINED
    }

    /// Reads weights: a safetensors file of 16-bit floats, the tensors `<layer>.weight`,
    /// `[output][input][y][x]`, and `<layer>.bias`.
    ///
    /// # Errors
    /// If it is no such file, or lacks a tensor, or one has another shape or type or a value that
    /// is not finite.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        Ok(Self { layers: Layers::from_bytes(bytes)? })
    }

    /// The picture without its noise, linear radiance, three channels. Runs on all threads of the
    /// current pool; the result does not depend on how many there are.
    ///
    /// The result is linear in the picture's exposure. Memory: 150 bytes per pixel, and no more than
    /// 750 MB, besides input and result.
    #[must_use]
    pub fn denoise(&self, input: &NetworkInput<'_>) -> Image {
        self.denoise_with(InstructionSet::best(), tiles::MOST_PIXELS, input)
    }

    /// The same with a set of instructions, and tiles of a size.
    fn denoise_with(&self, set: InstructionSet, most_pixels: usize, input: &NetworkInput<'_>) -> Image {
        let (width, height) = (input.width(), input.height());
        let mut result = Image::black(width as u32, height as u32, 3);
        if width == 0 || height == 0 {
            return result;
        }
        let scaled = Scaled::new(input);
        for tile in tiles::plan(width, height, most_pixels) {
            let decoded = self.layers.decode(set, scaled.unshuffled(tile.region));
            let rows = tile.core.y.min(height)..(tile.core.y + tile.core.height).min(height);
            let to = &mut result.data_mut()[3 * width * rows.start..3 * width * rows.end];
            filter::filter(set, &self.layers, decoded, scaled, tile, width, to);
        }
        result
    }
}

#[cfg(test)]
mod tests;
