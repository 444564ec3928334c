//! Faces of any number of corners, and strips, before their vertices are known.

use super::INVALID;
use crate::triangulate::Triangulator;
use crate::{LoadReport, TriangleMesh};
use glam::Vec2;
use std::collections::HashMap;

/// Faces before triangulation: their vertices may come after them.
#[derive(Default)]
pub(super) struct Polygons {
    /// Vertex of each corner; out-of-range values are kept.
    pub corners: Vec<u32>,
    /// Texture coordinates of each corner; empty if no face has them.
    uvs: Vec<Vec2>,
    /// Where each face's corners end.
    pub ends: Vec<usize>,
    /// Triangles of strips.
    pub strips: Vec<[u32; 3]>,
}

impl Polygons {
    /// A face: its vertices, and of each corner both texture coordinates or none.
    pub fn add(&mut self, corners: &[u32], uvs: &[f32]) {
        let start = self.corners.len();
        self.corners.extend_from_slice(corners);
        self.ends.push(self.corners.len());
        if uvs.len() == corners.len() * 2 && !uvs.is_empty() {
            self.uvs.resize(start, Vec2::ZERO);
            self.uvs.extend(uvs.as_chunks::<2>().0.iter().map(|uv| Vec2::new(uv[0], 1.0 - uv[1])));
        }
    }

    /// Triangles of strips, which −1 separates; every other one is turned round.
    pub fn add_strips(&mut self, corners: &[u32]) {
        for strip in corners.split(|c| *c == INVALID) {
            for (i, window) in strip.windows(3).enumerate() {
                let [a, b, c] = [window[0], window[1], window[2]];
                if a != b && b != c && c != a {
                    self.strips.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
                }
            }
        }
    }

    /// Cuts all faces into triangles of the mesh, whose vertices are complete.
    pub fn triangulate(mut self, mesh: &mut TriangleMesh, report: &mut LoadReport) {
        let count = mesh.positions.len();
        let in_range = |i: &u32| (*i as usize) < count;
        let (mut out_of_range, mut too_small, mut not_simple) = (0usize, 0usize, 0usize);
        let by_corner = !self.uvs.is_empty();
        if by_corner {
            self.uvs.resize(self.corners.len(), Vec2::ZERO);
        }
        let mut triangulator = Triangulator::default();
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        let mut corner_triangles: Vec<[usize; 3]> = Vec::new();
        let mut start = 0;
        for end in self.ends {
            let (first, face) = (start, &self.corners[start..end]);
            start = end;
            if face.len() < 3 {
                too_small += 1;
                continue;
            }
            if !face.iter().all(in_range) {
                out_of_range += 1;
                continue;
            }
            triangles.clear();
            points.clear();
            points.extend(face.iter().map(|i| mesh.positions[*i as usize]));
            not_simple += usize::from(!triangulator.polygon(&points, &mut triangles));
            if by_corner {
                corner_triangles.extend(triangles.iter().map(|t| t.map(|i| first + i as usize)));
            } else {
                mesh.indices.extend(triangles.iter().map(|t| t.map(|i| face[i as usize])));
            }
        }
        if by_corner {
            split_by_corner(mesh, &self.corners, &self.uvs, &corner_triangles);
        }
        let (strips, broken): (Vec<_>, Vec<_>) =
            self.strips.into_iter().partition(|t| t.iter().all(in_range));
        out_of_range += broken.len();
        mesh.indices.extend(strips);
        if out_of_range > 0 {
            report.ignored(format!("{out_of_range} faces refer to vertices that do not exist ({count} do)"));
        }
        if too_small > 0 {
            report.ignored(format!("{too_small} faces have fewer than three corners"));
        }
        if not_simple > 0 {
            report.repaired(format!("{not_simple} polygons cross themselves or have no area"));
        }
    }
}

/// Gives each vertex the texture coordinates of its corners, adding a vertex for each further pair of them, and turns
/// triangles of corners into triangles of vertices.
fn split_by_corner(mesh: &mut TriangleMesh, corners: &[u32], uvs: &[Vec2], triangles: &[[usize; 3]]) {
    let mut known: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
    let mut assigned = vec![false; mesh.positions.len()];
    mesh.uv0 = vec![Vec2::ZERO; mesh.positions.len()];
    let mut vertex_of = |corner: usize| {
        let (vertex, uv) = (corners[corner], uvs[corner]);
        *known.entry((vertex, uv.to_array().map(f32::to_bits))).or_insert_with(|| {
            let old = vertex as usize;
            if !std::mem::replace(&mut assigned[old], true) {
                mesh.uv0[old] = uv;
                return vertex;
            }
            mesh.positions.push(mesh.positions[old]);
            mesh.uv0.push(uv);
            if let Some(normal) = mesh.normals.get(old).copied() {
                mesh.normals.push(normal);
            }
            if let Some(color) = mesh.colors.get(old).copied() {
                mesh.colors.push(color);
            }
            (mesh.positions.len() - 1) as u32
        })
    };
    let indices: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(&mut vertex_of)).collect();
    mesh.indices.extend(indices);
}
