//! Denoising the frames of a sequence: what frames before have found counts, too.
//!
//! Not denoised pictures are carried from frame to frame but noisy ones, so that the filter sees
//! one picture of many samples, with the variance that it has, and can still tell noise from
//! texture. The history is looked up where each surface was in the last frame (`reproject`),
//! believed as far as noise explains how it differs from the new frame (`trust`), and averaged with
//! it. What is kept for the next frame is that average. After filtering, the frame's own noise and
//! its own light have the last word.
//!
//! Sources: Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, for accumulating
//! light without albedo; the weights are those of a Kalman filter whose process noise is what the
//! innovations show.

mod reproject;
#[cfg(test)]
mod tests;
mod trust;

use crate::denoise::{NoisyPicture, SizesDiffer, demodulators, estimate_variance, keep_light};
use elementary::powi;
use film::Image;
use rayon::prelude::*;
use reproject::reproject;
use trust::{Pixel, trust};

/// What a pixel of a frame sees first, and where that was in the last frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// How far it has moved since: pixels to the right and down that lead back to its place in the
    /// last frame. NaN if it was not in that picture, or nobody knows.
    pub back: [f32; 2],
    /// Distance from the camera in the last frame, metres, infinite for the sky; NaN if nobody
    /// knows.
    pub distance_before: f32,
    /// Distance from the camera, metres; infinite for the sky, NaN if nobody knows.
    pub distance: f32,
    /// Whose surface it is, such as the numbers of instance and material: history is that of equal
    /// ones.
    pub ids: [u32; 2],
}

/// A frame of a sequence.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The frame by itself.
    pub noisy: &'a NoisyPicture,
    /// What its pixels see, row by row.
    pub surfaces: &'a [Surface],
}

/// Why a frame cannot be denoised.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The images are not of one picture.
    #[error(transparent)]
    Sizes(#[from] SizesDiffer),
    /// There are not as many surfaces as pixels.
    #[error("there are {found} surfaces for {expected} pixels")]
    Surfaces {
        /// How many there are.
        found: usize,
        /// How many pixels there are.
        expected: usize,
    },
}

/// What the frames of a sequence have found so far.
#[derive(Clone, Debug, Default)]
pub struct History {
    past: Option<Past>,
}

/// The average that the last frame has left, row by row.
#[derive(Clone, Debug)]
struct Past {
    size: [usize; 2],
    /// Radiance divided by `demodulator`.
    irradiance: Vec<[f32; 3]>,
    /// Variance of `irradiance`.
    variance: Vec<[f32; 3]>,
    demodulator: Vec<[f32; 3]>,
    normal: Vec<[f32; 3]>,
    surfaces: Vec<Surface>,
}

impl History {
    /// Denoises the next frame by `filter`, which is given a picture with less noise than the
    /// frame's own, and may be any denoiser.
    ///
    /// No pixel is moved by more than the frame's own noise allows, and the mean of each colour is
    /// the frame's own, as [`crate::denoise`] has them. The first frame is filtered as it is; one
    /// of another size is a first frame.
    ///
    /// # Errors
    /// When the images differ in size, or `filter` fails.
    pub fn denoise<E: From<FrameError>>(
        &mut self,
        frame: Frame,
        filter: impl FnOnce(&NoisyPicture) -> Result<Image, E>,
    ) -> Result<Image, E> {
        let size = [frame.noisy.colour.width() as usize, frame.noisy.colour.height() as usize];
        let is_first = self.past.as_ref().is_none_or(|past| past.size != size);
        let combined = self.combine(frame)?;
        if is_first {
            return filter(frame.noisy);
        }
        let mut filtered = filter(&combined)?;
        keep_light(frame.noisy, &mut filtered);
        Ok(filtered)
    }

    /// The next frame with what those before have found, not filtered yet. The history goes on from
    /// there.
    ///
    /// # Errors
    /// When the images differ in size.
    pub fn combine(&mut self, frame: Frame) -> Result<NoisyPicture, FrameError> {
        let Frame { noisy, surfaces } = frame;
        noisy.input()?;
        let size = [noisy.colour.width() as usize, noisy.colour.height() as usize];
        let expected = size[0] * size[1];
        if surfaces.len() != expected {
            return Err(FrameError::Surfaces { found: surfaces.len(), expected });
        }
        let mut own = Past::of_frame(frame, size);
        if let Some(past) = self.past.take().filter(|past| past.size == size) {
            own.add(&past);
        }
        let picture = NoisyPicture {
            colour: own.image(&own.irradiance, 1),
            // Of single samples it is a guess, which is worse for filters than none.
            variance: noisy.variance.as_ref().map(|_| own.image(&own.variance, 2)),
            albedo: noisy.albedo.clone(),
            normal: noisy.normal.clone(),
        };
        self.past = Some(own);
        Ok(picture)
    }
}

impl Past {
    /// What one frame alone knows.
    fn of_frame(frame: Frame, size: [usize; 2]) -> Self {
        let Frame { noisy, surfaces } = frame;
        let estimated;
        let variance = match &noisy.variance {
            Some(variance) => variance,
            None => {
                estimated = estimate_variance(&noisy.colour, &noisy.albedo);
                &estimated
            }
        };
        let demodulator = demodulators(&noisy.albedo);
        let divided = |image: &Image, power: i32| -> Vec<[f32; 3]> {
            let divide = |(value, d): (&[f32; 3], &[f32; 3])| {
                std::array::from_fn(|c| finite(value[c] / powi(d[c], power)))
            };
            rgb(image).iter().zip(&demodulator).map(divide).collect()
        };
        Self {
            size,
            irradiance: divided(&noisy.colour, 1),
            variance: divided(variance, 2),
            normal: rgb(&noisy.normal),
            surfaces: surfaces.to_vec(),
            demodulator,
        }
    }

    /// Averages with what was before, pixel by pixel.
    fn add(&mut self, past: &Self) {
        let before = reproject(self, past);
        let is_still = self.surfaces.iter().all(|s| s.back == [0.0; 2]);
        let pixels: Vec<Pixel> = (0..before.len()).map(|i| Pixel::new(self, before[i], i)).collect();
        let trust = trust(&pixels, &self.surfaces, self.size, is_still);
        let values = self.irradiance.par_iter_mut().zip(&mut self.variance);
        values.zip(before).zip(trust).for_each(|(((own, variance), before), trust)| {
            let Some(before) = before else { return };
            let weight = trust.weight;
            let total: f32 = variance.iter().sum::<f32>().max(f32::MIN_POSITIVE);
            for c in 0..3 {
                let uncertain = before.variance[c] + trust.wrong * variance[c] / total;
                own[c] += weight * (before.irradiance[c] - own[c]);
                variance[c] = weight * weight * uncertain + powi(1.0 - weight, 2) * variance[c];
            }
        });
    }

    /// A picture again, of values times the demodulator to some power.
    fn image(&self, values: &[[f32; 3]], power: i32) -> Image {
        let width = self.size[0];
        Image::from_fn(width as u32, self.size[1] as u32, |x, y| {
            let i = y as usize * width + x as usize;
            std::array::from_fn(|c| values[i][c] * powi(self.demodulator[i][c], power))
        })
    }
}

/// The pixels of an image, row by row.
fn rgb(image: &Image) -> Vec<[f32; 3]> {
    image.to_rgb().data().chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
}

/// What is no number has found nothing.
fn finite(value: f32) -> f32 {
    if value.is_finite() { value.max(0.0) } else { 0.0 }
}
