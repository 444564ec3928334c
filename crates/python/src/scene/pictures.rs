//! Pictures of a scene.

use super::Scene;
use crate::arrays::{matrices, square};
use crate::camera::coefficients;
use crate::part::{Part, render_part};
use crate::render::{Settings, render};
use crate::sensors;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::PathBuf;

#[pymethods]
impl Scene {
    /// Renders a picture.
    ///
    /// Other Python threads run meanwhile; KeyboardInterrupt and an exception in `progress` stop it.
    ///
    /// Parameters
    /// ----------
    /// width, height : int, optional
    ///     Pixels. What is missing follows from the scene or the camera's aspect.
    /// spp : int, optional
    ///     Samples per pixel; what the scene says, or 64.
    /// camera : Camera, int or str, optional
    ///     A camera, or one of the scene's by number or name.
    /// aovs : sequence of str
    ///     Auxiliary layers: depth (metres along the ray), position, normal, geometric-normal, uv, albedo, material, instance,
    ///     primitive, samples, standard-error; on the CPU also cryptomatte-object and cryptomatte-material, an array of
    ///     6 ranks of (id, share of the pixel's samples).
    /// seed : int, default 0
    ///     Changes the noise.
    /// integrator : str, optional
    ///     How light is transported: "path", "direct" or another that `alhazen render --help` lists; what the scene says, or
    ///     "path".
    /// max_depth : int, optional
    ///     Longest path: 1 is emission, 2 direct light.
    /// mis : {"power", "balance", "light", "bsdf"}, default "power"
    ///     How the two ways to find light are weighted: by the power or the balance heuristic, or samples of lights or of
    ///     BSDFs alone. Changes the noise, not the expected picture. For "path" only.
    /// clamp_indirect : float, optional
    ///     The most that indirect light adds to a sample each time that a path finds some: removes bright specks, and light
    ///     with them. For "path" only; the picture is biased.
    /// caustics : {"off", "on", "auto"}, optional
    ///     Photons for light that comes by mirrors or through glass; "auto" looks whether the scene has such surfaces and
    ///     small lights. For "path" on the CPU only. By default what the scene's file says, or "off".
    /// guiding : {"off", "on", "auto"}, optional
    ///     Whether paths follow what training paths have learned of the light before the picture; "auto": where the training
    ///     says that it is worth its time. The expected picture is the same. For "path" on the CPU only. By default what the
    ///     scene's file says, or "off".
    /// ambient_distance : float, optional
    ///     How far occluders count in ambient occlusion, in metres; 0 or not given: everything counts.
    /// sampler : {"sobol", "independent"}, default "sobol"
    /// crop : sequence of 4 int, optional
    ///     Render only this part: x, y, width, height in pixels from the upper left.
    /// first_sample : int, default 0
    ///     Number of the first sample, so that pictures of the same seed can be averaged.
    /// time : float, default 0
    ///     Seconds; cameras of scene files move.
    /// time_limit : float, optional
    ///     Stop after so many seconds.
    /// noise : float, optional
    ///     Stop when the relative standard error of the picture is below this.
    /// backend : str, default "auto"
    ///     auto (a GPU if there is a real one), cpu, gpu, gpu-bvh, gpu-query, gpu-pipeline, all; see `backends`.
    /// adapter : str, optional
    ///     Part of the GPU's name.
    /// threads : int, optional
    ///     Threads of the CPU; all cores if not given.
    /// progress : callable, optional
    ///     Called now and then with the share that is done, from 0 to 1.
    ///
    /// Returns
    /// -------
    /// Picture
    ///     A dict: "color" is float32 of shape (height, width, 3), linear radiance; each auxiliary layer is an array of shape
    ///     (height, width) or (height, width, channels) by its name: float32, or int32 for ids (-1: nothing was hit) and counts.
    ///     Row 0 is at the top.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     For values that cannot be rendered.
    /// BackendError
    ///     If the back end is not there, cannot hold the scene, or fails.
    #[pyo3(signature = (
        width=None, height=None, spp=None, *, camera=None, aovs=Vec::new(), seed=0, integrator=None, max_depth=None,
        mis="power".into(), clamp_indirect=None, caustics=None, guiding=None, ambient_distance=None, sampler="sobol".into(), crop=None,
        first_sample=0, time=0.0,
        time_limit=None, noise=None, backend="auto".into(), adapter=None, threads=None, progress=None
    ))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        width: Option<u32>,
        height: Option<u32>,
        spp: Option<u32>,
        camera: Option<Bound<'py, PyAny>>,
        aovs: Vec<String>,
        seed: u32,
        integrator: Option<String>,
        max_depth: Option<u32>,
        mis: String,
        clamp_indirect: Option<f32>,
        caustics: Option<String>,
        guiding: Option<String>,
        ambient_distance: Option<f32>,
        sampler: String,
        crop: Option<[u32; 4]>,
        first_sample: u32,
        time: f32,
        time_limit: Option<f64>,
        noise: Option<f64>,
        backend: String,
        adapter: Option<String>,
        threads: Option<usize>,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        #[rustfmt::skip]
        let settings = Settings {
    width, height, spp, camera, aovs, seed, integrator, max_depth, mis, clamp_indirect, caustics, ambient_distance, sampler, crop, guiding,
            first_sample, time, time_limit, noise, backend, adapter, threads, progress,
        };
        render(py, self, &settings)
    }

    /// Renders a part of a picture, to be added up with others by `merge`.
    ///
    /// Parameters
    /// ----------
    /// width, height, spp : int, optional
    ///     Of the whole picture, as for `render`.
    /// tile : str, optional
    ///     Such as "1/4": the first of four tiles. All pixels if not given.
    /// samples : tuple of 2 int, optional
    ///     Numbers of the samples: from the first up to, but not including, the second. All if not given.
    /// frame : int, optional
    ///     Number of the picture in a sequence: parts of different frames do not merge.
    /// **settings
    ///     camera, aovs, seed, integrator, max_depth, mis, clamp_indirect, ambient_distance, sampler, crop, time, backend, adapter,
    ///     threads and progress, as for `render`.
    ///
    /// Returns
    /// -------
    /// Part
    #[pyo3(signature = (width=None, height=None, spp=None, *, tile=None, samples=None, frame=None, **settings))]
    fn render_part<'py>(
        &self,
        py: Python<'py>,
        width: Option<u32>,
        height: Option<u32>,
        spp: Option<u32>,
        tile: Option<String>,
        samples: Option<(u32, u32)>,
        frame: Option<u32>,
        settings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Part> {
        let settings = Settings::from_keywords([width, height, spp], settings)?;
        render_part(py, self, &settings, tile.as_deref(), samples, frame)
    }

    /// Writes a data set: for each pose a picture, exact layers, and annotations as COCO has them.
    ///
    /// Parameters
    /// ----------
    /// folder : str or os.PathLike
    ///     Made if need be; gets images/*.png, layers/*.exr and annotations.json, the last when all is done.
    /// width, height : int
    ///     Pixels.
    /// matrix : array_like, shape (3, 3)
    ///     Intrinsics as OpenCV has them, in pixels.
    /// poses : array_like, shape (n, 4, 4)
    ///     Camera to world for each picture, with OpenCV's camera axes.
    /// distortion : array_like, optional
    ///     Coefficients of the lens, and whether they are those of a `fisheye`; see `Camera.from_opencv`.
    /// fisheye : bool, default False
    /// moves : dict of str to array_like, shape (n, 4, 4), optional
    ///     Object to world, for each picture, of instances that move, by name.
    /// categories : dict of str to str, optional
    ///     Categories by instance name; all others are called as their mesh is.
    /// spp : int, optional
    ///     Samples per pixel; what the scene says, or 64.
    /// seed : int, default 0
    /// backend : str, default "auto"
    /// progress : callable, optional
    ///     Called now and then with the share that is done, from 0 to 1.
    ///
    /// Returns
    /// -------
    /// int
    ///     Number of annotated objects in all pictures.
    #[pyo3(signature = (
        folder, width, height, *, matrix, poses, distortion=None, fisheye=false, moves=BTreeMap::new(), categories=BTreeMap::new(), spp=None, seed=0,
        backend="auto".into(), progress=None
    ))]
    fn write_dataset<'py>(
        &self,
        py: Python<'py>,
        folder: PathBuf,
        width: u32,
        height: u32,
        matrix: &Bound<'py, PyAny>,
        poses: &Bound<'py, PyAny>,
        distortion: Option<&Bound<'py, PyAny>>,
        fisheye: bool,
        moves: BTreeMap<String, Bound<'py, PyAny>>,
        categories: BTreeMap<String, String>,
        spp: Option<u32>,
        seed: u32,
        backend: String,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<usize> {
        let moves = moves.into_iter().map(|(name, m)| Ok((name, matrices("moves", &m)?)));
        let wanted = sensors::Wanted {
            folder,
            width,
            height,
            matrix: square("matrix", matrix)?,
            distortion: coefficients(distortion)?,
            fisheye,
            poses: matrices("poses", poses)?,
            moves: moves.collect::<PyResult<_>>()?,
            categories,
            spp,
            seed,
            backend,
            progress,
        };
        sensors::write_dataset(py, self, wanted)
    }
}
