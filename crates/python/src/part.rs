//! Parts of a picture, to be made apart and added up.

use crate::errors::{PartError, bad, chain, render_error};
use crate::protect;
use crate::render::{self, Settings, layers};
use crate::scene::{Scene, lock};
use crate::watch::watch;
use alhazen::{
    Control, Description, Merger, Part as ScenePart, PartError as SceneError, PartJob, RenderPartError, Tile,
    finish,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;

/// Python's exception for a part that does not do.
fn part_error(error: SceneError) -> PyErr {
    PartError::new_err(chain(&error))
}

fn render_part_error(error: RenderPartError) -> PyErr {
    match error {
        RenderPartError::Backend(error) => render_error(error),
        RenderPartError::Part(error) => part_error(error),
        _ => bad(chain(&error)),
    }
}

/// A part of a picture: exact sums of some of its samples, and of what picture they are.
///
/// Parts that belong together add up to the picture made whole, bit for bit, in any order. A part can be sent to another
/// process: it can be pickled.
#[pyclass(frozen, module = "alhazen")]
pub struct Part(ScenePart);

#[pymethods]
impl Part {
    /// Reads a part from an .exr file that `save` or ``alhazen render --part`` wrote.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    #[staticmethod]
    fn load(py: Python, path: PathBuf) -> PyResult<Self> {
        py.detach(|| ScenePart::read(&path)).map(Self).map_err(part_error)
    }

    /// The inverse of `to_bytes`.
    ///
    /// Parameters
    /// ----------
    /// data : bytes
    #[staticmethod]
    fn from_bytes(py: Python, data: &[u8]) -> PyResult<Self> {
        py.detach(|| ScenePart::from_bytes("the part", data)).map(Self).map_err(part_error)
    }

    /// The bytes of the file that `save` writes.
    ///
    /// Returns
    /// -------
    /// bytes
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| self.0.to_bytes()).map_err(part_error)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes an .exr file that ``alhazen merge`` and `load` read.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    fn save(&self, py: Python, path: PathBuf) -> PyResult<()> {
        protect::check(&path)?;
        py.detach(|| self.0.write(&path)).map_err(part_error)
    }

    /// Whether no sample of the picture is missing: bool.
    #[getter]
    fn is_complete(&self) -> bool {
        self.0.missing().is_empty()
    }

    /// The finished picture.
    ///
    /// Parameters
    /// ----------
    /// allow_missing : bool, default False
    ///     Whether samples may be missing. Pixels without any are black.
    ///
    /// Returns
    /// -------
    /// Picture
    ///
    /// Raises
    /// ------
    /// PartError
    ///     If samples are missing.
    #[pyo3(signature = (*, allow_missing=false))]
    fn picture<'py>(&self, py: Python<'py>, allow_missing: bool) -> PyResult<Bound<'py, PyAny>> {
        if !(allow_missing || self.is_complete()) {
            return Err(PartError::new_err("the picture is not complete: tiles or samples are missing"));
        }
        let about = PyDict::new(py);
        about.set_item("seconds", self.0.render_time.as_secs_f64())?;
        about.set_item("backend", self.0.backends.iter().cloned().collect::<Vec<_>>().join(", "))?;
        let film = py.detach(|| finish(self.0.clone())).map_err(part_error)?.0;
        about.set_item("spp", film.pixels().iter().map(alhazen::PixelStats::count).min().unwrap_or(0))?;
        about.set_item("noise", film.relative_error())?;
        about.set_item("invalid_samples", film.invalid_samples())?;
        render::picture(py, layers(py, &film)?, &about)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((py.get_type::<Self>().getattr("from_bytes")?, (self.to_bytes(py)?,)))
    }

    fn __repr__(&self) -> String {
        let (film, whole) = (self.0.film(), self.0.whole());
        let state = if self.is_complete() { "complete" } else { "incomplete" };
        format!(
            "<Part of {}×{} pixels with {} samples, {state}>",
            film.width(),
            film.height(),
            whole.samples.len()
        )
    }
}

/// Adds up parts of a picture, in any order.
///
/// Parameters
/// ----------
/// parts : iterable of Part
///
/// Returns
/// -------
/// Part
///
/// Raises
/// ------
/// PartError
///     If parts do not belong to the same picture, or have samples in common; the text names what is different.
#[pyfunction]
pub fn merge(parts: &Bound<PyAny>) -> PyResult<Part> {
    let mut merger = Merger::new();
    for (number, part) in parts.try_iter()?.enumerate() {
        let part = part?;
        let part = part.cast::<Part>().map_err(|_| bad(format!("parts: number {number} is no Part")))?;
        merger.add(&format!("part {number}"), part.get().0.clone()).map_err(part_error)?;
    }
    merger.finish().map(Part).map_err(part_error)
}

/// Renders a part of a picture.
pub fn render_part(
    py: Python,
    scene: &Scene,
    settings: &Settings,
    tile: Option<&str>,
    samples: Option<(u32, u32)>,
    frame: Option<u32>,
) -> PyResult<Part> {
    let options = render::renderer_options(settings)?;
    let tile = tile.map(|t| t.parse::<Tile>().map_err(|e| bad(e.to_string()))).transpose()?;
    let (job, limits, description) = {
        let contents = scene.contents(py);
        let scene = &contents.scene;
        let description = Description::new(&scene.name, &[], scene);
        (render::job(scene, settings)?, render::limits(scene, settings)?, description)
    };
    let part_job = PartJob {
        tile,
        samples: samples.map(|(a, b)| a..b),
        time: settings.time,
        frame,
        ..PartJob::whole(&job, limits.spp, &description)
    };
    let share = part_job.share().map_err(render_part_error)?;
    let mut prepared = lock(py, &scene.prepared);
    let control = Control::new();
    let renderer = render::prepare(py, scene, &mut prepared, options, &control)?;
    let total = (share.window.area() * share.samples.len()).max(1) as f64;
    let fraction = || control.progress().samples_done as f64 / total;
    let part = watch(py, &control, settings.progress.as_ref(), fraction, || {
        renderer.render_part(&part_job, None, &control, None)
    })?;
    part.map(|(part, _)| Part(part)).map_err(render_part_error)
}
