//! Denoising a finished film, by what there is.

use film::{Film, Image};
use post::{DenoiseError, NoisyPicture, Oidn, OidnError};

/// What denoises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Denoiser {
    /// Open Image Denoise if it is installed, else our own filter.
    #[default]
    Auto,
    /// Our own filter: the same result on every machine.
    Own,
    /// Open Image Denoise, or an error.
    Oidn,
}

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
    /// The film does not have what is needed.
    #[error(transparent)]
    Film(#[from] DenoiseError),
    /// Open Image Denoise was asked for by name.
    #[error(transparent)]
    Oidn(#[from] OidnError),
}

impl Denoiser {
    /// Removes the noise of a film that has the layers [`NoisyPicture::LAYERS`].
    ///
    /// # Errors
    /// See [`DenoiseFilmError`]. With [`Denoiser::Auto`], a library that is there but fails is replaced by our own filter.
    pub fn run(self, film: &Film) -> Result<Denoised, DenoiseFilmError> {
        Ok(self.run_on(&NoisyPicture::of_film(film)?)?)
    }

    /// Removes the noise of a picture.
    ///
    /// # Errors
    /// As [`Denoiser::run`].
    pub fn run_on(self, noisy: &NoisyPicture) -> Result<Denoised, OidnError> {
        let own =
            |why: &str| Denoised { picture: post::denoise(noisy), by: format!("Alhazen's regression{why}") };
        let oidn = || -> Result<Denoised, OidnError> {
            let library = Oidn::find()?;
            let by = format!("Open Image Denoise ({})", library.path().display());
            Ok(Denoised { picture: library.denoise(noisy)?, by })
        };
        match self {
            Self::Own => Ok(own("")),
            Self::Oidn => Ok(oidn()?),
            Self::Auto => Ok(match oidn() {
                Ok(denoised) => denoised,
                Err(OidnError::NotFound { .. }) => own(""),
                Err(error) => own(&format!(" ({error})")),
            }),
        }
    }
}
