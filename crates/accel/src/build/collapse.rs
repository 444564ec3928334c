//! From a binary tree to an eight-wide one, with the lowest cost that the binary tree allows.
//!
//! Method: dynamic programming as in Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs", HPG 2017.

use super::WideTree;
use super::binned::BinaryNode;
use crate::aabb::Aabb;
use crate::layout::{ChildRef, EMPTY, LEAF, Node, WIDTH};

/// Cost of visiting a node, in units of area.
const NODE_COST: f32 = 1.0;

/// The costs of an inner binary node from those of its children. `cost[i]` is the cost as `i + 1` children of a wide node.
pub(super) fn costs(half_area: f32, left: &[f32; 7], right: &[f32; 7]) -> [f32; 7] {
    let mut cost = [f32::INFINITY; 7];
    // As one child: a wide node of its own, with eight children to share out.
    cost[0] = half_area * NODE_COST + share(left, right, 8).0;
    for i in 1..7 {
        cost[i] = share(left, right, i + 1).0.min(cost[i - 1]);
    }
    cost
}

/// The cheapest way to give `n` children to both sides, and how many of them the left side gets.
#[inline]
fn share(left: &[f32; 7], right: &[f32; 7], n: usize) -> (f32, usize) {
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
        tree.root = place(binary, 0, &mut tree);
    }
    tree
}

/// Adds the subtree at `at` to the wide tree. The depth of the recursion is that of the tree, which is bounded.
fn place(binary: &[BinaryNode], at: usize, tree: &mut WideTree) -> ChildRef {
    let node = &binary[at];
    if node.right == 0 {
        tree.leaves.push((node.first, node.count));
        return LEAF | (tree.leaves.len() - 1) as u32;
    }
    let mut children = Children { at: [0; WIDTH], count: 0 };
    share_out(binary, at, 8, true, &mut children);
    let index = tree.nodes.len();
    tree.nodes.push(Node::EMPTY);
    for (slot, &child) in children.at[..children.count].iter().enumerate() {
        tree.nodes[index].set_bounds(slot, &binary[child].bounds.to_aabb());
        let reference = place(binary, child, tree);
        tree.nodes[index].children[slot] = reference;
    }
    index as ChildRef
}

/// The roots of a wide node's children.
struct Children {
    at: [usize; WIDTH],
    count: usize,
}

/// Finds again how the lowest cost came about: the binary node at `at` as up to `n` children.
fn share_out(binary: &[BinaryNode], at: usize, mut n: usize, forced: bool, children: &mut Children) {
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
    let (_, l) = share(&binary[left].cost, &binary[right].cost, n);
    share_out(binary, left, l, false, children);
    share_out(binary, right, n - l, false, children);
}
