//! Denoising a finished film.

use crate::Renderer;
use film::{Film, Image};
use post::{
    DenoiseError, FrameError, Network, NoisyPicture, Oidn, OidnError, denoise, denoise_by_regression,
    denoise_with,
};

/// What denoises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Denoiser {
    /// Our own network: the same on every platform, and it keeps the light of the picture.
    #[default]
    Network,
    /// Weighted regression over albedo and normals, without a network.
    Regression,
    /// Open Image Denoise, or an error.
    Oidn,
}

/// What [`Denoised::by`] says of the network on the CPU.
const NETWORK: &str = "Alhazen's network";

/// A picture without its noise.
#[derive(Clone, Debug)]
pub struct Denoised {
    /// Linear radiance.
    pub picture: Image,
    /// What was used: for people and for the file's metadata.
    pub by: String,
}

/// Why a film could not be denoised.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DenoiseFilmError {
    /// What is to be denoised does not have what is needed.
    #[error(transparent)]
    Film(#[from] DenoiseError),
    /// A frame does not have what a sequence needs.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Open Image Denoise was asked for by name.
    #[error(transparent)]
    Oidn(#[from] OidnError),
}

impl Denoiser {
    /// Removes the noise of a film that has the layers [`NoisyPicture::LAYERS`].
    ///
    /// # Errors
    /// See [`DenoiseFilmError`].
    pub fn run(self, film: &Film) -> Result<Denoised, DenoiseFilmError> {
        self.run_on(&NoisyPicture::of_film(film)?)
    }

    /// Removes the noise of a picture.
    ///
    /// # Errors
    /// When its images differ in size, or Open Image Denoise was asked for and is not there or
    /// fails.
    pub fn run_on(self, noisy: &NoisyPicture) -> Result<Denoised, DenoiseFilmError> {
        let (picture, by) = match self {
            Self::Network => (denoise(noisy)?, NETWORK.to_owned()),
            Self::Regression => (denoise_by_regression(noisy)?, "Alhazen's regression".to_owned()),
            Self::Oidn => {
                let library = Oidn::find()?;
                let by = format!("Open Image Denoise ({})", library.path().display());
                (library.denoise(noisy)?, by)
            }
        };
        Ok(Denoised { picture, by })
    }
}

impl Renderer {
    /// Removes the noise of a picture: as [`Denoiser::run_on`], but the network runs on the device
    /// that renders, if that is a GPU. Results differ by rounding. What a device cannot do the CPU
    /// does; [`Renderer::take_notices`] says why.
    ///
    /// # Errors
    /// As [`Denoiser::run_on`].
    pub fn denoise(
        &mut self,
        denoiser: Denoiser,
        noisy: &NoisyPicture,
    ) -> Result<Denoised, DenoiseFilmError> {
        if denoiser != Denoiser::Network {
            return denoiser.run_on(noisy);
        }
        let mut is_on_device = true;
        let picture = denoise_with(noisy, |input| {
            Ok::<_, DenoiseError>(self.filter_noise(input).unwrap_or_else(|| {
                is_on_device = false;
                Network::trained().denoise(input)
            }))
        })?;
        let by = match is_on_device {
            true => format!("Alhazen's network ({})", self.describe()),
            false => NETWORK.to_owned(),
        };
        Ok(Denoised { picture, by })
    }
}
