//! From a wide tree to encoded nodes: where everything stands in the arrays.

use super::node::{self, EMPTY_SLOT, EncodedNode, Slots};
use crate::build::WideTree;
use crate::cover::Cover;
use crate::layout::{LEAF, Node, WIDTH, leaf_index};
use rayon::prelude::*;

/// A tree over primitives, with everything numbered but nothing encoded.
///
/// A node's children follow each other, and so do its primitives. Parents come before their children, in the
/// order depth first, so that what is visited together is close together.
pub(super) struct Plan {
    tree: WideTree,
    slots: Vec<Slots>,
    /// For each node of `tree`: number of its first child, number of its first primitive.
    firsts: Vec<(u32, u32)>,
    /// Which nodes of `tree` the new ones are.
    order: Vec<u32>,
    /// Which of the references that the tree was built from the primitives are.
    pub primitives: Vec<u32>,
    /// Most nodes on the way from the root to a leaf.
    pub depth: u32,
}

impl Plan {
    /// Numbers what is in a tree.
    pub fn new(mut tree: WideTree) -> Plan {
        if tree.leaves.len() == 1 {
            // A lone leaf has no node to be in.
            let mut root = Node::EMPTY;
            root.set_bounds(0, &tree.bounds);
            root.children[0] = tree.root;
            tree.nodes.push(root);
            tree.root = 0;
        }
        let mut slots = Vec::new();
        tree.nodes.par_iter().with_min_len(256).map(node::assign_slots).collect_into_vec(&mut slots);
        let mut plan = Plan {
            firsts: Vec::with_capacity(tree.nodes.len()),
            order: Vec::with_capacity(tree.nodes.len()),
            primitives: Vec::with_capacity(tree.leaves.iter().map(|leaf| leaf.1 as usize).sum()),
            depth: 0,
            tree,
            slots,
        };
        plan.number();
        plan
    }

    fn number(&mut self) {
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

    /// The nodes. The first will stand at `first_node` of the array that they go to, the primitives at
    /// `first_primitive`.
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

    /// The box around everything.
    pub fn bounds(&self) -> crate::Aabb {
        self.tree.bounds
    }

    /// What is known of the box around everything when it is turned.
    pub fn cover(&self) -> Cover {
        Cover::new(&self.tree.nodes, self.tree.root, self.tree.bounds)
    }
}

/// Children of full nodes fit the bits that shaders keep of them.
const _: () = assert!(WIDTH * node::MAX_LEAF == 24);
