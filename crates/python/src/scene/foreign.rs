//! Meshes of other packages, by the arrays that they have.

use crate::arrays::Input;
use crate::errors::bad;
use pyo3::prelude::*;

/// The arrays of a mesh of trimesh, Open3D or the like.
#[derive(Default)]
pub struct ForeignMesh<'py> {
    pub vertices: Option<Bound<'py, PyAny>>,
    pub triangles: Option<Bound<'py, PyAny>>,
    pub normals: Option<Bound<'py, PyAny>>,
    pub uvs: Option<Bound<'py, PyAny>>,
    /// Linear RGB.
    pub colors: Option<Bound<'py, PyAny>>,
}

impl<'py> ForeignMesh<'py> {
    /// What an object has; nothing if it is no mesh.
    pub fn of(object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let attribute = |of: &Bound<'py, PyAny>, name: &str| of.getattr(name).ok().filter(|v| !v.is_none());
        let Some(vertices) = attribute(object, "vertices") else { return Ok(Self::default()) };
        let triangles = attribute(object, "faces").or_else(|| attribute(object, "triangles"));
        let mut mesh = Self { triangles, ..Self::default() };
        // Open3D has arrays of everything, which may be empty; trimesh computes smooth normals
        // whenever it is asked for some.
        let has = |what: &str| -> bool {
            let answer = object.call_method0(what).and_then(|answer| answer.extract::<bool>());
            answer.unwrap_or(false)
        };
        if has("has_vertex_normals") {
            mesh.normals = attribute(object, "vertex_normals");
        }
        if has("has_vertex_colors") {
            mesh.colors = attribute(object, "vertex_colors");
        }
        if let Some(visual) = attribute(object, "visual") {
            mesh.uvs = attribute(&visual, "uv").map(|uv| upside_down(&uv)).transpose()?;
            let kind = attribute(&visual, "kind").and_then(|kind| kind.extract::<String>().ok());
            if kind.as_deref() == Some("vertex") {
                mesh.colors = attribute(&visual, "vertex_colors").map(|c| linear(&c)).transpose()?;
            }
        }
        mesh.vertices = Some(vertices);
        Ok(mesh)
    }
}

/// Texture coordinates whose v axis points up, with v pointing down.
fn upside_down<'py>(uv: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let input = Input::<f32>::new("uv", uv)?;
    let turned = input.rows::<2>()?.iter().flat_map(|[u, v]| [*u, 1.0 - v]).collect();
    crate::arrays::output(uv.py(), turned, &[input.shape()[0], 2])
}

/// Colours of 8 bits as sRGB, with or without alpha, in linear RGB.
fn linear<'py>(colors: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let input = Input::<u8>::new("vertex_colors", colors)?;
    let [count, channels @ (3 | 4)] = *input.shape() else {
        return Err(bad("vertex_colors: expected the shape (n, 3 or 4)"));
    };
    let decode = |code: &u8| {
        // As it is written in hexadecimal.
        let [value, _, _] = alhazen::hex_color(&format!("#{code:02x}0000")).unwrap_or_default();
        value
    };
    let rgb = input.numbers()?.chunks_exact(channels).flat_map(|c| c[..3].iter().map(decode)).collect();
    crate::arrays::output(colors.py(), rgb, &[count, 3])
}
