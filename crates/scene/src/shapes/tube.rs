//! Tubes along curves: tori, knots, mouldings and rods.

use super::patch::{Vertex, add_patch};
use crate::TriangleMesh;
use elementary::{atan2, cos, sin};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// A torus about the y axis.
///
/// `radius` is that of the ring's centre line, `tube` that of its cross-section, metres.
pub fn torus(radius: f32, tube: f32, segments: u32, sides: u32) -> TriangleMesh {
    let (segments, sides) = (segments.max(3), sides.max(3));
    let mut mesh = TriangleMesh::default();
    add_patch(&mut mesh, segments, sides, |i, j| {
        let phi = TAU * (i % segments) as f32 / segments as f32;
        let theta = TAU * (j % sides) as f32 / sides as f32;
        let outward = Vec3::new(sin(phi), 0.0, cos(phi));
        let normal = outward * cos(theta) + Vec3::Y * sin(theta);
        let uv = Vec2::new(i as f32 / segments as f32, 1.0 - j as f32 / sides as f32);
        Vertex { position: outward * radius + normal * tube, normal, uv }
    });
    mesh
}

/// A torus knot about the y axis: `p` turns around the axis, `q` through the hole.
///
/// `radius` is that of the torus's centre line, `tube` that of the cross-section, metres.
pub fn knot(p: u32, q: u32, radius: f32, tube_radius: f32, segments: u32, sides: u32) -> TriangleMesh {
    let segments = segments.max(8);
    let path: Vec<Vec3> = (0..segments)
        .map(|i| {
            let t = TAU * i as f32 / segments as f32;
            let (around, through) = (t * p as f32, t * q as f32);
            let ring = radius * (1.0 + 0.45 * cos(through));
            Vec3::new(ring * sin(around), radius * 0.45 * sin(through), ring * cos(around))
        })
        .collect();
    tube(&path, true, tube_radius, sides)
}

/// A round tube along a polyline; an open one gets flat caps.
///
/// Points that coincide with their predecessor are left out; fewer than two points (three, if `closed`) give an
/// empty mesh.
pub fn tube(path: &[Vec3], closed: bool, radius: f32, sides: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut path = path.to_vec();
    path.dedup();
    if closed && path.len() > 1 && path.first() == path.last() {
        path.pop();
    }
    if path.len() < if closed { 3 } else { 2 } {
        return mesh;
    }
    let frames = frames(&path, closed);
    let (count, sides) = (path.len() as u32, sides.max(3));
    let ring = |i: u32, j: u32| {
        let k = (i % count) as usize;
        let theta = TAU * (j % sides) as f32 / sides as f32;
        let (_, right, up) = frames[k];
        let normal = right * cos(theta) + up * sin(theta);
        (path[k] + normal * radius, normal)
    };
    let columns = if closed { count } else { count - 1 };
    add_patch(&mut mesh, sides, columns, |j, i| {
        let (position, normal) = ring(i, j);
        Vertex { position, normal, uv: Vec2::new(j as f32 / sides as f32, i as f32 / columns as f32) }
    });
    if !closed {
        for (i, flip) in [(0, true), (count - 1, false)] {
            let (tangent, ..) = frames[i as usize];
            let normal = if flip { -tangent } else { tangent };
            add_patch(&mut mesh, sides, 1, |j, row| {
                let j = if flip { sides - j } else { j };
                let position = if row == 0 { ring(i, j).0 } else { path[i as usize] };
                Vertex { position, normal, uv: Vec2::splat(0.5) }
            });
        }
    }
    mesh
}

/// Tangent and two perpendicular directions at each point, twisted as little as possible (parallel transport); along
/// a closed curve the remaining twist is spread evenly. (right, up, tangent) is right-handed.
fn frames(path: &[Vec3], closed: bool) -> Vec<(Vec3, Vec3, Vec3)> {
    let count = path.len();
    let tangent = |i: usize| {
        let (before, after) = if closed {
            ((i + count - 1) % count, (i + 1) % count)
        } else {
            (i.saturating_sub(1), (i + 1).min(count - 1))
        };
        (path[after] - path[before]).normalize_or(Vec3::Y)
    };
    let mut right = tangent(0).any_orthonormal_vector();
    let mut rights = vec![right];
    for i in 1..count {
        right = transport(right, tangent(i));
        rights.push(right);
    }
    let twist = if closed {
        let end = transport(right, tangent(0));
        atan2(end.dot(rights[0].cross(tangent(0))), end.dot(rights[0]))
    } else {
        0.0
    };
    (0..count)
        .map(|i| {
            let t = tangent(i);
            let side = rights[i].cross(t); // turning by +angle: right·cos + (t × right)·sin, and side = right × t
            let angle = twist * i as f32 / count as f32;
            let right = rights[i] * cos(angle) - side * sin(angle);
            (t, right, t.cross(right))
        })
        .collect()
}

/// The direction closest to `right` that is perpendicular to `tangent`.
fn transport(right: Vec3, tangent: Vec3) -> Vec3 {
    (right - tangent * right.dot(tangent)).try_normalize().unwrap_or(tangent.any_orthonormal_vector())
}
