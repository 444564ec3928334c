//! What is to be subdivided.

use super::cage::Cage;
use super::description::{Displacement, Scheme};
use super::rate::Rate;
use crate::{Mesh, MeshId, Shape, TriangleMesh};

/// A mesh that will be subdivided.
#[derive(Clone, Debug)]
pub struct Refinement {
    /// Index into [`crate::Scene::meshes`]. Until then the mesh is the cage's.
    pub mesh: MeshId,
    /// What is subdivided.
    pub cage: Cage,
    /// How.
    pub scheme: Scheme,
    /// How finely.
    pub rate: Rate,
    /// How it is displaced.
    pub displacement: Option<Displacement>,
}

impl Refinement {
    /// A refinement that leaves the faces as they are.
    pub fn new(mesh: MeshId, cage: Cage) -> Self {
        Self { mesh, cage, scheme: Scheme::Linear, rate: Rate::Levels(0), displacement: None }
    }

    /// The refinement of a mesh as it is: of its triangles, and none of its spheres.
    ///
    /// - `pair`: see [`Cage::from_triangles`].
    pub fn of_mesh(number: MeshId, mesh: &Mesh, pair: bool) -> Option<Self> {
        let empty = TriangleMesh::default();
        let parts: Vec<_> = mesh
            .parts
            .iter()
            .map(|part| match &part.shape {
                Shape::Triangles(mesh) => (mesh, part.material),
                Shape::Spheres(_) => (&empty, part.material),
            })
            .collect();
        let cage = Cage::from_triangles(&parts, pair);
        (cage.faces() > 0).then(|| Self::new(number, cage))
    }
}
