//! Geometry: meshes of one or several parts, each of one material, and their instances.

use crate::{MaterialId, MeshId};
use glam::{Affine3A, Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// Geometry that can be instanced: one or several parts.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Mesh {
    /// Name from the file, for messages and overrides. Need not be unique.
    pub name: String,
    /// Pieces of one material each (a glTF primitive, an OBJ `usemtl` range, a sphere set).
    pub parts: Vec<Part>,
}

/// A piece of a mesh that has one material.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Part {
    /// The surface.
    pub shape: Shape,
    /// Index into [`crate::Scene::materials`].
    pub material: MaterialId,
}

/// A surface in object space.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Shape {
    /// Indexed triangles.
    Triangles(TriangleMesh),
    /// Analytic spheres; they are never tessellated.
    Spheres(Vec<Sphere>),
}

/// An analytic sphere, in object space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// Centre, in metres.
    pub center: Vec3,
    /// Radius, in metres, positive.
    pub radius: f32,
}

/// Indexed triangles with optional vertex attributes.
///
/// Every attribute array is either empty (absent) or as long as `positions`. Counter-clockwise winding faces front.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TriangleMesh {
    /// Positions in object space, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals. Empty: the mesh is flat-shaded with geometric normals.
    pub normals: Vec<Vec3>,
    /// Unit tangent (xyz) and handedness of the bitangent (w = ±1), as glTF has them.
    pub tangents: Vec<Vec4>,
    /// First set of texture coordinates; (0, 0) is the image's upper left corner as in glTF.
    pub uv0: Vec<Vec2>,
    /// Second set of texture coordinates.
    pub uv1: Vec<Vec2>,
    /// Linear vertex colours, multiplied into the base colour.
    pub colors: Vec<Vec4>,
    /// Vertex indices of each triangle, each less than `positions.len()`.
    pub indices: Vec<[u32; 3]>,
}

/// A mesh placed in the world.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Instance {
    /// Name of the node, for messages, overrides and picking.
    pub name: String,
    /// Index into [`crate::Scene::meshes`].
    pub mesh: MeshId,
    /// Object to world.
    pub transform: Affine3A,
    /// Replaces the parts' own materials, one entry for each part; `None` keeps them.
    pub materials: Option<Vec<MaterialId>>,
    /// Hidden instances are not part of the picture and cast no shadow.
    pub visible: bool,
    /// Whether the transform may change later. Static instances of a mesh that stands in the world once are moved
    /// into world space when tables are built, which makes tracing faster.
    pub dynamic: bool,
}

impl Instance {
    /// A visible static instance with the parts' own materials.
    pub fn new(name: impl Into<String>, mesh: MeshId, transform: Affine3A) -> Self {
        Self { name: name.into(), mesh, transform, materials: None, visible: true, dynamic: false }
    }
}

impl Mesh {
    /// A mesh of one part.
    pub fn single(name: impl Into<String>, shape: Shape, material: MaterialId) -> Self {
        Self { name: name.into(), parts: vec![Part { shape, material }] }
    }

    /// Number of triangles in all parts.
    pub fn triangle_count(&self) -> usize {
        let triangles = |part: &Part| match &part.shape {
            Shape::Triangles(mesh) => mesh.indices.len(),
            Shape::Spheres(_) => 0,
        };
        self.parts.iter().map(triangles).sum()
    }

    /// Object-space bounds of all finite vertices and spheres; `None` if there are none.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let parts = self.parts.iter().filter_map(|part| part.shape.bounds());
        parts.reduce(|(a, b), (low, high)| (a.min(low), b.max(high)))
    }
}

impl Shape {
    /// Bounds of all finite vertices and spheres; `None` if there are none.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut bounds: Option<(Vec3, Vec3)> = None;
        let mut grow = |low: Vec3, high: Vec3| {
            if low.is_finite() && high.is_finite() {
                let (a, b) = bounds.unwrap_or((low, high));
                bounds = Some((a.min(low), b.max(high)));
            }
        };
        match self {
            Shape::Triangles(mesh) => mesh.positions.iter().for_each(|p| grow(*p, *p)),
            Shape::Spheres(spheres) => {
                spheres.iter().for_each(|s| grow(s.center - s.radius, s.center + s.radius));
            }
        }
        bounds
    }
}
