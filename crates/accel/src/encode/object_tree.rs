//! The tree of an object: over whole triangles, or over split triangles if that is cheaper.

use super::geometry_ref::{self, GeometryRef};
use super::node::MAX_LEAF;
use super::tree_layout::TreeLayout;
use crate::build::{
    BinaryTree, EmptyArea, LeafCost, PresplitSettings, Presplits, PrimitiveRef, Quality, Settings,
};

/// An object's tree before it is encoded.
pub(super) struct ObjectTree {
    pub layout: TreeLayout,
    /// The references that it was built over.
    pub refs: Vec<PrimitiveRef>,
    /// Number of primitives that cannot be hit.
    pub skipped: usize,
}

impl ObjectTree {
    /// Builds the tree over the geometries of an object.
    pub fn new(geometries: &[GeometryRef], quality: Quality) -> ObjectTree {
        let (refs, skipped) = geometry_ref::references(geometries);
        let Candidate { tree, refs } = best(refs, geometries, quality);
        ObjectTree { layout: TreeLayout::new(tree.collapse()), refs, skipped }
    }
}

/// A candidate for the tree of an object.
struct Candidate {
    tree: BinaryTree,
    refs: Vec<PrimitiveRef>,
}

impl Candidate {
    fn new(mut refs: Vec<PrimitiveRef>, quality: Quality) -> Candidate {
        let tree = BinaryTree::new(&mut refs, settings(quality));
        Candidate { tree: if quality == Quality::Fast { tree } else { tree.optimized() }, refs }
    }

    fn is_cheaper(&self, than: &Candidate, factor: f32) -> bool {
        self.tree.cost() < factor * than.tree.cost()
    }
}

/// Settings of trees for shaders.
fn settings(quality: Quality) -> Settings {
    Settings::new(quality, MAX_LEAF, LeafCost::PerPrimitive(PRIMITIVE_COST))
}

/// Cost of a primitive test, in units of the cost of a node visit.
const PRIMITIVE_COST: f32 = 0.3;

/// Split budgets as a share of the triangles: the first, the factor between budgets, and the last.
const PRESPLITS: (f64, f64, f64) = (0.1, 3.0, 1.0);

/// Smaller objects are not split.
const MIN_TO_SPLIT: usize = 64;

/// For larger objects, only one tree is in memory at a time, one kind of splits is tried, and only
/// the chosen tree is optimised.
const LARGE_OBJECT: usize = 1 << 18;

/// Splits are tried if they can remove at least this share of the area of all boxes. Dense meshes
/// of small triangles are far below it.
const MIN_REMOVABLE_SHARE: f64 = 0.25;

/// More splits must reduce the cost of a tree by this factor.
const MIN_GAIN: f32 = 0.95;

/// The cheapest tree. The cost of splits is only known after a build: parts have less empty area,
/// but there are more of them.
fn best(refs: Vec<PrimitiveRef>, geometries: &[GeometryRef], quality: Quality) -> Candidate {
    let corners = |r: &PrimitiveRef| geometry_ref::corners(geometries, r);
    let presplits = |empty| Presplits::new(&refs, corners, PresplitSettings { budget: PRESPLITS.0, empty });
    let may_gain = quality != Quality::Fast
        && refs.len() >= MIN_TO_SPLIT
        && presplits(EmptyArea::BeyondHalf).removable_share(&refs) >= MIN_REMOVABLE_SHARE;
    if !may_gain {
        return Candidate::new(refs, quality);
    }
    if refs.len() <= LARGE_OBJECT {
        return cheapest_splits(Candidate::new(refs, quality), geometries, quality);
    }
    let whole_cost = BinaryTree::new(&mut refs.clone(), settings(quality)).cost();
    let mut split = presplits(EmptyArea::BeyondHalf).apply(&refs);
    let tree = BinaryTree::new(&mut split, settings(quality));
    if tree.cost() < MIN_GAIN * whole_cost {
        return Candidate { tree: tree.optimized(), refs: split };
    }
    drop(tree);
    Candidate::new(refs, quality)
}

fn cheapest_splits(whole: Candidate, geometries: &[GeometryRef], quality: Quality) -> Candidate {
    let corners = |r: &PrimitiveRef| geometry_ref::corners(geometries, r);
    let candidate = |empty, budget| {
        let presplits = Presplits::new(&whole.refs, corners, PresplitSettings { budget, empty });
        Candidate::new(presplits.apply(&whole.refs), quality)
    };
    let (mut budget, factor, most) = PRESPLITS;
    let (halves, wholes) =
        rayon::join(|| candidate(EmptyArea::BeyondHalf, budget), || candidate(EmptyArea::Whole, budget));
    let (mut best, empty) = match wholes.is_cheaper(&halves, 1.0) {
        true => (wholes, EmptyArea::Whole),
        false => (halves, EmptyArea::BeyondHalf),
    };
    if !best.is_cheaper(&whole, MIN_GAIN) {
        return whole;
    }
    while budget * factor <= most {
        budget *= factor;
        let more = candidate(empty, budget);
        if !more.is_cheaper(&best, MIN_GAIN) {
            break;
        }
        best = more;
    }
    best
}
