//! Removing the noise of a finished picture.
//!
//! A pixel's colour is estimated from those of its surroundings that show the same thing. How alike two pixels are is said
//! by three things: their colours and those of the patches around them, compared with their own variance, so that noise is
//! not taken for a difference and a difference not for noise (non-local means); their albedo; their normal. Through the
//! colours of those that are alike a plane is fitted, over normal and place, so that gradients stay gradients. The albedo is
//! divided out before and multiplied in after, so textures do not blur.
//!
//! Sources: Rousselle, Knaus and Zwicker, "Adaptive Rendering with Non-Local Means Filtering", 2012 (distances by variance);
//! Rousselle, Manzi and Zwicker, "Robust Denoising using Feature and Color Information", 2013 (features); Bitterli et al.,
//! "Nonlinearly Weighted First-order Regression for Denoising Monte Carlo Renderings", 2016 (regression).

#[cfg_attr(target_family = "wasm", path = "oidn_left_out.rs")]
#[allow(unsafe_code, reason = "the library has a C interface")]
mod oidn;
mod regression;
mod signal;

pub use oidn::{Oidn, OidnError};

use film::{Aov, AovData, Film, Image};
use signal::Signal;
pub use signal::estimate_variance;

/// What to filter.
#[derive(Clone, Debug)]
pub struct NoisyPicture {
    /// Linear radiance.
    pub colour: Image,
    /// Variance of each value of `colour`.
    pub variance: Image,
    /// Albedo at the first hit, the mean over the samples.
    pub albedo: Image,
    /// Shading normal at the first hit, the mean over the samples.
    pub normal: Image,
}

/// Why a picture cannot be denoised.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DenoiseError {
    /// The film lacks a layer.
    #[error("denoising needs the layer `{0}`, which was not rendered")]
    MissingLayer(Aov),
    /// A pixel has not two samples.
    #[error("denoising needs at least two samples in every pixel")]
    TooFewSamples,
}

impl NoisyPicture {
    /// Layers that a film must have for [`NoisyPicture::of_film`].
    pub const LAYERS: [Aov; 2] = [Aov::Albedo, Aov::Normal];

    /// What a film has learned.
    ///
    /// # Errors
    /// When a layer is missing, or a pixel has fewer than two samples.
    pub fn of_film(film: &Film) -> Result<Self, DenoiseError> {
        let layer = |aov| match film.aov(aov) {
            Some(AovData::Float(image)) => Ok(image),
            Some(AovData::Integer(_) | AovData::Shares(_)) | None => Err(DenoiseError::MissingLayer(aov)),
        };
        let variance = film.variance_of_mean().ok_or(DenoiseError::TooFewSamples)?;
        let (albedo, normal) = (layer(Aov::Albedo)?, layer(Aov::Normal)?);
        Ok(Self { colour: film.to_image(), variance, albedo, normal })
    }
}

/// The picture without its noise, linear radiance. Runs on all threads of the current pool; the result does not depend on how
/// many there are.
///
/// The filter is not linear and loses a percent or so of the light of pictures with bright specks. What the picture's mean has
/// lost of a colour is given back to all of its pixels alike, up to a twentieth.
#[must_use]
pub fn denoise(picture: &NoisyPicture) -> Image {
    const MOST: f64 = 0.05;
    let signal = Signal::new(picture);
    let mut filtered = signal.picture(&regression::filter(&signal));
    let means = picture.colour.to_rgb().mean().into_iter().zip(filtered.mean());
    let factors: Vec<f32> = means
        .map(|(before, after)| {
            let factor = if after > 0.0 { before / after } else { 1.0 };
            factor.clamp(1.0 - MOST, 1.0 + MOST) as f32
        })
        .collect();
    for pixel in filtered.data_mut().chunks_exact_mut(3) {
        pixel.iter_mut().zip(&factors).for_each(|(value, factor)| *value *= factor);
    }
    filtered
}

#[cfg(test)]
mod tests;
