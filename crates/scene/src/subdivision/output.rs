//! Triangles of the faces that are not split further.

use super::cage::NONE;
use crate::TriangleMesh;
use elementary::acos;
use glam::{Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// Points of a surface, and what is on them, each made once.
#[derive(Default)]
pub(super) struct Points {
    /// On the limit.
    pub limits: Vec<Vec3>,
    /// Where displacement moves them; the same without one.
    pub positions: Vec<Vec3>,
    pub colors: Vec<Vec4>,
    pub uvs: [Vec<Vec2>; 2],
    /// Unit normals of the limit.
    pub normals: Vec<Vec3>,
}

/// What is at a corner of a face: numbers of a point, of both texture coordinates, and of a normal. [`NONE`] where there
/// is no such attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub point: u32,
    pub uvs: [u32; 2],
    pub normal: u32,
}

/// A face beside others that are split further.
struct Patched {
    part: u32,
    /// Vertices of its corners; the last one of a triangle is [`NONE`].
    corners: [u32; 4],
    /// The vertex in its middle; none in triangles.
    middle: u32,
}

/// The middle of an edge, as the face sees it that is split.
#[derive(Clone, Copy)]
pub(super) struct Middle {
    pub vertex: u32,
    /// The vertices at the ends of the edge.
    pub ends: [u32; 2],
}

/// Faces that are not split further.
#[derive(Default)]
pub(super) struct Output {
    pub points: Points,
    vertices: Vec<Corner>,
    /// The newest vertex of each point, and for each vertex an older one of the same point.
    newest: Vec<u32>,
    older: Vec<u32>,
    /// Triangles of each part.
    triangles: Vec<Vec<[u32; 3]>>,
    patched: Vec<Patched>,
    /// The middles of edges, by the points of both ends, the lesser number first.
    middles: HashMap<[u32; 2], Middle>,
}

impl Output {
    pub fn new(parts: usize) -> Self {
        Self { triangles: vec![Vec::new(); parts.max(1)], ..Self::default() }
    }

    /// The vertex of a corner.
    pub fn vertex(&mut self, corner: Corner) -> u32 {
        let point = corner.point as usize;
        if self.newest.len() <= point {
            self.newest.resize((point + 1).max(self.points.limits.len()), NONE);
        }
        let mut known = self.newest[point];
        while known != NONE {
            if self.vertices[known as usize] == corner {
                return known;
            }
            known = self.older[known as usize];
        }
        let vertex = self.vertices.len() as u32;
        self.vertices.push(corner);
        self.older.push(self.newest[point]);
        self.newest[point] = vertex;
        vertex
    }

    /// Adds a face of three or four vertices whose neighbours are not split further.
    pub fn add(&mut self, part: u32, face: &[u32]) {
        match *face {
            [a, b, c] => self.triangle(part, [a, b, c]),
            [a, b, c, d] => {
                // The shorter diagonal; both faces of a plane square are equal, then the first.
                let at = |v: u32| self.points.positions[self.vertices[v as usize].point as usize];
                if at(a).distance_squared(at(c)) <= at(b).distance_squared(at(d)) {
                    self.triangle(part, [a, b, c]);
                    self.triangle(part, [a, c, d]);
                } else {
                    self.triangle(part, [a, b, d]);
                    self.triangle(part, [b, c, d]);
                }
            }
            _ => {}
        }
    }

    /// Adds a face whose neighbours are split further. `middle`: the vertex in the middle of a quadrilateral.
    pub fn add_patched(&mut self, part: u32, face: &[u32], middle: u32) {
        let corners = [0, 1, 2, 3].map(|i| face.get(i).copied().unwrap_or(NONE));
        self.patched.push(Patched { part, corners, middle });
    }

    /// Says what is in the middle of an edge.
    pub fn add_middle(&mut self, middle: Middle) {
        self.middles.insert(self.edge(middle.ends), middle);
    }

    /// The points of two vertices, the lesser number first.
    fn edge(&self, ends: [u32; 2]) -> [u32; 2] {
        let [a, b] = ends.map(|v| self.vertices[v as usize].point);
        [a.min(b), a.max(b)]
    }

    fn triangle(&mut self, part: u32, triangle: [u32; 3]) {
        if let Some(triangles) = self.triangles.get_mut(part as usize) {
            triangles.push(triangle);
        }
    }

    /// Cuts the faces beside others that are split further into triangles, which have all vertices of these.
    pub fn patch(&mut self) {
        let mut outline = Vec::new();
        for face in std::mem::take(&mut self.patched) {
            outline.clear();
            let count = if face.corners[3] == NONE { 3 } else { 4 };
            let mut split_side = 0;
            for i in 0..count {
                let (a, b) = (face.corners[i], face.corners[(i + 1) % count]);
                outline.push(a);
                let before = outline.len();
                self.expand(a, b, &mut outline);
                if outline.len() > before {
                    split_side = i;
                }
            }
            let around = |i: usize| [outline[i], outline[(i + 1) % outline.len()]];
            if face.middle != NONE {
                for i in 0..outline.len() {
                    let [a, b] = around(i);
                    self.triangle(face.part, [a, b, face.middle]);
                }
                continue;
            }
            // One side of the triangle is split: a fan from the corner opposite.
            let opposite = face.corners[(split_side + 2) % 3];
            for i in 0..outline.len() {
                let [a, b] = around(i);
                if a != opposite && b != opposite {
                    self.triangle(face.part, [a, b, opposite]);
                }
            }
        }
    }

    /// Appends the vertices on an edge between two, in their order.
    fn expand(&mut self, a: u32, b: u32, outline: &mut Vec<u32>) {
        let Some(known) = self.middles.get(&self.edge([a, b])).copied() else { return };
        let middle = if known.ends == [a, b] || known.ends == [b, a] {
            known.vertex
        } else {
            let [from, to, split] = [a, b, known.vertex].map(|v| self.vertices[v as usize]);
            let corner = self.between(from, to, split.point);
            self.vertex(corner)
        };
        self.expand(a, middle, outline);
        outline.push(middle);
        self.expand(middle, b, outline);
    }

    /// The corner at a point in the middle of an edge, on the side of a face that is not split, where both sides differ: a
    /// mean of what is at the ends.
    fn between(&mut self, from: Corner, to: Corner, point: u32) -> Corner {
        let mut uvs = [NONE; 2];
        for set in [0, 1].into_iter().filter(|set| from.uvs[*set] != NONE) {
            let all = &mut self.points.uvs[set];
            let mean = 0.5 * (all[from.uvs[set] as usize] + all[to.uvs[set] as usize]);
            uvs[set] = all.len() as u32;
            all.push(mean);
        }
        let normals = &mut self.points.normals;
        let mean = normals[from.normal as usize] + normals[to.normal as usize];
        normals.push(mean.normalize_or(normals[from.normal as usize]));
        Corner { point, uvs, normal: normals.len() as u32 - 1 }
    }

    /// The meshes of all parts.
    ///
    /// - `displaced`: whether normals are those of the triangles, not those of the limit.
    pub fn meshes(mut self, displaced: bool) -> Vec<TriangleMesh> {
        if displaced {
            self.normals_of_triangles();
        }
        let all = std::mem::take(&mut self.triangles);
        let mut new = vec![NONE; self.vertices.len()];
        all.into_iter()
            .map(|mut triangles| {
                new.fill(NONE);
                let mut mesh = TriangleMesh::default();
                for vertex in triangles.iter_mut().flatten() {
                    let known = &mut new[*vertex as usize];
                    if *known == NONE {
                        *known = mesh.positions.len() as u32;
                        self.push(&mut mesh, self.vertices[*vertex as usize]);
                    }
                    *vertex = *known;
                }
                mesh.indices = triangles;
                mesh
            })
            .collect()
    }

    fn push(&self, mesh: &mut TriangleMesh, corner: Corner) {
        let point = corner.point as usize;
        mesh.positions.push(self.points.positions[point]);
        mesh.normals.push(self.points.normals[corner.normal as usize]);
        if let Some(color) = self.points.colors.get(point) {
            mesh.colors.push(*color);
        }
        let of_mesh = [&mut mesh.uv0, &mut mesh.uv1];
        for (set, uvs) in of_mesh.into_iter().enumerate() {
            if corner.uvs[set] != NONE {
                uvs.push(self.points.uvs[set][corner.uvs[set] as usize]);
            }
        }
    }

    /// Normals of vertices are means of the triangles around, by their angle there (Thürmer and Wüthrich 1998).
    fn normals_of_triangles(&mut self) {
        let mut sums = vec![Vec3::ZERO; self.points.normals.len()];
        for triangle in self.triangles.iter().flatten() {
            let corners = triangle.map(|v| self.vertices[v as usize]);
            let at = corners.map(|corner| self.points.positions[corner.point as usize]);
            let edges = [0, 1, 2].map(|k| (at[(k + 1) % 3] - at[k]).normalize_or_zero());
            let Some(normal) = (at[1] - at[0]).cross(at[2] - at[0]).try_normalize() else { continue };
            for (k, corner) in corners.iter().enumerate() {
                let cos_angle = -edges[k].dot(edges[(k + 2) % 3]);
                sums[corner.normal as usize] += normal * acos(cos_angle.clamp(-1.0, 1.0));
            }
        }
        for (normal, sum) in self.points.normals.iter_mut().zip(sums) {
            *normal = sum.try_normalize().unwrap_or(*normal);
        }
    }
}
