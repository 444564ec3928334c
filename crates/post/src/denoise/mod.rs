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

mod oidn;
mod regression;
mod signal;

pub use oidn::{Oidn, OidnError};

use film::{Aov, AovData, Film, Image};
use signal::Signal;

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
            Some(AovData::Integer(_)) | None => Err(DenoiseError::MissingLayer(aov)),
        };
        let variance = film.variance_of_mean().ok_or(DenoiseError::TooFewSamples)?;
        let (albedo, normal) = (layer(Aov::Albedo)?, layer(Aov::Normal)?);
        Ok(Self { colour: film.to_image(), variance, albedo, normal })
    }
}

/// The picture without its noise, linear radiance, of the same mean within about a percent. Runs on all threads of the
/// current pool; the result does not depend on how many there are.
#[must_use]
pub fn denoise(picture: &NoisyPicture) -> Image {
    let signal = Signal::new(picture);
    signal.picture(&regression::filter(&signal))
}

#[cfg(test)]
mod tests;
