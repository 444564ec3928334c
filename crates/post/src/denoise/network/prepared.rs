//! A picture as devices take it that run the network themselves: cleaned and scaled, tile by tile.

use super::features::Scaled;
use super::input::NetworkInput;
use super::tiles::{self, Region, Tile};
use rayon::prelude::*;

/// Values of a pixel of [`Prepared::pixels`]: radiance times the scale (3 values, up to 1e30),
/// albedo (3, in `[0, 1]`), normal (3, in `[-1, 1]`), standard deviation of the irradiance,
/// compressed as the network sees it, whether that is known (0 or 1), and zero. All are finite.
pub const PREPARED_VALUES: usize = 12;

/// A picture with its scale.
#[derive(Clone, Copy)]
pub struct Prepared<'a> {
    scaled: Scaled<'a>,
    size: [usize; 2],
}

impl<'a> NetworkInput<'a> {
    /// Finds the picture's scale.
    #[must_use]
    pub fn prepared(&'a self) -> Prepared<'a> {
        Prepared { scaled: Scaled::new(self), size: [self.width(), self.height()] }
    }
}

impl Prepared<'_> {
    /// Width and height, in pixels.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Divides the picture into tiles of at most `most_pixels` with their overlap, as far as that
    /// is possible; none if it has no pixels. Filtered by themselves, they make up the filtered
    /// picture.
    #[must_use]
    pub fn tiles(&self, most_pixels: usize) -> Vec<Tile> {
        let [width, height] = self.size;
        if width == 0 || height == 0 { Vec::new() } else { tiles::plan(width, height, most_pixels) }
    }

    /// The pixels of a region, row by row, which may reach beyond the right and the lower edge of
    /// the picture: there it is mirrored.
    #[must_use]
    pub fn pixels(&self, region: Region) -> Vec<[f32; PREPARED_VALUES]> {
        let mut pixels = vec![[0.0; PREPARED_VALUES]; region.width * region.height];
        pixels.par_chunks_exact_mut(region.width.max(1)).enumerate().for_each(|(row, to)| {
            for (column, to) in to.iter_mut().enumerate() {
                let (x, y) = (region.x + column, region.y + row);
                let features = self.scaled.features(x, y);
                to[..3].copy_from_slice(&self.scaled.pixel(x, y).colour);
                to[3..11].copy_from_slice(&features[3..]);
            }
        });
        pixels
    }

    /// Radiance of a filtered value, which is times the scale: what is negative becomes zero, and
    /// what is not finite the largest number.
    #[must_use]
    pub fn radiance(&self, filtered: f32) -> f32 {
        (filtered.max(0.0) / self.scaled.scale).min(f32::MAX)
    }
}
