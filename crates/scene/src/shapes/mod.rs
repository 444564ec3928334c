//! Procedural shapes: pure functions from a few numbers to geometry.
//!
//! Every function returns a [`TriangleMesh`] with unit normals and texture coordinates, wound counter-clockwise seen
//! from outside, or analytic spheres. Closed shapes are watertight: neighbouring triangles share bit-identical
//! positions along their edge, also where normals or texture coordinates differ. Sizes that are too small or too
//! large are clamped to what the functions document, so that none of them fails; whoever takes numbers from a file
//! checks them before.

mod arch;
mod blob;
mod cloth;
mod coffer;
mod column;
mod cuboid;
mod lathe;
pub(crate) mod noise;
mod patch;
mod plane;
mod sphere;
mod terrain;
mod tube;

pub use arch::{Arch, arch};
pub use blob::{Blob, blob};
pub use cloth::{Curtain, curtain};
pub use coffer::{Coffers, coffers};
pub use column::{Column, baluster, column};
pub use cuboid::cuboid;
pub use lathe::{Lathe, cylinder, lathe};
pub use plane::{grid, quads, rectangle};
pub use sphere::{icosphere, sphere, uv_sphere};
pub use terrain::{Terrain, terrain};
pub use tube::{knot, torus, tube};

use crate::TriangleMesh;

/// Appends `other` to `mesh`.
///
/// Attributes that only one of the two has are dropped, so that the result stays consistent.
pub fn append(mesh: &mut TriangleMesh, other: TriangleMesh) {
    if mesh.positions.is_empty() {
        *mesh = other;
        return;
    }
    let base = mesh.positions.len() as u32;
    let (count, added) = (mesh.positions.len(), other.positions.len());
    join(&mut mesh.normals, other.normals, count, added);
    join(&mut mesh.tangents, other.tangents, count, added);
    join(&mut mesh.uv0, other.uv0, count, added);
    join(&mut mesh.uv1, other.uv1, count, added);
    join(&mut mesh.colors, other.colors, count, added);
    mesh.positions.extend(other.positions);
    mesh.indices.extend(other.indices.into_iter().map(|t| t.map(|i| i + base)));
}

/// Moves every vertex by a rigid motion with an optional uniform scale.
pub fn transformed(mut mesh: TriangleMesh, motion: &glam::Affine3A) -> TriangleMesh {
    mesh.positions.iter_mut().for_each(|p| *p = motion.transform_point3(*p));
    mesh.normals.iter_mut().for_each(|n| *n = motion.transform_vector3(*n).normalize_or_zero());
    mesh
}

fn join<T>(attribute: &mut Vec<T>, other: Vec<T>, count: usize, added: usize) {
    if attribute.len() == count && other.len() == added {
        attribute.extend(other);
    } else {
        attribute.clear();
    }
}

#[cfg(test)]
mod tests;
