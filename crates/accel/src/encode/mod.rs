//! Encoding for the GPU: a compressed eight-wide hierarchy in three plain arrays.
//!
//! [`EncodedScene::build`] makes nodes, primitives and instances from the objects and their places in the world;
//! shaders walk them as [`EncodedScene::closest`] and [`EncodedScene::any`], their scalar twins, do. Start at
//! [`EncodedNode`] for the format, then see `walk.rs` for what it is good for.
//!
//! The trees differ from those of [`crate::Blas`]: leaves hold one to three primitives that are tested one by one. Where large
//! triangles lie between small ones, they are in several leaves, each for a part of them.

mod instance;
mod node;
mod primitive;
mod tree;
mod walk;

pub use instance::{EncodedInstance, INSTANCE_IDENTITY, INSTANCE_SPHERES};
pub use node::EncodedNode;
pub use primitive::EncodedPrimitive;
pub use walk::{EncodedHit, WalkCounts};

use crate::aabb::Aabb;
use crate::blas::{self, Geometry, Sphere};
use crate::build::{Cuts, Cutting, Leaves, PrimitiveRef, Quality, Settings, Waste};
use crate::tlas::Instance;
use node::MAX_LEAF;
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
#[derive(Clone, Copy, Debug)]
struct EncodedObject {
    root: u32,
    bounds: Aabb,
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
    skipped: usize,
    /// Number of nodes that are set aside for the upper level.
    upper_capacity: usize,
}

/// An object's tree before it is encoded.
struct Planned {
    plan: Plan,
    refs: Vec<PrimitiveRef>,
    skipped: usize,
}

impl Planned {
    fn new(mut refs: Vec<PrimitiveRef>, quality: Quality, skipped: usize) -> Planned {
        let plan = Plan::new(&mut refs, settings(quality));
        Planned { plan, refs, skipped }
    }
}

/// Trees for shaders.
fn settings(quality: Quality) -> Settings {
    let settings = Settings::new(quality, MAX_LEAF, Leaves::OneByOne(PRIMITIVE_COST));
    Settings { reinserts: quality != Quality::Fast, ..settings }
}

/// Cost of a test of a primitive, in units of the cost of a visit to a node.
const PRIMITIVE_COST: f32 = 0.3;

fn plan_object(object: &Object, quality: Quality) -> Planned {
    let (mut refs, mut skipped) = (Vec::new(), 0);
    let mut add = |(mut new, new_skipped): (Vec<PrimitiveRef>, usize)| {
        skipped += new_skipped;
        if refs.is_empty() {
            refs = new;
        } else {
            refs.append(&mut new);
        }
    };
    match object {
        Object::Triangles(geometries) => {
            (0..).zip(geometries).for_each(|(number, g)| add(blas::triangle_references(g, number)));
        }
        Object::Spheres(geometries) => {
            (0..).zip(geometries).for_each(|(number, g)| add(blas::sphere_references(g.spheres, number)));
        }
    }
    let whole = Planned::new(refs, quality, skipped);
    match object {
        Object::Triangles(geometries) if quality != Quality::Fast => {
            cut_where_it_pays(whole, geometries, quality)
        }
        _ => whole,
    }
}

/// Boxes that cuts add at first, as a share of an object's triangles, by how much that grows while it pays, and where it ends.
const CUTS: (f64, f64, f64) = (0.1, 3.0, 1.0);

/// Objects of fewer triangles are not worth the time.
const LEAST_TO_CUT: usize = 64;

/// Share of the area of all boxes from which on trees over parts are tried. Dense meshes, whose triangles are all about as
/// small, do not come near it.
const LEAST_PROMISE: f64 = 0.25;

/// More cuts have to make a tree cheaper by this factor.
const LEAST_GAIN: f32 = 0.95;

/// The tree over parts of triangles instead, if rays are expected to pay less there. Only building it tells: parts have less
/// empty space around them, but there are more of them.
fn cut_where_it_pays(whole: Planned, geometries: &[Geometry], quality: Quality) -> Planned {
    if whole.refs.len() < LEAST_TO_CUT {
        return whole;
    }
    let corners = |r: &PrimitiveRef| {
        let g = &geometries[r.geometry() as usize];
        g.indices[r.index() as usize].map(|i| g.positions[i as usize])
    };
    let cuts = |waste, budget| Cuts::new(&whole.refs, corners, Cutting { budget, waste });
    let (mut budget, factor, most) = CUTS;
    if cuts(Waste::BeyondHalf, budget).promise(&whole.refs) < LEAST_PROMISE {
        return whole;
    }
    let tree = |waste, budget| Planned::new(cuts(waste, budget).make(&whole.refs), quality, whole.skipped);
    let cheaper = |a: &Planned, b: &Planned, factor: f32| a.plan.cost() < factor * b.plan.cost();
    let (halves, wholes) = rayon::join(|| tree(Waste::BeyondHalf, budget), || tree(Waste::Whole, budget));
    let (mut best, waste) = match cheaper(&wholes, &halves, 1.0) {
        true => (wholes, Waste::Whole),
        false => (halves, Waste::BeyondHalf),
    };
    if !cheaper(&best, &whole, LEAST_GAIN) {
        return whole;
    }
    while budget * factor <= most {
        budget *= factor;
        let more = tree(waste, budget);
        if !cheaper(&more, &best, LEAST_GAIN) {
            break;
        }
        best = more;
    }
    best
}

fn encode_primitive(object: &Object, r: &PrimitiveRef) -> EncodedPrimitive {
    let (geometry, index) = (r.geometry(), r.index());
    match object {
        Object::Triangles(g) => EncodedPrimitive::triangle(&g[geometry as usize], geometry, index),
        Object::Spheres(g) => {
            let g = &g[geometry as usize];
            EncodedPrimitive::sphere(&g.spheres[index as usize], g.first_id + index, geometry)
        }
    }
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
        let planned: Vec<Planned> = objects.par_iter().map(|o| plan_object(o, quality)).collect();
        let upper_capacity = instances.len().max(1);
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
            skipped: planned.iter().map(|p| p.skipped).sum(),
            upper_capacity,
        };
        scene.nodes.resize(upper_capacity, bytemuck::Zeroable::zeroed());
        for (object, planned) in objects.iter().zip(&planned) {
            scene.add(object, planned);
        }
        scene.update(instances);
        scene
    }

    fn add(&mut self, object: &Object, Planned { plan, refs, .. }: &Planned) {
        let (root, first_primitive) = (self.nodes.len() as u32, self.primitives.len() as u32);
        self.nodes.par_extend(plan.nodes(root, first_primitive));
        let primitives = plan.primitives.par_iter().with_min_len(1024);
        self.primitives.par_extend(primitives.map(|&r| encode_primitive(object, &refs[r as usize])));
        let has_spheres = matches!(object, Object::Spheres(_));
        self.objects.push(EncodedObject { root, bounds: plan.bounds(), has_spheres });
    }

    /// Encodes the upper level again, for instances that have moved or gone. Returns how many of the first `nodes` to
    /// copy to the GPU, besides all of `instances`.
    ///
    /// # Panics
    ///
    /// If an instance names an object that is not there, or if there are more instances than the scene was built with.
    pub fn update(&mut self, instances: &[Instance]) -> usize {
        assert!(instances.len() <= self.upper_capacity, "more instances than there is room for");
        let (mut refs, placed) = instance::place(instances, &self.objects);
        let plan = Plan::new(&mut refs, Settings::new(Quality::Balanced, 1, Leaves::Lanes));
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
        let filled =
            |spheres: bool| self.objects.iter().any(|o| o.has_spheres == spheres && !o.bounds.is_empty());
        (filled(false), filled(true))
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
