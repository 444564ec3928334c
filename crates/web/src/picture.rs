//! The picture as the page shows and saves it.

use crate::session::SessionError;
use alhazen::{Denoiser, Film, Image, NoisyPicture, ToneMapping};

/// A picture for the display.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue and an opacity of 255 for each pixel, row by row from the top.
    pub rgba: Vec<u8>,
}

impl Shown {
    /// Brings a film to the display.
    ///
    /// - `below`: what is shown of pixels without a sample, in whatever size.
    /// - `denoise`: whether its noise is removed before; not as long as pixels have no sample.
    ///
    /// # Errors
    /// Of the denoiser.
    pub(crate) fn of(
        film: &Film,
        below: Option<&Image>,
        tone: ToneMapping,
        denoise: bool,
    ) -> Result<Self, SessionError> {
        let picture = linear(film, below, denoise)?;
        let display = tone.apply(&picture);
        let byte = |v: &f32| (v * 255.0 + 0.5) as u8;
        let pixels = display.data().chunks_exact(3);
        let rgba = pixels.flat_map(|c| [byte(&c[0]), byte(&c[1]), byte(&c[2]), 255]).collect();
        Ok(Self { width: film.width(), height: film.height(), rgba })
    }
}

/// Linear radiance of a film, with or without its noise.
pub(crate) fn linear(film: &Film, below: Option<&Image>, denoise: bool) -> Result<Image, SessionError> {
    let is_whole = film.pixels().iter().all(|pixel| pixel.taken() > 0);
    if denoise && is_whole {
        let noisy = NoisyPicture::of_film(film).map_err(alhazen::DenoiseFilmError::from)?;
        return Ok(Denoiser::default().run_on(&noisy)?.picture);
    }
    let mut picture = film.to_image();
    if let (false, Some(below)) = (is_whole, below) {
        let (width, height) = (film.width(), film.height());
        let pixels = film.pixels().iter().zip(picture.data_mut().chunks_exact_mut(3));
        for (index, (_, c)) in pixels.enumerate().filter(|(_, (pixel, _))| pixel.taken() == 0) {
            let [x, y] = [index as u32 % width, index as u32 / width];
            c.copy_from_slice(&below.rgb(x * below.width() / width, y * below.height() / height));
        }
    }
    Ok(picture)
}
