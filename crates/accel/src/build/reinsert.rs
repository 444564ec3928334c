//! Better binary trees: nodes that stand in the wrong place are moved to a better one.
//!
//! A tree built from the top down decides early, and knows little then. Here each of the largest nodes is taken out and put where the
//! boxes around it grow least, which branch and bound finds among all places of the tree. Sources: Bittner, Hapala and Havran, "Fast
//! Insertion-Based Optimization of Bounding Volume Hierarchies", Computer Graphics Forum 32(1), 2013; Meister and Bittner, "Parallel
//! Reinsertion for Bounding Volume Hierarchy Optimization", Eurographics 2018.

use super::Bounds;
use super::binned::BinaryNode;
use super::collapse::costs;
use crate::kernel::MAX_DEPTH;

/// How often the largest nodes are looked for.
const ROUNDS: usize = 3;

/// How many they are: all of a small tree, a share of a large one, where most of what can be gained is at the top, and no more of a very
/// large one than is done in a fifth of a second.
const FEW: usize = 1 << 14;
const SHARE: f32 = 0.05;
const MANY: usize = 1 << 16;

/// Places that are looked at for one node at most: where everything overlaps, bounds do not help.
const MOST_PLACES: usize = 1 << 10;

/// The tree as links. The numbers of nodes are those in the array that it was made from.
struct Linked {
    bounds: Vec<Bounds>,
    parent: Vec<u32>,
    /// Both children; twice 0 for a leaf.
    children: Vec<[u32; 2]>,
}

/// Where a node is better put.
struct Move {
    /// Beside this node.
    to: u32,
    /// How much area all boxes together lose.
    gain: f32,
}

const ROOT: u32 = 0;

/// Moves nodes of a tree to better places. Leaves stay what they are.
pub(super) fn reinsert(nodes: Vec<BinaryNode>) -> Vec<BinaryNode> {
    // Of boxes without a size, differences say nothing.
    let can_compare = nodes.first().is_some_and(|root| root.bounds.half_area() < 1e30);
    if !can_compare {
        return nodes;
    }
    let count = ((nodes.len() as f32 * SHARE) as usize).clamp(FEW, MANY);
    let mut tree = Linked::new(&nodes);
    let mut stack = Vec::new();
    for _ in 0..ROUNDS {
        for node in tree.largest(count) {
            if let Some(better) = tree.find(node, &mut stack) {
                tree.put(node, better.to);
            }
        }
    }
    tree.depth_first(&nodes).unwrap_or(nodes)
}

impl Linked {
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

    /// The best place for a node, if there is a better one than where it is. `stack` is scratch memory.
    fn find(&self, node: u32, stack: &mut Vec<(f32, u32)>) -> Option<Move> {
        let parent = self.parent[node as usize];
        if parent == ROOT {
            return None;
        }
        let bounds = self.bounds[node as usize];
        let own_area = bounds.half_area();
        let mut best = Move { to: ROOT, gain: 0.0 };
        // What is gained when the node is taken out, up to the place that is looked at: its parent goes, and those above shrink.
        let mut gained = self.area(parent);
        let mut beside = self.sibling(node);
        let mut shrunk = self.bounds[beside as usize];
        let mut pivot = parent;
        let mut places = 0;
        loop {
            stack.push((gained, beside));
            while let Some((gained, place)) = stack.pop() {
                // No box around the node is smaller than the node.
                if gained - own_area <= best.gain || places == MOST_PLACES {
                    continue;
                }
                places += 1;
                let rest = gained - self.bounds[place as usize].union(bounds).half_area();
                if rest > best.gain {
                    best = Move { to: place, gain: rest };
                }
                if !self.is_leaf(place) {
                    // Further down, this box grows instead.
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
        let same = best.to == self.sibling(node) || best.to == parent;
        (best.gain > 1e-6 * self.area(ROOT) && !same).then_some(best)
    }

    /// Takes a node out and puts it beside another, under the parent that it takes along.
    fn put(&mut self, node: u32, to: u32) {
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

    /// Fits the boxes of a node and of all above.
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

    /// The tree depth first again; `None` if it has become too deep. `nodes`: what it was made from.
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
    use crate::build::{Leaves, PrimitiveRef, Quality, Settings, binned};

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
        binned::build(primitives, Settings::new(Quality::Balanced, 3, Leaves::OneByOne(0.3)))
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
