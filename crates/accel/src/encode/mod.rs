//! Encoding for the GPU: a compressed eight-wide hierarchy in three plain arrays.
//!
//! [`EncodedScene::build`] makes nodes, primitives and instances from the objects and their places in the world;
//! shaders walk them as [`EncodedScene::closest`] and [`EncodedScene::any`], their scalar twins, do. Start at
//! [`EncodedNode`] for the format, then see `walk.rs` for what it is good for.
//!
//! The trees differ from those of [`crate::Blas`]: leaves hold one to three primitives that are tested one by one. Where large
//! triangles lie between small ones, they are in several leaves, each for a part of them.

mod instance;
mod join;
mod node;
mod part;
mod plan;
mod primitive;
mod tree;
mod walk;

pub use instance::{EncodedInstance, INSTANCE_IDENTITY, INSTANCE_SPHERES};
pub use node::EncodedNode;
pub use primitive::{EncodedPrimitive, OWNER_SPHERE};
pub use walk::{EncodedHit, WalkCounts};

use crate::aabb::Aabb;
use crate::blas::{Geometry, Sphere};
use crate::build::{Leaves, Quality, Settings, build};
use crate::cover::Cover;
use crate::tlas::Instance;
use join::Joined;
use part::Part;
use plan::Planned;
use rayon::prelude::*;
use tree::Plan;

/// Consecutive spheres of an object.
#[derive(Clone, Copy, Debug)]
pub struct SphereGeometry<'a> {
    /// The spheres, in object space.
    pub spheres: &'a [Sphere],
    /// Number of the first sphere in its object; the others count on from there.
    pub first_id: u32,
}

/// What an object is made of. Geometries are numbered in this order.
#[derive(Clone, Debug)]
pub enum Object<'a> {
    /// Triangles.
    Triangles(Vec<Geometry<'a>>),
    /// Procedural spheres.
    Spheres(Vec<SphereGeometry<'a>>),
}

/// An encoded object as seen from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectInfo {
    /// Index of its root node, or `u32::MAX` where there is nothing to hit.
    pub root: u32,
    /// Lowest corner of its bounds, in object space.
    pub low: [f32; 3],
    /// Highest corner; below the lowest where there is nothing.
    pub high: [f32; 3],
    /// Whether it is made of spheres.
    pub has_spheres: bool,
}

/// What is known of an encoded object, for its instances.
#[derive(Clone, Debug)]
struct EncodedObject {
    root: u32,
    bounds: Aabb,
    /// What is known of the bounds when the object is turned.
    cover: Cover,
    has_triangles: bool,
    has_spheres: bool,
}

/// A scene that shaders can trace: three arrays for as many buffers.
///
/// The first records of `nodes` belong to the upper level and change with [`EncodedScene::update`]; all other records
/// stay as they are.
#[derive(Clone)]
pub struct EncodedScene {
    /// Nodes of both levels. The root of the upper level is the first.
    pub nodes: Vec<EncodedNode>,
    /// Triangles and spheres of all objects, some triangles more than once.
    pub primitives: Vec<EncodedPrimitive>,
    /// The world itself, then what is in it, in the order of the upper level's leaves. Never empty.
    pub instances: Vec<EncodedInstance>,
    objects: Vec<EncodedObject>,
    object_depth: u32,
    upper_depth: u32,
    single: bool,
    /// Whether the only object is made of all instances.
    joined: bool,
    skipped: usize,
    /// Number of nodes that are set aside for the upper level.
    upper_capacity: usize,
}

impl EncodedScene {
    /// Builds trees over `objects` and over their `instances`, and encodes them.
    ///
    /// Left out are primitives that cannot be hit, as [`crate::Blas::triangles`] and [`crate::Blas::spheres`] do, and
    /// instances that cannot be entered or have no bit in their mask.
    ///
    /// # Panics
    ///
    /// If an instance names an object that is not there.
    pub fn build(objects: &[Object], instances: &[Instance], quality: Quality) -> EncodedScene {
        let parts: Vec<Vec<Part>> = objects.iter().map(Part::of).collect();
        let mut scene = EncodedScene::over(&parts, instances.len(), quality);
        scene.update(instances);
        scene
    }

    /// As [`EncodedScene::build`], for instances that stand still: they are joined to one object in the world, if they have no more than
    /// `most_joined` primitives together, and [`EncodedScene::is_joined`] says so. Nothing can be moved then.
    ///
    /// # Panics
    ///
    /// If an instance names an object that is not there.
    pub fn build_still(
        objects: &[Object],
        instances: &[Instance],
        quality: Quality,
        most_joined: usize,
    ) -> EncodedScene {
        let Some(joined) = Joined::new(objects, instances, most_joined) else {
            return EncodedScene::build(objects, instances, quality);
        };
        let mut scene = EncodedScene::over(&[joined.parts()], 1, quality);
        let primitives = scene.primitives.par_iter_mut().with_min_len(1024);
        primitives.for_each(|p| (p.owner, p.geometry) = joined.owner(p.geometry));
        scene.update(&[Instance::identity(0)]);
        scene.joined = true;
        scene
    }

    /// Trees over objects, with room for so many instances of them.
    fn over(objects: &[Vec<Part>], instances: usize, quality: Quality) -> EncodedScene {
        let planned: Vec<Planned> = objects.par_iter().map(|parts| Planned::new(parts, quality)).collect();
        let upper_capacity = instances.max(1);
        let node_count: usize = planned.iter().map(|p| p.plan.node_count()).sum();
        let primitive_count: usize = planned.iter().map(|p| p.plan.primitives.len()).sum();
        let mut scene = EncodedScene {
            nodes: Vec::with_capacity(upper_capacity + node_count),
            primitives: Vec::with_capacity(primitive_count),
            instances: Vec::new(),
            objects: Vec::with_capacity(objects.len()),
            object_depth: planned.iter().map(|p| p.plan.depth).max().unwrap_or(0),
            upper_depth: 0,
            single: false,
            joined: false,
            skipped: planned.iter().map(|p| p.skipped).sum(),
            upper_capacity,
        };
        scene.nodes.resize(upper_capacity, bytemuck::Zeroable::zeroed());
        for (parts, planned) in objects.iter().zip(&planned) {
            scene.add(parts, planned);
        }
        scene
    }

    fn add(&mut self, parts: &[Part], Planned { plan, refs, .. }: &Planned) {
        let (root, first_primitive) = (self.nodes.len() as u32, self.primitives.len() as u32);
        self.nodes.par_extend(plan.nodes(root, first_primitive));
        let primitives = plan.primitives.par_iter().with_min_len(1024);
        self.primitives.par_extend(primitives.map(|&r| part::encode(parts, &refs[r as usize])));
        let has = |spheres: bool| parts.iter().any(|p| p.is_spheres() == spheres);
        let (has_triangles, has_spheres) = (has(false), has(true));
        let (bounds, cover) = (plan.bounds(), plan.cover());
        self.objects.push(EncodedObject { root, bounds, cover, has_triangles, has_spheres });
    }

    /// Encodes the upper level again, for instances that have moved or gone. Returns how many of the first `nodes` to
    /// copy to the GPU, besides all of `instances`.
    ///
    /// # Panics
    ///
    /// If an instance names an object that is not there, if there are more instances than the scene was built with, or if they are joined.
    pub fn update(&mut self, instances: &[Instance]) -> usize {
        assert!(!self.joined, "instances that are joined cannot be moved");
        assert!(instances.len() <= self.upper_capacity, "more instances than there is room for");
        let (mut refs, placed) = instance::place(instances, &self.objects);
        let plan = Plan::new(build(&mut refs, Settings::new(Quality::Balanced, 1, Leaves::Lanes)));
        let nodes: Vec<EncodedNode> = plan.nodes(0, 1).collect();
        self.nodes[..nodes.len()].copy_from_slice(&nodes);
        self.upper_depth = plan.depth;
        let in_leaves = plan.primitives.iter().map(|&r| placed[refs[r as usize].index() as usize]);
        self.instances = std::iter::once(EncodedInstance::world(plan.bounds())).chain(in_leaves).collect();
        self.single = matches!(self.instances[..], [_, one] if one.is_identity() && one.index == 0);
        if self.single {
            self.instances[0] = self.instances[1];
        }
        nodes.len()
    }

    /// The scene without the nodes and primitives of its objects: all that [`EncodedScene::update`] needs.
    #[must_use]
    pub fn into_upper(mut self) -> EncodedScene {
        self.nodes.truncate(self.upper_capacity);
        self.nodes.shrink_to_fit();
        self.primitives = Vec::new();
        self
    }

    /// What is known of each object, in order: for who builds the upper level elsewhere.
    pub fn objects(&self) -> impl Iterator<Item = ObjectInfo> {
        self.objects.iter().map(|o| ObjectInfo {
            root: if o.bounds.is_empty() { u32::MAX } else { o.root },
            low: o.bounds.min,
            high: o.bounds.max,
            has_spheres: o.has_spheres,
        })
    }

    /// Most nodes on the way from an object's root to a leaf.
    pub fn object_depth(&self) -> u32 {
        self.object_depth
    }

    /// Whether the only instance is the first and stands in the world as it is. Then its record stands in the place of
    /// the world's, and there is no upper level to walk.
    pub fn is_single(&self) -> bool {
        self.single
    }

    /// Whether all instances are one object, so that none can be moved: primitives say which they belong to.
    pub fn is_joined(&self) -> bool {
        self.joined
    }

    /// Whether there is nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.instances.len() < 2
    }

    /// Room that a traversal needs for groups of siblings that wait for their visit.
    pub fn stack_size(&self) -> u32 {
        // At a node of level n, siblings of levels 2 to n may wait; at the way into an instance, also the nodes and the other
        // instances beside it: (upper depth - 1) + 2 + (object depth - 1).
        let upper = if self.single { 0 } else { self.upper_depth };
        (upper + self.object_depth).max(1)
    }

    /// Whether there are triangles, and whether there are spheres.
    pub fn kinds(&self) -> (bool, bool) {
        let filled = || self.objects.iter().filter(|o| !o.bounds.is_empty());
        (filled().any(|o| o.has_triangles), filled().any(|o| o.has_spheres))
    }

    /// How many primitives were left out, because they cannot be hit.
    pub fn skipped_primitives(&self) -> usize {
        self.skipped
    }

    /// Bytes in the three arrays.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.primitives[..]) + size_of_val(&self.instances[..])
    }
}
