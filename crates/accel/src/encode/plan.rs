//! Which tree an object gets: over whole triangles, or over parts of those whose boxes are mostly empty.

use super::node::MAX_LEAF;
use super::part::{self, Part};
use super::tree::Plan;
use crate::build::{Cuts, Cutting, Draft, Leaves, PrimitiveRef, Quality, Settings, Waste};

/// An object's tree before it is encoded.
pub(super) struct Planned {
    pub plan: Plan,
    /// What it was built over.
    pub refs: Vec<PrimitiveRef>,
    /// How many primitives cannot be hit.
    pub skipped: usize,
}

impl Planned {
    /// Builds the tree over the geometries of an object.
    pub fn new(parts: &[Part], quality: Quality) -> Planned {
        let (refs, skipped) = part::references(parts);
        let Drafted { draft, refs } = best(refs, parts, quality);
        Planned { plan: Plan::new(draft.finish()), refs, skipped }
    }
}

/// One of the trees that an object may get.
struct Drafted {
    draft: Draft,
    refs: Vec<PrimitiveRef>,
}

impl Drafted {
    fn new(mut refs: Vec<PrimitiveRef>, quality: Quality) -> Drafted {
        let draft = Draft::new(&mut refs, settings(quality));
        Drafted { draft: if quality == Quality::Fast { draft } else { draft.improved() }, refs }
    }

    fn is_cheaper(&self, than: &Drafted, factor: f32) -> bool {
        self.draft.cost() < factor * than.draft.cost()
    }
}

/// Trees for shaders.
fn settings(quality: Quality) -> Settings {
    Settings::new(quality, MAX_LEAF, Leaves::OneByOne(PRIMITIVE_COST))
}

/// Cost of a test of a primitive, in units of the cost of a visit to a node.
const PRIMITIVE_COST: f32 = 0.3;

/// Boxes that cuts add at first, as a share of an object's triangles, by how much that grows while it pays, and where it ends.
const CUTS: (f64, f64, f64) = (0.1, 3.0, 1.0);

/// Objects of fewer primitives are not worth the time.
const LEAST_TO_CUT: usize = 64;

/// Objects of more have one tree at a time in memory, are cut in one way only, and nodes are moved when that is decided.
const MANY: usize = 1 << 18;

/// Share of the area of all boxes from which on trees over parts are tried. Dense meshes, whose triangles are all about as
/// small, do not come near it.
const LEAST_PROMISE: f64 = 0.25;

/// More cuts have to make a tree cheaper by this factor.
const LEAST_GAIN: f32 = 0.95;

/// The tree over parts of triangles, if rays are expected to pay less there. Only building it tells: parts have less empty space
/// around them, but there are more of them.
fn best(refs: Vec<PrimitiveRef>, parts: &[Part], quality: Quality) -> Drafted {
    let corners = |r: &PrimitiveRef| part::corners(parts, r);
    let cuts = |waste| Cuts::new(&refs, corners, Cutting { budget: CUTS.0, waste });
    let may_pay = quality != Quality::Fast
        && refs.len() >= LEAST_TO_CUT
        && cuts(Waste::BeyondHalf).promise(&refs) >= LEAST_PROMISE;
    if !may_pay {
        return Drafted::new(refs, quality);
    }
    if refs.len() <= MANY {
        return cut_where_it_pays(Drafted::new(refs, quality), parts, quality);
    }
    let whole_cost = Draft::new(&mut refs.clone(), settings(quality)).cost();
    let mut cut = cuts(Waste::BeyondHalf).make(&refs);
    let draft = Draft::new(&mut cut, settings(quality));
    if draft.cost() < LEAST_GAIN * whole_cost {
        return Drafted { draft: draft.improved(), refs: cut };
    }
    drop(draft);
    Drafted::new(refs, quality)
}

fn cut_where_it_pays(whole: Drafted, parts: &[Part], quality: Quality) -> Drafted {
    let corners = |r: &PrimitiveRef| part::corners(parts, r);
    let tree = |waste, budget| {
        let cuts = Cuts::new(&whole.refs, corners, Cutting { budget, waste });
        Drafted::new(cuts.make(&whole.refs), quality)
    };
    let (mut budget, factor, most) = CUTS;
    let (halves, wholes) = rayon::join(|| tree(Waste::BeyondHalf, budget), || tree(Waste::Whole, budget));
    let (mut best, waste) = match wholes.is_cheaper(&halves, 1.0) {
        true => (wholes, Waste::Whole),
        false => (halves, Waste::BeyondHalf),
    };
    if !best.is_cheaper(&whole, LEAST_GAIN) {
        return whole;
    }
    while budget * factor <= most {
        budget *= factor;
        let more = tree(waste, budget);
        if !more.is_cheaper(&best, LEAST_GAIN) {
            break;
        }
        best = more;
    }
    best
}
