//! Building: primitives → (parts of them) → binary tree by binned SAH → (nodes in better places) → eight-wide tree, depth first.

mod binned;
mod collapse;
mod presplit;
mod reinsert;

use crate::aabb::Aabb;
use crate::layout::{ChildRef, Node};
use crate::simd::quad::Quad;
use binned::BinaryNode;

pub(crate) use presplit::{Cuts, Cutting, Waste};

/// How much time to spend on a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// For structures that live for a frame.
    Fast,
    /// For almost everything.
    #[default]
    Balanced,
    /// For long renderings: large, slanted triangles are cut first.
    High,
}

/// Makes a small number look like an ordinary float: as denormals they would slow down the arithmetic on all lanes.
const NUMBER: u32 = 0x4000_0000;

/// A primitive's box, and where the primitive is. The fourth lanes hold the numbers.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct PrimitiveRef {
    low: Quad,
    high: Quad,
}

impl PrimitiveRef {
    #[inline]
    pub fn new(b: &Aabb, index: u32, geometry: u32) -> Self {
        let ([x0, y0, z0], [x1, y1, z1]) = (b.min, b.max);
        PrimitiveRef {
            low: Quad::new([x0, y0, z0, f32::from_bits(index ^ NUMBER)]),
            high: Quad::new([x1, y1, z1, f32::from_bits(geometry ^ NUMBER)]),
        }
    }

    pub fn index(&self) -> u32 {
        self.low.to_array()[3].to_bits() ^ NUMBER
    }

    pub fn geometry(&self) -> u32 {
        self.high.to_array()[3].to_bits() ^ NUMBER
    }

    pub fn bounds(&self) -> Aabb {
        let ([x0, y0, z0, _], [x1, y1, z1, _]) = (self.low.to_array(), self.high.to_array());
        Aabb { min: [x0, y0, z0], max: [x1, y1, z1] }
    }

    /// Twice the centre; the fourth lane means nothing.
    #[inline(always)]
    fn center2(&self) -> Quad {
        self.low.add(self.high)
    }
}

/// A box while building; the fourth lanes mean nothing.
#[derive(Clone, Copy)]
struct Bounds {
    low: Quad,
    high: Quad,
}

impl Bounds {
    #[inline(always)]
    fn empty() -> Bounds {
        Bounds { low: Quad::splat(f32::INFINITY), high: Quad::splat(f32::NEG_INFINITY) }
    }

    #[inline(always)]
    fn grow(&mut self, low: Quad, high: Quad) {
        self.low = self.low.min(low);
        self.high = self.high.max(high);
    }

    #[inline(always)]
    fn union(self, b: Bounds) -> Bounds {
        Bounds { low: self.low.min(b.low), high: self.high.max(b.high) }
    }

    #[inline(always)]
    fn half_area(&self) -> f32 {
        let [x, y, z, _] = self.high.sub(self.low).to_array();
        x * y + y * z + z * x
    }

    fn to_aabb(self) -> Aabb {
        let ([x0, y0, z0, _], [x1, y1, z1, _]) = (self.low.to_array(), self.high.to_array());
        Aabb { min: [x0, y0, z0], max: [x1, y1, z1] }
    }
}

/// Up to this many blocks are searched one by one, and are filled to the brim for that.
pub(crate) const TINY_BLOCKS: usize = 6;

/// How a leaf's primitives are tested, which decides what leaves are good.
#[derive(Clone, Copy)]
pub(crate) enum Leaves {
    /// All at once, in the lanes of a vector: a full leaf costs no more than one of a single primitive.
    Lanes,
    /// One after the other; each costs this, in units of the cost of a visit to a node.
    OneByOne(f32),
}

/// What the builder may assume and should aim for.
#[derive(Clone, Copy)]
pub(crate) struct Settings {
    /// Primitives a leaf can hold: the builder never splits fewer.
    pub leaf_size: usize,
    /// Most bins per axis.
    pub bins: usize,
    pub leaves: Leaves,
}

impl Settings {
    pub fn new(quality: Quality, leaf_size: usize, leaves: Leaves) -> Settings {
        let bins = if quality == Quality::Fast { 8 } else { 16 };
        Settings { leaf_size, bins, leaves }
    }

    /// Whether a tree over `n` primitives should fill its leaves to the brim instead of looking for the best cuts.
    fn is_tiny(&self, n: usize) -> bool {
        match self.leaves {
            Leaves::Lanes => self.leaf_size > 1 && n <= self.leaf_size * TINY_BLOCKS,
            Leaves::OneByOne(_) => false,
        }
    }

    /// What a box around `n` primitives costs where cuts are compared, in any unit.
    fn set_cost(&self, n: u32) -> f32 {
        match self.leaves {
            Leaves::Lanes => n.div_ceil(self.leaf_size as u32) as f32,
            Leaves::OneByOne(_) => n as f32,
        }
    }

    /// What a leaf of `n` primitives costs, in units of the cost of a visit to a node.
    fn leaf_cost(&self, n: u32) -> f32 {
        match self.leaves {
            Leaves::Lanes => 1.0,
            Leaves::OneByOne(cost) => cost * n as f32,
        }
    }
}

/// A finished tree over blocks that the caller fills.
pub(crate) struct WideTree {
    /// Depth first, the root first.
    pub nodes: Vec<Node>,
    pub root: ChildRef,
    pub bounds: Aabb,
    /// For each block: the range of primitives (in their new order) in it.
    pub leaves: Vec<(u32, u32)>,
}

/// Builds a tree; `primitives` are reordered.
pub(crate) fn build(primitives: &mut [PrimitiveRef], settings: Settings) -> WideTree {
    Draft::new(primitives, settings).finish()
}

/// A tree as it is built first: enough to know whether it is worth finishing.
pub(crate) struct Draft {
    binary: Vec<BinaryNode>,
}

impl Draft {
    /// Builds from the top down; `primitives` are reordered.
    pub fn new(primitives: &mut [PrimitiveRef], settings: Settings) -> Draft {
        Draft { binary: binned::build(primitives, settings) }
    }

    /// The same with nodes in better places.
    pub fn improved(self) -> Draft {
        Draft { binary: reinsert::reinsert(self.binary) }
    }

    /// What a ray through the box around it all may expect to pay, in units of the cost of a visit to a node.
    pub fn cost(&self) -> f32 {
        self.binary.first().map_or(0.0, |root| root.cost[0] / root.bounds.half_area())
    }

    /// The tree.
    pub fn finish(self) -> WideTree {
        collapse::collapse(&self.binary)
    }
}
