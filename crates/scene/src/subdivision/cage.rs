//! Meshes of polygons as they were modelled, and what has to be mended before they can be subdivided.

use super::description::Scheme;
use crate::triangulate::Triangulator;
use crate::{MaterialId, TriangleMesh};
use glam::{Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// No index.
pub(super) const NONE: u32 = u32::MAX;

/// A mesh of polygons. Lists by corner are as long as `positions_of`, or empty where there is no such attribute.
#[derive(Clone, Debug, Default)]
pub struct Cage {
    /// Positions in object space, metres.
    pub positions: Vec<Vec3>,
    /// Linear colour of each position, or empty.
    pub colors: Vec<Vec4>,
    /// Number of each position in its file, by which creases are named there; empty: its own.
    pub numbers: Vec<u32>,
    /// Both sets of texture coordinates, each with a numbering of its own.
    pub uvs: [Vec<Vec2>; 2],
    /// Unit normals, with a numbering of their own. Only [`Scheme::Linear`] uses them.
    pub normals: Vec<Vec3>,
    /// Where the corners of each face end.
    pub ends: Vec<u32>,
    /// For each corner its position.
    pub positions_of: Vec<u32>,
    /// For each corner its texture coordinates, of either set.
    pub uvs_of: [Vec<u32>; 2],
    /// For each corner its normal.
    pub normals_of: Vec<u32>,
    /// For each face the part of the mesh that it becomes a piece of; empty: all belong to the first.
    pub parts: Vec<u32>,
    /// Material of each part.
    pub materials: Vec<MaterialId>,
    /// Edges that stay sharp: both positions, and for how many levels. From [`Cage::ENDLESS`] on for ever.
    pub creases: Vec<([u32; 2], f32)>,
    /// Positions that stay where they are, and for how many levels.
    pub corners: Vec<(u32, f32)>,
    /// Whether corners of the border, where there is one face only, are rounded like the rest of it.
    pub round_corners: bool,
}

/// What had to be mended in a cage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CageReport {
    /// Faces without three different corners, with a corner twice, or with one that is nowhere; they are left out.
    pub broken_faces: usize,
    /// Edges of more than two faces, or of two that are wound against each other; the surface is cut open there.
    pub cut_edges: usize,
    /// Faces that were cut into triangles for [`Scheme::Loop`].
    pub triangulated: usize,
}

impl Cage {
    /// Creases and corners of this sharpness and more never become smooth (as in OpenSubdiv).
    pub const ENDLESS: f32 = 10.0;

    /// The cage of triangle meshes that are pieces of one surface, each with its material. Vertices in the same position are
    /// one; what else differs between them are seams. Two triangles that follow each other and lie in a plane become a
    /// quadrilateral, if `pair`.
    pub fn from_triangles(meshes: &[(&TriangleMesh, MaterialId)], pair: bool) -> Self {
        let mut cage = Self::default();
        let has = |of: fn(&TriangleMesh) -> usize| meshes.iter().any(|(mesh, _)| of(mesh) > 0);
        let has_uv = [has(|m| m.uv0.len()), has(|m| m.uv1.len())];
        let (has_colors, has_normals) = (has(|m| m.colors.len()), has(|m| m.normals.len()));
        let mut places: HashMap<[u32; 3], u32> = HashMap::new();
        for (part, (mesh, material)) in meshes.iter().enumerate() {
            cage.materials.push(*material);
            let first_uv = [0, 1].map(|set| cage.uvs[set].len() as u32);
            let first_normal = cage.normals.len() as u32;
            let count = mesh.positions.len();
            let mut place_of = Vec::with_capacity(count);
            for (i, position) in mesh.positions.iter().enumerate() {
                // Zero and minus zero are the same place.
                let bits = (*position + Vec3::ZERO).to_array().map(f32::to_bits);
                let place = *places.entry(bits).or_insert(cage.positions.len() as u32);
                if place as usize == cage.positions.len() {
                    cage.positions.push(*position);
                    if has_colors {
                        cage.colors.push(mesh.colors.get(i).copied().unwrap_or(Vec4::ONE));
                    }
                }
                place_of.push(place);
            }
            let sets = [&mesh.uv0, &mesh.uv1];
            for set in [0, 1].into_iter().filter(|set| has_uv[*set]) {
                cage.uvs[set].extend((0..count).map(|i| sets[set].get(i).copied().unwrap_or(Vec2::ZERO)));
            }
            if has_normals {
                cage.normals.extend((0..count).map(|i| mesh.normals.get(i).copied().unwrap_or(Vec3::ZERO)));
            }
            let mut triangles = mesh.indices.iter().peekable();
            while let Some(triangle) = triangles.next() {
                let joined = triangles.peek().filter(|_| pair).and_then(|next| quad(mesh, triangle, next));
                let face: &[u32] = match &joined {
                    Some(quad) => {
                        triangles.next();
                        quad
                    }
                    None => triangle,
                };
                if face.iter().any(|i| *i as usize >= count) {
                    continue;
                }
                cage.positions_of.extend(face.iter().map(|i| place_of[*i as usize]));
                for set in [0, 1].into_iter().filter(|set| has_uv[*set]) {
                    cage.uvs_of[set].extend(face.iter().map(|i| i + first_uv[set]));
                }
                if has_normals {
                    cage.normals_of.extend(face.iter().map(|i| i + first_normal));
                }
                cage.ends.push(cage.positions_of.len() as u32);
                cage.parts.push(part as u32);
            }
        }
        cage
    }

    /// Number of faces.
    pub fn faces(&self) -> usize {
        self.ends.len()
    }

    /// The corners of a face.
    pub(super) fn face(&self, face: usize) -> std::ops::Range<usize> {
        let start = if face == 0 { 0 } else { self.ends[face - 1] as usize };
        start..self.ends[face] as usize
    }

    /// The part of a face.
    pub(super) fn part(&self, face: usize) -> u32 {
        self.parts.get(face).copied().unwrap_or(0)
    }

    /// Makes a crease of every edge whose faces meet at more than `angle` radians.
    pub fn crease_by_angle(&mut self, angle: f32, sharpness: f32) {
        let normal = |face: usize| {
            let corners: Vec<Vec3> = self.face(face).filter_map(|c| self.position_at(c)).collect();
            newell(&corners).normalize_or_zero()
        };
        let cos_angle = elementary::cos(angle.clamp(0.0, std::f32::consts::PI));
        let mut first: HashMap<[u32; 2], usize> = HashMap::new();
        let mut creases = Vec::new();
        for face in 0..self.faces() {
            let corners = self.face(face);
            for c in corners.clone() {
                let next = if c + 1 == corners.end { corners.start } else { c + 1 };
                let (a, b) = (self.positions_of[c], self.positions_of[next]);
                let edge = [a.min(b), a.max(b)];
                if let Some(other) = first.insert(edge, face)
                    && normal(face).dot(normal(other)) < cos_angle
                {
                    creases.push((edge, sharpness));
                }
            }
        }
        self.creases.extend(creases);
    }

    fn position_at(&self, corner: usize) -> Option<Vec3> {
        self.positions.get(*self.positions_of.get(corner)? as usize).copied()
    }

    /// Faces that can be subdivided, in place of those that cannot.
    pub(super) fn cleaned(&self, scheme: Scheme, report: &mut CageReport) -> Self {
        let mut clean = Self {
            positions: self.positions.clone(),
            colors: if self.colors.len() == self.positions.len() { self.colors.clone() } else { Vec::new() },
            normals: self.normals.clone(),
            uvs: self.uvs.clone(),
            materials: self.materials.clone(),
            creases: self.creases.clone(),
            corners: self.corners.clone(),
            round_corners: self.round_corners,
            ..Self::default()
        };
        let count = self.positions_of.len();
        let complete = |of: &[u32], values: usize| {
            of.len() == count && of.iter().all(|index| (*index as usize) < values)
        };
        let has_uv = [0, 1].map(|set| complete(&self.uvs_of[set], self.uvs[set].len()));
        let has_normals = complete(&self.normals_of, self.normals.len());
        let mut add = |corners: &[usize], part: u32| {
            clean.positions_of.extend(corners.iter().map(|c| self.positions_of[*c]));
            for set in [0, 1].into_iter().filter(|set| has_uv[*set]) {
                clean.uvs_of[set].extend(corners.iter().map(|c| self.uvs_of[set][*c]));
            }
            if has_normals {
                clean.normals_of.extend(corners.iter().map(|c| self.normals_of[*c]));
            }
            clean.ends.push(clean.positions_of.len() as u32);
            clean.parts.push(part);
        };
        let mut triangulator = Triangulator::default();
        let (mut kept, mut triangles) = (Vec::new(), Vec::new());
        let mut seen: Vec<u32> = Vec::new();
        for face in 0..self.faces() {
            let corners = self.face(face);
            kept.clear();
            let at = |c: usize| self.positions_of.get(c).copied().unwrap_or(NONE);
            // Neighbouring corners in one place are one.
            kept.extend(corners.clone().filter(|c| {
                let before = if *c == corners.start { corners.end - 1 } else { c - 1 };
                at(*c) != at(before)
            }));
            seen.clear();
            seen.extend(kept.iter().map(|c| at(*c)));
            seen.sort_unstable();
            seen.dedup();
            let is_finite = |c: &usize| self.position_at(*c).is_some_and(Vec3::is_finite);
            if kept.len() < 3 || seen.len() < kept.len() || !kept.iter().all(is_finite) {
                report.broken_faces += 1;
                continue;
            }
            if scheme == Scheme::Loop && kept.len() > 3 {
                report.triangulated += 1;
                let points: Vec<Vec3> = kept.iter().filter_map(|c| self.position_at(*c)).collect();
                triangles.clear();
                triangulator.polygon(&points, &mut triangles);
                for t in &triangles {
                    add(&t.map(|i| kept[i as usize]), self.part(face));
                }
            } else {
                add(&kept, self.part(face));
            }
        }
        if clean.materials.is_empty() {
            clean.materials.push(0);
        }
        clean
    }
}

/// The normal of a polygon, not normalised (Newell's).
pub(super) fn newell(corners: &[Vec3]) -> Vec3 {
    let Some(first) = corners.first() else { return Vec3::ZERO };
    let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
    pairs.map(|(a, b)| (*a - *first).cross(*b - *first)).sum()
}

/// The quadrilateral of two triangles that share an edge and lie in a plane.
fn quad(mesh: &TriangleMesh, one: &[u32; 3], other: &[u32; 3]) -> Option<[u32; 4]> {
    let at = |i: u32| mesh.positions.get(i as usize).copied();
    // The edge from a to b of the first is that from b to a of the second.
    let (k, far) = (0..3).find_map(|k| {
        let (a, b) = (one[k], one[(k + 1) % 3]);
        (0..3).find_map(|j| (other[j] == b && other[(j + 1) % 3] == a).then(|| (k, other[(j + 2) % 3])))
    })?;
    let quad = [one[k], far, one[(k + 1) % 3], one[(k + 2) % 3]];
    let [a, b, c, d] = quad.map(at);
    let corners = [a?, b?, c?, d?];
    let normal = newell(&corners).try_normalize()?;
    let is_convex = (0..4).all(|i| {
        let [before, at, after] = [corners[(i + 3) % 4], corners[i], corners[(i + 1) % 4]];
        let (e, f) = (at - before, after - at);
        let turn = e.cross(f);
        turn.dot(normal) > 0.05 * e.length() * f.length() && turn.dot(normal) > 0.999 * turn.length()
    });
    is_convex.then_some(quad)
}
