//! The positions of a tree's nodes and primitives in the encoded arrays.

use super::node::{self, EMPTY_SLOT, EncodedNode, Slots};
use crate::aabb::Aabb;
use crate::build::WideTree;
use crate::bvh::TightBounds;
use crate::layout::{LEAF, Node, WIDTH, leaf_index};
use rayon::prelude::*;

/// A tree with a position for each node and primitive, before encoding.
///
/// The children of a node are contiguous, and so are its primitives. Parents come before their
/// children.
pub(super) struct TreeLayout {
    tree: WideTree,
    slots: Vec<Slots>,
    /// For each node of `tree`, the positions of its first child and of its first primitive.
    firsts: Vec<(u32, u32)>,
    /// Encoded nodes by their indices in `tree`.
    order: Vec<u32>,
    /// Encoded primitives by their indices in the references.
    pub primitives: Vec<u32>,
    /// The depth of the tree, in nodes.
    pub depth: u32,
}

impl TreeLayout {
    /// Computes the positions.
    pub fn new(mut tree: WideTree) -> TreeLayout {
        if tree.leaves.len() == 1 {
            // A root that is a leaf gets a node.
            let mut root = Node::EMPTY;
            root.set_bounds(0, &tree.bounds);
            root.children[0] = tree.root;
            tree.nodes.push(root);
            tree.root = 0;
        }
        let mut slots = Vec::new();
        tree.nodes.par_iter().with_min_len(256).map(node::assign_slots).collect_into_vec(&mut slots);
        let mut layout = TreeLayout {
            firsts: Vec::with_capacity(tree.nodes.len()),
            order: Vec::with_capacity(tree.nodes.len()),
            primitives: Vec::with_capacity(tree.leaves.iter().map(|leaf| leaf.1 as usize).sum()),
            depth: 0,
            tree,
            slots,
        };
        layout.assign_positions();
        layout
    }

    fn assign_positions(&mut self) {
        let mut depths = vec![1u32; self.tree.nodes.len()];
        if !depths.is_empty() {
            self.order.push(0);
        }
        for (at, (node, slots)) in self.tree.nodes.iter().zip(&self.slots).enumerate() {
            self.firsts.push((self.order.len() as u32, self.primitives.len() as u32));
            self.depth = self.depth.max(depths[at]);
            for &lane in slots.iter().filter(|lane| **lane != EMPTY_SLOT) {
                let child = node.children[lane as usize];
                if child & LEAF == 0 {
                    depths[child as usize] = depths[at] + 1;
                    self.order.push(child);
                } else {
                    let (first, count) = self.tree.leaves[leaf_index(child)];
                    self.primitives.extend(first..first + count);
                }
            }
        }
    }

    /// The encoded nodes. The first is at position `first_node` of the scene's nodes, the first
    /// primitive at `first_primitive`.
    pub fn nodes(
        &self,
        first_node: u32,
        first_primitive: u32,
    ) -> impl IndexedParallelIterator<Item = EncodedNode> {
        self.order.par_iter().with_min_len(256).map(move |&at| {
            let at = at as usize;
            let (child, primitive) = self.firsts[at];
            let count = |leaf: usize| self.tree.leaves[leaf].1;
            node::encode(
                &self.tree.nodes[at],
                &self.slots[at],
                first_node + child,
                first_primitive + primitive,
                count,
            )
        })
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.order.len()
    }

    /// The bounds of the tree.
    pub fn bounds(&self) -> Aabb {
        self.tree.bounds
    }

    /// For the bounds of transformed instances.
    pub fn tight_bounds(&self) -> TightBounds {
        TightBounds::new(&self.tree.nodes, self.tree.root, self.tree.bounds)
    }
}

/// Primitives of a node must fit the bits that shaders use for them.
const _: () = assert!(WIDTH * node::MAX_LEAF == 24);
