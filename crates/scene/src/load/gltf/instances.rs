//! Which meshes stand where: nodes with meshes, `EXT_mesh_gpu_instancing`, skins and morph weights.

use super::accessor::{Integers, Pick};
use super::document::Document;
use super::json::{Instancing, Kind};
use super::motion::Motion;
use super::nodes::{Hierarchy, VisitedNode, unit};
use crate::animation::Skin;
use crate::load::session::instance;
use crate::{Instance, LoadError, LoadReport, MeshId};
use glam::{DAffine3, DMat4, DQuat, DVec3, Vec3};
use std::collections::HashMap;
use std::sync::Arc;

/// A mesh to be built: geometry in a certain pose.
pub(super) struct Job {
    /// Index of the mesh in the file.
    pub mesh: u32,
    /// Weights of the morph targets; missing ones are 0.
    pub weights: Arc<[f32]>,
    /// What moves the vertices.
    pub pose: Pose,
    /// The node, whose weights an animation may change.
    pub node: u32,
    /// Vertices move against each other over time.
    pub animated: bool,
}

/// What moves the vertices of a mesh before it is stored.
pub(super) enum Pose {
    /// Nothing: instances carry the transform.
    Rest,
    /// A skin of the file: object to world of each joint; `node` moves what has no joints.
    Skinned { skin: u32, joints: Vec<DAffine3>, node: DAffine3 },
    /// The node's transform, which an instance cannot carry because it has no inverse.
    Baked(DAffine3),
}

/// Meshes to build, and their instances; an instance's mesh is the number of the job.
#[derive(Default)]
pub(super) struct Placement {
    pub jobs: Vec<Job>,
    pub instances: Vec<Instance>,
    /// What carries each instance.
    pub carriers: Vec<Carrier>,
    shared: HashMap<(u32, Arc<[u32]>), MeshId>,
    /// For each mesh the one that was asked for last.
    last: HashMap<u32, (Arc<[u32]>, MeshId)>,
}

/// What carries an instance.
#[derive(Clone, Copy)]
pub(super) struct Carrier {
    pub node: u32,
    /// Instance to world.
    pub world: DAffine3,
    /// Instance to node; `None` where the vertices are in world space already.
    pub local: Option<DAffine3>,
    /// The instance moves, its vertices do, or it is not always shown.
    pub moving: bool,
}

impl Document<'_> {
    /// Finds all instances and the meshes that they need, each once.
    ///
    /// # Errors
    /// References to what does not exist, and broken instancing or skin data.
    pub fn placement(
        &self,
        hierarchy: &Hierarchy,
        motion: &Motion,
        report: &mut LoadReport,
    ) -> Result<Placement, LoadError> {
        let mut placement = Placement::default();
        // Weights of meshes by their number: copied and compared once, however many nodes have none of their own.
        let mut of_meshes: HashMap<u32, Weights> = HashMap::new();
        for placed in &hierarchy.placed {
            let VisitedNode { node: number, .. } = *placed;
            let node = &self.json.nodes[number as usize];
            let Some(mesh) = node.mesh else { continue };
            let source = self.get(&self.json.meshes, mesh, "mesh")?;
            let (weights, key) = match &node.weights {
                Some(own) => with_bits(own),
                None => of_meshes
                    .entry(mesh)
                    .or_insert_with(|| with_bits(source.weights.as_deref().unwrap_or_default()))
                    .clone(),
            };
            self.note_mismatches(node.skin.is_some(), mesh, weights.len(), report);
            let name = self.node_name(number, source.name.as_deref());
            let world = hierarchy.worlds[number as usize];
            let moving = motion.moves(number);
            let animated = motion.morphs(number);
            let rest = Job { mesh, weights, pose: Pose::Rest, node: number, animated };
            let mut add = |job: Job, local: Option<DAffine3>| {
                let transform = local.map_or(DAffine3::IDENTITY, |local| world * local);
                let moving = moving || job.animated;
                placement.add(
                    job,
                    &key,
                    &name,
                    transform,
                    Carrier { node: number, world: transform, local, moving },
                    placed,
                    report,
                );
            };
            if let Some(skin) = self.used_skin(node.skin, mesh)? {
                let animated = animated || skin.joints.iter().any(|joint| motion.moves(*joint));
                let joints = skin.matrices(|joint| hierarchy.worlds[joint as usize]);
                let skin = node.skin.unwrap_or_default();
                let pose = Pose::Skinned { skin, joints, node: world };
                self.options.budget().take(instance(name.len()), "instances")?;
                add(Job { pose, animated, ..rest }, None);
            } else if let Some(instancing) = &node.extensions.instancing {
                let transforms = self.instance_transforms(instancing, number)?;
                self.reserve::<(Instance, Carrier)>(transforms.len() as u64)?;
                let size = instance(name.len()).saturating_mul(transforms.len() as u64);
                self.options.budget().take(size, "instances")?;
                for transform in transforms {
                    let job = Job { pose: Pose::Rest, weights: rest.weights.clone(), ..rest };
                    add(job, Some(transform));
                }
            } else {
                self.options.budget().take(instance(name.len()), "instances")?;
                add(rest, Some(DAffine3::IDENTITY));
            }
        }
        Ok(placement)
    }

    /// Says what a node asks of its mesh that the mesh does not have. `weights`: of morph targets, how many are given.
    fn note_mismatches(&self, has_skin: bool, mesh: u32, weights: usize, report: &mut LoadReport) {
        if has_skin && !self.has_joints(mesh) {
            report.ignored(format!("mesh {mesh} has no joints: the skin of its node moves nothing"));
        }
        let targets = self.target_count(mesh);
        if weights > 0 && weights != targets {
            report
                .ignored(format!("mesh {mesh} has {targets} morph targets, but {weights} weights are given"));
        }
    }

    fn has_joints(&self, mesh: u32) -> bool {
        self.json.meshes[mesh as usize].primitives.iter().any(|p| p.attributes.contains_key("JOINTS_0"))
    }

    /// The skin of a node's mesh; `None` if there is none or the mesh has no joints.
    fn used_skin(&self, skin: Option<u32>, mesh: u32) -> Result<Option<Skin>, LoadError> {
        let Some(index) = skin else { return Ok(None) };
        self.get(&self.json.skins, index, "skin")?;
        if self.has_joints(mesh) { self.skin(index).map(Some) } else { Ok(None) }
    }

    /// A skin of the file.
    ///
    /// # Errors
    /// It or one of its joints does not exist, or its matrices are broken.
    pub fn skin(&self, index: u32) -> Result<Skin, LoadError> {
        let skin = self.get(&self.json.skins, index, "skin")?;
        let inverse_bind = match skin.inverse_bind_matrices {
            Some(accessor) => {
                self.read::<16, [f32; 16]>(accessor, Kind::Mat4, Integers::AsDeclared, Pick::All)?
            }
            None => vec![glam::Mat4::IDENTITY.to_cols_array(); skin.joints.len()],
        };
        if inverse_bind.len() < skin.joints.len() {
            let message = format!("{} matrices for {} joints", inverse_bind.len(), skin.joints.len());
            return Err(self.malformed(format!("skin {index}"), message));
        }
        self.reserve::<(u32, DAffine3)>(skin.joints.len() as u64)?;
        for joint in skin.joints.iter() {
            self.get(&self.json.nodes, *joint, "node")?;
        }
        let matrix = |m: &[f32; 16]| DAffine3::from_mat4(DMat4::from_cols_array(&m.map(f64::from)));
        let inverse_bind = inverse_bind.iter().take(skin.joints.len()).map(matrix).collect();
        Ok(Skin { joints: skin.joints.to_vec(), inverse_bind })
    }

    /// The transforms of `EXT_mesh_gpu_instancing`.
    pub fn instance_transforms(&self, source: &Instancing, node: u32) -> Result<Vec<DAffine3>, LoadError> {
        let attribute = |name: &str| source.attributes.get(name).copied();
        let mut count: Option<u64> = None;
        for accessor in source.attributes.values() {
            let own = self.accessor_count(*accessor)?;
            if *count.get_or_insert(own) != own {
                let message = "its instancing attributes have different counts";
                return Err(self.malformed(format!("node {node}"), message));
            }
        }
        let (rest, plain) = (Pick::All, Integers::AsDeclared);
        let read3 =
            |name| attribute(name).map(|a| self.read::<3, Vec3>(a, Kind::Vec3, plain, rest)).transpose();
        let translations = read3("TRANSLATION")?;
        let scales = read3("SCALE")?;
        let rotations = attribute("ROTATION").map(|a| self.read::<4, [f32; 4]>(a, Kind::Vec4, plain, rest));
        let rotations = rotations.transpose()?;
        if translations.is_none() && scales.is_none() && rotations.is_none() {
            return Ok(Vec::new());
        }
        let count = count.unwrap_or(0) as usize;
        self.reserve::<DAffine3>(count as u64)?;
        let at = |list: &Option<Vec<Vec3>>, i: usize, other: DVec3| {
            list.as_ref().map_or(other, |l| l[i].as_dvec3())
        };
        let mut ignored = LoadReport::default(); // small integers are never exactly of unit length
        Ok((0..count)
            .map(|i| {
                let rotation = rotations.as_ref().map(|r| DQuat::from_array(r[i].map(f64::from)));
                DAffine3::from_scale_rotation_translation(
                    at(&scales, i, DVec3::ONE),
                    rotation.map_or(DQuat::IDENTITY, |r| unit(r, &mut ignored)),
                    at(&translations, i, DVec3::ZERO),
                )
            })
            .collect())
    }
}

/// Weights and their bits, by which they are compared.
type Weights = (Arc<[f32]>, Arc<[u32]>);

fn with_bits(weights: &[f32]) -> Weights {
    (Arc::from(weights), weights.iter().map(|w| w.to_bits()).collect())
}

impl Placement {
    /// The job of a mesh with the bits of these weights; `next` if there is none yet. Instances of a node have the same list,
    /// and so have nodes without weights of their own, so it is compared as a whole only where it is another one.
    fn shared_mesh(&mut self, mesh: u32, weights: &Arc<[u32]>, next: MeshId) -> MeshId {
        if let Some((list, id)) = self.last.get(&mesh)
            && Arc::ptr_eq(list, weights)
        {
            return *id;
        }
        let id = *self.shared.entry((mesh, weights.clone())).or_insert(next);
        self.last.insert(mesh, (weights.clone(), id));
        id
    }

    fn add(
        &mut self,
        mut job: Job,
        weights: &Arc<[u32]>,
        name: &str,
        world: DAffine3,
        mut carrier: Carrier,
        placed: &VisitedNode,
        report: &mut LoadReport,
    ) {
        let transform = world.as_affine3a();
        if !transform.is_finite() {
            return report.ignored("a node's transform is not finite: what it places is left out");
        }
        if !carrier.moving {
            if transform.matrix3 == glam::Mat3A::ZERO {
                return report.info("a node is scaled to nothing: what it places is left out");
            }
            if matches!(job.pose, Pose::Rest) && !transform.inverse().is_finite() {
                report.info("a node is scaled to a plane or a line: its vertices are moved into world space");
                job.pose = Pose::Baked(std::mem::replace(&mut carrier.world, DAffine3::IDENTITY));
                carrier.local = None;
            }
        }
        let next = self.jobs.len() as MeshId;
        let mesh = match job.pose {
            Pose::Rest if !job.animated => self.shared_mesh(job.mesh, weights, next),
            Pose::Rest | Pose::Skinned { .. } | Pose::Baked(_) => next,
        };
        if mesh == next {
            self.jobs.push(job);
        }
        let visible = placed.visible;
        let transform = carrier.world.as_affine3a();
        self.instances.push(Instance { visible, ..Instance::new(name, mesh, transform) });
        self.carriers.push(carrier);
    }
}
