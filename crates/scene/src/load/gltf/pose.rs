//! Morph targets and skins: the vertices of a mesh in the pose that the file's nodes and weights describe.

use super::accessor::{Integers, Pick};
use super::document::Document;
use super::instances::{Job, Pose};
use super::json::{Kind, Primitive};
use crate::{LoadError, TriangleMesh};
use glam::{Affine3A, Mat3A, Vec3, Vec4};

/// No primitive has more sets of four joints.
const MAX_JOINT_SETS: u32 = 16;

/// A primitive's place in the file and the vertices of it that are in use.
pub(super) struct Source<'p> {
    pub primitive: &'p Primitive,
    pub pick: Pick<'p>,
    /// The count of the `POSITION` accessor, which all attributes share.
    pub count: u64,
    /// The mesh and the primitive, for messages.
    pub object: &'p str,
}

impl Document<'_> {
    /// Moves the vertices of `mesh` into the job's pose.
    ///
    /// # Errors
    /// Broken morph targets, joints or weights.
    pub fn apply_pose(
        &self,
        job: &Job,
        source: &Source<'_>,
        mesh: &mut TriangleMesh,
    ) -> Result<(), LoadError> {
        for (target, weight) in source.primitive.targets.iter().zip(&job.weights) {
            if *weight != 0.0 && weight.is_finite() {
                self.morph(source, *weight, target, mesh)?;
            }
        }
        match &job.pose {
            Pose::Rest => Ok(()),
            Pose::Baked(transform) => {
                transform_vertices(mesh, |_| *transform);
                Ok(())
            }
            Pose::Skinned { joints, node } => {
                let skin = self.skin_matrices(joints, source, mesh.positions.len())?;
                transform_vertices(mesh, |vertex| skin.get(vertex).copied().unwrap_or(*node));
                Ok(())
            }
        }
    }

    fn morph(
        &self,
        source: &Source<'_>,
        weight: f32,
        target: &std::collections::BTreeMap<String, u32>,
        mesh: &mut TriangleMesh,
    ) -> Result<(), LoadError> {
        let deltas = |name: &str| -> Result<Vec<Vec3>, LoadError> {
            let Some(accessor) = target.get(name) else { return Ok(Vec::new()) };
            self.check_count(source, name, *accessor)?;
            self.read::<3, Vec3>(*accessor, Kind::Vec3, Integers::AsDeclared, source.pick)
        };
        for (position, delta) in mesh.positions.iter_mut().zip(deltas("POSITION")?) {
            *position += weight * delta;
        }
        for (normal, delta) in mesh.normals.iter_mut().zip(deltas("NORMAL")?) {
            *normal += weight * delta;
        }
        for (tangent, delta) in mesh.tangents.iter_mut().zip(deltas("TANGENT")?) {
            *tangent += (weight * delta).extend(0.0);
        }
        Ok(())
    }

    /// The weighted sum of the joints' matrices for each vertex; empty for a primitive without joints.
    fn skin_matrices(
        &self,
        joints: &[Affine3A],
        source: &Source<'_>,
        vertices: usize,
    ) -> Result<Vec<Affine3A>, LoadError> {
        let attribute = |name: &str| source.primitive.attributes.get(name).copied();
        let mut sums = Vec::new();
        for set in 0..MAX_JOINT_SETS {
            let (joint_name, weight_name) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            let (Some(joint), Some(weight)) = (attribute(&joint_name), attribute(&weight_name)) else {
                break;
            };
            self.check_count(source, &joint_name, joint)?;
            self.check_count(source, &weight_name, weight)?;
            let indices = self.read::<4, [f32; 4]>(joint, Kind::Vec4, Integers::AsDeclared, source.pick)?;
            let weights = self.read::<4, [f32; 4]>(weight, Kind::Vec4, Integers::Normalized, source.pick)?;
            if sums.is_empty() {
                self.reserve::<(Mat3A, Vec3, f32)>(vertices as u64)?;
                sums = vec![(Mat3A::ZERO, glam::Vec3A::ZERO, 0.0f32); vertices];
            }
            for ((sum, indices), weights) in sums.iter_mut().zip(&indices).zip(&weights) {
                for (index, weight) in indices.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
                    // The file's data can be of any type here; a saturating conversion keeps the check below honest.
                    let Some(joint) = joints.get(*index as usize) else {
                        let message = format!("{joint_name} has joint {index} of only {}", joints.len());
                        return Err(self.malformed(source.object, message));
                    };
                    sum.0 += *weight * joint.matrix3;
                    sum.1 += *weight * joint.translation;
                    sum.2 += weight;
                }
            }
        }
        let normalized = |(matrix3, translation, weight): (Mat3A, glam::Vec3A, f32)| {
            let scale = weight.recip();
            if !scale.is_finite() {
                return Affine3A::IDENTITY;
            }
            Affine3A { matrix3: matrix3 * scale, translation: translation * scale }
        };
        Ok(sums.into_iter().map(normalized).collect())
    }

    /// Checks that an attribute has as many elements as there are positions.
    pub fn check_count(&self, source: &Source<'_>, name: &str, accessor: u32) -> Result<(), LoadError> {
        let (own, count) = (self.accessor_count(accessor)?, source.count);
        if own == count {
            return Ok(());
        }
        Err(self.malformed(source.object, format!("{name} has {own} elements for {count} positions")))
    }
}

/// Moves vertex `i` by `transform(i)`.
fn transform_vertices(mesh: &mut TriangleMesh, transform: impl Fn(usize) -> Affine3A) {
    for (i, position) in mesh.positions.iter_mut().enumerate() {
        *position = transform(i).transform_point3(*position);
    }
    for (i, normal) in mesh.normals.iter_mut().enumerate() {
        // The cofactor matrix is the inverse transpose times the determinant, and exists for every matrix.
        let m = transform(i).matrix3;
        let cofactors =
            Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        *normal = (cofactors * *normal * sign).normalize_or(*normal);
    }
    for (i, tangent) in mesh.tangents.iter_mut().enumerate() {
        let direction = transform(i).transform_vector3(tangent.truncate());
        *tangent = Vec4::from((direction.normalize_or_zero(), tangent.w));
    }
}
