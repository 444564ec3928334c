//! The filter that the network describes: kernels of 5×5 pixels at six resolutions, and how they
//! are put together.
//!
//! It is linear in the picture, so what is in the result was in the picture: colours cannot be made
//! up, and its exposure does not matter. Sources: Bako et al., "Kernel-Predicting Convolutional
//! Networks for Denoising Monte Carlo Renderings", 2017; Vogels et al., "Denoising with Kernel
//! Prediction and Asymmetric Loss Functions", 2018; Balint et al., "Neural Partitioning Pyramids
//! for Denoising Monte Carlo Renderings", 2023.

use super::convolution::{Activations, Head};
use super::features::Scaled;
use super::kernels::{Kernels, PAIR};
use super::lanes::{InstructionSet, LANES};
use super::tiles::{Region, Tile};
use super::unet::Decoded;
use super::weights::Layers;
use elementary::exp;
use rayon::prelude::*;

/// Values per pixel of [`Trusted`] and [`Filtered`].
pub const VALUES: usize = 8;

/// How far kernels reach.
pub const REACH: usize = 2;

/// Pixels whose logits are in memory at a time: they stay in the nearest cache.
const SEGMENT: usize = 64;

/// A level of the picture, its values multiplied by the trust in them: radiance, irradiance, the
/// trust itself, and on the finest level the logit beta. A border of zeros two pixels wide is what
/// kernels find outside.
pub struct Trusted {
    /// Width without border, in pixels.
    pub width: usize,
    /// Height without border, in pixels.
    pub height: usize,
    /// The values, of all rows with their border, and one pixel more: kernels read pairs.
    pub data: Vec<[f32; VALUES]>,
}

impl Trusted {
    /// Where the logit beta is among the values.
    const BETA: usize = 7;

    /// Zeros.
    pub fn new(width: usize, height: usize) -> Self {
        let pixels = (width + 2 * REACH) * (height + 2 * REACH) + 1;
        Self { width, height, data: vec![[0.0; VALUES]; pixels] }
    }

    /// Pixels from one row to the next.
    pub fn pitch(&self) -> usize {
        self.width + 2 * REACH
    }

    /// The values of a pixel.
    #[inline]
    fn pixel(&self, x: usize, y: usize) -> &[f32; VALUES] {
        &self.data[(y + REACH) * self.pitch() + x + REACH]
    }

    /// The rows, without border above and below, in groups of `rows`.
    fn row_groups(&mut self, rows: usize) -> rayon::slice::ChunksExactMut<'_, [f32; VALUES]> {
        let (pitch, height) = (self.pitch(), self.height);
        self.data[REACH * pitch..][..height * pitch].par_chunks_exact_mut(rows * pitch)
    }

    /// The finest level of a region: the head `trust` says how far each pixel can be trusted,
    /// between 0.001 and 1, and beta.
    fn finest(
        set: InstructionSet,
        trust: &Head,
        decoded: &Activations,
        from: Scaled<'_>,
        region: Region,
    ) -> Self {
        let mut finest = Self::new(region.width, region.height);
        let pitch = finest.pitch();
        finest.row_groups(2).enumerate().for_each(|(y, group)| {
            let mut logits = vec![0.0; decoded.width() * LANES];
            trust.apply(set, decoded, [0, y], &mut logits);
            for (x, logits) in logits.as_chunks::<LANES>().0.iter().enumerate() {
                for place in 0..4 {
                    let [logit, beta] = [logits[place], logits[4 + place]];
                    let (x, row) = (2 * x + place % 2, place / 2);
                    let pixel = from.pixel(region.x + x, region.y + 2 * y + row);
                    let trust = 0.001 + 0.999 * sigmoid(logit);
                    let to = &mut group[row * pitch + REACH + x];
                    for c in 0..3 {
                        to[c] = pixel.colour[c] * trust;
                        to[3 + c] = pixel.irradiance[c] * trust;
                    }
                    to[6] = trust;
                    to[Self::BETA] = beta;
                }
            }
        });
        finest
    }

    /// The level of half the resolution: the mean of each 2×2. As values are multiplied by the
    /// trust in them, this is also the mean by trust.
    fn coarser(&self) -> Self {
        let mut coarser = Self::new(self.width / 2, self.height / 2);
        let (width, pitch) = (coarser.width, self.pitch());
        coarser.row_groups(1).enumerate().for_each(|(y, row)| {
            for (x, to) in row[REACH..][..width].iter_mut().enumerate() {
                let place = (REACH + 2 * y) * pitch + REACH + 2 * x;
                *to = mean(&self.data, place, pitch);
            }
        });
        coarser
    }
}

/// A filtered level: radiance, irradiance, and the logits alpha and detail of each pixel.
pub struct Filtered {
    width: usize,
    height: usize,
    data: Vec<[f32; VALUES]>,
}

impl Filtered {
    /// Where alpha is among the values.
    const ALPHA: usize = 6;
    /// Where detail is among the values.
    const DETAIL: usize = 7;

    /// A level, filtered by the kernels that a head says. At level 0 the head's pixels are 2×2 of
    /// the picture.
    fn new(set: InstructionSet, head: &Head, decoded: &Activations, from: &Trusted) -> Self {
        let (width, height) = (from.width, from.height);
        let scale = height / decoded.height();
        let mut data = vec![[0.0; VALUES]; width * height];
        data.par_chunks_exact_mut(scale * width).enumerate().for_each(|(y, rows)| {
            let mut logits = vec![0.0; SEGMENT * head.outputs()];
            for first in (0..decoded.width()).step_by(SEGMENT) {
                let count = SEGMENT.min(decoded.width() - first);
                head.apply(set, decoded, [first, y], &mut logits[..count * head.outputs()]);
                for (row, to) in rows.chunks_exact_mut(width).enumerate() {
                    let to = &mut to[scale * first..][..scale * count];
                    let pairs = logits.as_chunks_mut::<PAIR>().0;
                    set.run(Kernels {
                        from,
                        place: [scale * first, scale * y + row],
                        // With 2×2 pixels to one of the head's, the pairs of both rows alternate.
                        pairs: &mut pairs[row..],
                        step: scale,
                        to,
                    });
                }
            }
        });
        Self { width, height, data }
    }

    /// The means of each 2×2 pixels.
    fn means(&self) -> Self {
        let [width, height] = [self.width / 2, self.height / 2];
        let mut data = vec![[0.0; VALUES]; width * height];
        data.par_chunks_exact_mut(width).enumerate().for_each(|(y, row)| {
            for (x, to) in row.iter_mut().enumerate() {
                *to = mean(&self.data, 2 * y * self.width + 2 * x, self.width);
            }
        });
        Self { width, height, data }
    }

    /// The values of a pixel, put together of three parts: the level's means, smoothly enlarged; of
    /// what is finer, as much as the pixel's detail says; and of what the coarser level knows
    /// better, as much as its alpha says.
    ///
    /// A kernel of 5×5 leaves a tenth of the noise in what is finer. So on a plain wall there must
    /// be a way to leave that out.
    #[inline]
    fn composed(&self, means: &Self, coarse: &Self, x: usize, y: usize) -> [f32; VALUES] {
        let mut values = self.data[y * self.width + x];
        let [alpha, detail] = [values[Self::ALPHA], values[Self::DETAIL]].map(sigmoid);
        let [smooth, coarse] = [means, coarse].map(|level| level.enlarged(x, y));
        for i in 0..6 {
            values[i] = smooth[i] + detail * (values[i] - smooth[i]) + alpha * (coarse[i] - smooth[i]);
        }
        values
    }

    /// The level put together with the result of the next coarser one.
    fn combined(mut self, coarse: &Self) -> Self {
        let (means, width) = (self.means(), self.width);
        let composed = |i| self.composed(&means, coarse, i % width, i / width);
        self.data = (0..self.data.len()).into_par_iter().map(composed).collect();
        self
    }

    /// The values at a pixel of the double resolution: bilinear between centres of pixels, constant
    /// beyond the outermost.
    #[inline]
    fn enlarged(&self, x: usize, y: usize) -> [f32; VALUES] {
        let [near_x, near_y] = [x / 2, y / 2];
        let far = |near: usize, full: usize, length: usize| match full % 2 {
            0 => near.saturating_sub(1),
            _ => (near + 1).min(length - 1),
        };
        let (far_x, far_y) = (far(near_x, x, self.width), far(near_y, y, self.height));
        let at = |x: usize, y: usize| &self.data[y * self.width + x];
        let [near, beside] = [at(near_x, near_y), at(far_x, near_y)];
        let [above, across] = [at(near_x, far_y), at(far_x, far_y)];
        let mut enlarged = [0.0; VALUES];
        for i in 0..VALUES {
            enlarged[i] = 0.5625 * near[i] + 0.1875 * beside[i] + 0.1875 * above[i] + 0.0625 * across[i];
        }
        enlarged
    }
}

/// Filters a tile as the decoder says. The rows of what is kept of it go to `to`, which has them
/// whole: `width` pixels of three values each, from the first of the tile's rows on.
pub fn filter(
    set: InstructionSet,
    layers: &Layers,
    decoded: Decoded,
    from: Scaled<'_>,
    Tile { region, core }: Tile,
    width: usize,
    to: &mut [f32],
) {
    let [y0, y1, y2, y3, y4] = decoded;
    let level_0 = Trusted::finest(set, &layers.trust, &y0, from, region);
    let coarse = {
        let head = |level: usize, decoded: &Activations, from: &Trusted| {
            Filtered::new(set, &layers.heads[level], decoded, from)
        };
        let level_1 = level_0.coarser();
        let level_2 = level_1.coarser();
        let level_3 = level_2.coarser();
        let level_4 = level_3.coarser();
        let coarse = head(5, &y4, &level_4.coarser());
        let coarse = head(4, &y3, &level_4).combined(&coarse);
        let coarse = head(3, &y2, &level_3).combined(&coarse);
        let coarse = head(2, &y1, &level_2).combined(&coarse);
        head(1, &y0, &level_1).combined(&coarse)
    };
    drop((y1, y2, y3, y4));
    let finest = Filtered::new(set, &layers.heads[0], &y0, &level_0);
    drop(y0);
    let means = finest.means();
    to.par_chunks_exact_mut(3 * width).enumerate().for_each(|(row, to)| {
        let y = core.y + row;
        let columns = core.x..(core.x + core.width).min(width);
        for (x, to) in columns.zip(to[3 * core.x..].as_chunks_mut::<3>().0) {
            let [tile_x, tile_y] = [x - region.x, y - region.y];
            let values = finest.composed(&means, &coarse, tile_x, tile_y);
            let beta = sigmoid(level_0.pixel(tile_x, tile_y)[Trusted::BETA]);
            let demodulator = from.pixel(x, y).demodulator;
            for c in 0..3 {
                let mixed = beta * demodulator[c] * values[3 + c] + (1.0 - beta) * values[c];
                to[c] = (mixed.max(0.0) / from.scale).min(f32::MAX);
            }
        }
    });
}

/// The mean of 2×2 pixels, of which the first is at `place`.
#[inline]
fn mean(data: &[[f32; VALUES]], place: usize, pitch: usize) -> [f32; VALUES] {
    let [a, b] = [&data[place], &data[place + 1]];
    let [c, d] = [&data[place + pitch], &data[place + pitch + 1]];
    let mut mean = [0.0; VALUES];
    for i in 0..VALUES {
        mean[i] = 0.25 * ((a[i] + b[i]) + (c[i] + d[i]));
    }
    mean
}

/// From all numbers to between 0 and 1.
#[inline]
fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + exp(-x))
}
