//! Optimises binary trees by reinsertion.
//!
//! A top-down build decides the upper levels with little information. Here each of the largest
//! nodes is removed and inserted again where the surface area of the boxes grows least. Branch and
//! bound searches all places of the tree. Sources: Bittner, Hapala and Havran, "Fast
//! Insertion-Based Optimization of Bounding Volume Hierarchies", Computer Graphics Forum 32(1),
//! 2013; Meister and Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization",
//! Eurographics 2018.

use super::binary_node::BinaryNode;
use super::collapse::costs;
use super::primitive_ref::Bounds;
use crate::layout::MAX_DEPTH;

/// How often the largest nodes are selected and reinserted.
const ROUNDS: usize = 3;

/// Nodes per round: `SHARE` of the tree, because most of the gain is near the root, but at least
/// `MIN_NODES`. `MAX_NODES` take a fifth of a second.
const MIN_NODES: usize = 1 << 14;
const SHARE: f32 = 0.05;
const MAX_NODES: usize = 1 << 16;

/// Most places that are examined for one node. Where all boxes overlap, bounds prune nothing.
const MAX_PLACES: usize = 1 << 10;

/// The tree as links between nodes, which keep their indices.
struct LinkedTree {
    bounds: Vec<Bounds>,
    parent: Vec<u32>,
    /// Both children; `[0, 0]` for a leaf.
    children: Vec<[u32; 2]>,
}

/// A better place for a node.
struct Move {
    /// The node that becomes its sibling.
    sibling: u32,
    /// The reduction of the sum of all half areas.
    gain: f32,
}

const ROOT: u32 = 0;

/// Moves nodes of a tree to better places. The set of leaves does not change.
pub(super) fn reinsert(nodes: Vec<BinaryNode>) -> Vec<BinaryNode> {
    // Differences of infinite areas cannot be compared.
    let can_compare = nodes.first().is_some_and(|root| root.bounds.half_area() < 1e30);
    if !can_compare {
        return nodes;
    }
    let count = ((nodes.len() as f32 * SHARE) as usize).clamp(MIN_NODES, MAX_NODES);
    let mut tree = LinkedTree::new(&nodes);
    let mut stack = Vec::new();
    for _ in 0..ROUNDS {
        for node in tree.largest(count) {
            if let Some(better) = tree.find(node, &mut stack) {
                tree.reinsert(node, better.sibling);
            }
        }
    }
    tree.depth_first(&nodes).unwrap_or(nodes)
}

impl LinkedTree {
    fn new(nodes: &[BinaryNode]) -> Self {
        let mut parent = vec![ROOT; nodes.len()];
        let mut children = vec![[0; 2]; nodes.len()];
        for (at, node) in (0u32..).zip(nodes).filter(|(_, node)| node.right != 0) {
            let pair = [at + 1, at + node.right];
            children[at as usize] = pair;
            for child in pair {
                parent[child as usize] = at;
            }
        }
        Self { bounds: nodes.iter().map(|n| n.bounds).collect(), parent, children }
    }

    fn is_leaf(&self, node: u32) -> bool {
        self.children[node as usize] == [0; 2]
    }

    fn area(&self, node: u32) -> f32 {
        self.bounds[node as usize].half_area()
    }

    fn sibling(&self, node: u32) -> u32 {
        let [left, right] = self.children[self.parent[node as usize] as usize];
        if left == node { right } else { left }
    }

    /// The `count` nodes of largest area that are neither the root nor its children.
    fn largest(&self, count: usize) -> Vec<u32> {
        let mut nodes: Vec<(f32, u32)> = (1..self.parent.len() as u32)
            .filter(|&n| self.parent[n as usize] != ROOT)
            .map(|n| (self.area(n), n))
            .collect();
        let descending = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        let count = count.min(nodes.len());
        if count < nodes.len() {
            nodes.select_nth_unstable_by(count, descending);
            nodes.truncate(count);
        }
        nodes.sort_unstable_by(descending);
        nodes.into_iter().map(|(_, n)| n).collect()
    }

    /// The best place for a node, if it is better than the current one. `stack` is scratch memory.
    fn find(&self, node: u32, stack: &mut Vec<(f32, u32)>) -> Option<Move> {
        let parent = self.parent[node as usize];
        if parent == ROOT {
            return None;
        }
        let bounds = self.bounds[node as usize];
        let own_area = bounds.half_area();
        let mut best = Move { sibling: ROOT, gain: 0.0 };
        // The gain of removing the node, up to `pivot`: its parent disappears, ancestors shrink.
        let mut gained = self.area(parent);
        let mut beside = self.sibling(node);
        let mut shrunk = self.bounds[beside as usize];
        let mut pivot = parent;
        let mut places = 0;
        loop {
            stack.push((gained, beside));
            while let Some((gained, place)) = stack.pop() {
                // Every box around the node is at least as large as the node.
                if gained - own_area <= best.gain || places == MAX_PLACES {
                    continue;
                }
                places += 1;
                let rest = gained - self.bounds[place as usize].union(bounds).half_area();
                if rest > best.gain {
                    best = Move { sibling: place, gain: rest };
                }
                if !self.is_leaf(place) {
                    // Below this place, the box of the place itself grows.
                    let below = rest + self.area(place);
                    stack.extend(self.children[place as usize].map(|child| (below, child)));
                }
            }
            if pivot == ROOT {
                break;
            }
            if pivot != parent {
                shrunk = shrunk.union(self.bounds[beside as usize]);
                gained += self.area(pivot) - shrunk.half_area();
            }
            beside = self.sibling(pivot);
            pivot = self.parent[pivot as usize];
        }
        let same = best.sibling == self.sibling(node) || best.sibling == parent;
        (best.gain > 1e-6 * self.area(ROOT) && !same).then_some(best)
    }

    /// Removes a node with its parent and inserts both above `to`, so that `to` becomes the node's
    /// sibling.
    fn reinsert(&mut self, node: u32, to: u32) {
        let parent = self.parent[node as usize];
        let sibling = self.sibling(node);
        let above = self.parent[parent as usize];
        self.replace(above, parent, sibling);
        self.refit(above);
        let host = self.parent[to as usize];
        self.replace(host, to, parent);
        self.children[parent as usize] = [to, node];
        self.parent[to as usize] = parent;
        self.refit(parent);
    }

    fn replace(&mut self, parent: u32, old: u32, new: u32) {
        let children = &mut self.children[parent as usize];
        *children = children.map(|child| if child == old { new } else { child });
        self.parent[new as usize] = parent;
    }

    /// Updates the boxes of a node and its ancestors.
    fn refit(&mut self, mut node: u32) {
        loop {
            let [left, right] = self.children[node as usize].map(|child| self.bounds[child as usize]);
            self.bounds[node as usize] = left.union(right);
            if node == ROOT {
                return;
            }
            node = self.parent[node as usize];
        }
    }

    /// The tree in depth-first order; `None` if it has become too deep. `nodes`: the original tree.
    fn depth_first(&self, nodes: &[BinaryNode]) -> Option<Vec<BinaryNode>> {
        let mut made = Vec::with_capacity(nodes.len());
        self.emit(ROOT, 0, nodes, &mut made).then_some(made)
    }

    fn emit(&self, node: u32, depth: usize, nodes: &[BinaryNode], made: &mut Vec<BinaryNode>) -> bool {
        let at = made.len();
        let bounds = self.bounds[node as usize];
        if self.is_leaf(node) {
            made.push(nodes[node as usize]);
            return true;
        }
        if depth >= MAX_DEPTH {
            return false;
        }
        made.push(BinaryNode { bounds, first: 0, count: 0, right: 0, cost: [0.0; 7] });
        let [left, right] = self.children[node as usize];
        if !self.emit(left, depth + 1, nodes, made) {
            return false;
        }
        made[at].right = (made.len() - at) as u32;
        let beside = made.len();
        if !self.emit(right, depth + 1, nodes, made) {
            return false;
        }
        made[at].cost = costs(bounds.half_area(), &made[at + 1].cost, &made[beside].cost);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aabb::Aabb;
    use crate::build::{LeafCost, PrimitiveRef, Quality, Settings, binned_sah};

    /// Boxes of edge length up to `size` in the unit cube, pseudo-random.
    fn boxes(count: u32, size: f32) -> Vec<PrimitiveRef> {
        let mut state = 7u32;
        let mut draw = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / 16_777_216.0
        };
        let one = |i| {
            let min = [(); 3].map(|()| draw());
            // Long in one direction, as beams are.
            let long = i as usize % 3;
            let max = [0, 1, 2].map(|a| min[a] + size * if a == long { 20.0 } else { draw() });
            PrimitiveRef::new(&Aabb { min, max }, i, 0)
        };
        (0..count).map(one).collect()
    }

    fn built(primitives: &mut [PrimitiveRef]) -> Vec<BinaryNode> {
        binned_sah::build(primitives, Settings::new(Quality::Balanced, 3, LeafCost::PerPrimitive(0.3)))
    }

    fn leaves(nodes: &[BinaryNode]) -> Vec<(u32, u32)> {
        let mut leaves: Vec<_> = nodes.iter().filter(|n| n.right == 0).map(|n| (n.first, n.count)).collect();
        leaves.sort_unstable();
        leaves
    }

    fn area_of_inner_nodes(nodes: &[BinaryNode]) -> f32 {
        nodes.iter().filter(|n| n.right != 0).map(|n| n.bounds.half_area()).sum()
    }

    /// Every node's box is that of its children, and every node is reached once.
    fn assert_sound(nodes: &[BinaryNode]) {
        let mut reached = vec![0; nodes.len()];
        reached[0] = 1;
        for (at, node) in nodes.iter().enumerate().filter(|(_, n)| n.right != 0) {
            let children = [at + 1, at + node.right as usize];
            for child in children {
                reached[child] += 1;
            }
            let both = nodes[children[0]].bounds.union(nodes[children[1]].bounds).to_aabb();
            let own = node.bounds.to_aabb();
            assert_eq!((own.min, own.max), (both.min, both.max));
        }
        assert!(reached.iter().all(|&n| n == 1));
    }

    #[test]
    fn the_same_leaves_stand_in_a_cheaper_tree() {
        for (count, size) in [(1, 0.1), (5, 0.1), (300, 0.02), (5000, 0.01)] {
            let mut primitives = boxes(count, size);
            let before = built(&mut primitives);
            let after = reinsert(before.clone());
            assert_sound(&after);
            assert_eq!(leaves(&after), leaves(&before));
            let areas = [&before, &after].map(|nodes| area_of_inner_nodes(nodes));
            assert!(areas[1] <= areas[0] * 1.000_01, "{count}: {areas:?}");
            if count >= 300 {
                assert!(areas[1] < 0.97 * areas[0], "{count}: {areas:?}");
                assert!(after[0].cost[0] < before[0].cost[0], "{count}");
            }
        }
    }

    #[test]
    fn what_cannot_be_compared_stays() {
        assert!(reinsert(Vec::new()).is_empty());
        let wide = Aabb { min: [-1e20; 3], max: [1e20; 3] };
        let mut primitives: Vec<_> = (0..50).map(|i| PrimitiveRef::new(&wide, i, 0)).collect();
        let before = built(&mut primitives);
        assert_eq!(leaves(&reinsert(before.clone())), leaves(&before));
        let point = Aabb { min: [1.0; 3], max: [1.0; 3] };
        let mut primitives: Vec<_> = (0..50).map(|i| PrimitiveRef::new(&point, i, 0)).collect();
        let before = built(&mut primitives);
        assert_sound(&reinsert(before));
    }
}
