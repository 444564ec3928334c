//! Collapses a binary tree into the eight-wide tree of lowest cost.
//!
//! Method: dynamic programming (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on
//! GPUs Through Compressed Wide BVHs", HPG 2017).

use super::binary_node::BinaryNode;
use crate::aabb::Aabb;
use crate::layout::{ChildRef, EMPTY, LEAF, Node, WIDTH};

/// Cost of a node visit: the unit of all costs, per area.
const NODE_COST: f32 = 1.0;

/// An eight-wide tree. The caller makes blocks of its leaves.
pub(crate) struct WideTree {
    /// Depth first, the root first.
    pub nodes: Vec<Node>,
    pub root: ChildRef,
    pub bounds: Aabb,
    /// For each leaf: the first of its primitives, in their new order, and their number.
    pub leaves: Vec<(u32, u32)>,
}

/// The costs of an inner binary node from those of its children. `cost[i]` is its cost as `i + 1`
/// children of a wide node.
pub(super) fn costs(half_area: f32, left: &[f32; 7], right: &[f32; 7]) -> [f32; 7] {
    let mut cost = [f32::INFINITY; 7];
    // As one child: a wide node, whose eight children the two sides best_share.
    cost[0] = half_area * NODE_COST + best_share(left, right, 8).0;
    for i in 1..7 {
        cost[i] = best_share(left, right, i + 1).0.min(cost[i - 1]);
    }
    cost
}

/// The lowest cost of distributing `n` children to the two sides, and the number for the left side.
#[inline]
fn best_share(left: &[f32; 7], right: &[f32; 7], n: usize) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for l in 1..n {
        let cost = left[l - 1] + right[n - l - 1];
        if cost < best.0 {
            best = (cost, l);
        }
    }
    best
}

pub(super) fn collapse(binary: &[BinaryNode]) -> WideTree {
    let mut tree = WideTree { nodes: Vec::new(), root: EMPTY, bounds: Aabb::EMPTY, leaves: Vec::new() };
    if let Some(root) = binary.first() {
        tree.nodes.reserve(binary.len() / 8 + 1);
        tree.leaves.reserve(binary.len() / 2 + 1);
        tree.bounds = root.bounds.to_aabb();
        tree.root = append(binary, 0, &mut tree);
    }
    tree
}

/// Appends the subtree at `at` to the wide tree. The recursion is as deep as the tree, which is
/// bounded.
fn append(binary: &[BinaryNode], at: usize, tree: &mut WideTree) -> ChildRef {
    let node = &binary[at];
    if node.right == 0 {
        tree.leaves.push((node.first, node.count));
        return LEAF | (tree.leaves.len() - 1) as u32;
    }
    let mut children = ChildRoots { at: [0; WIDTH], count: 0 };
    gather_children(binary, at, 8, true, &mut children);
    let index = tree.nodes.len();
    tree.nodes.push(Node::EMPTY);
    for (slot, &child) in children.at[..children.count].iter().enumerate() {
        tree.nodes[index].set_bounds(slot, &binary[child].bounds.to_aabb());
        let reference = append(binary, child, tree);
        tree.nodes[index].children[slot] = reference;
    }
    index as ChildRef
}

/// The binary nodes that become the children of a wide node.
struct ChildRoots {
    at: [usize; WIDTH],
    count: usize,
}

/// Repeats the decisions behind the lowest cost: the binary node at `at` as up to `n` children.
/// `forced`: it must be opened.
fn gather_children(binary: &[BinaryNode], at: usize, mut n: usize, forced: bool, children: &mut ChildRoots) {
    let node = &binary[at];
    if node.right != 0 && !forced {
        while n > 1 && node.cost[n - 2] <= node.cost[n - 1] {
            n -= 1;
        }
    }
    if node.right == 0 || (n == 1 && !forced) {
        children.at[children.count] = at;
        children.count += 1;
        return;
    }
    let (left, right) = (at + 1, at + node.right as usize);
    let (_, l) = best_share(&binary[left].cost, &binary[right].cost, n);
    gather_children(binary, left, l, false, children);
    gather_children(binary, right, n - l, false, children);
}
