//! Intel Open Image Denoise where no library can be loaded, as in a browser: it is never found.

use super::NoisyPicture;
use film::Image;
use std::path::Path;

/// Why Open Image Denoise did not denoise.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OidnError {
    /// No library can be loaded.
    #[error("Open Image Denoise is not installed ({tried})")]
    NotFound {
        /// Why.
        tried: String,
    },
}

/// The library, which cannot be.
#[derive(Debug)]
pub enum Oidn {}

impl Oidn {
    /// Finds nothing.
    ///
    /// # Errors
    /// [`OidnError::NotFound`], always.
    pub fn find() -> Result<Self, OidnError> {
        Err(OidnError::NotFound { tried: "no library can be loaded on this platform".into() })
    }

    /// The file that was loaded.
    #[must_use]
    pub fn path(&self) -> &Path {
        match *self {}
    }

    /// The picture without its noise.
    ///
    /// # Errors
    /// None: there is no such value.
    pub fn denoise(&self, _: &NoisyPicture) -> Result<Image, OidnError> {
        match *self {}
    }
}
