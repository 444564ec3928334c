//! Sensors: a laser scanner, exact layers of a camera, boxes, data sets.

use crate::arrays::{Input, affine, affine_rows, output};
use crate::camera::Camera;
use crate::errors::{bad, chain, choice_error};
use crate::protect;
use crate::scene::Scene;
use crate::watch::watch;
use ::sensors::dataset::{Dataset, Poses};
use ::sensors::{Categories, GroundTruth, Motion, ReturnMode, SensorError, object_box};
use alhazen::{Control, Job, Limits, Renderer, RendererOptions};
use glam::{DAffine3, DMat3, DVec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Python's exception for what a sensor could not do.
fn sensor_error(error: SensorError) -> PyErr {
    match error {
        SensorError::Setting { .. } | SensorError::Camera { .. } | SensorError::UnknownFormat { .. } => {
            bad(chain(&error))
        }
        _ => crate::errors::Error::new_err(chain(&error)),
    }
}

/// A spinning laser scanner.
///
/// The sensor's axes are x forward, y left, z up. It does not move during a turn.
///
/// Parameters
/// ----------
/// channels : int, default 64
///     Number of lasers, at equal angles.
/// elevation : array_like, shape (2,), optional
///     Lowest and highest elevation above the horizon, radians; -25° and 15° if not given.
/// elevations : array_like, shape (n,), optional
///     Elevation of each laser, radians, instead of the two above.
/// azimuths : int, default 1024
///     Firings of a sweep.
/// azimuth : array_like, shape (2,), default (0, 2π)
///     Azimuths between which it measures, radians; 0 is forward, counter-clockwise seen from above.
/// range : array_like, shape (2,), default (0.5, 120)
///     Ranges that are measured, metres. What is nearer blocks the beam.
/// divergence : float, default 0
///     Full angle of a beam, radians.
/// beam_rays : int, default 16
///     Rays that sample a beam with a divergence.
/// returns : {"first", "strongest", "last", "all"}, default "strongest"
///     Which return counts where a beam meets several surfaces.
/// range_resolution : float, default 0.3
///     Surfaces closer to each other than this melt into one return, metres.
/// noise : float, default 0
///     Standard deviation of the range, metres; normally distributed.
/// min_intensity : float, default 0
///     Returns of lower intensity are lost.
/// seed : int, default 0
///     Changes the noise.
#[pyclass(frozen, module = "alhazen")]
pub struct Lidar(::sensors::Lidar);

#[pymethods]
impl Lidar {
    #[new]
    #[pyo3(signature = (
        channels=64, *, elevation=None, elevations=None, azimuths=1024,
        azimuth=None, range=None, divergence=0.0, beam_rays=16,
        returns="strongest", range_resolution=0.3, noise=0.0, min_intensity=0.0, seed=0
    ))]
    fn new(
        channels: u32,
        elevation: Option<&Bound<PyAny>>,
        elevations: Option<&Bound<PyAny>>,
        azimuths: u32,
        azimuth: Option<&Bound<PyAny>>,
        range: Option<&Bound<PyAny>>,
        divergence: f64,
        beam_rays: u32,
        returns: &str,
        range_resolution: f32,
        noise: f32,
        min_intensity: f32,
        seed: u32,
    ) -> PyResult<Self> {
        if channels > u32::from(u16::MAX) {
            return Err(bad(format!("channels: {channels} is not between 1 and 65535")));
        }
        let two = |name, value: Option<&Bound<PyAny>>, default: [f64; 2]| match value {
            Some(value) => Input::<f64>::new(name, value)?.array::<2>(),
            None => Ok(default),
        };
        let [lowest, highest] = two("elevation", elevation, [(-25f64).to_radians(), 15f64.to_radians()])?;
        let [first, end] = two("azimuth", azimuth, [0.0, std::f64::consts::TAU])?;
        let [nearest, farthest] = two("range", range, [0.5, 120.0])?;
        let mut lidar = ::sensors::Lidar::uniform(channels, lowest, highest, azimuths);
        if let Some(elevations) = elevations {
            lidar.elevations = Input::<f64>::new("elevations", elevations)?.numbers()?.to_vec();
        }
        (lidar.first_azimuth, lidar.sweep) = (first, end - first);
        (lidar.min_range, lidar.max_range) = (nearest as f32, farthest as f32);
        lidar.divergence = divergence;
        lidar.beam_rays = if divergence > 0.0 { beam_rays } else { 1 };
        lidar.mode = match returns {
            "first" => ReturnMode::First,
            "strongest" => ReturnMode::Strongest,
            "last" => ReturnMode::Last,
            "all" => ReturnMode::All,
            other => {
                return Err(bad(format!(
                    "returns: unknown `{other}`; there are: first, strongest, last, all"
                )));
            }
        };
        lidar.range_resolution = range_resolution;
        lidar.range_noise = noise;
        lidar.min_intensity = min_intensity;
        lidar.seed = seed;
        Ok(Self(lidar))
    }

    /// Scans a scene.
    ///
    /// Parameters
    /// ----------
    /// scene : Scene
    /// pose : array_like, shape (4, 4) or (3, 4)
    ///     Sensor to world, a rotation and a translation in metres; see `level_pose`.
    ///
    /// Returns
    /// -------
    /// PointCloud
    ///     Firing by firing, the channels of a firing together, several returns of a beam nearest first; beams
    ///     without a return are left out.
    fn scan(&self, py: Python, scene: &Scene, pose: &Bound<PyAny>) -> PyResult<PointCloud> {
        let [x, y, z] = affine_rows("pose", pose)?;
        let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
        let matrix = DMat3::from_cols(column(0), column(1), column(2));
        let pose = DAffine3::from_mat3_translation(matrix, column(3));
        let queries = scene.queries(py)?;
        let control = Control::new();
        let cloud = watch(py, &control, None, || 0.0, || self.0.scan(&queries, &pose, &control))?;
        cloud.map(PointCloud).map_err(sensor_error)
    }

    fn __repr__(&self) -> String {
        format!("Lidar(channels={}, azimuths={})", self.0.elevations.len(), self.0.azimuths)
    }
}

/// The pose of a scanner that stands level in a world with +Y up.
///
/// Parameters
/// ----------
/// position : array_like, shape (3,)
///     Metres.
/// heading : float, default 0
///     Turns it about +Y, counter-clockwise seen from above, radians; 0 looks towards -Z.
///
/// Returns
/// -------
/// ndarray, float64, shape (4, 4)
///     Sensor to world; the sensor's axes are x forward, y left, z up.
#[pyfunction]
#[pyo3(signature = (position, heading=0.0))]
pub fn level_pose<'py>(
    py: Python<'py>,
    position: &Bound<'py, PyAny>,
    heading: f64,
) -> PyResult<Bound<'py, PyAny>> {
    if !heading.is_finite() {
        return Err(bad(format!("heading: {heading} is no angle")));
    }
    let position = Input::<f64>::new("position", position)?.array::<3>()?;
    let pose = ::sensors::level_pose(DVec3::from(position), heading);
    output(py, glam::DMat4::from(pose).transpose().to_cols_array().to_vec(), &[4, 4])
}

/// What a scanner measured. Each attribute makes a new array.
#[pyclass(frozen, module = "alhazen")]
pub struct PointCloud(::sensors::PointCloud);

#[pymethods]
impl PointCloud {
    /// float32, shape (n, 3): positions in the sensor's frame (x forward, y left, z up), metres.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        output(py, self.0.positions.as_flattened().to_vec(), &[self.0.len(), 3])
    }

    /// float32, shape (n,): distance from the sensor, noise included, metres.
    #[getter]
    fn ranges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        output(py, self.0.ranges.clone(), &[self.0.len()])
    }

    /// float32, shape (n,): share of the light that comes back; 1 is a white diffuse surface that faces the sensor, at any
    /// distance.
    #[getter]
    fn intensities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        output(py, self.0.intensities.clone(), &[self.0.len()])
    }

    /// uint16, shape (n,): number of the laser.
    #[getter]
    fn channels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        output(py, self.0.channels.clone(), &[self.0.len()])
    }

    /// uint32, shape (n,): number of the firing in the sweep.
    #[getter]
    fn firings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        output(py, self.0.firings.clone(), &[self.0.len()])
    }

    /// int32, shape (n,): index of the instance that was met.
    #[getter]
    fn instances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        ids(py, &self.0.instances, &[self.0.len()])
    }

    /// Writes a binary .ply or an .npz with arrays of the names of the attributes.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    fn save(&self, py: Python, path: PathBuf) -> PyResult<()> {
        protect::check(&path)?;
        py.detach(|| self.0.write(&path)).map_err(sensor_error)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __repr__(&self) -> String {
        format!("<PointCloud of {} points>", self.0.len())
    }
}

/// Ids as arrays have them: "nothing" is the largest number in Rust, and -1 there.
fn ids<'py>(py: Python<'py>, ids: &[u32], shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    output(py, ids.iter().map(|i| *i as i32).collect(), shape)
}

/// Where instances are in the next frame: object to world by number.
type Transforms<'py> = BTreeMap<usize, Bound<'py, PyAny>>;

/// Exact layers at the centres of a camera's pixels; [`Scene`]'s method explains them.
pub fn observe<'py>(
    py: Python<'py>,
    scene: &Scene,
    camera: &Camera,
    (width, height): (u32, u32),
    next_camera: Option<&Camera>,
    next_transforms: Option<Transforms<'py>>,
    categories: BTreeMap<String, String>,
) -> PyResult<Bound<'py, PyDict>> {
    let queries = scene.queries(py)?;
    let description = scene.contents(py).scene.clone();
    let moves = next_transforms.is_some();
    let mut then = if moves { description.clone() } else { alhazen::Scene::default() };
    for (number, matrix) in next_transforms.into_iter().flatten() {
        let count = then.instances.len();
        let instance = then.instances.get_mut(number);
        let instance =
            instance.ok_or_else(|| bad(format!("next_transforms: {number} of only {count} instances")))?;
        instance.transform = affine("next_transforms", &matrix)?;
    }
    let next_scene = moves.then_some(&then);
    let next = (moves || next_camera.is_some())
        .then(|| Motion { camera: &next_camera.unwrap_or(camera).0, scene: next_scene });
    let categories = Categories::new(&description, &categories);
    let control = Control::new();
    let truth = watch(
        py,
        &control,
        None,
        || 0.0,
        || {
            GroundTruth::observe(
                &description,
                &queries,
                &categories,
                &camera.0,
                (width, height),
                next,
                &control,
            )
        },
    )?;
    let truth = truth.map_err(sensor_error)?;
    let (h, w) = (height as usize, width as usize);
    let layers = PyDict::new(py);
    layers.set_item("depth", output(py, truth.depth, &[h, w])?)?;
    layers.set_item("position", output(py, truth.position.into_flattened(), &[h, w, 3])?)?;
    layers.set_item("normal", output(py, truth.normal.into_flattened(), &[h, w, 3])?)?;
    if next.is_some() {
        layers.set_item("flow", output(py, truth.flow.into_flattened(), &[h, w, 2])?)?;
    }
    layers.set_item("instance", ids(py, &truth.instance, &[h, w])?)?;
    layers.set_item("category", ids(py, &truth.category, &[h, w])?)?;
    layers.set_item("material", ids(py, &truth.material, &[h, w])?)?;
    Ok(layers)
}

/// Boxes around all instances: centres and half axes.
pub fn boxes<'py>(py: Python<'py>, scene: &Scene) -> PyResult<[Bound<'py, PyAny>; 2]> {
    let contents = scene.contents(py);
    let count = contents.scene.instances.len();
    let mut centers: Vec<f32> = Vec::with_capacity(3 * count);
    let mut axes: Vec<f32> = Vec::with_capacity(9 * count);
    for i in 0..count {
        let found = object_box(&contents.scene, i);
        centers.extend(found.map_or([f32::NAN; 3], |b| b.center.to_array()));
        axes.extend(found.map_or([[f32::NAN; 3]; 3], |b| b.half_axes.map(|a| a.to_array())).as_flattened());
    }
    Ok([output(py, centers, &[count, 3])?, output(py, axes, &[count, 3, 3])?])
}

/// What a data set is made of, as Python gives it.
pub struct Wanted<'py> {
    pub folder: PathBuf,
    pub width: u32,
    pub height: u32,
    pub matrix: [[f64; 3]; 3],
    pub distortion: Vec<f64>,
    pub fisheye: bool,
    pub poses: Vec<[[f64; 4]; 4]>,
    pub moves: BTreeMap<String, Vec<[[f64; 4]; 4]>>,
    pub categories: BTreeMap<String, String>,
    pub spp: Option<u32>,
    pub seed: u32,
    pub backend: String,
    pub progress: Option<Bound<'py, PyAny>>,
}

/// Writes a data set; returns how many objects are annotated in all pictures.
pub fn write_dataset(py: Python, scene: &Scene, wanted: Wanted) -> PyResult<usize> {
    let Wanted { width, height, matrix, distortion, fisheye, poses, moves, categories, .. } = wanted;
    if poses.is_empty() || moves.values().any(|m| m.len() != poses.len()) {
        return Err(bad(
            "poses and moves: expected at least one pose, and as many matrices for each that moves",
        ));
    }
    let description = scene.contents(py).scene.clone();
    let spp = wanted.spp.or(description.defaults.spp).unwrap_or(Limits::default().spp).max(1);
    let count = poses.len();
    let dataset = Dataset {
        job: Job { seed: wanted.seed, ..Job::for_scene(&description) },
        scene: description,
        poses: Poses { width, height, matrix, distortion, fisheye, poses, moves },
        categories,
        limits: Limits { spp, ..Limits::default() },
    };
    let backend = wanted.backend.parse().map_err(|e| bad(format!("backend: {e}")))?;
    let options = RendererOptions { backend, ..RendererOptions::default() };
    let mut renderer = py.detach(|| Renderer::choose(&options)).map_err(choice_error)?.renderer;
    let done = AtomicUsize::new(0);
    let control = Control::new();
    let fraction = || done.load(Ordering::Relaxed) as f64 / count as f64;
    let exported = watch(py, &control, wanted.progress.as_ref(), fraction, || {
        dataset.export(&wanted.folder, &mut renderer, &control, |i| done.store(i + 1, Ordering::Relaxed))
    })?;
    exported.map(|e| e.annotations).map_err(sensor_error)
}
