//! Records of geometry and instances.

/// What a geometry is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum GeometryKind {
    /// Indexed triangles.
    Triangles = 0,
    /// Analytic spheres.
    Spheres = 1,
}

/// Consecutive primitives of one material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometryRecord {
    /// Triangles or spheres.
    pub kind: GeometryKind,
    /// Index of the first primitive in `indices` or `spheres`.
    pub first_primitive: u32,
    /// Number of primitives.
    pub primitive_count: u32,
    /// Number that the bottom-level structure gives to the first primitive.
    pub first_in_blas: u32,
    /// Index of the first vertex in `positions`.
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertex_count: u32,
    /// Index of the first normal in `normals`, or [`super::NONE`].
    pub first_normal: u32,
    /// Index of the first tangent in `tangents`, or [`super::NONE`].
    pub first_tangent: u32,
    /// Index of the first coordinate in `uv0`, or [`super::NONE`].
    pub first_uv0: u32,
    /// Index of the first coordinate in `uv1`, or [`super::NONE`].
    pub first_uv1: u32,
    /// Index of the first colour in `colors`, or [`super::NONE`].
    pub first_color: u32,
}

/// A bottom-level structure: geometries of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlasRecord {
    /// Index of the first geometry in `geometries`.
    pub first_geometry: u32,
    /// Number of geometries, at least 1.
    pub geometry_count: u32,
    /// What all its geometries are made of.
    pub kind: GeometryKind,
}

/// A bottom-level structure placed in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceRecord {
    /// Rows of the 3×4 object-to-world matrix.
    pub object_to_world: [[f32; 4]; 3],
    /// Rows of its inverse.
    pub world_to_object: [[f32; 4]; 3],
    /// Index into `blas`.
    pub blas: u32,
    /// Index of the first geometry's binding.
    pub first_binding: u32,
    /// Whether `object_to_world` is the identity.
    pub identity: bool,
}

/// What belongs to one geometry of one instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BindingRecord {
    /// Index into `materials`.
    pub material: u32,
    /// Index into `primitive_lights` of the first primitive's light, or [`super::NONE`] if its light cannot be sampled.
    pub first_light: u32,
    /// Index into [`crate::Scene::instances`]: what the user calls an instance.
    pub object: u32,
    /// Index into [`super::SceneTables::placements`], or [`super::NONE`]: of geometry that was moved into world space and
    /// has something that lies in the space of the object.
    pub placement: u32,
}
