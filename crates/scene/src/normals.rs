//! Vertex normals for meshes that come without.
//!
//! The normal of a vertex is the average of the faces around it, weighted by the angle each has there (Thürmer and
//! Wüthrich, "Computing Vertex Normals from Polygonal Facets", 1998), which does not depend on how the surface was
//! cut into triangles. Faces are averaged only across smooth edges: those where the faces meet at no more than the
//! crease angle, or which lie inside a smoothing group. A vertex where several smooth pieces meet is split.

use crate::TriangleMesh;
use elementary::{atan2, cos};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// The smoothing group of a triangle, as OBJ files have them, in the argument of [`generate_grouped`].
pub mod group {
    /// Not smoothed with any neighbour (`s off`).
    pub const FLAT: u32 = 0;
    /// The file does not say: the crease angle decides.
    pub const BY_CREASE: u32 = u32::MAX;
}

/// Gives normals to the meshes that lack them, smoothing edges whose faces meet at up to `crease_angle` radians.
///
/// The meshes are pieces of one surface: edges between two of them are smoothed, too, where their vertices have exactly the same
/// position. A mesh with `normals` keeps those that are not zero and gets the others. Vertices are added at creases.
/// With a crease angle of zero or less nothing is done: meshes without normals are flat-shaded.
///
/// Index out of range must not occur in the meshes.
pub fn generate(meshes: &mut [TriangleMesh], crease_angle: f32) {
    let groups: Vec<Vec<u32>> = vec![Vec::new(); meshes.len()];
    generate_grouped(meshes, crease_angle, &groups);
}

/// As [`generate`], with the smoothing group of each triangle in `groups[mesh]`; see [`group`]. Edges inside
/// a group are smooth at any angle, edges between two groups are sharp. An empty list means [`group::BY_CREASE`].
pub fn generate_grouped(meshes: &mut [TriangleMesh], crease_angle: f32, groups: &[Vec<u32>]) {
    let is_complete = |m: &TriangleMesh| !m.normals.is_empty() && m.normals.iter().all(|n| *n != Vec3::ZERO);
    let smooth = |g: &u32| *g != group::FLAT && (*g != group::BY_CREASE || crease_angle > 0.0);
    let any_smooth =
        groups.iter().any(|g| if g.is_empty() { crease_angle > 0.0 } else { g.iter().any(smooth) });
    let partial = meshes.iter().any(|m| !m.normals.is_empty());
    if meshes.iter().all(is_complete) || !(any_smooth || partial) {
        return;
    }
    let surface = Surface::new(meshes, groups, crease_angle);
    let pieces = surface.smooth_pieces();
    apply(meshes, &surface, &pieces);
}

/// Whether all vertex normals are those of the faces around them, to 10⁻⁵ radians: the mesh is flat with or without them. Not so
/// of a mesh that has none.
pub(crate) fn normals_are_faces(mesh: &TriangleMesh) -> bool {
    if mesh.normals.len() != mesh.positions.len() || mesh.normals.is_empty() {
        return false;
    }
    let corner = |i: u32| Some((*mesh.positions.get(i as usize)?, *mesh.normals.get(i as usize)?));
    let is_flat = |triangle: &[u32; 3]| {
        let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { return true };
        let face = (b.0 - a.0).cross(c.0 - a.0).normalize_or_zero();
        let along = |n: Vec3| face.dot(n) >= 0.0 && face.cross(n).length() <= 1e-5 * n.length();
        along(a.1) && along(b.1) && along(c.1)
    };
    mesh.indices.iter().all(is_flat)
}

/// Turns the normals of a surface round if they oppose the winding of most of its triangles: with both at odds, surfaces
/// are lit from behind. The meshes are the pieces of the surface; normals of zero are missing ones.
///
/// - `keep`: leave them as they are.
///
/// Returns what became of normals that oppose the winding, for reports.
pub(crate) fn turn_to_winding(meshes: &mut [TriangleMesh], keep: bool) -> Option<&'static str> {
    let (mut along, mut against) = (0usize, 0usize);
    for mesh in meshes.iter().filter(|mesh| !mesh.normals.is_empty()) {
        for triangle in &mesh.indices {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
            let normal: DVec3 = triangle.iter().map(|i| mesh.normals[*i as usize].as_dvec3()).sum();
            let side = (b - a).cross(c - a).dot(normal);
            along += usize::from(side > 0.0);
            against += usize::from(side < 0.0);
        }
    }
    if against <= along {
        return None;
    }
    if keep {
        return Some("are kept as they are");
    }
    meshes.iter_mut().flat_map(|mesh| &mut mesh.normals).for_each(|normal| *normal = -*normal);
    Some("are turned round")
}

/// All triangles of all meshes, with the corners that meet in each place.
struct Surface {
    /// Number of the first triangle and the first vertex of each mesh.
    offsets: Vec<(u32, u32)>,
    /// The place (vertices in the same position share it) of each triangle corner.
    places: Vec<[u32; 3]>,
    /// Vertex of each triangle corner, counted over all meshes.
    vertices: Vec<[u32; 3]>,
    /// Unit normal of each triangle, or zero.
    face_normals: Vec<Vec3>,
    /// Angle of each triangle at each corner, radians.
    angles: Vec<[f32; 3]>,
    /// Smoothing group of each triangle.
    groups: Vec<u32>,
    /// Corners (3 · triangle + 0, 1, 2), ordered by place.
    corners: Vec<u32>,
    /// Where each place's corners start in `corners`, and the end.
    starts: Vec<u32>,
    cos_crease: f32,
}

/// A corner and its normal. Corners of one smooth piece follow each other; `first` marks the start of a piece.
struct Corner {
    corner: u32,
    normal: Vec3,
    first: bool,
}

impl Surface {
    fn new(meshes: &[TriangleMesh], groups: &[Vec<u32>], crease_angle: f32) -> Self {
        let mut offsets = Vec::with_capacity(meshes.len());
        let mut positions = Vec::with_capacity(meshes.iter().map(|m| m.positions.len()).sum());
        let mut vertices = Vec::with_capacity(meshes.iter().map(|m| m.indices.len()).sum());
        let mut triangle_groups = Vec::with_capacity(vertices.capacity());
        for (mesh, group) in meshes.iter().zip(groups) {
            let first = positions.len() as u32;
            offsets.push((vertices.len() as u32, first));
            positions.extend_from_slice(&mesh.positions);
            vertices.extend(mesh.indices.iter().map(|t| t.map(|i| first + i)));
            triangle_groups.extend_from_slice(group);
            triangle_groups.resize(vertices.len(), group::BY_CREASE);
        }
        let (place_of, place_count) = places(&positions);
        let shape = |t: &[u32; 3]| triangle_shape(t.map(|i| positions[i as usize]));
        let (face_normals, angles) = vertices.par_iter().map(shape).unzip();
        let places: Vec<[u32; 3]> = vertices.iter().map(|t| t.map(|i| place_of[i as usize])).collect();
        let (corners, starts) = group_by_place(&places, place_count);
        // No edge is smooth at an angle below 0, and rounding must not make coplanar faces crease.
        let cos_crease =
            if crease_angle > 0.0 { cos(crease_angle.min(std::f32::consts::PI)) - 1e-6 } else { 2.0 };
        Self {
            offsets,
            places,
            vertices,
            face_normals,
            angles,
            groups: triangle_groups,
            corners,
            starts,
            cos_crease,
        }
    }

    /// The normal of every corner, by place and smooth piece.
    fn smooth_pieces(&self) -> Vec<Corner> {
        const PLACES_AT_ONCE: usize = 4096;
        let count = self.starts.len() - 1;
        let blocks: Vec<Vec<Corner>> = (0..count.div_ceil(PLACES_AT_ONCE))
            .into_par_iter()
            .map(|block| {
                let mut scratch = Scratch::default();
                let mut pieces = Vec::new();
                for place in block * PLACES_AT_ONCE..((block + 1) * PLACES_AT_ONCE).min(count) {
                    self.smooth_place(place, &mut scratch, &mut pieces);
                }
                pieces
            })
            .collect();
        blocks.into_iter().flatten().collect()
    }

    /// Joins the corners of one place across smooth edges, and averages each piece.
    fn smooth_place(&self, place: usize, scratch: &mut Scratch, pieces: &mut Vec<Corner>) {
        let corners = &self.corners[self.starts[place] as usize..self.starts[place + 1] as usize];
        let Scratch { edges, parent, order } = scratch;
        edges.clear();
        for (local, corner) in corners.iter().enumerate() {
            let (triangle, k) = (*corner as usize / 3, *corner as usize % 3);
            if self.face_normals[triangle] != Vec3::ZERO {
                edges.push((self.places[triangle][(k + 1) % 3], local as u32));
                edges.push((self.places[triangle][(k + 2) % 3], local as u32));
            }
        }
        edges.sort_unstable();
        parent.clear();
        parent.extend(0..corners.len() as u32);
        for edge in edges.chunk_by(|a, b| a.0 == b.0) {
            // Two faces share an edge; of an edge with many faces only near ones are compared, to bound the time.
            const NEAR: usize = 8;
            for (i, (_, a)) in edge.iter().enumerate() {
                for (_, b) in &edge[i + 1..edge.len().min(i + 1 + NEAR)] {
                    if self.is_smooth(corners[*a as usize] / 3, corners[*b as usize] / 3) {
                        join(parent, *a, *b);
                    }
                }
            }
        }
        order.clear();
        order.extend((0..corners.len() as u32).map(|i| (root(parent, i), i)));
        order.sort_unstable();
        for piece in order.chunk_by(|a, b| a.0 == b.0) {
            let own = |local: u32| {
                let corner = corners[local as usize];
                (corner, self.face_normals[corner as usize / 3])
            };
            let weighted = |(_, local): &(u32, u32)| {
                let (corner, normal) = own(*local);
                normal.as_dvec3() * f64::from(self.angles[corner as usize / 3][corner as usize % 3])
            };
            let average = piece.iter().map(weighted).sum::<DVec3>().try_normalize().map(|n| n.as_vec3());
            for (i, (_, local)) in piece.iter().enumerate() {
                let (corner, face) = own(*local);
                let face = if face == Vec3::ZERO { Vec3::Z } else { face };
                let normal = average.unwrap_or(face);
                pieces.push(Corner { corner, normal, first: i == 0 || average.is_none() });
            }
        }
    }

    fn is_smooth(&self, a: u32, b: u32) -> bool {
        let (a, b) = (a as usize, b as usize);
        match (self.groups[a], self.groups[b]) {
            (group::BY_CREASE, group::BY_CREASE) => {
                self.face_normals[a].dot(self.face_normals[b]) >= self.cos_crease
            }
            (x, y) => x == y && x != group::FLAT,
        }
    }
}

#[derive(Default)]
struct Scratch {
    /// Place at the other end of an edge, and the corner it belongs to.
    edges: Vec<(u32, u32)>,
    parent: Vec<u32>,
    order: Vec<(u32, u32)>,
}

fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        parent[node as usize] = parent[parent[node as usize] as usize];
        node = parent[node as usize];
    }
    node
}

fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

/// Numbers the distinct positions; returns each vertex's number and how many there are.
fn places(positions: &[Vec3]) -> (Vec<u32>, usize) {
    let key = |i: &u32| (positions[*i as usize] + 0.0).to_array().map(f32::to_bits); // + 0.0 makes −0 equal to 0
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|i| (key(i), *i));
    let mut place_of = vec![0; positions.len()];
    let mut count = 0;
    for same in order.chunk_by(|a, b| key(a) == key(b)) {
        for vertex in same {
            place_of[*vertex as usize] = count;
        }
        count += 1;
    }
    (place_of, count as usize)
}

/// Counting sort of the corners by place: the corners, and where each place's start.
fn group_by_place(places: &[[u32; 3]], count: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; count + 1];
    for place in places.iter().flatten() {
        starts[*place as usize + 1] += 1;
    }
    for i in 0..count {
        starts[i + 1] += starts[i];
    }
    let mut cursor = starts.clone();
    let mut corners = vec![0; places.len() * 3];
    for (corner, place) in places.iter().flatten().enumerate() {
        corners[cursor[*place as usize] as usize] = corner as u32;
        cursor[*place as usize] += 1;
    }
    (corners, starts)
}

/// Unit normal and the three angles of a triangle; zero for one without area.
///
/// In double precision, so that neither tiny, huge nor very thin triangles leave the range of the numbers.
fn triangle_shape(corners: [Vec3; 3]) -> (Vec3, [f32; 3]) {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let edges = [b - a, c - b, a - c];
    let normal = edges[0].cross(-edges[2]);
    let Some(unit) = normal.try_normalize() else { return (Vec3::ZERO, [0.0; 3]) };
    let double_area = normal.length();
    let angle = |before: DVec3, after: DVec3| atan2(double_area, (-before).dot(after)) as f32;
    (unit.as_vec3(), [angle(edges[2], edges[0]), angle(edges[0], edges[1]), angle(edges[1], edges[2])])
}

/// Writes the normals into the meshes, adding a vertex for each further smooth piece that a vertex is part of.
fn apply(meshes: &mut [TriangleMesh], surface: &Surface, pieces: &[Corner]) {
    let vertex_count: usize = meshes.iter().map(|m| m.positions.len()).sum();
    /// The last piece that used a vertex, and the vertex (within its mesh) that stands for it there.
    #[derive(Clone, Copy)]
    struct Use {
        piece: u32,
        vertex: u32,
    }
    const UNUSED: u32 = u32::MAX;
    let mut uses = vec![Use { piece: UNUSED, vertex: 0 }; vertex_count];
    for mesh in meshes.iter_mut() {
        mesh.normals.resize(mesh.positions.len(), Vec3::ZERO);
    }
    let had_normal: Vec<bool> =
        meshes.iter().flat_map(|m| m.normals.iter().map(|n| *n != Vec3::ZERO)).collect();
    let mut piece = 0;
    for corner in pieces {
        piece += u32::from(corner.first);
        let (triangle, k) = (corner.corner / 3, corner.corner as usize % 3);
        let vertex = surface.vertices[triangle as usize][k];
        if had_normal[vertex as usize] {
            continue;
        }
        let mesh_index = surface.offsets.partition_point(|(first, _)| *first <= triangle) - 1;
        let (first_triangle, first_vertex) = surface.offsets[mesh_index];
        let mesh = &mut meshes[mesh_index];
        let known = &mut uses[vertex as usize];
        if known.piece != piece {
            let own = vertex - first_vertex;
            let stands_for = if known.piece == UNUSED { own } else { duplicate(mesh, own) };
            mesh.normals[stands_for as usize] = corner.normal;
            *known = Use { piece, vertex: stands_for };
        }
        mesh.indices[(triangle - first_triangle) as usize][k] = known.vertex;
    }
    for normal in meshes.iter_mut().flat_map(|m| &mut m.normals).filter(|n| **n == Vec3::ZERO) {
        *normal = Vec3::Z; // vertices of no triangle
    }
}

/// Appends a copy of a vertex and returns its index.
fn duplicate(mesh: &mut TriangleMesh, vertex: u32) -> u32 {
    fn copy<T: Copy>(values: &mut Vec<T>, index: u32) {
        if let Some(value) = values.get(index as usize).copied() {
            values.push(value);
        }
    }
    let index = mesh.positions.len() as u32;
    copy(&mut mesh.positions, vertex);
    copy(&mut mesh.normals, vertex);
    copy(&mut mesh.tangents, vertex);
    copy(&mut mesh.uv0, vertex);
    copy(&mut mesh.uv1, vertex);
    copy(&mut mesh.colors, vertex);
    index
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, vec3};

    /// A unit cube with shared vertices, two triangles a side.
    fn cube() -> TriangleMesh {
        let positions =
            (0..8u32).map(|i| vec3((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let indices = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        TriangleMesh { positions, indices, ..Default::default() }
    }

    fn face_normal(mesh: &TriangleMesh, t: &[u32; 3]) -> Vec3 {
        triangle_shape(t.map(|i| mesh.positions[i as usize])).0
    }

    #[test]
    fn normals_of_faces_are_told_from_those_of_smooth_surfaces() {
        assert!(!normals_are_faces(&cube()), "it has none");
        let mut meshes = [cube()];
        generate(&mut meshes, 40f32.to_radians());
        assert!(normals_are_faces(&meshes[0]));
        let [mut mesh] = meshes;
        mesh.normals[5] = (mesh.normals[5] + 3e-5 * mesh.normals[5].any_orthonormal_vector()).normalize();
        assert!(!normals_are_faces(&mesh), "one of them is tilted");
        mesh.normals.iter_mut().for_each(|n| *n = -*n);
        assert!(!normals_are_faces(&mesh), "they point inwards");
        let mut meshes = [cube()];
        generate(&mut meshes, 100f32.to_radians());
        assert!(!normals_are_faces(&meshes[0]));
    }

    #[test]
    fn a_cube_stays_sharp_below_the_crease_angle_and_is_smooth_above() {
        let mut meshes = [cube()];
        generate(&mut meshes, 40f32.to_radians());
        assert_eq!((meshes[0].positions.len(), meshes[0].normals.len()), (24, 24));
        for t in &meshes[0].indices {
            let face = face_normal(&meshes[0], t);
            assert!(t.iter().all(|i| meshes[0].normals[*i as usize].distance(face) < 1e-6));
        }

        let mut meshes = [cube()];
        generate(&mut meshes, 100f32.to_radians());
        assert_eq!(meshes[0].positions.len(), 8);
        for (p, n) in meshes[0].positions.iter().zip(&meshes[0].normals) {
            // Angle weights make the diagonals of the sides irrelevant.
            assert!(n.distance((*p - 0.5).normalize()) < 1e-6, "{p} {n}");
        }
    }

    #[test]
    fn smoothing_groups_win_over_the_crease_angle() {
        let (flat, smooth) = (vec![group::FLAT; 12], vec![7; 12]);
        let mut meshes = [cube()];
        generate_grouped(&mut meshes, 1.0, &[flat]);
        assert!(meshes[0].normals.is_empty(), "a flat mesh needs no normals");
        generate_grouped(&mut meshes, 0.1, &[smooth]);
        assert_eq!(meshes[0].positions.len(), 8);

        let halves = (0..12).map(|t| u32::from(t < 6) + 1).collect();
        let mut meshes = [cube()];
        generate_grouped(&mut meshes, 1.0, &[halves]);
        assert!((9..24).contains(&meshes[0].positions.len()));
    }

    #[test]
    fn edges_between_two_meshes_are_smooth() {
        let roof = |x: f32| TriangleMesh {
            positions: vec![vec3(0.0, 1.0, 0.0), vec3(0.0, 1.0, 1.0), vec3(x, 0.8, 0.0)],
            uv0: vec![Vec2::ZERO; 3],
            indices: vec![if x > 0.0 { [0, 1, 2] } else { [1, 0, 2] }],
            ..Default::default()
        };
        let mut meshes = [roof(1.0), roof(-1.0)];
        generate(&mut meshes, 40f32.to_radians());
        for mesh in &meshes {
            assert!(mesh.normals[0].distance(Vec3::Y) < 1e-6, "{:?}", mesh.normals);
            assert!(mesh.normals[2].distance(Vec3::Y) > 0.1);
        }
    }

    #[test]
    fn given_normals_are_kept_and_zero_ones_filled() {
        let mut mesh = cube();
        mesh.normals = vec![Vec3::X; 8];
        mesh.normals[3] = Vec3::ZERO;
        let mut meshes = [mesh];
        generate(&mut meshes, 100f32.to_radians());
        assert_eq!(meshes[0].normals[0], Vec3::X);
        assert!(meshes[0].normals[3].distance(vec3(1.0, 1.0, -1.0).normalize()) < 1e-6);
    }

    #[test]
    fn degenerate_triangles_and_odd_numbers_give_unit_normals() {
        let positions = vec![
            Vec3::ZERO,
            Vec3::X,
            Vec3::X * 2.0,
            Vec3::splat(f32::NAN),
            Vec3::splat(3e38),
            Vec3::splat(1e-40),
        ];
        let indices = vec![[0, 1, 2], [0, 0, 0], [0, 1, 3], [4, 1, 0], [5, 0, 5]];
        let mut meshes = [TriangleMesh { positions, indices, ..Default::default() }, TriangleMesh::default()];
        generate(&mut meshes, 1.0);
        assert!(meshes[0].normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "{:?}", meshes[0].normals);
    }

    #[test]
    fn a_fan_of_many_triangles_takes_linear_time() {
        let count = 200_000;
        let ring = (0..count).map(|i| (i as f32 * 1e-3).sin_cos()).map(|(s, c)| vec3(c, s * c, s));
        let positions: Vec<Vec3> = [Vec3::ZERO].into_iter().chain(ring).collect();
        let indices: Vec<[u32; 3]> = (1..count).map(|i| [0, i, i + 1]).collect();
        for crease in [0.001, 3.0] {
            let mut meshes = [TriangleMesh {
                positions: positions.clone(),
                indices: indices.clone(),
                ..Default::default()
            }];
            let start = std::time::Instant::now();
            generate(&mut meshes, crease);
            assert!(start.elapsed().as_secs() < 10);
        }
    }
}
