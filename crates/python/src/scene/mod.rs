//! Scenes: from files or from arrays.

mod content;
mod editing;
mod foreign;
mod lighting;
mod motion;
mod pictures;
mod rays;
mod subdivision;
mod views;

use crate::arrays::output;
use crate::camera::Camera;
use crate::errors::{load_error, render_error};
use crate::protect;
use crate::render::Prepared;
use alhazen::{LoadOptions, RayQueries, SceneTables, Source, add_daylight_if_dark};
use glam::Vec3;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A scene: meshes, instances, materials, lights, cameras.
///
/// ``Scene()`` is empty; the ``add_…`` methods fill it and return indices. `load` reads one from a file. World units are
/// metres, +Y is up, colours are linear with Rec. 709 primaries, matrices map column vectors.
///
/// Acceleration structures are built when they are first needed and again after changes. A scene may be used from several
/// threads.
#[pyclass(frozen, module = "alhazen")]
#[derive(Default)]
pub struct Scene {
    contents: Mutex<Contents>,
    /// The renderer of the last picture.
    pub prepared: Mutex<Option<Prepared>>,
}

/// What a scene is made of.
#[derive(Default)]
pub struct Contents {
    /// The description.
    pub scene: alhazen::Scene,
    /// What the loader noticed.
    report: Vec<String>,
    /// Counts changes.
    pub version: u64,
    /// Structures for rays, and the version that they are of.
    queries: Option<(u64, Arc<RayQueries>)>,
}

/// Locks without keeping the interpreter from others meanwhile.
pub fn lock<'a, T>(py: Python, mutex: &'a Mutex<T>) -> MutexGuard<'a, T> {
    // A panic elsewhere was reported there; what is guarded here is whole between statements.
    mutex.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
}

/// Loads a scene from a file (.obj, .gltf, .glb, .ply, .toml, .alhazen, …) or the built-in list (see `scenes`).
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     File, or name of a built-in scene.
/// parameters : dict of str to str, optional
///     Parameters of scene files and built-in scenes.
/// lenient : bool, default False
///     Go on without what the file requires but Alhazen does not know.
/// daylight : bool, default True
///     Put a cloudy sky around a scene without lights, in which nothing is brighter than white paper, and around one whose
///     lights do not reach what is seen. `report` says so.
/// allow_paths : list of path, optional
///     Folders that the scene may read beside its own.
/// max_memory : int, optional
///     Bytes that the scene may take until it is rendered; three quarters of what is free if left out.
/// max_load_time : float, optional
///     Seconds that loading may take.
/// cull_backs : bool, default False
///     Leave out the backs of single-sided surfaces.
/// exact_terminator : bool, default False
///     Gather light on the triangles of smooth meshes, not where the smooth surface would be.
/// keep_normals : bool, default False
///     Keep normals that oppose the winding of most faces of their mesh instead of turning them round.
/// untrusted : bool, default False
///     Load in a sandbox where the system has one, with 2 GB and a minute unless the other arguments say more.
///
/// Returns
/// -------
/// Scene
///
/// Raises
/// ------
/// LoadError
///     If the file cannot be read or is malformed; the text names file, object and value.
#[pyfunction]
#[pyo3(signature = (path, *, parameters=None, lenient=false, daylight=true, allow_paths=None, max_memory=None, max_load_time=None, cull_backs=false, exact_terminator=false, keep_normals=false, untrusted=false))]
pub fn load(
    py: Python,
    path: PathBuf,
    parameters: Option<BTreeMap<String, String>>,
    lenient: bool,
    daylight: bool,
    allow_paths: Option<Vec<PathBuf>>,
    max_memory: Option<u64>,
    max_load_time: Option<f64>,
    cull_backs: bool,
    exact_terminator: bool,
    keep_normals: bool,
    untrusted: bool,
) -> PyResult<Scene> {
    let mut source = Source::parse(&path.to_string_lossy());
    source.parameters = parameters.into_iter().flatten().collect();
    let seconds = |s: f64| {
        Duration::try_from_secs_f64(s)
            .map_err(|_| PyValueError::new_err(format!("max_load_time cannot be {s} seconds")))
    };
    let max_load_time = max_load_time.map(seconds).transpose()?;
    // As `--untrusted` of the command does.
    let (memory, time) =
        if untrusted { (2_000_000_000, Some(Duration::from_secs(60))) } else { (u64::MAX, None) };
    let options = LoadOptions {
        lenient,
        allowed_paths: allow_paths.unwrap_or_default(),
        max_memory: max_memory.unwrap_or(memory),
        max_load_time: max_load_time.or(time),
        cull_backs,
        exact_terminator,
        keep_normals,
        untrusted,
        ..LoadOptions::default()
    };
    let mut loaded = py.detach(|| source.load(&options)).map_err(load_error)?;
    protect::remember(&options.files_read);
    if daylight {
        py.detach(|| add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None));
    }
    if let Some(shutter) = loaded.scene.defaults.shutter.filter(|_| loaded.scene.is_animated()) {
        loaded.scene.open_shutter(0.0, &shutter);
    }
    let report = loaded.report.notes.iter().map(ToString::to_string).collect();
    let contents = Contents { scene: loaded.scene, report, ..Contents::default() };
    Ok(Scene { contents: Mutex::new(contents), ..Scene::default() })
}

/// A text as Python writes it.
pub fn quoted(text: &str) -> String {
    let escaped = |c: char| match c {
        '\\' | '\'' => format!("\\{c}"),
        c if c.is_control() => format!("\\x{:02x}", u32::from(c)),
        c => c.to_string(),
    };
    format!("'{}'", text.chars().map(escaped).collect::<String>())
}

impl Scene {
    /// What it is made of.
    pub fn contents(&self, py: Python) -> MutexGuard<'_, Contents> {
        lock(py, &self.contents)
    }

    /// Changes the description.
    pub fn change<T>(
        &self,
        py: Python,
        change: impl FnOnce(&mut alhazen::Scene) -> PyResult<T>,
    ) -> PyResult<T> {
        let mut contents = self.contents(py);
        let result = change(&mut contents.scene)?;
        contents.version += 1;
        Ok(result)
    }

    /// The structures for rays, built if need be.
    pub fn queries(&self, py: Python) -> PyResult<Arc<RayQueries>> {
        let mut contents = self.contents(py);
        if let Some((version, queries)) = &contents.queries
            && *version == contents.version
        {
            return Ok(queries.clone());
        }
        let scene = &contents.scene;
        let built = py.detach(|| RayQueries::new(SceneTables::build(scene), None));
        let queries = Arc::new(built.map_err(render_error)?);
        contents.queries = Some((contents.version, queries.clone()));
        Ok(queries)
    }
}

#[pymethods]
impl Scene {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// The cameras of the scene: list of Camera.
    #[getter]
    fn cameras(&self, py: Python) -> Vec<Camera> {
        self.contents(py).scene.cameras.iter().cloned().map(Camera).collect()
    }

    /// The camera that `render` uses where it is given none: the first, or one that sees the whole scene.
    #[getter]
    fn default_camera(&self, py: Python) -> Camera {
        Camera(self.contents(py).scene.default_camera())
    }

    /// Name of the scene: str.
    #[getter]
    fn name(&self, py: Python) -> String {
        self.contents(py).scene.name.clone()
    }

    /// Names of the instances: list of str.
    #[getter]
    fn instance_names(&self, py: Python) -> Vec<String> {
        self.contents(py).scene.instances.iter().map(|i| i.name.clone()).collect()
    }

    /// Names of the materials: list of str.
    #[getter]
    fn material_names(&self, py: Python) -> Vec<String> {
        self.contents(py).scene.materials.iter().map(|m| m.name.clone()).collect()
    }

    /// Number of triangles in the world, every instance counted: int.
    #[getter]
    fn triangle_count(&self, py: Python) -> u64 {
        self.contents(py).scene.instanced_triangles()
    }

    /// Where the scene's own zero is in the world of its file: float64, shape (3,), metres. All positions of the scene, of
    /// its cameras and of rays are relative to it. Zero unless a file's scene is far from the file's origin.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let origin = self.contents(py).scene.origin.to_array().to_vec();
        output(py, origin, &[3])
    }

    /// Smallest and largest coordinates: float32, shape (2, 3), metres, relative to `origin`. None for a scene without geometry.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let bounds = self.contents(py).scene.bounds();
        let array =
            |(low, high): (Vec3, Vec3)| output(py, [low.to_array(), high.to_array()].concat(), &[2, 3]);
        bounds.map(array).transpose()
    }

    /// What the loader ignored, repaired or approximated: list of str.
    #[getter]
    fn report(&self, py: Python) -> Vec<String> {
        self.contents(py).report.clone()
    }

    fn __repr__(&self, py: Python) -> String {
        let contents = self.contents(py);
        let s = &contents.scene;
        let (meshes, instances) = (s.meshes.len(), s.instances.len());
        let (materials, lights) = (s.materials.len(), s.lights.len());
        let counts =
            format!("meshes={meshes}, instances={instances}, materials={materials}, lights={lights}");
        format!("Scene(name={}, {counts})", quoted(&s.name))
    }
}
