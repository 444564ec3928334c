//! `alhazen.denoise`: pictures without their noise.

use crate::arrays::output;
use crate::errors::bad;
use crate::render::rgb_image;
use alhazen::{Denoiser, Image, NoisyPicture};
use pyo3::prelude::*;

/// Removes the noise of a picture with the renderer's network.
///
/// Layers that are not given are not known: textures blur without `albedo`, edges between surfaces of one colour without
/// `normal`. NaN and infinite values count as 0.
///
/// Parameters
/// ----------
/// color : array_like, float32, shape (height, width, 3)
///     Linear radiance.
/// albedo : array_like, float32, shape (height, width, 3), optional
///     Albedo of what is seen first, in [0, 1]: the layer "albedo".
/// normal : array_like, float32, shape (height, width, 3), optional
///     Its shading normal, in world space: the layer "normal".
/// error : array_like, float32, shape (height, width, 3), optional
///     Standard error of `color`: the layer "standard-error". Not of pictures with one sample per pixel, where it is 0.
///
/// Returns
/// -------
/// ndarray, float32, shape (height, width, 3)
///     Linear radiance. The mean of each colour is that of `color`.
///
/// Raises
/// ------
/// ValueError
///     If an array has another shape.
#[pyfunction]
#[pyo3(signature = (color, *, albedo=None, normal=None, error=None))]
pub fn denoise<'py>(
    py: Python<'py>,
    color: &Bound<'py, PyAny>,
    albedo: Option<&Bound<'py, PyAny>>,
    normal: Option<&Bound<'py, PyAny>>,
    error: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let finite = |image: Image| image.map(|value| if value.is_finite() { value } else { 0.0 });
    let colour = finite(rgb_image("color", color)?);
    let (width, height) = (colour.width(), colour.height());
    let layer = |name, values: Option<&Bound<'py, PyAny>>| match values {
        Some(values) => Ok(finite(rgb_image(name, values)?)),
        None => Ok::<_, PyErr>(Image::black(width, height, 3)),
    };
    let (albedo, normal) = (layer("albedo", albedo)?, layer("normal", normal)?);
    let variance = error.map(|error| Ok::<_, PyErr>(finite(rgb_image("error", error)?).map(|e| e * e)));
    let noisy = NoisyPicture { colour, variance: variance.transpose()?, albedo, normal };
    let denoised = py.detach(|| Denoiser::Network.run_on(&noisy)).map_err(|e| bad(e.to_string()))?;
    output(py, denoised.picture.into_data(), &[height as usize, width as usize, 3])
}
