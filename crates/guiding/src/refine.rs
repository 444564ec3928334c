//! From what was found to the next guide: finer where there is more light and where there are more paths.

use crate::guide::{Guide, MOST_LEAVES, MOST_NODES, QuadNode, SpaceNode};
use crate::learner::{FRACTIONS, Learner};
use std::sync::atomic::Ordering;

/// A square of directions from which more than this share of a place's light arrives is divided.
const SHARE_OF_SQUARE: f64 = 0.01;
/// Squares are divided so many times at most: then one is about a tenth of a degree wide.
const DEEPEST_SQUARE: u32 = 10;
/// A box is divided so many times at most.
const DEEPEST_BOX: u32 = 40;
/// A leaf with fewer finds than this keeps what was known before.
const FEWEST_FINDS: u32 = 64;
/// The probability of the guide where nothing is known of what it brings.
const FIRST_FRACTION: f32 = 0.5;

impl Learner {
    /// The guide that follows from what was found.
    ///
    /// - `most_finds`: a leaf of the tree over space with more of them is divided.
    /// - `last`: whether nobody will learn from those who follow it. Then each place has the probability of the guide
    ///   that is best by what was found; before, half of the directions are the guide's, so that all places are looked at by both.
    pub fn refine(&self, most_finds: u32, last: bool) -> Guide {
        let mut next = Refinement {
            learner: self,
            most_finds: most_finds.max(1),
            last,
            guide: Guide { spaces: Vec::new(), quads: Vec::new(), bounds: self.guide.bounds, leaves: 0 },
            unvisited: self.guide.leaves,
        };
        next.guide.spaces.push(self.guide.spaces[0]);
        next.space(0, 0, self.guide.bounds, 0);
        next.guide
    }
}

/// A guide in the making.
struct Refinement<'a> {
    learner: &'a Learner,
    most_finds: u32,
    last: bool,
    guide: Guide,
    /// Leaves of the old guide that are still to come.
    unvisited: usize,
}

/// A tree over directions in the making: the children of the root are counted from 1.
type Tree = Vec<QuadNode>;

/// What is known of a leaf of the tree over space beside its tree over directions.
#[derive(Clone, Copy)]
struct LeafValues {
    /// Number of finds.
    count: u32,
    /// Probability of the guide.
    fraction: f32,
}

/// A square of a tree over directions that may be divided.
struct Square {
    /// The node whose child it is, and which.
    node: usize,
    child: usize,
    /// What was found in it.
    light: f64,
    /// The node that the old guide divided it by.
    old: Option<u32>,
    depth: u32,
}

impl Refinement<'_> {
    /// Writes the old guide's node `old`, whose box is `bounds`, into the place `at` of the new one.
    fn space(&mut self, old: usize, at: usize, bounds: [[f32; 3]; 2], depth: u32) {
        let node = self.learner.guide.spaces[old];
        if node.axis < 3 {
            let first = self.two_children(at, node.axis, node.split);
            for (half, bounds) in halves(bounds, node.axis as usize, node.split).into_iter().enumerate() {
                self.space(node.first as usize + half, first + half, bounds, depth + 1);
            }
            return;
        }
        self.unvisited -= 1;
        let sums = &self.learner.leaves[node.leaf as usize];
        let count = sums.count.load(Ordering::Relaxed);
        let (tree, fraction) = if count < FEWEST_FINDS {
            (self.copied(node.first), node.split)
        } else {
            (self.learned(node.first), self.fraction(node.leaf as usize))
        };
        self.divide(at, bounds, depth, &tree, LeafValues { count, fraction });
    }

    /// A node with two leaves that are to be written yet; returns the index of the first.
    fn two_children(&mut self, at: usize, axis: u32, split: f32) -> usize {
        let first = self.guide.spaces.len();
        self.guide.spaces[at] = SpaceNode { split, axis, first: first as u32, leaf: 0 };
        let nothing = SpaceNode { split: 0.0, axis: 3, first: 0, leaf: 0 };
        self.guide.spaces.extend([nothing; 2]);
        first
    }

    /// Writes a leaf, in parts if it has too many finds.
    fn divide(&mut self, at: usize, bounds: [[f32; 3]; 2], depth: u32, tree: &Tree, leaf: LeafValues) {
        let axis = longest_axis(bounds);
        let split = 0.5 * (bounds[0][axis] + bounds[1][axis]);
        // Room for this leaf twice, and for those that are to come once, as large as any can be.
        let leaves = self.guide.leaves + self.unvisited + 2;
        let nodes = self.guide.quads.len() + 2 * tree.len() + self.reserved();
        let fits = leaves <= MOST_LEAVES && nodes <= MOST_NODES;
        let divisible = bounds[0][axis] < split && split < bounds[1][axis];
        if leaf.count > self.most_finds && depth < DEEPEST_BOX && fits && divisible {
            let first = self.two_children(at, axis as u32, split);
            // Two at a time become one more.
            self.unvisited += 1;
            for (half, bounds) in halves(bounds, axis, split).into_iter().enumerate() {
                self.unvisited -= usize::from(half == 1);
                let leaf = LeafValues { count: leaf.count / 2, ..leaf };
                self.divide(first + half, bounds, depth + 1, tree, leaf);
            }
            return;
        }
        let root = self.guide.quads.len() as u32;
        let place = |child: u32| if child == 0 { 0 } else { root + child };
        let nodes = tree.iter().map(|n| QuadNode { weights: n.weights, children: n.children.map(place) });
        self.guide.quads.extend(nodes);
        let number = self.guide.leaves as u32;
        self.guide.spaces[at] = SpaceNode { split: leaf.fraction, axis: 3, first: root, leaf: number };
        self.guide.leaves += 1;
    }

    /// Nodes that the old leaves which are still to come may need.
    fn reserved(&self) -> usize {
        self.unvisited * MOST_NODES / MOST_LEAVES
    }

    /// The tree over directions of the old guide.
    fn copied(&self, root: u32) -> Tree {
        let mut tree = Tree::new();
        self.copy_node(root as usize, &mut tree);
        tree
    }

    fn copy_node(&self, old: usize, tree: &mut Tree) -> u32 {
        let at = tree.len();
        let node = self.learner.guide.quads[old];
        tree.push(QuadNode { children: [0; 4], ..node });
        for (child, old) in node.children.into_iter().enumerate().filter(|(_, old)| *old != 0) {
            let index = self.copy_node(old as usize, tree);
            tree[at].children[child] = index;
        }
        at as u32
    }

    /// The tree over directions that follows from what was found.
    fn learned(&self, root: u32) -> Tree {
        let whole = self.light(root as usize);
        let mut tree = Tree::new();
        if whole <= 0.0 {
            tree.push(QuadNode { weights: [0.25; 4], children: [0; 4] });
            return tree;
        }
        let most = (MOST_NODES / MOST_LEAVES).max(1);
        let mut undivided = Vec::new();
        self.learn_node(Some(root), [0.0; 4], 1, &mut tree, &mut undivided);
        // The brightest first: there may not be enough nodes for all.
        while tree.len() < most {
            let brightest = (0..undivided.len())
                .max_by(|a, b| undivided[*a].light.total_cmp(&undivided[*b].light).then(b.cmp(a)));
            let Some(square) = brightest.map(|at| undivided.swap_remove(at)) else { break };
            if square.light <= SHARE_OF_SQUARE * whole {
                break;
            }
            let quarter = [square.light / 4.0; 4];
            let index = self.learn_node(square.old, quarter, square.depth + 1, &mut tree, &mut undivided);
            tree[square.node].children[square.child] = index;
        }
        tree
    }

    /// Light that was found in all cells of a node of the old guide.
    fn light(&self, old: usize) -> f64 {
        (0..4).map(|child| self.light_of_child(old, child)).sum()
    }

    fn light_of_child(&self, old: usize, child: usize) -> f64 {
        match self.learner.guide.quads[old].children[child] {
            0 => self.learner.cells[4 * old + child].load(Ordering::Relaxed) as f64,
            next => self.light(next as usize),
        }
    }

    /// Writes the node that the old guide has as `old`, or, if it had none, whose children have found `light`; returns its index.
    /// `depth`: of the children, which become `undivided` squares.
    fn learn_node(
        &self,
        old: Option<u32>,
        light: [f64; 4],
        depth: u32,
        tree: &mut Tree,
        undivided: &mut Vec<Square>,
    ) -> u32 {
        let known = |old: u32| std::array::from_fn(|child| self.light_of_child(old as usize, child));
        let light = old.map_or(light, known);
        let sum: f64 = light.iter().sum();
        let node = tree.len();
        let weights = if sum > 0.0 { light.map(|l| (l / sum) as f32) } else { [0.25; 4] };
        tree.push(QuadNode { weights, children: [0; 4] });
        if depth < DEEPEST_SQUARE {
            let child_of = |old: u32, child: usize| self.learner.guide.quads[old as usize].children[child];
            undivided.extend(light.into_iter().enumerate().map(|(child, light)| {
                let old = old.map(|old| child_of(old, child)).filter(|old| *old != 0);
                Square { node, child, light, old, depth }
            }));
        }
        node as u32
    }

    /// The probability with which a leaf's guide should be followed: that with the least second moment.
    fn fraction(&self, leaf: usize) -> f32 {
        if !self.last {
            return FIRST_FRACTION;
        }
        let squares = self.learner.leaves[leaf].squares.each_ref().map(|sum| sum.load(Ordering::Relaxed));
        let mut best = 0;
        for (at, square) in squares.iter().enumerate() {
            // The last one that is least: where nothing was found, nothing is sampled in vain by asking for more.
            if *square < squares[best] {
                best = at;
            }
        }
        FRACTIONS[best]
    }
}

/// Both halves of a box.
fn halves(bounds: [[f32; 3]; 2], axis: usize, split: f32) -> [[[f32; 3]; 2]; 2] {
    let (mut low, mut high) = (bounds, bounds);
    low[1][axis] = split;
    high[0][axis] = split;
    [low, high]
}

fn longest_axis([low, high]: [[f32; 3]; 2]) -> usize {
    let extent = |axis: usize| high[axis] - low[axis];
    let longer = |best: usize, axis: usize| if extent(axis) > extent(best) { axis } else { best };
    [1, 2].into_iter().fold(0, longer)
}
