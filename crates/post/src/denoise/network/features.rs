//! What the network sees of a picture: eleven channels per pixel, scaled so that no picture is too
//! bright or too dark for it.

use super::convolution::{Activations, row_of};
use super::input::NetworkInput;
use super::tiles::Region;
use elementary::{exp, log};
use rayon::prelude::*;

/// Added to the albedo before dividing by it.
const ALBEDO_FLOOR: f32 = 0.05;

/// The largest radiance and variance that are filtered, after scaling: sums of hundreds of them are
/// still finite.
const LARGEST: f32 = 1e30;

/// Channels of [`features`]: eleven of each pixel of 2×2.
pub const CHANNELS: usize = 44;

/// One pixel, cleaned: no NaN, nothing infinite.
#[derive(Clone, Copy, Debug)]
pub struct Pixel {
    /// Radiance times the picture's scale.
    pub colour: [f32; 3],
    /// Radiance times the picture's scale, divided by `demodulator`.
    pub irradiance: [f32; 3],
    /// What irradiance is multiplied by: the albedo, and a little.
    pub demodulator: [f32; 3],
    /// Albedo, in `[0, 1]`.
    pub albedo: [f32; 3],
}

/// A picture with its scale, as if it went on beyond its right and lower edge, where it is mirrored:
/// sides of what is filtered are multiples of 32. Repeated edges would look like stripes, not noise.
#[derive(Clone, Copy)]
pub struct Scaled<'a> {
    input: &'a NetworkInput<'a>,
    /// What radiance is multiplied by.
    pub scale: f32,
}

impl<'a> Scaled<'a> {
    /// Chooses the scale that brings the logarithmic mean of the luminance of blocks of 16×16
    /// pixels to 0.18; 1 for a black picture.
    pub fn new(input: &'a NetworkInput<'a>) -> Self {
        const BLOCK: usize = 16;
        const DARKEST: f64 = 1e-8;
        let (columns, rows) = (input.width().div_ceil(BLOCK), input.height().div_ceil(BLOCK));
        let logarithm = |block: usize| -> Option<f64> {
            let (x, y) = (block % columns * BLOCK, block / columns * BLOCK);
            let (right, below) = ((x + BLOCK).min(input.width()), (y + BLOCK).min(input.height()));
            let mut sum = 0.0;
            for y in y..below {
                for x in x..right {
                    let [r, g, b] = radiance(input, y * input.width() + x);
                    sum += 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
                }
            }
            let mean = sum / ((right - x) * (below - y)) as f64;
            (mean > DARKEST).then(|| log(mean))
        };
        let logarithms: Vec<f64> = (0..columns * rows)
            .into_par_iter()
            .map(logarithm)
            .collect::<Vec<_>>()
            .into_iter()
            .flatten()
            .collect();
        let mean = logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64;
        // Of the brightest pictures that numbers can express, not even the inverse of the scale may
        // be infinite.
        let scale = if logarithms.is_empty() { 1.0 } else { (0.18 / exp(mean)).max(1e-37) };
        Self { input, scale: scale as f32 }
    }

    /// A pixel; beyond the right and lower edge, its mirror image.
    #[inline]
    pub fn pixel(&self, x: usize, y: usize) -> Pixel {
        let i = self.index(x, y);
        let (radiance, mut albedo) = (radiance(self.input, i), cleaned(self.input.albedo(i)));
        let [mut colour, mut irradiance, mut demodulator] = [[0.0; 3]; 3];
        for c in 0..3 {
            albedo[c] = albedo[c].clamp(0.0, 1.0);
            colour[c] = (radiance[c] * self.scale).min(LARGEST);
            demodulator[c] = albedo[c] + ALBEDO_FLOOR;
            irradiance[c] = colour[c] / demodulator[c];
        }
        Pixel { colour, irradiance, demodulator, albedo }
    }

    /// The number of a pixel, or of the one that it is a mirror image of.
    #[inline]
    fn index(&self, x: usize, y: usize) -> usize {
        mirrored(y, self.input.height()) * self.input.width() + mirrored(x, self.input.width())
    }

    /// The eleven channels of a pixel: irradiance, compressed; albedo; normal; standard deviation
    /// of the irradiance, compressed; whether that is known.
    #[inline]
    pub fn features(&self, x: usize, y: usize) -> [f32; 11] {
        let Pixel { irradiance, demodulator, albedo, .. } = self.pixel(x, y);
        let i = self.index(x, y);
        let normal = cleaned(self.input.normal(i));
        let mut features = [0.0; 11];
        for c in 0..3 {
            features[c] = compressed(irradiance[c]);
            features[3 + c] = albedo[c];
            features[6 + c] = normal[c].clamp(-1.0, 1.0);
        }
        if let Some(variance) = self.input.variance(i) {
            let variance = cleaned(variance);
            let mut sum = 0.0;
            for c in 0..3 {
                let scaled = (variance[c].max(0.0) * self.scale * self.scale).min(LARGEST);
                sum += scaled / (demodulator[c] * demodulator[c]);
            }
            features[9] = compressed((sum / 3.0).sqrt());
            features[10] = 1.0;
        }
        features
    }

    /// The features of a region, at half the resolution: channel `4 k + 2 i + j` of a pixel is
    /// channel `k` of the pixel in row `i` and column `j` of the 2×2 that it stands for.
    pub fn unshuffled(&self, region: Region) -> Activations {
        let mut features = Activations::new(region.width / 2, region.height / 2, CHANNELS);
        features.row_groups(1).enumerate().for_each(|(y, row)| {
            let row = row_of(row, CHANNELS, 1, 0);
            for (x, channels) in row.as_chunks_mut::<CHANNELS>().0.iter_mut().enumerate() {
                for place in 0..4 {
                    let (x, y) = (region.x + 2 * x + place % 2, region.y + 2 * y + place / 2);
                    let features = self.features(x, y);
                    for k in 0..features.len() {
                        channels[4 * k + place] = features[k];
                    }
                }
            }
        });
        features
    }
}

/// A place within `length`, of one beyond it in a row that is mirrored again and again.
#[inline]
fn mirrored(place: usize, length: usize) -> usize {
    if place < length {
        return place;
    }
    let place = place % (2 * length);
    if place < length { place } else { 2 * length - 1 - place }
}

/// Steep in the dark, logarithmic in the light.
#[inline]
fn compressed(x: f32) -> f32 {
    log(1.0 + 16.0 * x) / 3.0
}

/// The radiance of pixel `i`, without what is no radiance.
#[inline]
fn radiance(input: &NetworkInput<'_>, i: usize) -> [f32; 3] {
    let [r, g, b] = cleaned(input.colour(i));
    [r.max(0.0), g.max(0.0), b.max(0.0)]
}

/// Zeros for NaN and infinite values.
#[inline]
fn cleaned(mut values: [f32; 3]) -> [f32; 3] {
    for value in &mut values {
        *value = if value.is_finite() { *value } else { 0.0 };
    }
    values
}
