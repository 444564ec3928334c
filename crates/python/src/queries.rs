//! What rays hit, as arrays.

use crate::arrays::{Input, output};
use crate::errors::bad;
use crate::watch::watch;
use alhazen::{Coherence, Control, Hits as SceneHits, RayQueries, Rays};
use pyo3::prelude::*;

/// Nearest hits of many rays. Arrays have the shape of the rays' arrays without the last axis, here (...).
#[pyclass(frozen, module = "alhazen")]
pub struct Hits {
    /// float32, shape (...): distance in units of the ray's direction; infinite for a miss.
    #[pyo3(get)]
    t: Py<PyAny>,
    /// int32, shape (...): number of the triangle in its mesh, or of the sphere among its spheres; -1 for a miss.
    #[pyo3(get)]
    triangle: Py<PyAny>,
    /// int32, shape (...): index of the instance; -1 for a miss.
    #[pyo3(get)]
    instance: Py<PyAny>,
    /// float32, shape (..., 2): barycentric weights of the triangle's second and third vertex; zero for spheres and misses.
    #[pyo3(get)]
    barycentrics: Py<PyAny>,
    /// float32, shape (..., 3): unit normals of the geometry in world space, on the side that the winding faces, whatever side
    /// the ray came from; zero for a miss. None if they were not asked for.
    #[pyo3(get)]
    normals: Option<Py<PyAny>>,
    count: usize,
}

#[pymethods]
impl Hits {
    fn __len__(&self) -> usize {
        self.count
    }

    fn __repr__(&self) -> String {
        format!("<Hits of {} rays>", self.count)
    }
}

impl Hits {
    /// Arrays of the given shape, which take over the numbers.
    fn new(py: Python, hits: SceneHits, shape: &[usize], normals: bool) -> PyResult<Self> {
        let with = |last: usize| [shape, &[last]].concat();
        Ok(Self {
            count: hits.t.len(),
            t: output(py, hits.t, shape)?.unbind(),
            triangle: output(py, hits.primitive, shape)?.unbind(),
            instance: output(py, hits.instance, shape)?.unbind(),
            barycentrics: output(py, hits.barycentrics.into_flattened(), &with(2))?.unbind(),
            normals: match normals {
                true => Some(output(py, hits.normals.into_flattened(), &with(3))?.unbind()),
                false => None,
            },
        })
    }
}

/// Rays as a caller gives them.
pub struct RayArrays<'py> {
    origins: Input<'py, f32>,
    directions: Input<'py, f32>,
    t_min: f32,
    t_max: f32,
    coherent: bool,
}

/// From so many rays on, a call looks for Ctrl-C while it works; below, it is over before anyone could press it.
const MANY: usize = 1 << 17;

impl<'py> RayArrays<'py> {
    /// Arrays of shape (..., 3).
    pub fn new(
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: f32,
        t_max: f32,
        coherent: bool,
    ) -> PyResult<Self> {
        let rays = Self {
            origins: Input::new("origins", origins)?,
            directions: Input::new("directions", directions)?,
            t_min,
            t_max,
            coherent,
        };
        let (a, b) = (rays.origins.shape(), rays.directions.shape());
        if a != b || a.last() != Some(&3) {
            return Err(bad(format!(
                "origins and directions: expected two arrays of one shape (..., 3), got {a:?} and {b:?}"
            )));
        }
        if t_min.is_nan() || t_max.is_nan() {
            return Err(bad("t_min and t_max must be numbers"));
        }
        Ok(rays)
    }

    fn rays(&self) -> PyResult<Rays<'_>> {
        let (origins, directions) =
            (self.origins.numbers()?.as_chunks().0, self.directions.numbers()?.as_chunks().0);
        let coherence = if self.coherent { Coherence::Coherent } else { Coherence::Incoherent };
        Ok(Rays { origins, directions, t_min: self.t_min, t_max: self.t_max, coherence })
    }

    fn shape(&self) -> &[usize] {
        self.origins.shape().split_last().map_or(&[], |(_, rest)| rest)
    }

    /// What the rays hit.
    pub fn intersect(&self, py: Python, queries: &RayQueries, normals: bool) -> PyResult<Hits> {
        let rays = self.rays()?;
        let hits = traced(py, rays.len(), |control| queries.intersect(&rays, normals, control))?;
        Hits::new(py, hits, self.shape(), normals)
    }

    /// Whether they hit anything.
    pub fn occluded(&self, py: Python<'py>, queries: &RayQueries) -> PyResult<Bound<'py, PyAny>> {
        let rays = self.rays()?;
        let occluded = traced(py, rays.len(), |control| queries.occluded(&rays, control))?;
        output(py, occluded, self.shape())
    }
}

/// Traces without the interpreter's lock.
fn traced<T: Send>(py: Python, count: usize, trace: impl FnOnce(&Control) -> T + Send) -> PyResult<T> {
    let control = Control::new();
    if count < MANY {
        return Ok(py.detach(|| trace(&control)));
    }
    watch(py, &control, None, || 0.0, || trace(&control))
}
