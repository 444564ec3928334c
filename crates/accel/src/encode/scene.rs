//! A scene as shaders read it.

use super::flatten::FlattenedInstances;
use super::geometry_ref::{self, GeometryRef};
use super::instance::{self, EncodedInstance};
use super::node::EncodedNode;
use super::object::{EncodedObject, Object, ObjectInfo};
use super::object_tree::ObjectTree;
use super::primitive::EncodedPrimitive;
use super::tree_layout::TreeLayout;
use crate::build::{LeafCost, Quality, Settings, build};
use crate::bvh::{Instance, InstanceMotions};
use rayon::prelude::*;

/// A scene that shaders can trace: three arrays for three buffers.
///
/// The first records of `nodes` are the top level, which [`EncodedScene::update`] changes. All
/// other records are constant.
#[derive(Clone)]
pub struct EncodedScene {
    /// Nodes of both levels. The first is the root of the top level.
    pub nodes: Vec<EncodedNode>,
    /// Triangles and spheres of all objects. Split triangles occur more than once.
    pub primitives: Vec<EncodedPrimitive>,
    /// The world, then the instances in the order of the top level's leaves. Never empty.
    pub instances: Vec<EncodedInstance>,
    objects: Vec<EncodedObject>,
    object_depth: u32,
    top_level_depth: u32,
    is_single_object: bool,
    /// Whether the only object holds all instances.
    flattened: bool,
    skipped: usize,
    /// Number of nodes reserved for the top level.
    top_level_capacity: usize,
}

impl EncodedScene {
    /// Builds and encodes trees over `objects` and `instances`.
    ///
    /// Primitives that cannot be hit are left out, as in [`crate::Blas::triangles`] and
    /// [`crate::Blas::spheres`], and so are instances without an inverse transform or with an empty
    /// mask.
    ///
    /// # Panics
    ///
    /// If an instance refers to an object that does not exist.
    pub fn build(objects: &[Object], instances: &[Instance], quality: Quality) -> EncodedScene {
        let geometries: Vec<Vec<GeometryRef>> = objects.iter().map(GeometryRef::of).collect();
        let mut scene = EncodedScene::with_capacity_for(&geometries, instances.len(), quality);
        scene.update(instances);
        scene
    }

    /// As [`EncodedScene::build`], of instances of which some move while rays leave. The transforms
    /// of those are what a shader has to find out itself, at the time of its ray.
    ///
    /// # Panics
    ///
    /// If an instance refers to an object that does not exist.
    pub fn build_moving(
        objects: &[Object],
        instances: &[Instance],
        motions: &InstanceMotions,
        quality: Quality,
    ) -> EncodedScene {
        let geometries: Vec<Vec<GeometryRef>> = objects.iter().map(GeometryRef::of).collect();
        let mut scene = EncodedScene::with_capacity_for(&geometries, instances.len(), quality);
        scene.update_moving(instances, motions);
        scene
    }

    /// As [`EncodedScene::build`], for static instances: they are flattened to one object in world
    /// space, if they have at most `max_primitives` primitives. Then [`EncodedScene::is_flattened`]
    /// is true and instances cannot be moved.
    ///
    /// # Panics
    ///
    /// If an instance refers to an object that does not exist.
    pub fn build_flattened(
        objects: &[Object],
        instances: &[Instance],
        quality: Quality,
        max_primitives: usize,
    ) -> EncodedScene {
        let Some(flattened) = FlattenedInstances::new(objects, instances, max_primitives) else {
            return EncodedScene::build(objects, instances, quality);
        };
        let mut scene = EncodedScene::with_capacity_for(&[flattened.geometries()], 1, quality);
        let primitives = scene.primitives.par_iter_mut().with_min_len(1024);
        primitives.for_each(|p| (p.owner, p.geometry) = flattened.owner(p.geometry));
        scene.update(&[Instance::identity(0)]);
        scene.flattened = true;
        scene
    }

    /// Encodes objects and reserves nodes for a top level over `instances` instances.
    fn with_capacity_for(objects: &[Vec<GeometryRef>], instances: usize, quality: Quality) -> EncodedScene {
        let trees: Vec<ObjectTree> =
            objects.par_iter().map(|geometries| ObjectTree::new(geometries, quality)).collect();
        let top_level_capacity = instances.max(1);
        let node_count: usize = trees.iter().map(|p| p.layout.node_count()).sum();
        let primitive_count: usize = trees.iter().map(|p| p.layout.primitives.len()).sum();
        let mut scene = EncodedScene {
            nodes: Vec::with_capacity(top_level_capacity + node_count),
            primitives: Vec::with_capacity(primitive_count),
            instances: Vec::new(),
            objects: Vec::with_capacity(objects.len()),
            object_depth: trees.iter().map(|p| p.layout.depth).max().unwrap_or(0),
            top_level_depth: 0,
            is_single_object: false,
            flattened: false,
            skipped: trees.iter().map(|p| p.skipped).sum(),
            top_level_capacity,
        };
        scene.nodes.resize(top_level_capacity, bytemuck::Zeroable::zeroed());
        for (geometries, trees) in objects.iter().zip(&trees) {
            scene.add(geometries, trees);
        }
        scene
    }

    /// Appends an object.
    fn add(&mut self, geometries: &[GeometryRef], ObjectTree { layout, refs, .. }: &ObjectTree) {
        let (root, first_primitive) = (self.nodes.len() as u32, self.primitives.len() as u32);
        self.nodes.par_extend(layout.nodes(root, first_primitive));
        let primitives = layout.primitives.par_iter().with_min_len(1024);
        self.primitives.par_extend(primitives.map(|&r| geometry_ref::encode(geometries, &refs[r as usize])));
        let has = |spheres: bool| geometries.iter().any(|p| p.is_spheres() == spheres);
        let (has_triangles, has_spheres) = (has(false), has(true));
        let (bounds, tight_bounds) = (layout.bounds(), layout.tight_bounds());
        self.objects.push(EncodedObject { root, bounds, tight_bounds, has_triangles, has_spheres });
    }

    /// Encodes the top level again after instances were moved or removed. Returns how many of the
    /// first `nodes` have to be uploaded, besides all of `instances`.
    ///
    /// # Panics
    ///
    /// If an instance refers to an object that does not exist, if there are more instances than at
    /// the build, or if they are flattened.
    pub fn update(&mut self, instances: &[Instance]) -> usize {
        self.update_moving(instances, &InstanceMotions::default())
    }

    /// As [`EncodedScene::update`], of instances of which some move while rays leave.
    ///
    /// # Panics
    ///
    /// As [`EncodedScene::update`].
    pub fn update_moving(&mut self, instances: &[Instance], motions: &InstanceMotions) -> usize {
        assert!(!self.flattened, "flattened instances cannot be moved");
        assert!(instances.len() <= self.top_level_capacity, "more instances than at the build");
        let (mut refs, leaves) = instance::encode_instances(instances, motions, &self.objects);
        let layout =
            TreeLayout::new(build(&mut refs, Settings::new(Quality::Balanced, 1, LeafCost::PerBlock)));
        let nodes: Vec<EncodedNode> = layout.nodes(0, 1).collect();
        self.nodes[..nodes.len()].copy_from_slice(&nodes);
        self.top_level_depth = layout.depth;
        let in_leaves = layout.primitives.iter().map(|&r| leaves[refs[r as usize].index() as usize]);
        self.instances = std::iter::once(EncodedInstance::world(layout.bounds())).chain(in_leaves).collect();
        self.is_single_object = matches!(self.instances[..], [_, one] if one.is_identity() && one.index == 0);
        if self.is_single_object {
            self.instances[0] = self.instances[1];
        }
        nodes.len()
    }

    /// The scene without the nodes and primitives of objects. [`EncodedScene::update`] needs only
    /// this.
    #[must_use]
    pub fn into_top_level(mut self) -> EncodedScene {
        self.nodes.truncate(self.top_level_capacity);
        self.nodes.shrink_to_fit();
        self.primitives = Vec::new();
        self
    }

    /// Roots and bounds of the objects, for callers that build the top level themselves.
    pub fn objects(&self) -> impl Iterator<Item = ObjectInfo> {
        self.objects.iter().map(|o| ObjectInfo {
            root: if o.bounds.is_empty() { u32::MAX } else { o.root },
            low: o.bounds.min,
            high: o.bounds.max,
            has_spheres: o.has_spheres,
        })
    }

    /// The largest depth of an object's tree, in nodes.
    pub fn object_depth(&self) -> u32 {
        self.object_depth
    }

    /// Whether there is one instance, with index 0 and no transform. Then its record replaces that
    /// of the world, and there is no top level.
    pub fn is_single(&self) -> bool {
        self.is_single_object
    }

    /// Whether all instances are flattened to one object. Then primitives refer to their instances.
    pub fn is_flattened(&self) -> bool {
        self.flattened
    }

    /// Whether the scene is empty.
    pub fn is_empty(&self) -> bool {
        self.instances.len() < 2
    }

    /// The stack size of a traversal, in groups of siblings.
    pub fn stack_size(&self) -> u32 {
        // At a node of level n, siblings of levels 2 to n may be on the stack. On entering an
        // instance, the nodes and the other instances beside it: (top-level depth - 1) + 2 +
        // (object depth - 1).
        let top_level = if self.is_single_object { 0 } else { self.top_level_depth };
        (top_level + self.object_depth).max(1)
    }

    /// Whether there are triangles, and whether there are spheres.
    pub fn kinds(&self) -> (bool, bool) {
        let filled = || self.objects.iter().filter(|o| !o.bounds.is_empty());
        (filled().any(|o| o.has_triangles), filled().any(|o| o.has_spheres))
    }

    /// Number of primitives that were left out because they cannot be hit.
    pub fn skipped_primitives(&self) -> usize {
        self.skipped
    }

    /// Size of the three arrays, in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.primitives[..]) + size_of_val(&self.instances[..])
    }
}
