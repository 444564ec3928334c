//! Regular patches of vertices: the building block of almost every other shape.

use crate::TriangleMesh;
use glam::{Vec2, Vec3};

/// One vertex of a patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    /// Position, metres.
    pub position: Vec3,
    /// Unit shading normal.
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
}

/// Adds `columns × rows` quadrilaterals whose corners are `vertex(column, row)`.
///
/// The front side is where columns go to the right and rows go up. A triangle with two equal corners (at a pole) is
/// left out.
pub(super) fn add_patch(
    mesh: &mut TriangleMesh,
    columns: u32,
    rows: u32,
    mut vertex: impl FnMut(u32, u32) -> Vertex,
) {
    let base = mesh.positions.len() as u32;
    for row in 0..=rows {
        for column in 0..=columns {
            let v = vertex(column, row);
            mesh.positions.push(v.position);
            mesh.normals.push(v.normal);
            mesh.uv0.push(v.uv);
        }
    }
    let at = |column: u32, row: u32| base + row * (columns + 1) + column;
    for row in 0..rows {
        for column in 0..columns {
            let (a, b) = (at(column, row), at(column + 1, row));
            let (c, d) = (at(column + 1, row + 1), at(column, row + 1));
            add_triangle(mesh, [a, b, c]);
            add_triangle(mesh, [a, c, d]);
        }
    }
}

/// Adds a triangle unless two of its corners coincide.
pub(super) fn add_triangle(mesh: &mut TriangleMesh, [a, b, c]: [u32; 3]) {
    let [p, q, r] = [a, b, c].map(|i| mesh.positions[i as usize]);
    if p != q && q != r && r != p {
        mesh.indices.push([a, b, c]);
    }
}

/// Adds a flat quadrilateral, corners counter-clockwise; texture coordinates run from (0, 0) at the first corner to
/// (1, 1) at the third, and its normal is that of its diagonals.
pub(super) fn add_quad(mesh: &mut TriangleMesh, corners: [Vec3; 4]) {
    let [a, b, c, d] = corners;
    let normal = (c - a).cross(d - b).normalize_or_zero();
    let base = mesh.positions.len() as u32;
    for (position, uv) in corners.into_iter().zip([Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]) {
        mesh.positions.push(position);
        mesh.normals.push(normal);
        mesh.uv0.push(uv);
    }
    add_triangle(mesh, [base, base + 1, base + 2]);
    add_triangle(mesh, [base, base + 2, base + 3]);
}
