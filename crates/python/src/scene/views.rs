//! Many pictures of a scene in one call, and moving many instances in one.

use super::Scene;
use crate::arrays::{Input, affine_of, shown};
use crate::errors::bad;
use crate::render::Settings;
use crate::views::{Wanted, render_views};
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pymethods]
impl Scene {
    /// Renders the pictures of many cameras in one go.
    ///
    /// The scene is moved to the device once, shaders are compiled once, and what is there is kept for the next call: a call
    /// with other poses costs what the pixels cost. Each view has the values that it has alone.
    ///
    /// Parameters
    /// ----------
    /// poses : array_like, shape (n, 4, 4)
    ///     Camera to world for each view, a rotation and a translation in metres, last row 0, 0, 0, 1.
    /// intrinsics : array_like, shape (3, 3) or (n, 3, 3), or float or shape (n,)
    ///     As OpenCV has them, in pixels, pixel centres at whole numbers; or full vertical fields of view, radians.
    /// width, height : int or sequence of n int
    ///     Pixels. With sequences each view has its own size, and each layer is a list of arrays.
    /// layers : sequence of str, default ("rgb",)
    ///     "rgb": linear radiance by the integrator. Exact values at the centres of pixels: "depth" (metres along the camera's
    ///     axis), "normal" (shading normal, world space), "position" (metres), "albedo", "flow" (pixels to the right and down
    ///     to where the next pose shows it, NaN where it does not), "instance", "material", "primitive" (ids, -1: nothing).
    /// spp : int, optional
    ///     Samples per pixel of "rgb"; what the scene says, or 64.
    /// integrator : str, optional
    ///     Of "rgb": "path", "direct", "aov" or "ao"; what the scene says, or "path".
    /// max_depth : int, optional
    ///     Longest path: 1 is emission, 2 direct light.
    /// next_poses : array_like, shape (n, 4, 4), optional
    ///     For "flow": where each camera is in the next picture.
    /// axes : {"opencv", "opengl"}, default "opencv"
    ///     The cameras' axes: x right, y down, z into the picture; or x right, y up, z out of it.
    /// seed : int, default 0
    /// sampler : {"sobol", "independent", "blue-noise"}, default "sobol"
    /// backend, adapter, threads, progress
    ///     As for `render`.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray
    ///     By layer: float32 of shape (n, height, width) or (n, height, width, channels), int32 for ids. Row 0 is at the
    ///     top. ``torch.from_dlpack`` and its like take the arrays without a copy.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     For wrong shapes and values; the text says what was expected and which view is wrong.
    /// BackendError
    ///     If the back end is not there, cannot hold the scene, or fails.
    #[pyo3(signature = (
        poses, intrinsics, width, height, *, layers=vec!["rgb".to_owned()], spp=None, integrator=None, max_depth=None,
        next_poses=None, axes="opencv".into(), seed=0, sampler="sobol".into(), backend="auto".into(), adapter=None,
        threads=None, progress=None
    ))]
    #[allow(clippy::too_many_arguments, reason = "keywords in Python")]
    fn render_views<'py>(
        &self,
        py: Python<'py>,
        poses: Bound<'py, PyAny>,
        intrinsics: Bound<'py, PyAny>,
        width: Bound<'py, PyAny>,
        height: Bound<'py, PyAny>,
        layers: Vec<String>,
        spp: Option<u32>,
        integrator: Option<String>,
        max_depth: Option<u32>,
        next_poses: Option<Bound<'py, PyAny>>,
        axes: String,
        seed: u32,
        sampler: String,
        backend: String,
        adapter: Option<String>,
        threads: Option<usize>,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let usual = Settings::from_keywords([None, None, spp], None)?;
        #[rustfmt::skip]
        let settings = Settings { integrator, max_depth, seed, sampler, backend, adapter, threads, progress, ..usual };
        let wanted = Wanted { poses, intrinsics, width, height, layers, next_poses, axes };
        render_views(py, self, &wanted, &settings)
    }

    /// Moves many instances at once.
    ///
    /// Parameters
    /// ----------
    /// transforms : array_like, shape (n, 3, 4) or (n, 4, 4)
    ///     Object to world, of each instance.
    /// instances : array_like, int, shape (n,), optional
    ///     What `add_instance` returned; if not given, all instances in their order.
    #[pyo3(signature = (transforms, instances=None))]
    fn set_transforms(
        &self,
        py: Python,
        transforms: &Bound<PyAny>,
        instances: Option<&Bound<PyAny>>,
    ) -> PyResult<()> {
        let input = Input::<f64>::new("transforms", transforms)?;
        let [count, rows @ (3 | 4), 4] = *input.shape() else {
            let got = shown(input.shape());
            return Err(bad(format!("transforms: expected the shape (n, 3, 4) or (n, 4, 4), got {got}")));
        };
        let matrices = input.numbers()?.chunks_exact(4 * rows).enumerate();
        let moved =
            matrices.map(|(i, m)| affine_of(m).map_err(|why| bad(format!("transforms: matrix {i}: {why}"))));
        let moved = moved.collect::<PyResult<Vec<_>>>()?;
        let numbers = instances.map(|i| Input::<i64>::new("instances", i)).transpose()?;
        let numbers = numbers.as_ref().map(Input::numbers).transpose()?;
        self.change(py, |scene| {
            let all = scene.instances.len();
            let expected = numbers.map_or(all, <[i64]>::len);
            if expected != count {
                return Err(bad(format!("transforms: {count} matrices for {expected} instances")));
            }
            let place =
                |i: usize| numbers.map_or(Some(i), |n| usize::try_from(n[i]).ok().filter(|p| *p < all));
            let places: Vec<Option<usize>> = (0..count).map(place).collect();
            if let Some(i) = places.iter().position(Option::is_none) {
                let wrong = numbers.map_or(0, |n| n[i]);
                return Err(bad(format!("instances: {wrong} of only {all}")));
            }
            for (place, transform) in places.into_iter().flatten().zip(moved) {
                scene.instances[place].transform = transform;
            }
            Ok(())
        })
    }
}
