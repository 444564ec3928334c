//! Vertices that move against each other: morph targets, then a skin.

use crate::TriangleMesh;
use glam::{Affine3A, DAffine3, DVec3, Mat3A, Vec2, Vec3, Vec3A, Vec4};
use rayon::prelude::*;

/// Differences from the rest pose at weight 1. Every array is empty or as long as the mesh's positions.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Of positions.
    pub positions: Vec<Vec3>,
    /// Of normals.
    pub normals: Vec<Vec3>,
    /// Of tangents.
    pub tangents: Vec<Vec3>,
    /// Of the first texture coordinates.
    pub uv0: Vec<Vec2>,
    /// Of the second texture coordinates.
    pub uv1: Vec<Vec2>,
    /// Of colours.
    pub colors: Vec<Vec4>,
}

/// A joint's influence on a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Index into the skin's joints.
    pub joint: u32,
    /// Share of the vertex, relative to its other influences.
    pub weight: f32,
}

/// Which joints move which vertex.
#[derive(Clone, Debug, Default)]
pub struct Influences {
    /// Where the influences of each vertex begin, and at last their number: one more than there are vertices.
    pub first: Vec<u32>,
    /// Those of the first vertex, then of the second, …
    pub all: Vec<Influence>,
}

impl Influences {
    fn of(&self, vertex: usize) -> &[Influence] {
        &self.all[self.first[vertex] as usize..self.first[vertex + 1] as usize]
    }
}

/// What moves the vertices of a triangle mesh against each other.
#[derive(Clone, Debug, Default)]
pub struct Deformation {
    /// The mesh at rest, without indices.
    pub rest: TriangleMesh,
    /// What the positions at rest are relative to where joints move them, metres: meshes may be made far from their origin.
    pub anchor: DVec3,
    /// Morph targets.
    pub targets: Vec<MorphTarget>,
    /// The skin's influences; `None` for a mesh without joints, which moves as a whole if it has a skin.
    pub influences: Option<Influences>,
}

/// Where a skin is.
#[derive(Clone, Copy, Debug)]
pub struct Joints<'j> {
    /// From the mesh's space to the world, for each joint.
    pub matrices: &'j [DAffine3],
    /// The same for what has no joints.
    pub node: DAffine3,
    /// The same for vertices that no joint moves.
    pub unmoved: DAffine3,
}

impl Deformation {
    /// Gives vertices that were split off others (`copies` are the others' indices) the same movement.
    pub fn split(&mut self, copies: &[u32]) {
        fn extend<T: Copy>(values: &mut Vec<T>, copies: &[u32]) {
            if !values.is_empty() {
                values.extend(copies.iter().map(|c| *c as usize).map(|c| values[c]).collect::<Vec<_>>());
            }
        }
        for target in &mut self.targets {
            extend(&mut target.positions, copies);
            extend(&mut target.normals, copies);
            extend(&mut target.tangents, copies);
            extend(&mut target.uv0, copies);
            extend(&mut target.uv1, copies);
            extend(&mut target.colors, copies);
        }
        let Some(influences) = &mut self.influences else { return };
        for copy in copies {
            let own = influences.of(*copy as usize).to_vec();
            influences.all.extend(own);
            influences.first.push(influences.all.len() as u32);
        }
    }

    /// Writes the vertices with these `weights` of the targets and this place of the joints into `mesh`. What comes out
    /// as no number stays at rest.
    ///
    /// Source: glTF 2.0 specification, sections 3.7.2.2 (morph targets) and 3.7.3 (skins).
    pub fn apply(&self, weights: &[f32], joints: Option<Joints<'_>>, mesh: &mut TriangleMesh) {
        mesh.positions.clone_from(&self.rest.positions);
        mesh.normals.clone_from(&self.rest.normals);
        mesh.tangents.clone_from(&self.rest.tangents);
        mesh.uv0.clone_from(&self.rest.uv0);
        mesh.uv1.clone_from(&self.rest.uv1);
        mesh.colors.clone_from(&self.rest.colors);
        for (target, weight) in self.targets.iter().zip(weights) {
            if *weight != 0.0 && weight.is_finite() {
                target.add(*weight, mesh);
            }
        }
        match (joints, &self.influences) {
            (None, _) => {}
            (Some(joints), None) => {
                let node = self.anchored(&joints.node);
                transform(mesh, |_| node);
            }
            (Some(joints), Some(influences)) => {
                let matrices: Vec<Affine3A> = joints.matrices.iter().map(|m| self.anchored(m)).collect();
                let unmoved = self.anchored(&joints.unmoved);
                transform(mesh, |vertex| blend(influences.of(vertex), &matrices).unwrap_or(unmoved));
            }
        }
        self.settle(mesh);
    }

    /// A transform of the mesh's space as one of what the positions at rest are relative to.
    fn anchored(&self, world: &DAffine3) -> Affine3A {
        (*world * DAffine3::from_translation(self.anchor)).as_affine3a()
    }

    /// Unit vectors, finite numbers.
    fn settle(&self, mesh: &mut TriangleMesh) {
        for (position, rest) in mesh.positions.iter_mut().zip(&self.rest.positions) {
            *position = if position.is_finite() { *position } else { *rest };
        }
        for (normal, rest) in mesh.normals.iter_mut().zip(&self.rest.normals) {
            *normal = normal.normalize_or(*rest);
        }
        for (tangent, rest) in mesh.tangents.iter_mut().zip(&self.rest.tangents) {
            *tangent = tangent.truncate().normalize_or(rest.truncate()).extend(rest.w);
        }
        let settle = |uvs: &mut [Vec2], rest: &[Vec2]| {
            let broken = uvs.iter_mut().zip(rest).filter(|(uv, _)| !uv.is_finite());
            broken.for_each(|(uv, rest)| *uv = *rest);
        };
        settle(&mut mesh.uv0, &self.rest.uv0);
        settle(&mut mesh.uv1, &self.rest.uv1);
        for color in &mut mesh.colors {
            // Sums of colours may leave the range; `max` drops NaN, too.
            *color = color.max(Vec4::ZERO).min(Vec4::ONE);
        }
    }
}

impl MorphTarget {
    fn add(&self, weight: f32, mesh: &mut TriangleMesh) {
        fn add<T: Copy + std::ops::AddAssign + std::ops::Mul<f32, Output = T>>(
            values: &mut [T],
            deltas: &[T],
            weight: f32,
        ) {
            values.iter_mut().zip(deltas).for_each(|(value, delta)| *value += *delta * weight);
        }
        add(&mut mesh.positions, &self.positions, weight);
        add(&mut mesh.normals, &self.normals, weight);
        add(&mut mesh.uv0, &self.uv0, weight);
        add(&mut mesh.uv1, &self.uv1, weight);
        add(&mut mesh.colors, &self.colors, weight);
        let moved = mesh.tangents.iter_mut().zip(&self.tangents);
        moved.for_each(|(tangent, delta)| *tangent += (*delta * weight).extend(0.0));
    }
}

/// The weighted mean of the joints' matrices; `None` for a vertex without influences.
fn blend(influences: &[Influence], joints: &[Affine3A]) -> Option<Affine3A> {
    let (mut matrix3, mut translation, mut sum) = (Mat3A::ZERO, Vec3A::ZERO, 0.0);
    for influence in influences {
        let Some(joint) = joints.get(influence.joint as usize) else { continue };
        matrix3 += influence.weight * joint.matrix3;
        translation += influence.weight * joint.translation;
        sum += influence.weight;
    }
    let scale = sum.recip();
    scale.is_finite().then(|| Affine3A { matrix3: matrix3 * scale, translation: translation * scale })
}

/// Moves vertex `i` by `to(i)`.
pub(crate) fn transform(mesh: &mut TriangleMesh, to: impl Fn(usize) -> Affine3A + Sync) {
    const CHUNK: usize = 4096;
    mesh.positions.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, positions)| {
        for (i, position) in positions.iter_mut().enumerate() {
            *position = to(chunk * CHUNK + i).transform_point3(*position);
        }
    });
    mesh.normals.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, normals)| {
        for (i, normal) in normals.iter_mut().enumerate() {
            // The cofactor matrix is the inverse transpose times the determinant, and exists for every matrix.
            let m = to(chunk * CHUNK + i).matrix3;
            let cofactors = Mat3A::from_cols(
                m.y_axis.cross(m.z_axis),
                m.z_axis.cross(m.x_axis),
                m.x_axis.cross(m.y_axis),
            );
            let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
            *normal = (cofactors * *normal * sign).normalize_or(*normal);
        }
    });
    for (i, tangent) in mesh.tangents.iter_mut().enumerate() {
        let direction = to(i).transform_vector3(tangent.truncate());
        *tangent = direction.normalize_or_zero().extend(tangent.w);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    fn triangle() -> TriangleMesh {
        TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, -1.0); 3],
            uv0: vec![Vec2::ZERO; 3],
            colors: vec![Vec4::splat(0.5); 3],
            indices: vec![[0, 1, 2]],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn weights_add_targets_of_every_attribute() {
        let target = MorphTarget {
            positions: vec![Vec3::Z; 3],
            normals: vec![Vec3::X; 3],
            tangents: vec![Vec3::new(-1.0, 1.0, 0.0); 3],
            uv0: vec![Vec2::ONE; 3],
            uv1: vec![],
            colors: vec![Vec4::splat(1.0); 3],
        };
        let deformation = Deformation { rest: triangle(), targets: vec![target], ..Deformation::default() };
        let mut mesh = triangle();
        deformation.apply(&[0.5], None, &mut mesh);
        assert_eq!(mesh.positions[1], Vec3::new(1.0, 0.0, 0.5));
        assert!((mesh.normals[0] - Vec3::new(0.5, 0.0, 1.0).normalize()).length() < 1e-6);
        assert!((mesh.tangents[0].truncate() - Vec3::new(0.5, 0.5, 0.0).normalize()).length() < 1e-6);
        assert_eq!((mesh.tangents[0].w, mesh.uv0[0], mesh.colors[0]), (-1.0, Vec2::splat(0.5), Vec4::ONE));
        deformation.apply(&[0.0], None, &mut mesh);
        assert_eq!(mesh.positions, triangle().positions, "back at rest");
    }

    #[test]
    fn joints_share_a_vertex_by_weight_and_copies_follow() {
        let influence = |joint, weight| Influence { joint, weight };
        let influences = Influences {
            first: vec![0, 1, 2, 4],
            all: vec![influence(0, 1.0), influence(1, 0.25), influence(0, 1.0), influence(1, 1.0)],
        };
        let mut deformation =
            Deformation { rest: triangle(), influences: Some(influences), ..Deformation::default() };
        deformation.split(&[2]);
        deformation.rest.positions.push(Vec3::Y);
        let quarter = f64::from(FRAC_PI_2);
        let matrices = [DAffine3::from_translation(DVec3::Z), DAffine3::from_rotation_z(quarter)];
        let (node, unmoved) = (DAffine3::IDENTITY, DAffine3::IDENTITY);
        let mut mesh = triangle();
        deformation.apply(&[], Some(Joints { matrices: &matrices, node, unmoved }), &mut mesh);
        assert_eq!(mesh.positions[0], Vec3::Z);
        assert!(
            (mesh.positions[1] - Vec3::Y).length() < 1e-6,
            "one joint has all of it, whatever its weight"
        );
        assert!((mesh.positions[2] - Vec3::new(-0.5, 0.5, 0.5)).length() < 1e-6, "{}", mesh.positions[2]);
        assert_eq!(mesh.positions[2], mesh.positions[3]);
    }
}
