//! [`Guide`]: the frozen trees, and how they are walked.

use optics::guiding::{
    GuideSample, guide_descent, guide_descent_step, guide_half, guide_jacobian, guide_walk, guide_walk_end,
    guide_walk_step,
};
use optics::{Vec2f, Vec3f, vec4f};

/// Leaves of the tree over space that a guide has at most.
pub const MOST_LEAVES: usize = 4096;

/// Nodes of trees over directions that a guide has at most, all together: 16 MiB, and as much while it learns.
pub const MOST_NODES: usize = 1 << 19;

/// [`SpaceNode::axis`] of leaves.
const LEAF: u32 = 3;

/// A node of the tree over space.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct SpaceNode {
    /// Where it is divided, metres. Of a leaf: the probability with which the guide is followed, in `[0, 1)`.
    pub split: f32,
    /// Across which axis it is divided; 3 for a leaf.
    pub axis: u32,
    /// Index of the first of its two children. Of a leaf: of the root of its tree over directions.
    pub first: u32,
    /// Number of the leaf.
    pub leaf: u32,
}

/// A node of a tree over directions: a square in four.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct QuadNode {
    /// Probability of each child; they sum to one.
    pub weights: [f32; 4],
    /// Index of each child; 0 for those that are not divided.
    pub children: [u32; 4],
}

/// What is known of the light at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GuideLeaf {
    /// Its tree over directions.
    pub root: u32,
    /// Probability with which the guide is followed there, in `[0, 1)`.
    pub fraction: f32,
    /// Its number among the leaves.
    pub number: u32,
}

/// What was learned of the light in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// The tree over space, from its root on.
    pub(crate) spaces: Vec<SpaceNode>,
    /// Trees over directions.
    pub(crate) quads: Vec<QuadNode>,
    /// The box that the tree over space divides, metres.
    pub(crate) bounds: [[f32; 3]; 2],
    /// Number of leaves.
    pub(crate) leaves: usize,
}

impl Guide {
    /// A guide that knows nothing and is never followed, of a scene in the box `bounds`, metres.
    pub fn unlearned(bounds: [[f32; 3]; 2]) -> Self {
        let leaf = SpaceNode { split: 0.0, axis: LEAF, first: 0, leaf: 0 };
        let quad = QuadNode { weights: [0.25; 4], children: [0; 4] };
        Self { spaces: vec![leaf], quads: vec![quad], bounds, leaves: 1 }
    }

    /// What is known at a place.
    #[inline]
    pub fn leaf(&self, position: Vec3f) -> GuideLeaf {
        let mut node = &self.spaces[0];
        while node.axis != LEAF {
            node = &self.spaces[(node.first + guide_half(position, node.axis, node.split)) as usize];
        }
        GuideLeaf { root: node.first, fraction: node.split, number: node.leaf }
    }

    /// A direction from which light arrives. `u`: uniform numbers in `[0, 1)`.
    #[inline]
    pub fn sample(&self, leaf: GuideLeaf, u: Vec2f) -> GuideSample {
        let mut walk = guide_walk(u);
        let mut node = &self.quads[leaf.root as usize];
        loop {
            let [a, b, c, d] = node.weights;
            walk = guide_walk_step(walk, vec4f(a, b, c, d));
            match node.children[walk.child as usize] {
                0 => return guide_walk_end(walk),
                next => node = &self.quads[next as usize],
            }
        }
    }

    /// Density over solid angle with which [`Guide::sample`] finds the unit direction `wi`.
    #[inline]
    pub fn pdf(&self, leaf: GuideLeaf, wi: Vec3f) -> f32 {
        self.find(leaf, wi).1 * guide_jacobian(wi)
    }

    /// The cell of a direction, as node and child, and the density over the unit square there.
    #[inline]
    pub(crate) fn find(&self, leaf: GuideLeaf, wi: Vec3f) -> (usize, f32) {
        let mut descent = guide_descent(wi);
        let mut at = leaf.root as usize;
        loop {
            let node = &self.quads[at];
            let [a, b, c, d] = node.weights;
            descent = guide_descent_step(descent, vec4f(a, b, c, d));
            match node.children[descent.child as usize] {
                0 => return (at * 4 + descent.child as usize, descent.density),
                next => at = next as usize,
            }
        }
    }

    /// Number of places that it knows apart.
    pub fn leaves(&self) -> usize {
        self.leaves
    }

    /// Number of nodes of its trees over directions.
    pub fn nodes(&self) -> usize {
        self.quads.len()
    }

    /// Bytes of its trees.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.spaces[..]) + size_of_val(&self.quads[..])
    }
}
