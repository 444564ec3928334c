//! Binary tree, top down: each set of primitives is cut where the surface area heuristic, tried at the edges of a few
//! bins, is lowest (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007). Large sets are
//! worked on in parallel.

use super::{Bounds, Leaves, PrimitiveRef, Settings};
use crate::kernel::MAX_DEPTH;
use crate::simd::quad::Quad;
use rayon::prelude::*;
use std::ops::Range;

/// Sets larger than this are split by two threads.
const PARALLEL: usize = 8192;

/// Sets larger than this are binned by several threads.
const PARALLEL_BINNING: usize = 65536;

/// A primitive whose box has more than this share of the area around all of them is large.
const LARGE: f32 = 0.1;

/// Most large primitives: more are no exceptions.
const MOST_LARGE: usize = 32;

/// From this depth on sets are halved, so that the tree's depth has a bound.
const SAH_DEPTH: usize = MAX_DEPTH - 32;

/// A node of the binary tree, depth first: the left child follows its parent.
#[derive(Clone, Copy)]
pub(super) struct BinaryNode {
    pub bounds: Bounds,
    /// The range of primitives below.
    pub first: u32,
    pub count: u32,
    /// How far behind this node the right child is; 0 for a leaf.
    pub right: u32,
    /// The cheapest cost of the primitives below as `i + 1` children of one wide node. See `collapse`.
    pub cost: [f32; 7],
}

pub(super) fn build(primitives: &mut [PrimitiveRef], settings: Settings) -> Vec<BinaryNode> {
    let set = Set {
        bounds: total_bounds(primitives, |p| (p.low, p.high)),
        centers: total_bounds(primitives, |p| (p.center2(), p.center2())),
        first: 0,
        depth: 0,
    };
    let mut nodes = Vec::new();
    if !primitives.is_empty() {
        nodes.reserve(primitives.len() / 2 + 8);
        Builder { settings, is_tiny: settings.is_tiny(primitives.len()) }
            .subtree(primitives, set, &mut nodes);
    }
    nodes
}

fn total_bounds(primitives: &[PrimitiveRef], f: impl Fn(&PrimitiveRef) -> (Quad, Quad) + Sync) -> Bounds {
    let chunk = |c: &[PrimitiveRef]| {
        c.iter().fold(Bounds::empty(), |mut b, p| {
            let (low, high) = f(p);
            b.grow(low, high);
            b
        })
    };
    if primitives.len() < PARALLEL_BINNING {
        return chunk(primitives);
    }
    primitives.par_chunks(16384).map(chunk).reduce(Bounds::empty, Bounds::union)
}

/// A set of primitives that becomes a subtree.
#[derive(Clone, Copy)]
struct Set {
    bounds: Bounds,
    /// The box around the doubled centres.
    centers: Bounds,
    first: u32,
    depth: usize,
}

#[derive(Clone, Copy)]
struct Builder {
    settings: Settings,
    is_tiny: bool,
}

/// Boxes and counts by axis and bin.
struct Bins<const N: usize> {
    bounds: [[Bounds; N]; 3],
    counts: [[u32; N]; 3],
}

/// From doubled centres to `N` bins; `N` is a power of two.
#[derive(Clone, Copy)]
struct Binning<const N: usize> {
    origin: Quad,
    scale: Quad,
}

impl<const N: usize> Binning<N> {
    fn new(centers: &Bounds) -> Binning<N> {
        let size = centers.high.sub(centers.low).to_array();
        // A flat axis gets one bin. The factor below 1 keeps the last centre inside of the last bin.
        let scale = size.map(|s| if s > 0.0 && s.is_finite() { N as f32 * 0.99999 / s } else { 0.0 });
        let scale = scale.map(|s| if s.is_finite() { s } else { 0.0 });
        Binning { origin: centers.low, scale: Quad::new(scale) }
    }

    #[inline(always)]
    fn bins_of(&self, p: &PrimitiveRef) -> [usize; 3] {
        let [x, y, z, _] = p.center2().sub(self.origin).mul(self.scale).to_i32();
        // The mask never changes a bin; it spares the bounds check.
        [x as usize & (N - 1), y as usize & (N - 1), z as usize & (N - 1)]
    }
}

impl<const N: usize> Bins<N> {
    fn empty() -> Bins<N> {
        Bins { bounds: [[Bounds::empty(); N]; 3], counts: [[0; N]; 3] }
    }

    #[inline]
    fn fill(&mut self, binning: &Binning<N>, primitives: &[PrimitiveRef]) {
        for p in primitives {
            let at = binning.bins_of(p);
            for a in 0..3 {
                self.bounds[a][at[a]].grow(p.low, p.high);
                self.counts[a][at[a]] += 1;
            }
        }
    }

    fn of(binning: &Binning<N>, primitives: &[PrimitiveRef]) -> Bins<N> {
        let mut bins = Bins::empty();
        if primitives.len() < PARALLEL_BINNING {
            bins.fill(binning, primitives);
            return bins;
        }
        let chunk = |c: &[PrimitiveRef]| {
            let mut bins = Bins::empty();
            bins.fill(binning, c);
            bins
        };
        primitives.par_chunks(16384).map(chunk).reduce(Bins::empty, Bins::union)
    }

    fn union(mut self, other: Bins<N>) -> Bins<N> {
        for a in 0..3 {
            for i in 0..N {
                self.bounds[a][i] = self.bounds[a][i].union(other.bounds[a][i]);
                self.counts[a][i] += other.counts[a][i];
            }
        }
        self
    }
}

/// A cut: primitives in bins below `bin` of `axis` go left.
struct Cut {
    axis: usize,
    bin: usize,
    cost: f32,
    left: Bounds,
    right: Bounds,
}

impl Builder {
    fn best_cut<const N: usize>(&self, bins: &Bins<N>) -> Option<Cut> {
        let mut best: Option<Cut> = None;
        for axis in 0..3 {
            let (bounds, counts) = (&bins.bounds[axis], &bins.counts[axis]);
            let mut right = [(Bounds::empty(), f32::INFINITY); N];
            let (mut b, mut n) = (Bounds::empty(), 0);
            for i in (1..N).rev() {
                b = b.union(bounds[i]);
                n += counts[i];
                if n > 0 {
                    right[i] = (b, b.half_area() * self.settings.set_cost(n));
                }
            }
            let (mut b, mut n) = (Bounds::empty(), 0);
            for bin in 1..N {
                b = b.union(bounds[bin - 1]);
                n += counts[bin - 1];
                if n == 0 {
                    continue;
                }
                let cost = b.half_area() * self.settings.set_cost(n) + right[bin].1;
                if cost < best.as_ref().map_or(f32::INFINITY, |c| c.cost) {
                    best = Some(Cut { axis, bin, cost, left: b, right: right[bin].0 });
                }
            }
        }
        best
    }

    /// Reorders `primitives` by the cheapest cut between bins, if there is one.
    fn cut<const N: usize>(&self, primitives: &mut [PrimitiveRef], set: &Set) -> Option<(usize, Set, Set)> {
        let binning = Binning::<N>::new(&set.centers);
        let cut = self.best_cut(&Bins::of(&binning, primitives))?;
        let middle = partition(primitives, |p| binning.bins_of(p)[cut.axis] < cut.bin);
        if middle == 0 || middle == primitives.len() {
            return None;
        }
        let (l, r) = primitives.split_at(middle);
        let child = |s: &[PrimitiveRef], first, bounds| Set {
            bounds,
            centers: total_bounds(s, |p| (p.center2(), p.center2())),
            first,
            depth: set.depth + 1,
        };
        Some((middle, child(l, set.first, cut.left), child(r, set.first + middle as u32, cut.right)))
    }

    /// Moves the few largest primitives of all to the front and makes them the left side, if there are any. The planes between bins
    /// cannot part them from what is around their centres: a floor would go with a slice of everything that stands on it.
    fn large_apart(&self, primitives: &mut [PrimitiveRef], set: &Set) -> Option<(usize, Set, Set)> {
        let limit = LARGE * set.bounds.half_area();
        let is_large = |p: &PrimitiveRef| Bounds { low: p.low, high: p.high }.half_area() > limit;
        let large: Vec<usize> = if primitives.len() < PARALLEL_BINNING {
            primitives.iter().enumerate().filter(|(_, p)| is_large(p)).map(|(i, _)| i).collect()
        } else {
            primitives.par_iter().enumerate().filter(|(_, p)| is_large(p)).map(|(i, _)| i).collect()
        };
        if large.is_empty() || large.len() > MOST_LARGE || large.len() == primitives.len() {
            return None;
        }
        // In ascending order, so none has been moved before its turn.
        for (to, from) in large.iter().enumerate() {
            primitives.swap(to, *from);
        }
        Some((
            large.len(),
            child(set, primitives, 0..large.len()),
            child(set, primitives, large.len()..primitives.len()),
        ))
    }

    /// Appends the subtree of `primitives` to `nodes`.
    fn subtree(self, primitives: &mut [PrimitiveRef], set: Set, nodes: &mut Vec<BinaryNode>) {
        let at = nodes.len();
        let count = primitives.len() as u32;
        nodes.push(BinaryNode { bounds: set.bounds, first: set.first, count, right: 0, cost: [0.0; 7] });
        if primitives.len() <= self.settings.leaf_size {
            let cost = set.bounds.half_area() * self.settings.leaf_cost(count);
            nodes[at].cost = [cost; 7];
            return;
        }
        let (middle, left, right) = self.split(primitives, &set);
        let (left_primitives, right_primitives) = primitives.split_at_mut(middle);
        if left_primitives.len() + right_primitives.len() > PARALLEL {
            let mut right_nodes = Vec::with_capacity(right_primitives.len() / 2);
            rayon::join(
                || self.subtree(left_primitives, left, nodes),
                || self.subtree(right_primitives, right, &mut right_nodes),
            );
            nodes[at].right = (nodes.len() - at) as u32;
            nodes.append(&mut right_nodes);
        } else {
            self.subtree(left_primitives, left, nodes);
            nodes[at].right = (nodes.len() - at) as u32;
            self.subtree(right_primitives, right, nodes);
        }
        let (l, r) = (nodes[at + 1].cost, nodes[at + nodes[at].right as usize].cost);
        nodes[at].cost = super::collapse::costs(set.bounds.half_area(), &l, &r);
    }

    /// Reorders `primitives` so that those below the returned index go left.
    fn split(&self, primitives: &mut [PrimitiveRef], set: &Set) -> (usize, Set, Set) {
        let n = primitives.len();
        let leaf = self.settings.leaf_size;
        if set.depth == 0
            && !self.is_tiny
            && matches!(self.settings.leaves, Leaves::Lanes)
            && let Some(result) = self.large_apart(primitives, set)
        {
            return result;
        }
        if set.depth < SAH_DEPTH && !self.is_tiny {
            let cut = if n < 128 || self.settings.bins <= 8 {
                self.cut::<8>(primitives, set)
            } else {
                self.cut::<16>(primitives, set)
            };
            if let Some(result) = cut {
                return result;
            }
        }
        // All centres in one place, a tree grown too deep, or a tiny one that wants full blocks: halve, in whole blocks, along the longest axis.
        let size = set.centers.high.sub(set.centers.low).to_array();
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        let middle = n.div_ceil(leaf) / 2 * leaf;
        primitives.select_nth_unstable_by(middle, |a, b| {
            a.center2().to_array()[axis].total_cmp(&b.center2().to_array()[axis])
        });
        (middle, child(set, primitives, 0..middle), child(set, primitives, middle..n))
    }
}

/// Some of the primitives of a set, as a set of its own.
fn child(set: &Set, primitives: &[PrimitiveRef], some: Range<usize>) -> Set {
    let first = set.first + some.start as u32;
    let primitives = &primitives[some];
    Set {
        bounds: total_bounds(primitives, |p| (p.low, p.high)),
        centers: total_bounds(primitives, |p| (p.center2(), p.center2())),
        first,
        depth: set.depth + 1,
    }
}

/// Moves those that go left to the front. Returns their number.
fn partition(primitives: &mut [PrimitiveRef], goes_left: impl Fn(&PrimitiveRef) -> bool) -> usize {
    let mut middle = 0;
    // Always swap, advance sometimes: a branch here would be wrong every other time.
    for i in 0..primitives.len() {
        let p = primitives[i];
        primitives.swap(i, middle);
        middle += usize::from(goes_left(&p));
    }
    middle
}
