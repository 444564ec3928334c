//! Tangents for normal maps, by the MikkTSpace algorithm that the makers of normal maps use.

use crate::{Scene, Shape, TriangleMesh, UvTransform};
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};
use std::collections::{HashMap, HashSet};
use std::convert::Infallible;

/// How tangents were found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// There was nothing to do.
    None,
    /// By MikkTSpace.
    MikkTSpace,
    /// Each triangle for itself, because so many meet in one point that MikkTSpace would take for ever.
    PerTriangle,
}

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
pub fn generate(mesh: &mut TriangleMesh, uv_set: u32) -> Method {
    generate_and_split(mesh, uv_set, &UvTransform::default()).0
}

/// As [`generate`], of coordinates that are transformed before the normal map is looked up; also returns, for each vertex that
/// was added, the index of the one that it is a copy of.
pub fn generate_and_split(
    mesh: &mut TriangleMesh,
    uv_set: u32,
    transform: &UvTransform,
) -> (Method, Vec<u32>) {
    let uvs = if uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
    if mesh.indices.is_empty() || uvs.len() != mesh.positions.len() {
        return (Method::None, Vec::new());
    }
    let crowded = is_crowded(mesh);
    let tangents = vec![Vec4::ZERO; mesh.indices.len() * 3];
    let mut corners = Corners { mesh, uv_set, transform: *transform, tangents };
    if crowded {
        corners.generate_per_triangle();
    } else {
        // The error type has no values.
        let _ = generate_tangents(&mut corners);
    }
    let tangents = corners.tangents;
    let copies = split(mesh, &tangents);
    (if crowded { Method::PerTriangle } else { Method::MikkTSpace }, copies)
}

impl Scene {
    /// Gives tangents to the meshes of all instances that need some and have none: see [`Material::tangent_coordinates`].
    /// Returns how many parts of meshes have materials that want different ones; they have those of the first.
    ///
    /// Meshes that change their shape are left as they are: whoever made them knows how their vertices move.
    ///
    /// [`Material::tangent_coordinates`]: crate::Material::tangent_coordinates
    pub fn complete_tangents(&mut self) -> usize {
        self.complete_tangents_within(|_| Ok::<_, Infallible>(())).unwrap_or_else(|never| match never {})
    }

    /// As [`Scene::complete_tangents`]; `take` hears of how many triangles tangents are made next, and may refuse.
    ///
    /// # Errors
    /// What `take` says. What has tangents by then keeps them.
    pub(crate) fn complete_tangents_within<E>(
        &mut self,
        mut take: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<usize, E> {
        let deforming: HashSet<_> =
            self.animations.iter().flat_map(|a| &a.deformations).map(|part| part.mesh).collect();
        let mut made = HashMap::new();
        let mut several = HashSet::new();
        for instance in 0..self.instances.len() {
            if deforming.contains(&self.instances[instance].mesh) {
                continue;
            }
            for (place, wanted) in self.tangents_wanted(instance) {
                let known = made.entry(place).or_insert(wanted);
                if *known != wanted {
                    several.insert(place);
                }
                if let Some(mesh) = self.without_tangents(place) {
                    take(mesh.indices.len())?;
                    let (uv_set, transform) = wanted;
                    generate_and_split(mesh, uv_set, &transform);
                }
            }
        }
        Ok(several.len())
    }

    /// For each part that wants tangents: mesh and number of the part, and the coordinates that they follow.
    fn tangents_wanted(&self, instance: usize) -> Vec<((u32, usize), Coordinates)> {
        let instance = &self.instances[instance];
        let Some(mesh) = self.meshes.get(instance.mesh as usize) else { return Vec::new() };
        let wanted = |(i, part): (usize, &crate::Part)| {
            let own = instance.materials.as_ref().and_then(|m| m.get(i).copied()).unwrap_or(part.material);
            let coordinates = self.materials.get(own as usize)?.tangent_coordinates()?;
            Some(((instance.mesh, i), coordinates))
        };
        mesh.parts.iter().enumerate().filter_map(wanted).collect()
    }

    fn without_tangents(&mut self, (mesh, part): (u32, usize)) -> Option<&mut TriangleMesh> {
        match &mut self.meshes[mesh as usize].parts[part].shape {
            Shape::Triangles(mesh) if mesh.tangents.is_empty() => Some(mesh),
            _ => None,
        }
    }
}

/// A set of texture coordinates, and how it is transformed.
type Coordinates = (u32, UvTransform);

/// Whether MikkTSpace would be too slow: it compares all corners that are at one position with each other.
fn is_crowded(mesh: &TriangleMesh) -> bool {
    const COMPARISONS: u64 = 1 << 28;
    let corners = mesh.indices.len() as u64 * 3;
    if corners * corners <= COMPARISONS {
        return false;
    }
    let mut counts: HashMap<[u32; 3], u64> = HashMap::with_capacity(mesh.positions.len());
    for index in mesh.indices.as_flattened() {
        *counts.entry(mesh.positions[*index as usize].to_array().map(f32::to_bits)).or_default() += 1;
    }
    let comparisons = counts.values().map(|count| count * count).fold(0, u64::saturating_add);
    comparisons > COMPARISONS + 256 * corners
}

/// The mesh as unconnected corners.
struct Corners<'m> {
    mesh: &'m TriangleMesh,
    uv_set: u32,
    transform: UvTransform,
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.indices[face][corner] as usize
    }

    /// The direction in which u grows, in the plane of each triangle.
    fn generate_per_triangle(&mut self) {
        for face in 0..self.mesh.indices.len() {
            let [p, q, r] = [0, 1, 2].map(|i| Vec3::from_array(self.position(face, i)));
            let [s, t, u] = [0, 1, 2].map(|i| Vec2::from_array(self.tex_coord(face, i)));
            let ((e, f), (a, b)) = ((q - p, r - p), (t - s, u - s));
            let sign = if a.perp_dot(b) < 0.0 { -1.0 } else { 1.0 };
            let direction = (e * b.y - f * a.y) * sign;
            for corner in 0..3 {
                let normal = Vec3::from_array(self.normal(face, corner));
                let tangent = (direction - normal * normal.dot(direction)).normalize_or_zero();
                self.set(face, corner, tangent, sign);
            }
        }
    }

    /// A unit tangent; for a zero vector, any that is perpendicular to the normal.
    fn set(&mut self, face: usize, corner: usize, tangent: Vec3, sign: f32) {
        let unit = tangent.normalize_or_zero();
        self.tangents[3 * face + corner] = if unit == Vec3::ZERO {
            let normal = Vec3::from_array(self.normal(face, corner)).normalize_or(Vec3::Y);
            normal.any_orthonormal_vector().extend(1.0)
        } else {
            unit.extend(sign)
        };
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
        let uv = self.transform.apply(uvs[self.vertex(face, corner)]);
        // MikkTSpace expects v to grow upwards.
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = tangent.map_or(Vec4::ZERO, |t| Vec4::from_array(t.tangent_encoded()));
        self.set(face, corner, tangent.truncate(), if tangent.w < 0.0 { -1.0 } else { 1.0 });
    }
}

/// Gives the corners' tangents to the vertices, splitting a vertex whose corners disagree; returns the originals of the
/// vertices added.
fn split(mesh: &mut TriangleMesh, tangents: &[Vec4]) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    /// Copies of one vertex that are searched before another is made: the hub of a huge fan has many.
    const SEARCHED: usize = 8;
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
    copies
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit square in the x–y plane that shows the whole image upright, seen from +z.
    fn quad() -> TriangleMesh {
        TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
            uv0: vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO],
            indices: vec![[0, 1, 2], [0, 2, 3]],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn the_bitangent_points_to_the_upper_side_of_the_image() {
        let mut mesh = quad();
        assert_eq!(generate(&mut mesh, 0), Method::MikkTSpace);
        assert_eq!(mesh.positions.len(), 4, "nothing to split");
        for tangent in &mesh.tangents {
            assert!((tangent.truncate() - Vec3::X).length() < 1e-6);
            assert_eq!(tangent.w * Vec3::Z.cross(Vec3::X), Vec3::Y);
        }
    }

    /// Coordinates that are turned or mirrored by a transform have the tangents of those that are so themselves.
    #[test]
    fn tangents_follow_the_transform_of_the_normal_map() {
        for (rotation, scale) in [(0.4, Vec2::ONE), (-1.2, Vec2::new(2.0, 0.5)), (0.0, Vec2::new(1.0, -1.0))]
        {
            let transform = UvTransform::new(Vec2::new(0.3, -2.0), rotation, scale);
            let (mut transformed, mut plain) = (quad(), quad());
            plain.uv0.iter_mut().for_each(|uv| *uv = transform.apply(*uv));
            generate_and_split(&mut transformed, 0, &transform);
            generate(&mut plain, 0);
            assert_eq!(transformed.tangents.len(), plain.tangents.len());
            for (a, b) in transformed.tangents.iter().zip(&plain.tangents) {
                assert!((*a - *b).length() < 1e-5, "{a} against {b}");
            }
            assert_eq!(transformed.tangents[0].w < 0.0, transform.mirrors());
        }
    }

    /// Materials of parts, of instances, and none that wants tangents; a mesh that has some keeps them.
    #[test]
    fn meshes_of_a_scene_get_what_their_materials_want() {
        use crate::{Instance, Material, Mesh, TextureRef};
        let turned = |rotation| {
            let transform = UvTransform::new(Vec2::ZERO, rotation, Vec2::ONE);
            let texture = TextureRef { transform, ..TextureRef::new(0) };
            Material { normal_texture: Some(texture), ..Material::default() }
        };
        let mesh = |material| Mesh::single("quad", Shape::Triangles(quad()), material);
        let given = TriangleMesh { tangents: vec![Vec4::Y; 4], ..quad() };
        let instance =
            |mesh, materials| Instance { materials, ..Instance::new("quad", mesh, glam::Affine3A::IDENTITY) };
        let quarter = std::f32::consts::FRAC_PI_2;
        let mut scene = Scene {
            materials: vec![Material::default(), turned(0.0), turned(quarter)],
            meshes: vec![mesh(0), mesh(1), mesh(0), Mesh::single("given", Shape::Triangles(given), 1)],
            instances: vec![
                instance(0, None),
                instance(1, None),
                instance(2, Some(vec![2])),
                instance(3, None),
                instance(1, Some(vec![2])),
            ],
            ..Scene::default()
        };
        assert_eq!(scene.complete_tangents(), 1, "the second mesh has two materials");
        let tangent = |mesh: usize| match &scene.meshes[mesh].parts[0].shape {
            Shape::Triangles(mesh) => mesh.tangents.first().map(|t| t.truncate()),
            Shape::Spheres(_) => None,
        };
        assert_eq!(tangent(0), None);
        assert!(tangent(1).expect("some").abs_diff_eq(Vec3::X, 1e-5));
        // (u, v) becomes (v, −u): u grows where v did, downwards.
        assert!(tangent(2).expect("some").abs_diff_eq(Vec3::NEG_Y, 1e-5));
        assert_eq!(tangent(3), Some(Vec3::Y));
    }

    #[test]
    fn mirrored_halves_are_split_and_keep_their_attributes() {
        let mut mesh = quad();
        // The second triangle sees the image mirrored.
        mesh.positions.push(mesh.positions[2]);
        mesh.uv0 = vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::new(2.0, 0.0), Vec2::X];
        mesh.indices = vec![[0, 1, 2], [0, 2, 3]];
        generate(&mut mesh, 0);
        let count = mesh.positions.len();
        assert!(count > 5 && mesh.uv0.len() == count && mesh.tangents.len() == count);
        assert!(mesh.normals.is_empty() && mesh.colors.is_empty());
        let signs: Vec<f32> = mesh.indices.iter().map(|t| mesh.tangents[t[0] as usize].w).collect();
        assert_eq!(signs, [1.0, -1.0]);
        assert_eq!(mesh.positions[mesh.indices[1][0] as usize], Vec3::ZERO);
    }

    #[test]
    fn both_methods_agree_on_flat_triangles() {
        let mut mesh = quad();
        mesh.uv0 = vec![Vec2::ZERO, Vec2::new(0.3, 0.1), Vec2::new(0.2, 0.9), Vec2::new(-0.4, 0.5)];
        mesh.indices.truncate(1);
        let transform = UvTransform::default();
        let mut corners = Corners { mesh: &mesh, uv_set: 0, transform, tangents: vec![Vec4::ZERO; 3] };
        corners.generate_per_triangle();
        let per_triangle = std::mem::take(&mut corners.tangents);
        generate(&mut mesh, 0);
        for (index, expected) in mesh.indices[0].into_iter().zip(per_triangle) {
            let tangent = mesh.tangents[index as usize];
            assert!((tangent - expected).length() < 1e-5, "{tangent} against {expected}");
        }
    }

    /// MikkTSpace takes time quadratic in the triangles around a point.
    #[test]
    fn a_huge_fan_takes_no_longer_than_its_size() {
        let count = 60_000u32;
        let rim = |i: u32| (i as f32 * 1e-4).sin_cos();
        let mut mesh = TriangleMesh {
            positions: (0..count).map(|i| rim(i).into()).map(|p: Vec2| p.extend(0.1 * p.x)).collect(),
            uv0: (0..count).map(|i| rim(i).into()).collect(),
            indices: (2..count).map(|i| [0, i - 1, i]).collect(),
            ..TriangleMesh::default()
        };
        assert_eq!(generate(&mut mesh, 0), Method::PerTriangle);
        assert!(mesh.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-4));
    }
}
