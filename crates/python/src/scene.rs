//! Scenes: from files or from arrays.

use crate::arrays::{Input, affine, matrices, output, square};
use crate::camera::Camera;
use crate::errors::{bad, load_error, render_error};
use crate::light::{color, directional, point, spot};
use crate::material::{Described, environment_image, material};
use crate::part::{Part, render_part};
use crate::queries::{Hits, RayArrays};
use crate::render::{Prepared, Settings, render};
use crate::sensors;
use alhazen::{
    Environment, Instance, Light, LightKind, LoadOptions, Mesh, RayQueries, SceneTables, Shape, Source,
    Sphere, TriangleMesh, add_daylight_if_dark,
};
use glam::Vec3;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

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

/// Loads a scene from a file (.obj, .gltf, .glb, .ply, .toml) or the built-in list (see `scenes`).
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
///     Put a cloudy sky around a scene in which nothing shines.
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
#[pyo3(signature = (path, *, parameters=None, lenient=false, daylight=true))]
pub fn load(
    py: Python,
    path: PathBuf,
    parameters: Option<BTreeMap<String, String>>,
    lenient: bool,
    daylight: bool,
) -> PyResult<Scene> {
    let mut source = Source::parse(&path.to_string_lossy());
    source.parameters = parameters.into_iter().flatten().collect();
    let options = LoadOptions { lenient, ..LoadOptions::default() };
    let mut loaded = py.detach(|| source.load(&options)).map_err(load_error)?;
    if daylight {
        add_daylight_if_dark(&mut loaded.scene, &mut loaded.report);
    }
    let report = loaded.report.notes.iter().map(ToString::to_string).collect();
    let contents = Contents { scene: loaded.scene, report, ..Contents::default() };
    Ok(Scene { contents: Mutex::new(contents), ..Scene::default() })
}

impl Scene {
    /// What it is made of.
    pub fn contents(&self, py: Python) -> MutexGuard<'_, Contents> {
        lock(py, &self.contents)
    }

    /// Changes the description.
    fn change<T>(&self, py: Python, change: impl FnOnce(&mut alhazen::Scene) -> PyResult<T>) -> PyResult<T> {
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

    fn add_shape(&self, py: Python, shape: Shape, material: u32, name: String) -> PyResult<u32> {
        self.change(py, |scene| {
            let implied = material == 0 && scene.materials.is_empty();
            if material as usize >= scene.materials.len() && !implied {
                return Err(bad(format!("material: {material} of only {}", scene.materials.len())));
            }
            scene.meshes.push(Mesh::single(name, shape, material));
            Ok(scene.meshes.len() as u32 - 1)
        })
    }

    fn add_light(&self, py: Python, kind: LightKind, name: String) -> PyResult<u32> {
        self.change(py, |scene| {
            scene.lights.push(Light { name, kind });
            Ok(scene.lights.len() as u32 - 1)
        })
    }
}

#[pymethods]
impl Scene {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Adds a triangle mesh; it is seen where `add_instance` puts it.
    ///
    /// Parameters
    /// ----------
    /// vertices : array_like, float32, shape (n, 3)
    ///     Positions in object space, metres.
    /// triangles : array_like, int, shape (m, 3)
    ///     Indices of vertices, counter-clockwise seen from the front.
    /// normals : array_like, float32, shape (n, 3), optional
    ///     Unit shading normals; without them the mesh is flat-shaded.
    /// uvs : array_like, float32, shape (n, 2), optional
    ///     Texture coordinates; (0, 0) is the upper left corner of the picture.
    /// colors : array_like, float32, shape (n, 3), optional
    ///     Linear RGB, multiplied into the material's base colour.
    /// material : int, default 0
    ///     What `add_material` returned. A scene without materials has a grey one.
    /// name : str, default ""
    ///
    /// Returns
    /// -------
    /// int
    ///     Index of the mesh.
    #[pyo3(signature = (vertices, triangles, *, normals=None, uvs=None, colors=None, material=0, name=String::new()))]
    fn add_mesh(
        &self,
        py: Python,
        vertices: &Bound<PyAny>,
        triangles: &Bound<PyAny>,
        normals: Option<&Bound<PyAny>>,
        uvs: Option<&Bound<PyAny>>,
        colors: Option<&Bound<PyAny>>,
        material: u32,
        name: String,
    ) -> PyResult<u32> {
        let positions = attribute::<3, _>("vertices", Some(vertices), None, Vec3::from)?;
        let n = Some(positions.len());
        let unit = |v: [f32; 3]| Vec3::from(v).normalize_or_zero();
        let mesh = TriangleMesh {
            normals: attribute("normals", normals, n, unit)?,
            uv0: attribute("uvs", uvs, n, glam::Vec2::from)?,
            colors: attribute("colors", colors, n, |[r, g, b]: [f32; 3]| glam::vec4(r, g, b, 1.0))?,
            indices: indices(triangles, positions.len())?,
            positions,
            ..TriangleMesh::default()
        };
        self.add_shape(py, Shape::Triangles(mesh), material, name)
    }

    /// Adds analytic spheres as one mesh; they are seen where `add_instance` puts it.
    ///
    /// Parameters
    /// ----------
    /// centers : array_like, float32, shape (n, 3)
    ///     In object space, metres.
    /// radii : array_like, float32, shape (n,)
    ///     Metres, positive.
    /// material : int, default 0
    /// name : str, default ""
    ///
    /// Returns
    /// -------
    /// int
    ///     Index of the mesh.
    #[pyo3(signature = (centers, radii, *, material=0, name=String::new()))]
    fn add_spheres(
        &self,
        py: Python,
        centers: &Bound<PyAny>,
        radii: &Bound<PyAny>,
        material: u32,
        name: String,
    ) -> PyResult<u32> {
        let (centers, radii) = (Input::<f32>::new("centers", centers)?, Input::<f32>::new("radii", radii)?);
        let (centers, radii) = (centers.rows::<3>()?, radii.numbers()?);
        if centers.len() != radii.len() {
            return Err(bad(format!("there are {} centers but {} radii", centers.len(), radii.len())));
        }
        let usable = |(c, r): (&[f32; 3], &f32)| Vec3::from(*c).is_finite() && *r > 0.0 && r.is_finite();
        if let Some(i) = centers.iter().zip(radii).position(|s| !usable(s)) {
            return Err(bad(format!(
                "sphere {i}: center {:?} with radius {} is not a sphere",
                centers[i], radii[i]
            )));
        }
        let sphere = |(c, r): (&[f32; 3], &f32)| Sphere { center: (*c).into(), radius: *r };
        let spheres = centers.iter().zip(radii).map(sphere).collect();
        self.add_shape(py, Shape::Spheres(spheres), material, name)
    }

    /// Puts a mesh into the world.
    ///
    /// Parameters
    /// ----------
    /// mesh : int
    ///     What `add_mesh` or `add_spheres` returned.
    /// transform : array_like, shape (4, 4) or (3, 4), optional
    ///     Object to world; the identity if not given.
    /// material : int, optional
    ///     Replaces the mesh's own material.
    /// name : str, default ""
    /// dynamic : bool, default False
    ///     Whether `set_transform` will move it often. Then a move does not rebuild the scene, but rays take a little longer.
    ///
    /// Returns
    /// -------
    /// int
    ///     Index of the instance, which hits and the layer ``instance`` name.
    #[pyo3(signature = (mesh, *, transform=None, material=None, name=String::new(), dynamic=false))]
    fn add_instance(
        &self,
        py: Python,
        mesh: u32,
        transform: Option<&Bound<PyAny>>,
        material: Option<u32>,
        name: String,
        dynamic: bool,
    ) -> PyResult<u32> {
        let transform =
            transform.map(|t| affine("transform", t)).transpose()?.unwrap_or(glam::Affine3A::IDENTITY);
        self.change(py, |scene| {
            let known = scene.meshes.get(mesh as usize);
            let known = known.ok_or_else(|| bad(format!("mesh: {mesh} of only {}", scene.meshes.len())))?;
            if let Some(material) = material.filter(|m| *m as usize >= scene.materials.len()) {
                return Err(bad(format!("material: {material} of only {}", scene.materials.len())));
            }
            let materials = material.map(|m| vec![m; known.parts.len()]);
            let name = if name.is_empty() { known.name.clone() } else { name };
            scene.instances.push(Instance { materials, dynamic, ..Instance::new(name, mesh, transform) });
            Ok(scene.instances.len() as u32 - 1)
        })
    }

    /// Moves an instance.
    ///
    /// Parameters
    /// ----------
    /// instance : int
    ///     What `add_instance` returned.
    /// transform : array_like, shape (4, 4) or (3, 4)
    ///     Object to world.
    fn set_transform(&self, py: Python, instance: u32, transform: &Bound<PyAny>) -> PyResult<()> {
        let transform = affine("transform", transform)?;
        self.change(py, |scene| {
            let count = scene.instances.len();
            let instance = scene.instances.get_mut(instance as usize);
            instance.ok_or_else(|| bad(format!("instance: the scene has only {count}")))?.transform =
                transform;
            Ok(())
        })
    }

    /// Where an instance stands: float64, shape (4, 4), object to world.
    fn transform<'py>(&self, py: Python<'py>, instance: u32) -> PyResult<Bound<'py, PyAny>> {
        let contents = self.contents(py);
        let instances = &contents.scene.instances;
        let instance = instances.get(instance as usize);
        let instance =
            instance.ok_or_else(|| bad(format!("instance: the scene has only {}", instances.len())))?;
        let matrix = glam::Mat4::from(instance.transform).as_dmat4().transpose();
        output(py, matrix.to_cols_array().to_vec(), &[4, 4])
    }

    /// Adds a material.
    ///
    /// Parameters
    /// ----------
    /// name : str, default ""
    /// model : {"metallic-roughness", "lambert", "dielectric", "mirror", "unlit"}
    ///     How the surface scatters; metallic-roughness as glTF 2.0 has it if not given.
    /// base_color : array_like, shape (3,) or (4,), default 0.8
    ///     Linear RGB, or RGB and alpha, each in [0, 1].
    /// metallic, roughness, specular, transmission : float
    ///     In [0, 1]; roughness is perceptual, GGX's alpha is its square.
    /// ior : float, default 1.5
    ///     Index of refraction, at least 1.
    /// thin_walled : bool, default False
    ///     Light goes straight through instead of being refracted.
    /// emission : float or array_like, shape (3,), default 0
    ///     Emitted radiance, linear RGB, W/(sr·m²); on the front side unless `emission_two_sided`.
    /// emission_two_sided : bool, default False
    /// alpha_mode : {"opaque", "mask", "blend"}, default "opaque"
    ///     Use of the base colour's alpha: none, a hole below `alpha_cutoff`, or coverage.
    /// alpha_cutoff : float, default 0.5
    /// base_color_texture, emission_texture : array_like, uint8, shape (height, width, 3 or 4), optional
    ///     sRGB pictures multiplied into the base colour and the emission; row 0 at the top.
    /// metallic_roughness_texture, normal_texture : array_like, uint8, shape (height, width, 3 or 4), optional
    ///     Linear: roughness in G and metalness in B; the tangent-space normal.
    ///
    /// Returns
    /// -------
    /// int
    ///     Index of the material.
    #[pyo3(signature = (
        name=String::new(), *, model="metallic-roughness".into(), base_color=None, metallic=0.0, roughness=0.5,
        specular=1.0, ior=1.5, transmission=0.0, thin_walled=false, emission=None, emission_two_sided=false,
        alpha_mode="opaque".into(), alpha_cutoff=0.5, base_color_texture=None, metallic_roughness_texture=None,
        emission_texture=None, normal_texture=None
    ))]
    fn add_material(
        &self,
        py: Python,
        name: String,
        model: String,
        base_color: Option<Bound<PyAny>>,
        metallic: f32,
        roughness: f32,
        specular: f32,
        ior: f32,
        transmission: f32,
        thin_walled: bool,
        emission: Option<Bound<PyAny>>,
        emission_two_sided: bool,
        alpha_mode: String,
        alpha_cutoff: f32,
        base_color_texture: Option<Bound<PyAny>>,
        metallic_roughness_texture: Option<Bound<PyAny>>,
        emission_texture: Option<Bound<PyAny>>,
        normal_texture: Option<Bound<PyAny>>,
    ) -> PyResult<u32> {
        #[rustfmt::skip]
        let described = Described {
            name, model, base_color, metallic, roughness, ior, specular, transmission, thin_walled, emission,
            emission_two_sided, alpha_mode, alpha_cutoff, base_color_texture, metallic_roughness_texture,
            emission_texture, normal_texture,
        };
        self.change(py, |scene| {
            let material = material(scene, &described)?;
            scene.materials.push(material);
            Ok(scene.materials.len() as u32 - 1)
        })
    }

    /// Adds a light that shines in all directions from a point.
    ///
    /// Parameters
    /// ----------
    /// position : array_like, shape (3,)
    ///     Metres.
    /// intensity : float or array_like, shape (3,)
    ///     Radiant intensity, linear RGB, W/sr.
    /// name : str, default ""
    #[pyo3(signature = (position, intensity, *, name=String::new()))]
    fn add_point_light(
        &self,
        py: Python,
        position: &Bound<PyAny>,
        intensity: &Bound<PyAny>,
        name: String,
    ) -> PyResult<u32> {
        self.add_light(py, point(position, intensity)?, name)
    }

    /// Adds a light that shines into a cone.
    ///
    /// Parameters
    /// ----------
    /// position, direction : array_like, shape (3,)
    ///     Where it is, in metres, and where it shines.
    /// intensity : float or array_like, shape (3,)
    ///     Radiant intensity on the axis, linear RGB, W/sr.
    /// inner_angle, outer_angle : float
    ///     Angles from the axis between which the intensity falls to zero, radians, at most π/2.
    /// name : str, default ""
    #[pyo3(signature = (position, direction, intensity, *, inner_angle=0.0, outer_angle=0.5, name=String::new()))]
    fn add_spot_light(
        &self,
        py: Python,
        position: &Bound<PyAny>,
        direction: &Bound<PyAny>,
        intensity: &Bound<PyAny>,
        inner_angle: f32,
        outer_angle: f32,
        name: String,
    ) -> PyResult<u32> {
        self.add_light(py, spot(position, direction, intensity, inner_angle, outer_angle)?, name)
    }

    /// Adds a light that is infinitely far away.
    ///
    /// Parameters
    /// ----------
    /// direction : array_like, shape (3,)
    ///     Where the light travels.
    /// irradiance : float or array_like, shape (3,)
    ///     On a surface that faces the light, linear RGB, W/m².
    /// angular_diameter : float, default 0
    ///     Full angle under which the source is seen, radians; 0 gives hard shadows.
    /// name : str, default ""
    #[pyo3(signature = (direction, irradiance, *, angular_diameter=0.0, name=String::new()))]
    fn add_directional_light(
        &self,
        py: Python,
        direction: &Bound<PyAny>,
        irradiance: &Bound<PyAny>,
        angular_diameter: f32,
        name: String,
    ) -> PyResult<u32> {
        self.add_light(py, directional(direction, irradiance, angular_diameter)?, name)
    }

    /// Replaces the light from outside.
    ///
    /// Parameters
    /// ----------
    /// radiance : float, or array_like of shape (3,) or (height, width, 3), or None
    ///     The same linear radiance everywhere; or an equirectangular picture of it, row 0 at the top, whose centre column is
    ///     seen towards -Z; or darkness.
    /// rotation : float, default 0
    ///     Turns a picture about +Y, counter-clockwise seen from above, radians.
    /// intensity : float, default 1
    ///     Multiplied into a picture.
    #[pyo3(signature = (radiance, *, rotation=0.0, intensity=1.0))]
    fn set_environment(
        &self,
        py: Python,
        radiance: Option<&Bound<PyAny>>,
        rotation: f32,
        intensity: f32,
    ) -> PyResult<()> {
        if !(rotation.is_finite() && intensity >= 0.0 && intensity.is_finite()) {
            return Err(bad(format!(
                "rotation {rotation} and intensity {intensity} are not an angle and a factor"
            )));
        }
        let is_picture = |r: &Bound<PyAny>| Input::<f32>::new("radiance", r).map(|a| a.shape().len() == 3);
        let picture = match radiance {
            Some(r) if is_picture(r)? => Some(environment_image(r)?),
            _ => None,
        };
        let constant = radiance.filter(|_| picture.is_none()).map(|r| color("radiance", r)).transpose()?;
        self.change(py, |scene| {
            scene.environment = match (picture, constant) {
                (Some(picture), _) => {
                    scene.images.push(picture);
                    let image = scene.images.len() as u32 - 1;
                    Environment::Image { image, rotation, intensity }
                }
                (None, Some(color)) => Environment::Constant(color),
                (None, None) => Environment::Black,
            };
            Ok(())
        })
    }

    /// Adds a camera; the first one is used where `render` is given none.
    ///
    /// Parameters
    /// ----------
    /// camera : Camera
    ///
    /// Returns
    /// -------
    /// int
    ///     Index of the camera.
    fn add_camera(&self, py: Python, camera: &Camera) -> u32 {
        let mut contents = self.contents(py);
        contents.scene.cameras.push(camera.0.clone());
        contents.scene.cameras.len() as u32 - 1
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

    /// Smallest and largest coordinates: float32, shape (2, 3), metres. None for a scene without geometry.
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
    ///     primitive, samples, standard-error.
    /// seed : int, default 0
    ///     Changes the noise.
    /// integrator : {"path", "direct", "aov"}, optional
    ///     How light is transported; what the scene says, or "path".
    /// max_depth : int, optional
    ///     Longest path: 1 is emission, 2 direct light.
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
    ///     auto (a GPU if there is a real one), cpu, gpu, gpu-bvh, gpu-query, gpu-pipeline; see `backends`.
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
        sampler="sobol".into(), crop=None, first_sample=0, time=0.0, time_limit=None, noise=None,
        backend="auto".into(), adapter=None, threads=None, progress=None
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
            width, height, spp, camera, aovs, seed, integrator, max_depth, sampler, crop, first_sample, time,
            time_limit, noise, backend, adapter, threads, progress,
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
    ///     camera, aovs, seed, integrator, max_depth, sampler, crop, time, backend, adapter, threads and progress, as for `render`.
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
        folder, width, height, *, matrix, poses, moves=BTreeMap::new(), categories=BTreeMap::new(), spp=None, seed=0,
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

    fn __repr__(&self, py: Python) -> String {
        let contents = self.contents(py);
        let s = &contents.scene;
        let (meshes, lights) = (s.meshes.len(), s.lights.len());
        format!("Scene({:?}: {meshes} meshes, {} instances, {lights} lights)", s.name, s.instances.len())
    }
}

/// The rows of an optional array, which must be `count` if that is given.
fn attribute<const N: usize, T>(
    name: &'static str,
    value: Option<&Bound<PyAny>>,
    count: Option<usize>,
    convert: impl Fn([f32; N]) -> T,
) -> PyResult<Vec<T>> {
    let Some(value) = value else { return Ok(Vec::new()) };
    let input = Input::<f32>::new(name, value)?;
    let rows = input.rows::<N>()?;
    match count {
        Some(count) if count != rows.len() => {
            Err(bad(format!("{name}: {} rows for {count} vertices", rows.len())))
        }
        _ => Ok(rows.iter().map(|row| convert(*row)).collect()),
    }
}

/// Triangles from an array of any kind of whole numbers.
fn indices(triangles: &Bound<PyAny>, vertices: usize) -> PyResult<Vec<[u32; 3]>> {
    let array = triangles.py().import("numpy")?.call_method1("asarray", (triangles,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let size: usize = array.getattr("size")?.extract()?;
    if !matches!(kind.as_str(), "i" | "u") && size > 0 {
        return Err(bad("triangles: expected whole numbers"));
    }
    let input = Input::<i64>::new("triangles", &array)?;
    let rows = input.rows::<3>()?;
    let is_bad = |i: &i64| *i < 0 || *i >= vertices as i64 || *i >= i64::from(u32::MAX);
    if let Some(row) = rows.iter().position(|r| r.iter().any(is_bad)) {
        return Err(bad(format!(
            "triangles: row {row} is {:?} but there are {vertices} vertices",
            rows[row]
        )));
    }
    Ok(rows.iter().map(|r| r.map(|i| i as u32)).collect())
}
