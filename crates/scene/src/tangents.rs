//! Tangents for normal maps, by the MikkTSpace algorithm that the makers of normal maps use.

use crate::TriangleMesh;
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec3, Vec4};

/// Computes the tangents of a mesh from its texture coordinates.
///
/// - `uv_set`: the set of texture coordinates of the normal map, 0 or 1.
///
/// Vertices are split where the triangles around them have different tangents, as along the seams of mirrored
/// textures, so that the mesh may have more vertices afterwards. A mesh without normals keeps none: its tangents are
/// those of the flat triangles. Does nothing for a mesh without triangles or without that set of coordinates.
///
/// The bitangent, `w · normal × tangent`, points towards the upper side of the image, as glTF defines it.
/// Indices must be in range. Positions, normals and coordinates that are not finite give useless tangents, which are
/// nevertheless unit vectors.
pub fn generate(mesh: &mut TriangleMesh, uv_set: u32) {
    let uvs = if uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
    if mesh.indices.is_empty() || uvs.len() != mesh.positions.len() {
        return;
    }
    let mut corners = Corners { mesh, uv_set, tangents: vec![Vec4::ZERO; mesh.indices.len() * 3] };
    // The error type has no values.
    let _ = generate_tangents(&mut corners);
    let tangents = corners.tangents;
    split(mesh, &tangents);
}

/// The mesh as unconnected corners.
struct Corners<'m> {
    mesh: &'m TriangleMesh,
    uv_set: u32,
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.indices[face][corner] as usize
    }

    fn face_normal(&self, face: usize) -> Vec3 {
        let [a, b, c] = self.mesh.indices[face].map(|i| self.mesh.positions[i as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.indices.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        let normal = self.mesh.normals.get(self.vertex(face, corner)).copied();
        normal.unwrap_or_else(|| self.face_normal(face)).to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uvs = if self.uv_set == 0 { &self.mesh.uv0 } else { &self.mesh.uv1 };
        let uv = uvs[self.vertex(face, corner)];
        // MikkTSpace expects v to grow upwards.
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = tangent.map_or(Vec4::ZERO, |t| Vec4::from_array(t.tangent_encoded()));
        let direction = tangent.truncate();
        let unit = direction.normalize_or_zero();
        let normal = Vec3::from_array(self.normal(face, corner));
        self.tangents[3 * face + corner] = if unit == Vec3::ZERO {
            let normal = normal.normalize_or(Vec3::Y);
            normal.any_orthonormal_vector().extend(1.0)
        } else {
            unit.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 })
        };
    }
}

/// Gives the corners' tangents to the vertices, splitting a vertex whose corners disagree.
fn split(mesh: &mut TriangleMesh, tangents: &[Vec4]) {
    const NONE: u32 = u32::MAX;
    /// Copies of one vertex that are searched before another is made: the hub of a huge fan has many.
    const SEARCHED: usize = 32;
    let originals = mesh.positions.len();
    // Per vertex: its tangent, and the next copy of the same original vertex.
    let mut assigned = vec![Vec4::ZERO; originals];
    let mut next = vec![NONE; originals];
    let mut copies: Vec<u32> = Vec::new();
    for (index, tangent) in mesh.indices.as_flattened_mut().iter_mut().zip(tangents) {
        let original = *index;
        let mut at = original;
        for step in 0.. {
            if assigned[at as usize] == Vec4::ZERO {
                assigned[at as usize] = *tangent;
            }
            if same(assigned[at as usize], *tangent) {
                break;
            }
            let following = next[at as usize];
            if following != NONE && step < SEARCHED {
                at = following;
                continue;
            }
            next[at as usize] = assigned.len() as u32;
            at = assigned.len() as u32;
            assigned.push(*tangent);
            next.push(following);
            copies.push(original);
            break;
        }
        *index = at;
    }
    assigned[..originals].iter_mut().filter(|t| **t == Vec4::ZERO).for_each(|t| *t = Vec4::X + Vec4::W);
    mesh.tangents = assigned;
    duplicate(&mut mesh.positions, &copies);
    duplicate(&mut mesh.normals, &copies);
    duplicate(&mut mesh.uv0, &copies);
    duplicate(&mut mesh.uv1, &copies);
    duplicate(&mut mesh.colors, &copies);
}

/// Equal up to rounding: the corners of a smooth vertex get their tangent from one sum, but not always in one order.
fn same(a: Vec4, b: Vec4) -> bool {
    a.w == b.w && a.truncate().dot(b.truncate()) > 0.9999
}

/// Appends the elements with the given numbers, unless the attribute is absent.
fn duplicate<T: Copy>(values: &mut Vec<T>, copies: &[u32]) {
    if !values.is_empty() {
        values.reserve_exact(copies.len());
        values.extend(copies.iter().map(|c| *c as usize).map(|c| values[c]).collect::<Vec<_>>());
    }
}
