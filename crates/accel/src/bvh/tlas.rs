//! The top level: instances of objects.

use super::blas::Blas;
use super::instance::{Instance, inverse, to_object_space};
use super::motion::{InstanceMotions, motion_bounds};
use super::validate::validate_tree;
use crate::aabb::Aabb;
use crate::build::{self, LeafCost, PrimitiveRef, Quality, Settings};
use crate::layout::{ChildRef, EMPTY, INSTANCE, LEAF, Node};
use crate::ray::Ray;
use crate::simd::InstructionSet;
use optics::motion::{AffineRows, MOTION_MIDDLE, affine_inverse};
use std::sync::Arc;

/// [`InstanceLeaf::placement`] of an instance in world space.
const IDENTITY: u32 = u32::MAX;
/// [`InstanceLeaf::placement`] of an instance that stands still.
const STILL: u32 = u32::MAX - 1;

/// A leaf of the top level: an instance as queries need it.
struct InstanceLeaf {
    world_to_object: [[f32; 4]; 3],
    blas: u32,
    mask: u32,
    index: u32,
    /// [`IDENTITY`], [`STILL`], or the number of the instance, which then moves.
    placement: u32,
}

/// A bounding volume hierarchy over instances.
pub struct Tlas {
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: ChildRef,
    /// See [`Aabb::extent`].
    pub(crate) extent: [f32; 3],
    /// By leaf index.
    leaves: Vec<InstanceLeaf>,
    blas: Vec<Arc<Blas>>,
    motions: InstanceMotions,
    bounds: Aabb,
    /// The mask of the single instance, if there is exactly one and it has no transform.
    single_mask: Option<u32>,
    skipped: usize,
    instruction_set: InstructionSet,
}

impl Tlas {
    /// Builds over `instances` of the objects `blas`. [`Hit::instance`](crate::Hit::instance) is an
    /// index into `instances`.
    ///
    /// Instances whose transform is not finite or has no inverse, and those of empty objects, are
    /// left out, see [`Tlas::skipped_instances`].
    ///
    /// # Panics
    ///
    /// If an instance refers to an object that does not exist.
    pub fn build(instances: &[Instance], blas: Vec<Arc<Blas>>) -> Tlas {
        let mut tlas = Tlas {
            nodes: Vec::new(),
            root: EMPTY,
            extent: [0.0; 3],
            leaves: Vec::new(),
            blas,
            motions: InstanceMotions::default(),
            bounds: Aabb::EMPTY,
            single_mask: None,
            skipped: 0,
            instruction_set: InstructionSet::best(),
        };
        tlas.update(instances);
        tlas
    }

    /// Rebuilds the top level after instances were moved, added or removed, or objects were
    /// refitted.
    ///
    /// # Panics
    ///
    /// If an instance refers to an object that does not exist.
    pub fn update(&mut self, instances: &[Instance]) {
        self.update_moving(instances, InstanceMotions::default());
    }

    /// As [`Tlas::update`], of instances of which some move while rays leave. Their own transforms
    /// do not count.
    ///
    /// # Panics
    ///
    /// If an instance refers to an object that does not exist.
    pub fn update_moving(&mut self, instances: &[Instance], motions: InstanceMotions) {
        self.motions = motions;
        let mut refs = Vec::with_capacity(instances.len());
        let mut leaves = Vec::with_capacity(instances.len());
        for (index, instance) in instances.iter().enumerate() {
            let object = &self.blas[instance.blas as usize];
            let bounds = object.bounds();
            let motion = self.motions.of(index);
            let middle = || AffineRows::of_motion(motion, MOTION_MIDDLE).rows();
            let object_to_world = if motion.is_empty() { instance.object_to_world } else { middle() };
            let is_identity = motion.is_empty() && object_to_world == Instance::IDENTITY;
            let Some(world_to_object) = inverse(&object_to_world) else { continue };
            let world = if is_identity {
                bounds
            } else if motion.is_empty() {
                object.transformed_bounds(&object_to_world)
            } else {
                motion_bounds(motion, &bounds, |rows| object.transformed_bounds(rows))
            };
            let placement = match (is_identity, motion.is_empty()) {
                (true, _) => IDENTITY,
                (false, true) => STILL,
                (false, false) => index as u32,
            };
            if bounds.is_empty() || !world.min.iter().chain(&world.max).all(|c| c.is_finite()) {
                continue;
            }
            refs.push(PrimitiveRef::new(&world, leaves.len() as u32, 0));
            let (blas, mask) = (instance.blas, instance.mask);
            leaves.push(Some(InstanceLeaf { world_to_object, blas, mask, index: index as u32, placement }));
        }
        self.skipped = instances.len() - leaves.len();
        let tree = build::build(&mut refs, Settings::new(Quality::Balanced, 1, LeafCost::PerBlock));
        let order = tree.leaves.iter().map(|&(first, _)| refs[first as usize].index() as usize);
        self.leaves = order.filter_map(|i| leaves[i].take()).collect();
        self.nodes = tree.nodes;
        self.root = instance_ref(tree.root);
        for node in &mut self.nodes {
            node.children = node.children.map(instance_ref);
        }
        self.bounds = tree.bounds;
        self.extent = tree.bounds.extent();
        self.single_mask = match &self.leaves[..] {
            [one] if one.placement == IDENTITY && one.index == 0 => Some(one.mask),
            _ => None,
        };
        #[cfg(debug_assertions)]
        self.validate().expect("a tree that was just built");
    }

    /// Mutable access to object `index`, for example to refit it. Call [`Tlas::update`] before the
    /// next query.
    ///
    /// # Panics
    ///
    /// If there is no such object, or if it is shared.
    pub fn blas_mut(&mut self, index: usize) -> &mut Blas {
        Arc::get_mut(&mut self.blas[index]).expect("an object that is modified must not be shared")
    }

    /// The objects.
    pub fn blas(&self) -> &[Arc<Blas>] {
        &self.blas
    }

    /// The bounds of all instances, in world space.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Number of instances that were left out because they cannot be hit.
    pub fn skipped_instances(&self) -> usize {
        self.skipped
    }

    /// Memory that this occupies, in bytes. Each object counts once.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Tlas>()
            + self.nodes.capacity() * size_of::<Node>()
            + self.leaves.capacity() * size_of::<InstanceLeaf>()
            + self.blas.iter().map(|b| b.memory_bytes()).sum::<usize>()
    }

    /// The instruction set that queries use.
    pub fn instruction_set(&self) -> InstructionSet {
        self.instruction_set
    }

    /// Sets the instruction set, for tests and comparisons.
    ///
    /// # Panics
    ///
    /// If this processor does not have it.
    pub fn set_instruction_set(&mut self, isa: InstructionSet) {
        assert!(isa.is_available(), "{isa:?} is not available here");
        self.instruction_set = isa;
    }

    /// Checks the structure, see [`Blas::validate`]. Does not check the objects.
    ///
    /// # Errors
    ///
    /// A description of the first defect.
    pub fn validate(&self) -> Result<(), String> {
        if self.leaves.iter().any(|p| p.blas as usize >= self.blas.len()) {
            return Err("an instance refers to an object that does not exist".into());
        }
        validate_tree(&self.nodes, self.root, &vec![Aabb::EMPTY; self.leaves.len()])
    }

    /// The object, if there is exactly one instance, without a transform, and `mask` can see it.
    /// Then queries skip the top level.
    #[inline(always)]
    pub(crate) fn single_object(&self, mask: u32) -> Option<&Blas> {
        match self.single_mask {
            Some(m) if m & mask != 0 => Some(&self.blas[self.leaves[0].blas as usize]),
            _ => None,
        }
    }

    /// The object of the instance at leaf `leaf`, the index of the instance, and the ray in object
    /// space. `None` if `mask` cannot see the instance. `time`: the ray's; asked only where the
    /// instance moves.
    #[inline(always)]
    pub(crate) fn enter(
        &self,
        leaf: usize,
        ray: &Ray,
        time: impl Fn() -> f32,
        mask: u32,
    ) -> Option<(&Blas, u32, Ray)> {
        let leaf = &self.leaves[leaf];
        if leaf.mask & mask == 0 {
            return None;
        }
        let mut r = *ray;
        if leaf.placement != IDENTITY {
            r = match leaf.placement {
                STILL => to_object_space(&leaf.world_to_object, ray),
                moving => to_object_space(&self.world_to_object(moving, time()), ray),
            };
            if !r.is_valid() {
                return None;
            }
        }
        Some((&self.blas[leaf.blas as usize], leaf.index, r))
    }

    /// From world space to that of an instance that moves, at `time`. Out of line: what stands
    /// still pays nothing for it.
    #[inline(never)]
    fn world_to_object(&self, instance: u32, time: f32) -> [[f32; 4]; 3] {
        affine_inverse(AffineRows::of_motion(self.motions.of(instance as usize), time)).rows()
    }
}

/// Marks leaf references as references to instances.
fn instance_ref(child: ChildRef) -> ChildRef {
    if child & LEAF == 0 { child } else { child | INSTANCE }
}
