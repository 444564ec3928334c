//! Morph targets and skins: how the vertices of a mesh move, and where they are in the pose that the file's nodes and
//! weights describe.

use super::accessor::{Integers, Pick};
use super::document::Document;
use super::draco::Decompressed;
use super::instances::{Job, Pose};
use super::json::{Kind, Primitive};
use super::materials::Use;
use crate::animation::{Deformation, Influence, Influences, Joints, MorphTarget};
use crate::origin::{Bounds, subtract};
use crate::{LoadError, LoadReport, TriangleMesh};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use std::collections::BTreeMap;

/// No primitive has more sets of four joints.
const MAX_JOINT_SETS: u32 = 16;

/// A primitive's place in the file and the vertices of it that are in use.
pub(super) struct Source<'p> {
    pub primitive: &'p Primitive,
    /// What was compressed of it.
    pub compressed: Option<&'p Decompressed<'p>>,
    pub pick: Pick<'p>,
    /// The count of the `POSITION` accessor, which all attributes share.
    pub count: u64,
    /// The mesh and the primitive, for messages.
    pub object: &'p str,
}

impl Job {
    /// Whether the vertices of the primitive are not where the file has them.
    fn deforms(&self, primitive: &Primitive) -> bool {
        let morphs = !primitive.targets.is_empty()
            && (self.animated || self.weights.iter().any(|w| *w != 0.0 && w.is_finite()));
        morphs || !matches!(self.pose, Pose::Rest)
    }
}

impl Document<'_> {
    /// How the vertices of `mesh`, which is the primitive as the file has it, move; `None` if they stay.
    ///
    /// # Errors
    /// Broken morph targets, joints or weights.
    pub fn deformation(
        &self,
        job: &Job,
        source: &Source<'_>,
        material: Use,
        mesh: &TriangleMesh,
    ) -> Result<Option<Deformation>, LoadError> {
        if !job.deforms(source.primitive) {
            return Ok(None);
        }
        let mut targets = Vec::new();
        for (index, target) in source.primitive.targets.iter().enumerate() {
            let weight = job.weights.get(index).copied().unwrap_or(0.0);
            // A target without weight is not read, so that an error in it goes unnoticed.
            let used = job.animated || weight != 0.0;
            targets.push(if used {
                self.target(source, target, material, mesh)?
            } else {
                MorphTarget::default()
            });
        }
        let influences = match &job.pose {
            Pose::Skinned { joints, .. } => self.influences(joints.len(), source, mesh.positions.len())?,
            Pose::Rest | Pose::Baked(_) => None,
        };
        Ok(Some(Deformation { targets, influences, ..Deformation::default() }))
    }

    /// Moves the vertices of `mesh` into the job's pose. The deformation remembers where they were.
    ///
    /// - `origin`: what the job's transforms are relative to.
    pub fn apply_pose(
        &self,
        job: &Job,
        origin: DVec3,
        deformation: &mut Deformation,
        mesh: &mut TriangleMesh,
        report: &mut LoadReport,
    ) {
        let indices = std::mem::take(&mut mesh.indices);
        deformation.rest = std::mem::take(mesh);
        if !matches!(job.pose, Pose::Rest) {
            let bounds = Bounds::of(deformation.rest.positions.iter().map(|p| p.as_dvec3()));
            deformation.anchor = bounds.anchor();
            subtract(&mut deformation.rest.positions, deformation.anchor);
        }
        let unmoved = DAffine3::from_translation(-origin);
        let joints = match &job.pose {
            Pose::Rest => None,
            Pose::Baked(node) => Some(Joints { matrices: &[], node: *node, unmoved }),
            Pose::Skinned { joints, node, .. } => {
                if joints.iter().any(|j| !j.is_finite()) {
                    report.repaired("joints that are not finite leave their vertices where they are at rest");
                }
                Some(Joints { matrices: joints, node: *node, unmoved })
            }
        };
        deformation.apply(&job.weights, joints, mesh);
        mesh.indices = indices;
    }

    fn target(
        &self,
        source: &Source<'_>,
        target: &BTreeMap<String, u32>,
        material: Use,
        mesh: &TriangleMesh,
    ) -> Result<MorphTarget, LoadError> {
        let find = |name: &str, present: bool| -> Result<Option<u32>, LoadError> {
            let Some(accessor) = target.get(name).filter(|_| present) else { return Ok(None) };
            self.check_count(source, name, *accessor)?;
            Ok(Some(*accessor))
        };
        let vectors = |name: &str, present: bool| -> Result<Vec<Vec3>, LoadError> {
            let Some(accessor) = find(name, present)? else { return Ok(Vec::new()) };
            self.read::<3, Vec3>(accessor, Kind::Vec3, Integers::AsDeclared, source.pick)
        };
        let uvs = |slot: usize, present: bool| -> Result<Vec<Vec2>, LoadError> {
            let name = format!("TEXCOORD_{}", material.uv_sets[slot]);
            let Some(accessor) = find(&name, present)? else { return Ok(Vec::new()) };
            self.read::<2, Vec2>(accessor, Kind::Vec2, Integers::AsDeclared, source.pick)
        };
        let colors = match find("COLOR_0", !mesh.colors.is_empty())? {
            None => Vec::new(),
            Some(accessor) if self.accessor_kind(accessor)? == Kind::Vec3 => {
                let rgb = self.read::<3, Vec3>(accessor, Kind::Vec3, Integers::Normalized, source.pick)?;
                self.reserve::<Vec4>(rgb.len() as u64)?;
                rgb.into_iter().map(|c| c.extend(0.0)).collect()
            }
            Some(accessor) => {
                self.read::<4, Vec4>(accessor, Kind::Vec4, Integers::Normalized, source.pick)?
            }
        };
        Ok(MorphTarget {
            positions: vectors("POSITION", true)?,
            normals: vectors("NORMAL", !mesh.normals.is_empty())?,
            tangents: vectors("TANGENT", !mesh.tangents.is_empty())?,
            uv0: uvs(0, !mesh.uv0.is_empty())?,
            uv1: uvs(1, !mesh.uv1.is_empty())?,
            colors,
        })
    }

    /// The influences of `joints` joints on each vertex; `None` for a primitive without joints.
    fn influences(
        &self,
        joints: usize,
        source: &Source<'_>,
        vertices: usize,
    ) -> Result<Option<Influences>, LoadError> {
        let mut sets = Vec::new();
        for set in 0..MAX_JOINT_SETS {
            let (joint_name, weight_name) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            let indices =
                self.attribute::<4, [f32; 4]>(source, &joint_name, Kind::Vec4, Integers::AsDeclared)?;
            let weights =
                self.attribute::<4, [f32; 4]>(source, &weight_name, Kind::Vec4, Integers::Normalized)?;
            let Some((indices, weights)) = indices.zip(weights) else { break };
            // The file's data can be of any type here; a saturating conversion keeps the check honest.
            let beyond = |(index, weight): &(&f32, &f32)| **weight != 0.0 && **index as usize >= joints;
            let numbers = indices.as_flattened().iter().zip(weights.as_flattened());
            if let Some((index, _)) = numbers.clone().find(beyond) {
                let message = format!("{joint_name} has joint {index} of only {joints}");
                return Err(self.malformed(source.object, message));
            }
            sets.push((indices, weights));
        }
        if sets.is_empty() {
            return Ok(None);
        }
        self.reserve::<[Influence; 4]>((sets.len() * vertices) as u64)?;
        let mut influences = Influences { first: vec![0], all: Vec::new() };
        for vertex in 0..vertices {
            for (indices, weights) in &sets {
                let pairs = indices[vertex].into_iter().zip(weights[vertex]).filter(|(_, w)| *w != 0.0);
                influences.all.extend(pairs.map(|(joint, weight)| Influence { joint: joint as u32, weight }));
            }
            influences.first.push(influences.all.len() as u32);
        }
        Ok(Some(influences))
    }

    /// An attribute of a primitive, from its accessor or from what was compressed; `None` if it has no such attribute.
    ///
    /// # Errors
    /// As [`Document::read`]; also for a number of elements that is not that of the positions.
    pub fn attribute<const N: usize, T: From<[f32; N]> + Copy>(
        &self,
        source: &Source<'_>,
        name: &str,
        kind: Kind,
        integers: Integers,
    ) -> Result<Option<Vec<T>>, LoadError> {
        let Some(accessor) = source.primitive.attributes.get(name) else { return Ok(None) };
        if let Some(values) = source.compressed.and_then(|c| c.read(self, name, integers, source.pick)) {
            return Ok(Some(values));
        }
        self.check_count(source, name, *accessor)?;
        self.read(*accessor, kind, integers, source.pick).map(Some)
    }

    /// The shape of an attribute's elements; `None` if there is no such attribute.
    ///
    /// # Errors
    /// Its accessor does not exist.
    pub fn attribute_kind(&self, source: &Source<'_>, name: &str) -> Result<Option<Kind>, LoadError> {
        let compressed = source.compressed.and_then(|c| c.kind(name));
        let accessor = source.primitive.attributes.get(name).filter(|_| compressed.is_none());
        Ok(compressed.or(accessor.map(|a| self.accessor_kind(*a)).transpose()?))
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
