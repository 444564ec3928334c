//! Top-down build of a binary tree with the binned surface area heuristic (Wald, "On fast
//! Construction of SAH-based Bounding Volume Hierarchies", 2007). Large sets are processed in
//! parallel.

use super::binary_node::BinaryNode;
use super::collapse::costs;
use super::primitive_ref::{Bounds, PrimitiveRef};
use super::settings::{LeafCost, Settings};
use crate::layout::MAX_DEPTH;
use crate::simd::float4::Float4;
use rayon::prelude::*;
use std::ops::Range;

/// Sets larger than this are split by two threads.
const PARALLEL: usize = 8192;

/// Sets larger than this are binned by several threads.
const PARALLEL_BINNING: usize = 65536;

/// A primitive is large if its box has more than this share of the area of the root's box.
const LARGE: f32 = 0.1;

/// More large primitives than this are not split off.
const MOST_LARGE: usize = 32;

/// From this depth on, sets are split at the median, which bounds the depth of the tree.
const SAH_DEPTH: usize = MAX_DEPTH - 32;

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
        Builder { settings, fills_blocks: settings.fills_blocks(primitives.len()) }
            .subtree(primitives, set, &mut nodes);
    }
    nodes
}

fn total_bounds(primitives: &[PrimitiveRef], f: impl Fn(&PrimitiveRef) -> (Float4, Float4) + Sync) -> Bounds {
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
    /// The bounds of the doubled centres.
    centers: Bounds,
    first: u32,
    depth: usize,
}

#[derive(Clone, Copy)]
struct Builder {
    settings: Settings,
    fills_blocks: bool,
}

/// Boxes and counts by axis and bin.
struct Bins<const N: usize> {
    bounds: [[Bounds; N]; 3],
    counts: [[u32; N]; 3],
}

/// Maps doubled centres to `N` bins; `N` is a power of two.
#[derive(Clone, Copy)]
struct Binning<const N: usize> {
    origin: Float4,
    scale: Float4,
}

impl<const N: usize> Binning<N> {
    fn new(centers: &Bounds) -> Binning<N> {
        let size = centers.high.sub(centers.low).to_array();
        // A flat axis gets one bin. The factor below 1 keeps the last centre in the last bin.
        let scale = size.map(|s| if s > 0.0 && s.is_finite() { N as f32 * 0.99999 / s } else { 0.0 });
        let scale = scale.map(|s| if s.is_finite() { s } else { 0.0 });
        Binning { origin: centers.low, scale: Float4::new(scale) }
    }

    #[inline(always)]
    fn bins_of(&self, p: &PrimitiveRef) -> [usize; 3] {
        let [x, y, z, _] = p.center2().sub(self.origin).mul(self.scale).to_i32();
        // The mask never changes a bin; it removes the bounds check.
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

/// A split: primitives in bins below `bin` of `axis` go left.
struct Split {
    axis: usize,
    bin: usize,
    cost: f32,
    left: Bounds,
    right: Bounds,
}

impl Builder {
    fn best_split<const N: usize>(&self, bins: &Bins<N>) -> Option<Split> {
        let mut best: Option<Split> = None;
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
                    best = Some(Split { axis, bin, cost, left: b, right: right[bin].0 });
                }
            }
        }
        best
    }

    /// Partitions `primitives` by the cheapest split between bins, if there is one.
    fn sah_split<const N: usize>(
        &self,
        primitives: &mut [PrimitiveRef],
        set: &Set,
    ) -> Option<(usize, Set, Set)> {
        let binning = Binning::<N>::new(&set.centers);
        let split = self.best_split(&Bins::of(&binning, primitives))?;
        let middle = partition(primitives, |p| binning.bins_of(p)[split.axis] < split.bin);
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
        Some((middle, child(l, set.first, split.left), child(r, set.first + middle as u32, split.right)))
    }

    /// Moves the few large primitives to the front and makes them the left side, if there are any.
    /// Splits between bins cannot separate them from what is near their centres: a floor would
    /// share a child with a slice of everything that stands on it.
    fn split_off_large(&self, primitives: &mut [PrimitiveRef], set: &Set) -> Option<(usize, Set, Set)> {
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
        // In ascending order, so that none has been moved before its turn.
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
            let cost = set.bounds.half_area() * self.settings.cost_of_leaf(count);
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
        nodes[at].cost = costs(set.bounds.half_area(), &l, &r);
    }

    /// Partitions `primitives`: those below the returned index go left.
    fn split(&self, primitives: &mut [PrimitiveRef], set: &Set) -> (usize, Set, Set) {
        let n = primitives.len();
        let leaf = self.settings.leaf_size;
        if set.depth == 0
            && !self.fills_blocks
            && matches!(self.settings.leaf_cost, LeafCost::PerBlock)
            && let Some(result) = self.split_off_large(primitives, set)
        {
            return result;
        }
        if set.depth < SAH_DEPTH && !self.fills_blocks {
            let split = if n < 128 || self.settings.bins <= 8 {
                self.sah_split::<8>(primitives, set)
            } else {
                self.sah_split::<16>(primitives, set)
            };
            if let Some(result) = split {
                return result;
            }
        }
        // All centres in one place, a tree too deep, or an object that fills its blocks: split at
        // the median along the longest axis, in whole blocks.
        let size = set.centers.high.sub(set.centers.low).to_array();
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        let middle = n.div_ceil(leaf) / 2 * leaf;
        primitives.select_nth_unstable_by(middle, |a, b| {
            a.center2().to_array()[axis].total_cmp(&b.center2().to_array()[axis])
        });
        (middle, child(set, primitives, 0..middle), child(set, primitives, middle..n))
    }
}

/// A range of the primitives of a set, as a set.
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

/// Moves primitives that go left to the front. Returns their number.
fn partition(primitives: &mut [PrimitiveRef], goes_left: impl Fn(&PrimitiveRef) -> bool) -> usize {
    let mut middle = 0;
    // Always swaps: a branch would be mispredicted half of the time.
    for i in 0..primitives.len() {
        let p = primitives[i];
        primitives.swap(i, middle);
        middle += usize::from(goes_left(&p));
    }
    middle
}
