//! Flat shapes: rectangles, free quadrilaterals and subdivided grids.

use super::patch::{Vertex, add_patch, add_quad};
use crate::TriangleMesh;
use glam::{Vec2, Vec3};

/// A rectangle in the x–z plane, centred on the origin, that faces +Y.
///
/// `size`: its extent along x and z, metres.
pub fn rectangle(size: Vec2) -> TriangleMesh {
    grid(size, [1, 1])
}

/// A rectangle in the x–z plane that faces +Y, divided into `divisions[0] × divisions[1]` quadrilaterals (at least
/// one each).
pub fn grid(size: Vec2, divisions: [u32; 2]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let [columns, rows] = divisions.map(|d| d.max(1));
    add_patch(&mut mesh, columns, rows, |i, j| {
        let (u, v) = (i as f32 / columns as f32, j as f32 / rows as f32);
        Vertex {
            position: Vec3::new((u - 0.5) * size.x, 0.0, (0.5 - v) * size.y),
            normal: Vec3::Y,
            uv: Vec2::new(u, 1.0 - v),
        }
    });
    mesh
}

/// Flat quadrilaterals from four corners each, counter-clockwise seen from their front. Corners that do not fill a
/// quadrilateral are left out.
pub fn quads(corners: &[Vec3]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for quad in corners.chunks_exact(4) {
        add_quad(&mut mesh, [quad[0], quad[1], quad[2], quad[3]]);
    }
    mesh
}
