//! Spheres: analytic, geodesic, and by longitude and latitude.

use super::patch::{Vertex, add_patch};
use crate::{Shape, Sphere, TriangleMesh};
use elementary::{acos, atan2, cos, sin};
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use std::f32::consts::{PI, TAU};

/// An analytic sphere around the origin; it is never tessellated.
pub fn sphere(radius: f32) -> Shape {
    Shape::Spheres(vec![Sphere { center: Vec3::ZERO, radius }])
}

/// A sphere of `segments` (at least 3) around and `rings` (at least 2) from pole to pole, its poles on the y axis.
pub fn uv_sphere(radius: f32, segments: u32, rings: u32) -> TriangleMesh {
    let (segments, rings) = (segments.max(3), rings.max(2));
    let mut mesh = TriangleMesh::default();
    add_patch(&mut mesh, segments, rings, |i, j| {
        let phi = TAU * (i % segments) as f32 / segments as f32;
        let theta = PI * j as f32 / rings as f32; // from the lower pole up
        let ring = if j == 0 || j == rings { 0.0 } else { sin(theta) };
        let normal = Vec3::new(ring * sin(phi), -cos(theta), ring * cos(phi)).normalize();
        let uv = Vec2::new(i as f32 / segments as f32, 1.0 - j as f32 / rings as f32);
        Vertex { position: normal * radius, normal, uv }
    });
    mesh
}

/// A sphere of `20 · 4^level` nearly equal triangles; `level` is at most 9 (5.2 million triangles).
///
/// Texture coordinates are those of [`uv_sphere`]; the seam is not split.
pub fn icosphere(radius: f32, level: u32) -> TriangleMesh {
    let (directions, indices) = unit_icosphere(level);
    TriangleMesh {
        positions: directions.iter().map(|n| *n * radius).collect(),
        uv0: directions.iter().map(|n| direction_uv(*n)).collect(),
        normals: directions,
        indices,
        ..Default::default()
    }
}

/// Equirectangular texture coordinates of a direction.
pub(super) fn direction_uv(n: Vec3) -> Vec2 {
    Vec2::new((atan2(n.x, n.z) / TAU).rem_euclid(1.0), acos(n.y.clamp(-1.0, 1.0)) / PI)
}

/// Unit vertices and triangles of a geodesic sphere.
pub(super) fn unit_icosphere(level: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    #[rustfmt::skip]
    let mut vertices: Vec<Vec3> = [
        [-1.0, g, 0.0], [1.0, g, 0.0], [-1.0, -g, 0.0], [1.0, -g, 0.0], [0.0, -1.0, g], [0.0, 1.0, g],
        [0.0, -1.0, -g], [0.0, 1.0, -g], [g, 0.0, -1.0], [g, 0.0, 1.0], [-g, 0.0, -1.0], [-g, 0.0, 1.0],
    ].iter().map(|v| Vec3::from_array(*v).normalize()).collect();
    #[rustfmt::skip]
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
        [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
        [8, 6, 7], [9, 8, 1],
    ];
    for _ in 0..level.min(9) {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::with_capacity(triangles.len() * 3 / 2);
        let mut finer = Vec::with_capacity(triangles.len() * 4);
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    vertices.push((vertices[i as usize] + vertices[j as usize]).normalize());
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (vertices, triangles)
}
