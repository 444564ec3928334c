//! Removing the noise of a finished picture.
//!
//! A trained network sees the picture, how noisy each pixel is, and the albedo and the normal of what is seen first, and
//! says with which weights each pixel is made of those around it (`network`). What noise does not explain stays as it was
//! (`limit`), and what filtering has changed of the picture's light is restored (`energy`). Open Image Denoise can be used instead where it is installed (`oidn`).

mod energy;
mod limit;
mod network;
#[cfg_attr(target_family = "wasm", path = "oidn_left_out.rs")]
#[allow(unsafe_code, reason = "the library has a C interface")]
mod oidn;
mod regression;
mod signal;

pub use network::{
    LayerWeights, Network, NetworkInput, NetworkWeights, PREPARED_VALUES, Prepared, Region, SizesDiffer,
    Tile, WeightsError,
};
pub use oidn::{Oidn, OidnError};

pub(crate) use signal::{demodulators, estimate_variance};

use film::{Aov, AovData, Film, Image};
use signal::Signal;

/// What to filter: images of one size.
#[derive(Clone, Debug)]
pub struct NoisyPicture {
    /// Linear radiance.
    pub colour: Image,
    /// Variance of each value of `colour`; `None` if nobody knows, as of a single sample.
    pub variance: Option<Image>,
    /// Albedo at the first hit, the mean over the samples. Black if it is not known.
    pub albedo: Image,
    /// [`Aov::DenoisingNormal`], or the shading normal at the first hit, the mean over the samples. Black if it is not known.
    pub normal: Image,
}

/// Why a picture cannot be denoised.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DenoiseError {
    /// The film lacks a layer.
    #[error("denoising needs the layer `{0}`, which was not rendered")]
    MissingLayer(Aov),
    /// The images are not of one picture.
    #[error(transparent)]
    Sizes(#[from] SizesDiffer),
}

impl NoisyPicture {
    /// Layers that a film must have for [`NoisyPicture::of_film`].
    ///
    /// The normal is that of what is seen in mirrors and through glass, the albedo is not: radiance is divided by it and
    /// the result multiplied by it, and what samples find behind glass is noisy.
    pub const LAYERS: [Aov; 2] = [Aov::Albedo, Aov::DenoisingNormal];

    /// What a film has learned. The variance is not known if a pixel has fewer than two samples.
    ///
    /// # Errors
    /// When a layer is missing.
    pub fn of_film(film: &Film) -> Result<Self, DenoiseError> {
        let layer = |aov| match film.aov(aov) {
            Some(AovData::Float(image)) => Ok(image),
            Some(AovData::Integer(_) | AovData::Shares(_)) | None => Err(DenoiseError::MissingLayer(aov)),
        };
        let (albedo, normal) = (layer(Aov::Albedo)?, layer(Aov::DenoisingNormal)?);
        Ok(Self { colour: film.to_image(), variance: film.variance_of_mean(), albedo, normal })
    }

    /// The picture as the network takes it.
    ///
    /// # Errors
    /// When the images differ in size.
    pub fn input(&self) -> Result<NetworkInput<'_>, SizesDiffer> {
        NetworkInput::new(&self.colour, &self.albedo, &self.normal, self.variance.as_ref())
    }
}

/// The picture without its noise, linear radiance. Runs on all threads of the current pool; the result does not depend on how
/// many there are.
///
/// The mean of each colour stays, and that of each block of 64×64 pixels as far as it is certain.
///
/// # Errors
/// When the images differ in size.
pub fn denoise(picture: &NoisyPicture) -> Result<Image, DenoiseError> {
    denoise_with(picture, |input| Ok(Network::trained().denoise(input)))
}

/// As [`denoise`], but the network runs where `filter` runs it, such as on a GPU: its result is the
/// filtered picture, linear radiance of three channels, before the picture's light is restored.
///
/// # Errors
/// When the images differ in size, or `filter` fails.
pub fn denoise_with<E: From<DenoiseError>>(
    picture: &NoisyPicture,
    filter: impl FnOnce(&NetworkInput<'_>) -> Result<Image, E>,
) -> Result<Image, E> {
    let mut filtered = filter(&picture.input().map_err(DenoiseError::from)?)?;
    let (noisy, variance) = (picture.colour.to_rgb(), picture.variance.as_ref().map(Image::to_rgb));
    if let Some(variance) = &variance {
        limit::limit(&noisy, variance, &mut filtered);
    }
    energy::restore(&noisy, variance.as_ref(), &mut filtered);
    Ok(filtered)
}

/// Keeps a picture that was filtered with more knowledge than the noisy one has within the noise of that one, and its mean.
pub(crate) fn keep_light(picture: &NoisyPicture, filtered: &mut Image) {
    let noisy = picture.colour.to_rgb();
    if let Some(variance) = &picture.variance {
        limit::limit(&noisy, &variance.to_rgb(), filtered);
    }
    energy::restore(&noisy, None, filtered);
}

/// The same by weighted regression over the features, without a network.
///
/// # Errors
/// When the images differ in size.
pub fn denoise_by_regression(picture: &NoisyPicture) -> Result<Image, DenoiseError> {
    picture.input()?;
    let signal = Signal::new(picture);
    let mut filtered = signal.picture(&regression::filter(&signal));
    energy::restore(&picture.colour.to_rgb(), None, &mut filtered);
    Ok(filtered)
}

#[cfg(test)]
mod tests;
