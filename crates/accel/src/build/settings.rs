//! What the builder aims for.

/// How much time to spend on building a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// For trees that are rebuilt every frame.
    Fast,
    /// For almost everything.
    #[default]
    Balanced,
    /// For long renderings: the boxes of large, slanted triangles are split before the build.
    High,
}

/// Objects of at most this many leaf blocks are searched without a tree. Their blocks are filled.
pub(crate) const MAX_BRUTE_FORCE_BLOCKS: usize = 6;

/// The cost of a leaf in the surface area heuristic, in units of the cost of a node visit.
#[derive(Clone, Copy)]
pub(crate) enum LeafCost {
    /// All primitives of a block are tested at once: a full block costs as much as one primitive.
    PerBlock,
    /// Primitives are tested one by one; each costs this much.
    PerPrimitive(f32),
}

/// Parameters of a build.
#[derive(Clone, Copy)]
pub(crate) struct Settings {
    /// Most primitives of a leaf. Smaller sets are never split.
    pub leaf_size: usize,
    /// Bins per axis of the surface area heuristic, at most.
    pub bins: usize,
    pub leaf_cost: LeafCost,
}

impl Settings {
    pub fn new(quality: Quality, leaf_size: usize, leaf_cost: LeafCost) -> Settings {
        let bins = if quality == Quality::Fast { 8 } else { 16 };
        Settings { leaf_size, bins, leaf_cost }
    }

    /// Whether a tree over `n` primitives should fill its leaf blocks instead of minimising the
    /// surface area heuristic: such objects are searched without a tree.
    pub(super) fn fills_blocks(&self, n: usize) -> bool {
        match self.leaf_cost {
            LeafCost::PerBlock => self.leaf_size > 1 && n <= self.leaf_size * MAX_BRUTE_FORCE_BLOCKS,
            LeafCost::PerPrimitive(_) => false,
        }
    }

    /// The cost of `n` primitives below one child when splits are compared, in any unit.
    pub(super) fn set_cost(&self, n: u32) -> f32 {
        match self.leaf_cost {
            LeafCost::PerBlock => n.div_ceil(self.leaf_size as u32) as f32,
            LeafCost::PerPrimitive(_) => n as f32,
        }
    }

    /// The cost of a leaf of `n` primitives, in units of the cost of a node visit.
    pub(super) fn cost_of_leaf(&self, n: u32) -> f32 {
        match self.leaf_cost {
            LeafCost::PerBlock => 1.0,
            LeafCost::PerPrimitive(cost) => cost * n as f32,
        }
    }
}
