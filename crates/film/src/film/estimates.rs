//! What a film's sums say: pictures, layers and their errors.

use super::{Film, Layer, UNSET};
use crate::{Aov, AovData, Image, PixelStats};
use rayon::prelude::*;

/// Pixels whose errors are summed by one thread. Fixed, so that the rounded sum of all is the same on every machine.
const PARTIAL_SUM: usize = 4096;

impl Film {
    /// The mean radiance of the window: linear RGB, each pixel weighing the same.
    #[must_use]
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for pixel in &self.pixels {
            let mean = pixel.mean();
            (0..3).for_each(|c| sum[c] += mean[c]);
        }
        sum.map(|s| s / self.pixels.len() as f64)
    }

    /// The relative standard error of the picture, for stopping criteria such as `--noise 0.02`.
    ///
    /// It is the root mean square over all pixels and channels
    ///
    /// `√( mean( se² / (m² + 0.01·L²) ) )`
    ///
    /// where `m` is the channel's mean, `se` its standard error and `L` the mean over all pixels and channels of
    /// `|m|`. The second term is the floor that keeps black pixels from asking for endless samples: below a tenth of
    /// the picture's mean level, errors count relative to that level. Scaling the radiance does not change the result, and
    /// its square is the expected relMSE of the picture when `L` is one.
    /// Like every estimate of an error it is unreliable below some 16 samples: it cannot know of paths that were
    /// never found.
    ///
    /// `None` if a pixel has fewer than two samples. A black picture has error zero.
    #[must_use]
    pub fn relative_error(&self) -> Option<f64> {
        let channels = 3.0 * self.pixels.len() as f64;
        let floor = self.error_floor();
        let of_pixel = |pixel: &PixelStats| {
            let (mean, variance) = (pixel.mean(), pixel.variance_of_mean()?);
            let errors = mean.iter().zip(&variance).filter(|(_, v)| **v > 0.0);
            Some(errors.map(|(m, v)| v / (m * m + floor)).sum::<f64>())
        };
        let parts: Option<Vec<f64>> =
            self.pixels.par_chunks(PARTIAL_SUM).map(|part| part.iter().map(of_pixel).sum()).collect();
        Some((parts?.iter().sum::<f64>() / channels).sqrt())
    }

    /// The floor `0.01·L²` of [`Film::relative_error`].
    pub(crate) fn error_floor(&self) -> f64 {
        const FLOOR: f64 = 0.01;
        let of_pixel = |pixel: &PixelStats| pixel.mean().iter().map(|m| m.abs()).sum::<f64>();
        let parts: Vec<f64> =
            self.pixels.par_chunks(PARTIAL_SUM).map(|part| part.iter().map(of_pixel).sum()).collect();
        let level = parts.iter().sum::<f64>() / (3.0 * self.pixels.len() as f64);
        FLOOR * level * level
    }

    /// The estimate of the window's radiance: linear RGB. Pixels without samples are black.
    #[must_use]
    pub fn to_image(&self) -> Image {
        self.image_of(3, |i, out| out.copy_from_slice(&self.pixels[i].mean().map(|m| m as f32)))
    }

    /// The variance of the mean of each pixel and channel. `None` if a pixel has fewer than two samples.
    #[must_use]
    pub fn variance_of_mean(&self) -> Option<Image> {
        if self.pixels.iter().any(|p| p.count() < 2) {
            return None;
        }
        Some(self.image_of(3, |i, out| {
            let variance = self.pixels[i].variance_of_mean().unwrap_or_default();
            out.copy_from_slice(&variance.map(|v| v as f32));
        }))
    }

    /// The window's values of an auxiliary layer, or `None` if the film does not have it.
    #[must_use]
    pub fn aov(&self, aov: Aov) -> Option<AovData> {
        let layer = &self.layers[self.aovs.iter().position(|&a| a == aov)?];
        let n = aov.channels().len();
        Some(match layer {
            Layer::Mean(sums) => AovData::Float(self.image_of(n, |i, out| {
                let count = f64::from(self.aov_counts[i].max(1));
                let sums = &sums[i * n..];
                out.iter_mut().zip(sums).for_each(|(o, s)| *o = (s.to_f64() / count) as f32);
            })),
            Layer::First(values) => AovData::Float(self.image_of(n, |i, out| {
                let values = &values[i * n..];
                out.iter_mut().zip(values).for_each(|(o, &v)| *o = if v == UNSET { 0.0 } else { v });
            })),
            Layer::FirstId(ids) => AovData::Integer(ids.clone()),
            Layer::Shares(pixels) => {
                let shares = pixels.iter().zip(&self.aov_counts).map(|(pixel, &samples)| {
                    let share = |count: u32| count as f32 / samples.max(1) as f32;
                    pixel.iter().map(|(id, count)| (id, share(count))).collect()
                });
                AovData::Shares(shares.collect())
            }
            Layer::Derived if aov == Aov::StandardError => AovData::Float(self.image_of(n, |i, out| {
                let error = self.pixels[i].standard_error().unwrap_or_default();
                out.copy_from_slice(&error.map(|e| e as f32));
            })),
            Layer::Derived => {
                let counts = self.pixels.iter().map(|p| u32::try_from(p.count()).unwrap_or(u32::MAX));
                AovData::Integer(counts.collect())
            }
        })
    }

    fn image_of(&self, channels: usize, mut pixel: impl FnMut(usize, &mut [f32])) -> Image {
        let mut image = Image::black(self.window.width, self.window.height, channels);
        image.data_mut().chunks_exact_mut(channels).enumerate().for_each(|(i, out)| pixel(i, out));
        image
    }
}
