//! The steps of a build, see [`crate::build`].

use super::binary_node::BinaryNode;
use super::collapse::{self, WideTree};
use super::primitive_ref::PrimitiveRef;
use super::settings::Settings;
use super::{binned_sah, reinsertion};

/// Builds an eight-wide tree and reorders `primitives`.
pub(crate) fn build(primitives: &mut [PrimitiveRef], settings: Settings) -> WideTree {
    BinaryTree::new(primitives, settings).collapse()
}

/// A binary tree. Its cost is known before it is collapsed, so that candidates can be compared.
pub(crate) struct BinaryTree {
    nodes: Vec<BinaryNode>,
}

impl BinaryTree {
    /// Builds top-down and reorders `primitives`.
    pub fn new(primitives: &mut [PrimitiveRef], settings: Settings) -> BinaryTree {
        BinaryTree { nodes: binned_sah::build(primitives, settings) }
    }

    /// The tree after reinsertion of its largest nodes.
    pub fn optimized(self) -> BinaryTree {
        BinaryTree { nodes: reinsertion::reinsert(self.nodes) }
    }

    /// The expected cost of a ray that hits the root's box, in units of the cost of a node visit.
    pub fn cost(&self) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.cost[0] / root.bounds.half_area())
    }

    /// The eight-wide tree of lowest cost.
    pub fn collapse(self) -> WideTree {
        collapse::collapse(&self.nodes)
    }
}
