//! Changing and removing what a scene has, copying it, and saving it.

use super::content::{attribute, indices};
use super::{Contents, Scene};
use crate::errors::{Error, bad, load_error};
use crate::protect;
use alhazen::{Shape, TriangleMesh, packed};
use glam::Vec3;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Whether `index` is one of `count` things called `name`.
fn known(name: &str, index: u32, count: usize) -> PyResult<usize> {
    let index = index as usize;
    if index < count { Ok(index) } else { Err(bad(format!("{name}: {index} of only {count}"))) }
}

impl Scene {
    fn of(scene: alhazen::Scene) -> Self {
        Self { contents: Mutex::new(Contents { scene, ..Contents::default() }), ..Self::default() }
    }

    fn packed(&self, py: Python) -> PyResult<Vec<u8>> {
        let contents = self.contents(py);
        let scene = &contents.scene;
        py.detach(|| packed::pack(scene)).map_err(Error::new_err)
    }
}

#[pymethods]
impl Scene {
    /// Replaces a material. Everything that is not given gets its default, the name excepted.
    ///
    /// Parameters
    /// ----------
    /// material : int
    /// **settings
    ///     As for `add_material`.
    #[pyo3(signature = (material, **settings))]
    fn set_material(slf: &Bound<Self>, material: u32, settings: Option<&Bound<PyDict>>) -> PyResult<()> {
        let py = slf.py();
        known("material", material, slf.get().contents(py).scene.materials.len())?;
        slf.call_method("add_material", (), settings)?;
        let keeps_name = settings.is_none_or(|s| !s.contains("name").unwrap_or(false));
        slf.get().change(py, |scene| {
            let Some(mut made) = scene.materials.pop() else { return Ok(()) };
            let index = known("material", material, scene.materials.len())?;
            let old = &mut scene.materials[index];
            if keeps_name {
                made.name = std::mem::take(&mut old.name);
            }
            *old = made;
            Ok(())
        })
    }

    /// Replaces the material of an instance.
    ///
    /// Parameters
    /// ----------
    /// instance : int
    /// material : int or None
    ///     None: the mesh's own.
    fn set_instance_material(&self, py: Python, instance: u32, material: Option<u32>) -> PyResult<()> {
        self.change(py, |scene| {
            let instance = known("instance", instance, scene.instances.len())?;
            material.map(|m| known("material", m, scene.materials.len())).transpose()?;
            let parts = scene.meshes[scene.instances[instance].mesh as usize].parts.len();
            scene.instances[instance].materials = material.map(|m| vec![m; parts]);
            Ok(())
        })
    }

    /// Shows or hides an instance. What is hidden casts no shadow and is not hit; its index stays.
    ///
    /// Parameters
    /// ----------
    /// instance : int
    /// visible : bool
    fn set_visible(&self, py: Python, instance: u32, visible: bool) -> PyResult<()> {
        self.change(py, |scene| {
            let instance = known("instance", instance, scene.instances.len())?;
            scene.instances[instance].visible = visible;
            Ok(())
        })
    }

    /// Replaces the geometry of a mesh of triangles; its material stays.
    ///
    /// Parameters
    /// ----------
    /// mesh : int
    /// vertices : array_like, float32, shape (n, 3)
    /// triangles : array_like, int, shape (m, 3), optional
    ///     The old ones if not given.
    /// normals : array_like, float32, shape (n, 3), optional
    ///     Without them the mesh is flat-shaded.
    #[pyo3(signature = (mesh, vertices, triangles=None, *, normals=None))]
    fn set_vertices(
        &self,
        py: Python,
        mesh: u32,
        vertices: &Bound<PyAny>,
        triangles: Option<&Bound<PyAny>>,
        normals: Option<&Bound<PyAny>>,
    ) -> PyResult<()> {
        let positions = attribute::<3, _>("vertices", Some(vertices), None, Vec3::from)?;
        let unit = |v: [f32; 3]| Vec3::from(v).normalize_or_zero();
        let normals = attribute("normals", normals, Some(positions.len()), unit)?;
        let triangles = triangles.map(|t| indices(t, positions.len())).transpose()?;
        self.change(py, |scene| {
            let mesh = known("mesh", mesh, scene.meshes.len())?;
            let [part] = &mut scene.meshes[mesh].parts[..] else {
                return Err(bad(format!("mesh: {mesh} has several parts")));
            };
            let Shape::Triangles(old) = &mut part.shape else {
                return Err(bad(format!("mesh: {mesh} has no triangles")));
            };
            let same = old.positions.len() == positions.len();
            if triangles.is_none() && !same {
                return Err(bad(format!(
                    "vertices: {} rows for the {} that the triangles need",
                    positions.len(),
                    old.positions.len()
                )));
            }
            let taken = std::mem::take(old);
            let (uv0, uv1, colors) =
                if same { (taken.uv0, taken.uv1, taken.colors) } else { Default::default() };
            let indices = triangles.unwrap_or(taken.indices);
            *old = TriangleMesh { positions, normals, uv0, uv1, colors, indices, ..TriangleMesh::default() };
            Ok(())
        })
    }

    /// Removes an instance. The indices of those after it become less by one.
    ///
    /// Parameters
    /// ----------
    /// instance : int
    fn remove_instance(&self, py: Python, instance: u32) -> PyResult<()> {
        self.change(py, |scene| {
            scene.instances.remove(known("instance", instance, scene.instances.len())?);
            scene.animations.clear();
            Ok(())
        })
    }

    /// Removes a mesh with its instances. The indices of those after them become less.
    ///
    /// Parameters
    /// ----------
    /// mesh : int
    fn remove_mesh(&self, py: Python, mesh: u32) -> PyResult<()> {
        self.change(py, |scene| {
            scene.meshes.remove(known("mesh", mesh, scene.meshes.len())?);
            scene.instances.retain(|i| i.mesh != mesh);
            scene.instances.iter_mut().filter(|i| i.mesh > mesh).for_each(|i| i.mesh -= 1);
            scene.animations.clear();
            Ok(())
        })
    }

    /// Removes a light. The indices of those after it become less by one.
    ///
    /// Parameters
    /// ----------
    /// light : int
    fn remove_light(&self, py: Python, light: u32) -> PyResult<()> {
        self.change(py, |scene| {
            scene.lights.remove(known("light", light, scene.lights.len())?);
            scene.animations.clear();
            Ok(())
        })
    }

    /// Removes a camera. The indices of those after it become less by one.
    ///
    /// Parameters
    /// ----------
    /// camera : int
    fn remove_camera(&self, py: Python, camera: u32) -> PyResult<()> {
        self.change(py, |scene| {
            scene.cameras.remove(known("camera", camera, scene.cameras.len())?);
            scene.animations.clear();
            Ok(())
        })
    }

    /// Names of the meshes: list of str.
    #[getter]
    fn mesh_names(&self, py: Python) -> Vec<String> {
        self.contents(py).scene.meshes.iter().map(|m| m.name.clone()).collect()
    }

    /// Names of the lights: list of str.
    #[getter]
    fn light_names(&self, py: Python) -> Vec<String> {
        self.contents(py).scene.lights.iter().map(|l| l.name.clone()).collect()
    }

    /// Writes the scene, with all that it refers to, to a file that `load` and the command
    /// `alhazen` read. What moves is saved as it stands.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     Ends in .alhazen.
    fn save(&self, py: Python, path: PathBuf) -> PyResult<()> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        if !ending.eq_ignore_ascii_case(packed::ENDING) {
            return Err(bad(format!("{}: scenes are saved as .alhazen files", path.display())));
        }
        let bytes = self.packed(py)?;
        let failed = |source| alhazen::ImageError::Write { path: path.clone(), source };
        let write =
            || alhazen::write_atomically(&path, |w| std::io::Write::write_all(w, &bytes).map_err(failed));
        py.detach(write).map_err(protect::write_error)
    }

    /// A copy that shares nothing with the scene.
    fn __copy__(&self, py: Python) -> Self {
        Self::of(self.contents(py).scene.clone())
    }

    /// A copy that shares nothing with the scene.
    fn __deepcopy__(&self, py: Python, _memo: &Bound<PyAny>) -> Self {
        self.__copy__(py)
    }

    #[staticmethod]
    fn _unpickle(py: Python, data: &[u8]) -> PyResult<Self> {
        let scene = py.detach(|| packed::unpack(Path::new("the pickled scene"), data));
        scene.map(Self::of).map_err(load_error)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((py.get_type::<Self>().getattr("_unpickle")?, (PyBytes::new(py, &self.packed(py)?),)))
    }
}
