//! Boxes, with sharp or rounded edges.

use super::patch::{Vertex, add_patch};
use crate::TriangleMesh;
use elementary::tan;
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_PI_4;

/// A box around the origin.
///
/// - `size`: full extents, metres.
/// - `bevel`: radius of the rounded edges, metres; clamped to half the smallest extent. 0 keeps edges sharp.
/// - `segments`: quadrilaterals across half an edge's rounding, at least 1.
pub fn cuboid(size: Vec3, bevel: f32, segments: u32) -> TriangleMesh {
    let half = size.abs() * 0.5;
    let bevel = bevel.clamp(0.0, half.min_element());
    let steps = if bevel > 0.0 { segments.max(1) } else { 0 };
    let mut mesh = TriangleMesh::default();
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            add_face(&mut mesh, half, bevel, steps, axis, sign);
        }
    }
    mesh
}

/// Adds the face whose normal is `sign` along `axis`, with its share of the rounded edges.
fn add_face(mesh: &mut TriangleMesh, half: Vec3, bevel: f32, steps: u32, axis: usize, sign: f32) {
    // (right, up, normal) is right-handed for both signs.
    let (right, up) =
        if sign > 0.0 { ((axis + 1) % 3, (axis + 2) % 3) } else { ((axis + 2) % 3, (axis + 1) % 3) };
    let inner = half - bevel;
    let divisions = 2 * steps + 1;
    add_patch(mesh, divisions, divisions, |i, j| {
        let (a, b) = (edge_coordinate(i, steps), edge_coordinate(j, steps));
        let mut direction = Vec3::ZERO;
        direction[axis] = sign;
        let mut core = Vec3::ZERO;
        core[axis] = sign * inner[axis];
        for (along, (side, bend)) in [(right, a), (up, b)] {
            direction[along] = bend;
            core[along] = side * inner[along];
        }
        let normal = direction.normalize();
        let position = core + normal * bevel;
        let place = |along: usize| position[along] / (2.0 * half[along]).max(f32::MIN_POSITIVE) + 0.5;
        let (mut u, mut v) = (place(right), 1.0 - place(up));
        if axis == 0 || (axis == 1 && sign < 0.0) {
            (u, v) = (1.0 - v, 1.0 - u); // keep v vertical on the sides
        }
        Vertex {
            position,
            normal: if bevel > 0.0 { normal } else { sign * Vec3::AXES[axis] },
            uv: Vec2::new(u, v),
        }
    });
}

/// For step `i` of a face: which side it is on (−1 or 1), and the tangent of the normal's tilt towards that side.
fn edge_coordinate(i: u32, steps: u32) -> (f32, f32) {
    let (side, from_flat) = if i <= steps { (-1.0, steps - i) } else { (1.0, i - steps - 1) };
    if from_flat == 0 {
        return (side, 0.0);
    }
    if from_flat == steps {
        return (side, side); // exactly, so that neighbouring faces meet
    }
    (side, side * tan(FRAC_PI_4 * from_flat as f32 / steps as f32))
}
