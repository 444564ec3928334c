//! Asking a scene what rays meet.

use super::Scene;
use crate::camera::Camera;
use crate::errors::bad;
use crate::queries::{Hits, RayArrays};
use crate::render::{Settings, job};
use crate::sensors;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

#[pymethods]
impl Scene {
    /// Finds the nearest hit of each ray, on all cores.
    ///
    /// Arrays that are float32 and contiguous are read where they are. Surfaces with holes (alpha) let rays through there.
    ///
    /// Parameters
    /// ----------
    /// origins, directions : array_like, float32, shape (..., 3)
    ///     World space, metres. Directions may have any length but zero; distances are in units of it. A ray with a number that
    ///     is not finite misses everything.
    /// t_min, t_max : float
    ///     Hits must lie between these distances.
    /// normals : bool, default True
    ///     Whether `Hits.normals` is wanted, which costs some time.
    /// coherent : bool, default False
    ///     Whether neighbours in the array are alike, as camera rays are. Affects speed only.
    ///
    /// Returns
    /// -------
    /// Hits
    #[pyo3(signature = (origins, directions, *, t_min=0.0, t_max=f32::INFINITY, normals=true, coherent=false))]
    fn intersect(
        &self,
        py: Python,
        origins: &Bound<PyAny>,
        directions: &Bound<PyAny>,
        t_min: f32,
        t_max: f32,
        normals: bool,
        coherent: bool,
    ) -> PyResult<Hits> {
        let rays = RayArrays::new(origins, directions, t_min, t_max, coherent)?;
        rays.intersect(py, &*self.queries(py)?, normals)
    }

    /// Finds out whether each ray hits anything, on all cores; faster than `intersect`.
    ///
    /// Parameters
    /// ----------
    /// origins, directions : array_like, float32, shape (..., 3)
    ///     As for `intersect`. For visibility between two points give their difference as direction and ``t_max=1``.
    /// t_min, t_max : float
    ///     Hits must lie between these distances.
    /// coherent : bool, default False
    ///     Whether neighbours in the array are alike.
    ///
    /// Returns
    /// -------
    /// ndarray, bool, shape (...)
    #[pyo3(signature = (origins, directions, *, t_min=0.0, t_max=f32::INFINITY, coherent=false))]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: f32,
        t_max: f32,
        coherent: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let rays = RayArrays::new(origins, directions, t_min, t_max, coherent)?;
        rays.occluded(py, &*self.queries(py)?)
    }

    /// Makes a sample of a pixel again, and says what its paths did, vertex by vertex.
    ///
    /// The sample is that of a picture by `path` on the CPU, bit for bit, with the same settings.
    ///
    /// Parameters
    /// ----------
    /// x, y : int
    ///     The pixel: column and row, from the upper left.
    /// sample : int, default 0
    ///     Index of the sample.
    /// width, height : int, optional
    ///     Of the picture, pixels.
    /// **settings
    ///     camera, seed, max_depth, mis, clamp_indirect, sampler and time, as for `render`.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``radiance``, and for each path of ``paths`` its ``vertices`` (surface, light found, light sample, scattering: with
    ///     densities, weights and what each adds) and why it ends. See ``docs/explain.md``.
    #[pyo3(signature = (x, y, *, sample=0, width=None, height=None, **settings))]
    #[allow(clippy::too_many_arguments, reason = "keywords in Python")]
    fn explain<'py>(
        &self,
        py: Python<'py>,
        x: u32,
        y: u32,
        sample: u32,
        width: Option<u32>,
        height: Option<u32>,
        settings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let settings = Settings::from_keywords([width, height, None], settings)?;
        let view = job(&self.contents(py).scene, &settings)?.view(settings.time);
        let record = self.queries(py)?.replay(&view, [x, y], sample).map_err(|e| bad(e.to_string()))?;
        let text = serde_json::to_string(&record).map_err(|e| bad(e.to_string()))?;
        py.import("json")?.call_method1("loads", (text,))
    }

    /// What an ideal camera would know of each pixel, exact at the pixels' centres.
    ///
    /// Parameters
    /// ----------
    /// camera : Camera
    /// width, height : int
    ///     Pixels.
    /// next_camera : Camera, optional
    ///     The camera at the next frame, for optical flow.
    /// next_transforms : dict of int to array_like, shape (4, 4) or (3, 4), optional
    ///     Where instances will be at the next frame, for optical flow.
    /// categories : dict of str to str, optional
    ///     Categories by instance name; all others are called as their mesh is.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray
    ///     "depth": float32, (height, width), metres along the camera's axis. "position" and "normal": float32, (height, width, 3),
    ///     world space. "flow", with a next frame: float32, (height, width, 2), pixels to the right and down, NaN behind the camera.
    ///     "instance" and "material": int32, (height, width), -1 for nothing. "category": int32, from 1, 0 for nothing.
    #[pyo3(signature = (camera, width, height, *, next_camera=None, next_transforms=None, categories=BTreeMap::new()))]
    fn observe<'py>(
        &self,
        py: Python<'py>,
        camera: &Camera,
        width: u32,
        height: u32,
        next_camera: Option<&Camera>,
        next_transforms: Option<BTreeMap<usize, Bound<'py, PyAny>>>,
        categories: BTreeMap<String, String>,
    ) -> PyResult<Bound<'py, PyDict>> {
        sensors::observe(py, self, camera, (width, height), next_camera, next_transforms, categories)
    }

    /// Boxes around the instances: those of their meshes, moved as they are.
    ///
    /// Returns
    /// -------
    /// centers : ndarray, float32, shape (n, 3)
    ///     World space, metres; NaN for an instance without geometry.
    /// half_axes : ndarray, float32, shape (n, 3, 3)
    ///     For each box, three vectors from the centre to the middles of faces.
    fn boxes<'py>(&self, py: Python<'py>) -> PyResult<[Bound<'py, PyAny>; 2]> {
        sensors::boxes(py, self)
    }
}
