//! Filling a scene from arrays.

use super::Scene;
use super::foreign::ForeignMesh;
use crate::arrays::{Input, affine, output};
use crate::camera::Camera;
use crate::errors::bad;
use crate::material::{Described, LayersDescribed, material};
use crate::medium::{BodyDescribed, Medium};
use alhazen::{Instance, Mesh, Shape, Sphere, TriangleMesh};
use glam::Vec3;
use pyo3::prelude::*;
use pyo3::types::PyDict;

impl Scene {
    /// The index of a material that a caller names: by its index or name, by a colour such as "#ff8000", or by a dictionary of
    /// the arguments of `add_material`. The last two are added.
    fn material_index(slf: &Bound<Self>, value: Option<&Bound<PyAny>>) -> PyResult<u32> {
        let Some(value) = value else { return Ok(0) };
        if let Ok(keywords) = value.cast::<PyDict>() {
            return slf.call_method("add_material", (), Some(keywords))?.extract();
        }
        if let Ok(text) = value.extract::<String>() {
            if text.starts_with('#') {
                let keywords = PyDict::new(slf.py());
                keywords.set_item("base_color", text)?;
                return slf.call_method("add_material", (), Some(&keywords))?.extract();
            }
            let contents = slf.get().contents(slf.py());
            let found = contents.scene.materials.iter().position(|m| m.name == text);
            return found.map(|i| i as u32).ok_or_else(|| bad(format!("material: there is no `{text}`")));
        }
        value.extract().map_err(|_| bad("material: expected an index, a name, a colour or a dictionary"))
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
}

#[pymethods]
impl Scene {
    /// Adds a triangle mesh; it is seen where `add_instance` puts it.
    ///
    /// Parameters
    /// ----------
    /// vertices : array_like, float32, shape (n, 3), or a mesh
    ///     Positions in object space, metres. A mesh of trimesh, Open3D or the like has them as `vertices`, the triangles as
    ///     `faces` or `triangles`, and perhaps colours, texture coordinates and computed normals; these are taken as they are.
    /// triangles : array_like, int, shape (m, 3), optional
    ///     Indices of vertices, counter-clockwise seen from the front; those of the mesh if not given.
    /// normals : array_like, float32, shape (n, 3), optional
    ///     Unit shading normals; without them the mesh is flat-shaded.
    /// uvs : array_like, float32, shape (n, 2), optional
    ///     Texture coordinates; (0, 0) is the upper left corner of the picture.
    /// colors : array_like, float32, shape (n, 3), optional
    ///     Linear RGB, multiplied into the material's base colour.
    /// material : int, str or dict, default 0
    ///     What `add_material` returned, the name of a material, a colour such as "#ff8000", or a dictionary of the arguments
    ///     of `add_material`. A scene without materials has a grey one.
    /// name : str, default ""
    ///
    /// Returns
    /// -------
    /// int
    ///     Index of the mesh.
    #[pyo3(signature = (vertices, triangles=None, *, normals=None, uvs=None, colors=None, material=None, name=String::new()))]
    fn add_mesh(
        slf: &Bound<Self>,
        vertices: &Bound<PyAny>,
        triangles: Option<&Bound<PyAny>>,
        normals: Option<&Bound<PyAny>>,
        uvs: Option<&Bound<PyAny>>,
        colors: Option<&Bound<PyAny>>,
        material: Option<&Bound<PyAny>>,
        name: String,
    ) -> PyResult<u32> {
        let foreign = match triangles {
            Some(_) => ForeignMesh::default(),
            None => ForeignMesh::of(vertices)?,
        };
        let vertices = foreign.vertices.as_ref().unwrap_or(vertices);
        let missing = || bad("triangles: expected an array, or a mesh that has vertices and faces");
        let triangles = triangles.or(foreign.triangles.as_ref()).ok_or_else(missing)?;
        let normals = normals.or(foreign.normals.as_ref());
        let (uvs, colors) = (uvs.or(foreign.uvs.as_ref()), colors.or(foreign.colors.as_ref()));
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
        let material = Self::material_index(slf, material)?;
        slf.get().add_shape(slf.py(), Shape::Triangles(mesh), material, name)
    }

    /// Adds analytic spheres as one mesh; they are seen where `add_instance` puts it.
    ///
    /// Parameters
    /// ----------
    /// centers : array_like, float32, shape (n, 3)
    ///     In object space, metres.
    /// radii : array_like, float32, shape (n,)
    ///     Metres, positive.
    /// material : int, str or dict, default 0
    ///     As for `add_mesh`.
    /// name : str, default ""
    ///
    /// Returns
    /// -------
    /// int
    ///     Index of the mesh.
    #[pyo3(signature = (centers, radii, *, material=None, name=String::new()))]
    fn add_spheres(
        slf: &Bound<Self>,
        centers: &Bound<PyAny>,
        radii: &Bound<PyAny>,
        material: Option<&Bound<PyAny>>,
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
        let material = Self::material_index(slf, material)?;
        slf.get().add_shape(slf.py(), Shape::Spheres(spheres), material, name)
    }

    /// Puts a mesh into the world.
    ///
    /// Parameters
    /// ----------
    /// mesh : int
    ///     What `add_mesh` or `add_spheres` returned.
    /// transform : array_like, shape (4, 4) or (3, 4), optional
    ///     Object to world; the identity if not given.
    /// material : int, str or dict, optional
    ///     Replaces the mesh's own material; as for `add_mesh`.
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
        slf: &Bound<Self>,
        mesh: u32,
        transform: Option<&Bound<PyAny>>,
        material: Option<&Bound<PyAny>>,
        name: String,
        dynamic: bool,
    ) -> PyResult<u32> {
        let transform =
            transform.map(|t| affine("transform", t)).transpose()?.unwrap_or(glam::Affine3A::IDENTITY);
        let material = material.map(|m| Self::material_index(slf, Some(m))).transpose()?;
        slf.get().change(slf.py(), |scene| {
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
    /// model : {"metallic-roughness", "lambert", "dielectric", "mirror", "unlit", "boundary"}
    ///     How the surface scatters; metallic-roughness as glTF 2.0 has it if not given. A boundary is the end of a medium and
    ///     no surface.
    /// base_color : array_like, shape (3,) or (4,), default 0.8
    ///     Linear RGB, or RGB and alpha, each in [0, 1]; or a text such as "#ff8000", which is sRGB. Other colours may be
    ///     such texts as well.
    /// metallic, roughness, specular, transmission : float
    ///     In [0, 1]; roughness is perceptual, GGX's alpha is its square.
    /// ior : float, default 1.5
    ///     Index of refraction, at least 1.
    /// thin_walled : bool, default False
    ///     Light goes straight through instead of being refracted.
    /// sheen_color : float or array_like, shape (3,), default 0
    ///     Colour of a cloth's fibres, in [0, 1].
    /// specular_color : float or array_like, shape (3,), default 1
    ///     Colour of the reflection of what is not metal.
    /// iridescence_thickness : float, default 400
    ///     Thickness of a thin film, nanometres.
    /// anisotropy_rotation : float, default 0
    ///     Angle from the tangent to the direction in which highlights are stretched, radians.
    /// diffuse_transmission_color : float or array_like, shape (3,), default 1
    ///     Colour of the diffuse light that leaves on the other side, in [0, 1].
    /// **layers : float
    ///     Numbers of the layers by their names in scene files, with `_` for `-`; each is in [0, 1] unless it says otherwise:
    ///
    ///     - clearcoat, clearcoat_roughness: share of the surface under a clear coat, and the coat's roughness.
    ///     - sheen_roughness: of a cloth's fibres.
    ///     - iridescence, iridescence_ior: share under a thin film, and its index of refraction, 1 to 10.
    ///     - anisotropy: how far highlights are stretched along the tangent.
    ///     - diffuse_transmission: share of the diffuse light that leaves on the other side.
    ///     - diffuse_roughness: of the diffuse reflection, from Lambert's (0) to the roughest of Oren and Nayar's (1).
    ///     - dispersion: 20 / Abbe number, 0 to 20; needs refraction.
    /// attenuation_distance : float, default infinity
    ///     After so many metres inside of a body, white light has `attenuation_color`; needs refraction.
    /// medium : Medium, optional
    ///     What is inside of a body that light gets into: dielectrics, `transmission`, boundaries.
    /// subsurface_radius : float or array_like, shape (3,), optional
    ///     How far light gets on average inside of a dielectric before it is scattered, metres: skin, wax, marble. The body then
    ///     shows `base_color`; `subsurface_anisotropy` is the mean cosine of the angle by which scattered light turns.
    /// priority : int, optional
    ///     Which body is there where bodies overlap: the one of the highest priority.
    /// emission : float or array_like, shape (3,), default 0
    ///     Emitted radiance, linear RGB, W/(sr·m²); on the front side unless `emission_two_sided`.
    /// emission_two_sided : bool, default False
    /// alpha_mode : {"opaque", "mask", "blend"}, default "opaque"
    ///     Use of the base colour's alpha: none, a hole below `alpha_cutoff`, or coverage.
    /// alpha_cutoff : float, default 0.5
    /// base_color_texture, emission_texture : array_like, uint8 or float32, shape (height, width, 3 or 4), optional
    ///     Pictures multiplied into the base colour and the emission; row 0 at the top. Bytes are sRGB; floats are linear,
    ///     and of emission and unlit colours they may be above 1. Or a dict: a texture that is computed, such as
    ///     ``{"node": "noise", "octaves": 5, "space": "object", "scale": 3}``. Its keys are those of scene files, and an
    ///     ``image`` is an array.
    /// metallic_roughness_texture, normal_texture : array_like, uint8 or float32, shape (height, width, 3 or 4), optional
    ///     Linear: roughness in G and metalness in B; the tangent-space normal. Or a dict, whose value counts in all
    ///     channels; of `normal_texture` it is a height in metres.
    ///
    /// Returns
    /// -------
    /// int
    ///     Index of the material.
    #[pyo3(signature = (
        name=String::new(), *, model="metallic-roughness".into(), base_color=None, metallic=0.0, roughness=0.5,
        specular=1.0, ior=1.5, transmission=0.0, thin_walled=false, emission=None, emission_two_sided=false,
        alpha_mode="opaque".into(), alpha_cutoff=0.5, base_color_texture=None, metallic_roughness_texture=None,
        emission_texture=None, normal_texture=None, sheen_color=None, specular_color=None, iridescence_thickness=400.0,
        anisotropy_rotation=0.0, diffuse_transmission_color=None, attenuation_color=None,
        attenuation_distance=f32::INFINITY, medium=None, subsurface_radius=None, subsurface_anisotropy=0.0,
        priority=None, **layers
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
        sheen_color: Option<Bound<PyAny>>,
        specular_color: Option<Bound<PyAny>>,
        iridescence_thickness: f32,
        anisotropy_rotation: f32,
        diffuse_transmission_color: Option<Bound<PyAny>>,
        attenuation_color: Option<Bound<PyAny>>,
        attenuation_distance: f32,
        medium: Option<Bound<Medium>>,
        subsurface_radius: Option<Bound<PyAny>>,
        subsurface_anisotropy: f32,
        priority: Option<i32>,
        layers: Option<Bound<PyDict>>,
    ) -> PyResult<u32> {
        #[rustfmt::skip]
        let layers = LayersDescribed {
            numbers: layers, sheen_color, specular_color, iridescence_thickness, anisotropy_rotation,
            diffuse_transmission_color, attenuation_color, attenuation_distance,
        };
        let body = BodyDescribed { medium, subsurface_radius, subsurface_anisotropy, priority };
        #[rustfmt::skip]
        let described = Described {
            name, model, base_color, metallic, roughness, ior, specular, transmission, thin_walled, emission,
            emission_two_sided, alpha_mode, alpha_cutoff, base_color_texture, metallic_roughness_texture,
            emission_texture, normal_texture, layers, body,
        };
        self.change(py, |scene| {
            let material = material(scene, &described)?;
            scene.materials.push(material);
            Ok(scene.materials.len() as u32 - 1)
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
}

/// The rows of an optional array, which must be `count` if that is given.
pub(super) fn attribute<const N: usize, T>(
    name: &'static str,
    value: Option<&Bound<PyAny>>,
    count: Option<usize>,
    convert: impl Fn([f32; N]) -> T,
) -> PyResult<Vec<T>> {
    let Some(value) = value else { return Ok(Vec::new()) };
    let input = Input::<f32>::new(name, value)?;
    let rows = input.rows::<N>()?;
    if let Some(row) = rows.iter().position(|row| !row.iter().all(|x| x.is_finite())) {
        return Err(bad(format!("{name}: row {row} is {:?}", rows[row])));
    }
    match count {
        Some(count) if count != rows.len() => {
            Err(bad(format!("{name}: {} rows for {count} vertices", rows.len())))
        }
        _ => Ok(rows.iter().map(|row| convert(*row)).collect()),
    }
}

/// Triangles from an array of any kind of whole numbers.
pub(super) fn indices(triangles: &Bound<PyAny>, vertices: usize) -> PyResult<Vec<[u32; 3]>> {
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
