//! `alhazen.denoise` and `alhazen.SequenceDenoiser`: pictures and sequences without their noise.

use crate::arrays::{Input, output};
use crate::errors::bad;
use crate::render::rgb_image;
use alhazen::{DenoiseFilmError, Denoiser, Frame, History, Image, NoisyPicture, Surface};
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
///     Shading normal, in world space: the layer "denoising-normal", which sees through glass, or "normal".
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
    let noisy = noisy_picture(color, albedo, normal, error)?;
    let shape = [noisy.colour.height() as usize, noisy.colour.width() as usize, 3];
    let denoised = py.detach(|| Denoiser::Network.run_on(&noisy)).map_err(|e| bad(e.to_string()))?;
    output(py, denoised.picture.into_data(), &shape)
}

/// A picture from arrays, where what is not finite counts as 0.
fn noisy_picture<'py>(
    color: &Bound<'py, PyAny>,
    albedo: Option<&Bound<'py, PyAny>>,
    normal: Option<&Bound<'py, PyAny>>,
    error: Option<&Bound<'py, PyAny>>,
) -> PyResult<NoisyPicture> {
    let finite = |image: Image| image.map(|value| if value.is_finite() { value } else { 0.0 });
    let colour = finite(rgb_image("color", color)?);
    let (width, height) = (colour.width(), colour.height());
    let layer = |name, values: Option<&Bound<'py, PyAny>>| match values {
        Some(values) => Ok(finite(rgb_image(name, values)?)),
        None => Ok::<_, PyErr>(Image::black(width, height, 3)),
    };
    let (albedo, normal) = (layer("albedo", albedo)?, layer("normal", normal)?);
    let variance = error.map(|error| Ok::<_, PyErr>(finite(rgb_image("error", error)?).map(|e| e * e)));
    Ok(NoisyPicture { colour, variance: variance.transpose()?, albedo, normal })
}

/// Denoises the frames of a sequence, each with what those before have found.
///
/// The light of earlier frames is looked up where it was and counts as far as it agrees with the new frame. The result
/// flickers less and is cleaner than frame by frame. Give each frame a `seed` of its own: equal noise does not add up.
#[pyclass(module = "alhazen", name = "SequenceDenoiser")]
#[derive(Default)]
pub struct SequenceDenoiser {
    history: History,
}

#[pymethods]
impl SequenceDenoiser {
    /// A denoiser that has seen no frame.
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Removes the noise of the next frame.
    ///
    /// Parameters
    /// ----------
    /// color : array_like, float32, shape (height, width, 3)
    ///     Linear radiance.
    /// albedo, normal, error : array_like, float32, shape (height, width, 3), optional
    ///     As `alhazen.denoise` takes them.
    /// motion : array_like, float32, shape (height, width, 2) or (height, width, 3), optional
    ///     Where what a pixel shows was in the last frame, relative to the pixel: pixels to the right and down; NaN where that
    ///     is not known. It is the "flow" of `Scene.observe` with the last frame's camera as `next_camera`. The third
    ///     number is its distance from the camera then, in metres. Without it, nothing has moved.
    /// distance : array_like, float32, shape (height, width), optional
    ///     Distance from the camera in metres, for the next frame to compare with; 0 and infinity are the sky.
    /// ids : array_like, uint32, shape (height, width), optional
    ///     Whose surface it is, such as the layer "instance": the history is that of equal numbers.
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
    #[pyo3(signature = (color, *, albedo=None, normal=None, error=None, motion=None, distance=None, ids=None))]
    #[allow(clippy::too_many_arguments, reason = "Python names them")]
    fn denoise<'py>(
        &mut self,
        py: Python<'py>,
        color: &Bound<'py, PyAny>,
        albedo: Option<&Bound<'py, PyAny>>,
        normal: Option<&Bound<'py, PyAny>>,
        error: Option<&Bound<'py, PyAny>>,
        motion: Option<&Bound<'py, PyAny>>,
        distance: Option<&Bound<'py, PyAny>>,
        ids: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let noisy = noisy_picture(color, albedo, normal, error)?;
        let size = [noisy.colour.height() as usize, noisy.colour.width() as usize];
        let surfaces = surfaces(size, motion, distance, ids)?;
        let frame = Frame { noisy: &noisy, surfaces: &surfaces };
        let filter =
            |combined: &NoisyPicture| Denoiser::Network.run_on(combined).map(|denoised| denoised.picture);
        let picture = py.detach(|| self.history.denoise::<DenoiseFilmError>(frame, filter));
        let picture = picture.map_err(|e| bad(e.to_string()))?;
        output(py, picture.into_data(), &[size[0], size[1], 3])
    }
}

/// What the pixels of a frame see, of `[height, width]` pixels.
fn surfaces(
    size: [usize; 2],
    motion: Option<&Bound<PyAny>>,
    distance: Option<&Bound<PyAny>>,
    ids: Option<&Bound<PyAny>>,
) -> PyResult<Vec<Surface>> {
    let unknown = Surface { back: [0.0; 2], distance_before: f32::NAN, distance: f32::NAN, ids: [0; 2] };
    let mut surfaces = vec![unknown; size[0] * size[1]];
    let wrong = |name, shape: &[usize]| {
        bad(format!(
            "{name} has the shape {shape:?}, but the picture has {} rows and {} columns",
            size[0], size[1]
        ))
    };
    if let Some(motion) = motion {
        let motion = Input::<f32>::new("motion", motion)?;
        let [height, width, numbers @ (2 | 3)] = *motion.shape() else {
            return Err(wrong("motion", motion.shape()));
        };
        if [height, width] != size {
            return Err(wrong("motion", motion.shape()));
        }
        for (surface, values) in surfaces.iter_mut().zip(motion.numbers()?.chunks_exact(numbers)) {
            surface.back = [values[0], values[1]];
            surface.distance_before = values.get(2).map_or(f32::NAN, |d| as_distance(*d));
        }
    }
    if let Some(distance) = distance {
        let distance = Input::<f32>::new("distance", distance)?;
        if *distance.shape() != size {
            return Err(wrong("distance", distance.shape()));
        }
        surfaces.iter_mut().zip(distance.numbers()?).for_each(|(s, d)| s.distance = as_distance(*d));
    }
    if let Some(ids) = ids {
        let ids = Input::<u32>::new("ids", ids)?;
        if *ids.shape() != size {
            return Err(wrong("ids", ids.shape()));
        }
        surfaces.iter_mut().zip(ids.numbers()?).for_each(|(s, id)| s.ids = [*id, 0]);
    }
    if motion.is_none() {
        surfaces.iter_mut().for_each(|s| s.distance_before = s.distance);
    }
    Ok(surfaces)
}

/// The layer "depth" has 0 where there is only sky.
fn as_distance(value: f32) -> f32 {
    if value > 0.0 || value.is_nan() { value } else { f32::INFINITY }
}
