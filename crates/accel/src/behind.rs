//! What lies behind the triangles that rays leave.
//!
//! A ray that leaves a triangle stays on the side of the triangle's plane to which it goes. Whatever lies wholly on the other side it
//! cannot meet. Around each triangle that is often much: a ray that is reflected by a sphere, a bottle or the corner of a box begins
//! amidst the boxes of its neighbours, walks down through all of them, and none of those neighbours can be in its way. So for each
//! triangle and each of its sides it is found out once which subtrees around it lie behind; rays that say which side of which triangle
//! they leave ([`crate::RayColumns::leaving`]) are not tested with those.
//!
//! This changes no answer: rays start a little above the surface that they leave, by more than what counts as behind may stick out.

use crate::aabb::Aabb;
use crate::handful::ALL_CHILDREN;
use crate::kernel::{self, Kernel, MAX_DEPTH};
use crate::layout::{ChildRef, EMPTY, LEAF, NO_PRIMITIVE, Node, TriangleBlock, WIDTH, leaf_index};
use crate::simd::Simd;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::hint::select_unpredictable;

/// A side of a triangle, of one or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Side(u32);

impl Side {
    /// Of no triangle.
    pub const NONE: Side = Side(u32::MAX);

    /// Of the triangle of an id, the one from which its corners go around counter-clockwise (`is_front`), or the other.
    #[inline(always)]
    pub fn of(id: u32, is_front: bool) -> Side {
        Side(id.wrapping_mul(2) | u32::from(!is_front))
    }

    /// The other side; of no triangle if this is.
    #[inline(always)]
    pub fn other(self) -> Side {
        Side(self.0 ^ 1)
    }
}

impl Default for Side {
    fn default() -> Self {
        Side::NONE
    }
}

/// How far something may stick out of a triangle's plane and be behind it, as a share of the largest magnitude of a coordinate of the
/// triangle: a little less than what rays start above it. What is flat has corners that are rounded, so that zero would not do.
const TOLERANCE: f32 = 0.875 / (1 << 22) as f32;

/// Relative error of a height above a plane, with room: of the normal, of a difference, of a product and of the sums.
const ERROR: f32 = 4.0 * f32::EPSILON;

/// Nodes and leaves that are looked at for one side of all triangles of a block at most. Most need few; where planes cut through
/// everything, it would be all.
const MOST_VISITS: u32 = 1024;

/// Sides of more triangles have no numbers, children of more nodes neither.
const MOST_TRIANGLES: usize = 1 << 30;
const MOST_NODES: usize = 1 << 24;

/// Some children of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct Children(u32);

impl Children {
    /// None of any.
    pub const NONE: Children = Children(0);

    /// Those of node `node` whose places are set in `which`, as bits.
    fn new(node: u32, which: u32) -> Children {
        debug_assert!(node < MOST_NODES as u32 && which < 1 << WIDTH);
        Children(node << WIDTH | which)
    }

    /// Places of those that are the children of `node`, as bits.
    #[inline(always)]
    pub fn of(self, node: ChildRef) -> u32 {
        select_unpredictable(self.0 >> WIDTH == node, self.0 & ALL_CHILDREN, 0)
    }
}

/// What lies behind the sides of an object's triangles.
pub(crate) struct Behind(Vec<Children>);

impl Behind {
    /// Nothing is known.
    pub const NOTHING: Behind = Behind(Vec::new());

    /// Of a tree over so many triangles. Nothing is known if their ids are not the numbers from zero on.
    pub fn find(kernel: Kernel, nodes: &[Node], blocks: &[TriangleBlock], triangles: usize) -> Behind {
        let mut ids = blocks.iter().flat_map(|block| block.ids).filter(|id| *id != NO_PRIMITIVE);
        let is_large = triangles > MOST_TRIANGLES || nodes.len() > MOST_NODES;
        if is_large || ids.any(|id| id as usize >= triangles) {
            return Behind::NOTHING;
        }
        let tree = Climb::new(nodes, blocks);
        let all = (0..blocks.len()).into_par_iter().with_min_len(64);
        let found: Vec<_> = all.map(|block| kernel::behind_block(kernel, &tree, block)).collect();
        let mut behind = vec![Children::NONE; 2 * triangles];
        for (block, found) in blocks.iter().zip(&found) {
            for (id, found) in block.ids.iter().zip(found).filter(|(id, _)| **id != NO_PRIMITIVE) {
                behind[2 * *id as usize..][..2].copy_from_slice(found);
            }
        }
        Behind(behind)
    }

    /// Whether nothing is known.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What rays cannot meet that leave a side, as far as it is known.
    #[inline(always)]
    pub fn of(&self, side: Side) -> Children {
        self.0.get(side.0 as usize).copied().unwrap_or(Children::NONE)
    }

    /// Bytes of memory that this occupies.
    pub fn memory_bytes(&self) -> usize {
        self.0.capacity() * size_of::<Children>()
    }
}

/// One side of a triangle.
#[derive(Clone, Copy)]
pub(crate) struct Plane {
    pub point: [f32; 3],
    /// Of unit length, to the side that is above.
    pub normal: [f32; 3],
    /// What is not higher above than this is not above.
    pub tolerance: f32,
}

impl Plane {
    /// The side of a triangle from which its corners go around counter-clockwise; `None` where that cannot be told.
    fn of([a, b, c]: [[f32; 3]; 3]) -> Option<Plane> {
        let edge = |p: [f32; 3]| [0, 1, 2].map(|k: usize| f64::from(p[k]) - f64::from(a[k]));
        let (p, q) = (edge(b), edge(c));
        let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        let largest = [a, b, c].as_flattened().iter().fold(0.0f32, |m, x| m.max(x.abs()));
        (length > 0.0 && length.is_finite()).then(|| Plane {
            point: a,
            normal: n.map(|x| (x / length) as f32),
            tolerance: TOLERANCE * largest,
        })
    }

    /// Of no triangle.
    const NOTHING: Plane = Plane { point: [0.0; 3], normal: [0.0; 3], tolerance: 0.0 };

    fn turned(self) -> Plane {
        Plane { normal: self.normal.map(|x| -x), ..self }
    }
}

/// One side of each triangle of a block.
struct Sides {
    planes: [Plane; WIDTH],
    columns: Columns,
}

/// Planes, by coordinate and lane.
pub(crate) struct Columns {
    point: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    tolerance: [f32; WIDTH],
}

impl Sides {
    fn of(planes: [Plane; WIDTH]) -> Sides {
        let columns = Columns {
            point: [0, 1, 2].map(|axis: usize| planes.map(|plane| plane.point[axis])),
            normal: [0, 1, 2].map(|axis: usize| planes.map(|plane| plane.normal[axis])),
            tolerance: planes.map(|plane| plane.tolerance),
        };
        Sides { planes, columns }
    }

    fn turned(&self) -> Sides {
        Sides::of(self.planes.map(Plane::turned))
    }
}

/// Above which of eight planes a box reaches, as bits.
#[derive(Clone, Copy)]
pub(crate) struct BoxAbove {
    /// Above these a corner may be in spite of all rounding.
    maybe: u32,
    /// Above these a whole side is. Something in the box touches that side, and so is above them, too; if boxes were larger than what is in
    /// them, less would be found to lie behind.
    surely: u32,
}

/// What is above planes. Each number is rounded by itself, so that all kernels find the same.
pub(crate) trait Measure: Copy {
    /// Points, by coordinate and lane, that may be above a plane in spite of all rounding, as bits. Not where coordinates are not numbers.
    fn above(self, plane: &Plane, points: [&[f32; WIDTH]; 3]) -> u32;

    /// Above which planes a box reaches that is not empty. What overflows is above.
    fn box_above(self, planes: &Columns, bounds: Aabb) -> BoxAbove;
}

/// Lane by lane.
#[derive(Clone, Copy)]
pub(crate) struct OneByOne;

impl Measure for OneByOne {
    fn above(self, plane: &Plane, points: [&[f32; WIDTH]; 3]) -> u32 {
        let is_above = |lane: usize| {
            let part = |axis: usize| plane.normal[axis] * (points[axis][lane] - plane.point[axis]);
            let [x, y, z] = [part(0), part(1), part(2)];
            (x + y + z) + ERROR * (x.abs() + y.abs() + z.abs()) > plane.tolerance
        };
        (0..WIDTH).fold(0, |bits, lane| bits | u32::from(is_above(lane)) << lane)
    }

    fn box_above(self, planes: &Columns, bounds: Aabb) -> BoxAbove {
        // As vector instructions choose where one is not a number.
        let [larger, smaller] =
            [|a: f32, b: f32| if a > b { a } else { b }, |a: f32, b: f32| if a < b { a } else { b }];
        let mut above = BoxAbove { maybe: 0, surely: 0 };
        for lane in 0..WIDTH {
            let parts = [0, 1, 2].map(|axis: usize| {
                let part = |end: f32| planes.normal[axis][lane] * (end - planes.point[axis][lane]);
                [part(bounds.min[axis]), part(bounds.max[axis])]
            });
            let [x, y, z] = parts.map(|[a, b]| larger(a, b));
            let [low_x, low_y, low_z] = parts.map(|[a, b]| smaller(a, b));
            let height = (x + y + z) + ERROR * (x.abs() + y.abs() + z.abs());
            let span = larger(x - low_x, larger(y - low_y, z - low_z));
            let tolerance = planes.tolerance[lane];
            let is_below = height <= tolerance; // false for NaN
            above.maybe |= u32::from(!is_below) << lane;
            above.surely |= u32::from((low_x + low_y + low_z) + span > tolerance) << lane;
        }
        above
    }
}

/// All lanes at once.
#[derive(Clone, Copy)]
pub(crate) struct AllAtOnce<S>(pub S);

impl<S: Simd> AllAtOnce<S> {
    /// The sum of three parts of a height, as large as rounding may have made it.
    #[inline(always)]
    fn height(self, [x, y, z]: [S::F; 3]) -> S::F {
        let s = self.0;
        let magnitude = |part: S::F| s.flip_sign(part, part);
        let size = s.add(s.add(magnitude(x), magnitude(y)), magnitude(z));
        s.add(s.add(s.add(x, y), z), s.mul(s.splat(ERROR), size))
    }
}

impl<S: Simd> Measure for AllAtOnce<S> {
    #[inline(always)]
    fn above(self, plane: &Plane, points: [&[f32; WIDTH]; 3]) -> u32 {
        let s = self.0;
        let part = |axis: usize| {
            s.mul(s.splat(plane.normal[axis]), s.sub(s.load(points[axis]), s.splat(plane.point[axis])))
        };
        s.bits(s.lt(s.splat(plane.tolerance), self.height([part(0), part(1), part(2)])))
    }

    #[inline(always)]
    fn box_above(self, planes: &Columns, bounds: Aabb) -> BoxAbove {
        let s = self.0;
        let [mut high, mut low] = [[s.splat(0.0); 3]; 2];
        for axis in 0..3 {
            let (normal, point) = (s.load(&planes.normal[axis]), s.load(&planes.point[axis]));
            let part = |end: f32| s.mul(normal, s.sub(s.splat(end), point));
            let (a, b) = (part(bounds.min[axis]), part(bounds.max[axis]));
            (high[axis], low[axis]) = (s.max(a, b), s.min(a, b));
        }
        let span = |axis: usize| s.sub(high[axis], low[axis]);
        let of_a_side = s.add(s.add(s.add(low[0], low[1]), low[2]), s.max(span(0), s.max(span(1), span(2))));
        let tolerance = s.load(&planes.tolerance);
        BoxAbove {
            maybe: s.bits(s.le(self.height(high), tolerance)) ^ ALL_PLANES,
            surely: s.bits(s.lt(tolerance, of_a_side)),
        }
    }
}

/// All planes of a block's side, as bits.
const ALL_PLANES: u32 = (1 << WIDTH) - 1;

#[inline(always)]
fn rows([x, y, z]: &[[f32; WIDTH]; 3]) -> [&[f32; WIDTH]; 3] {
    [x, y, z]
}

/// A tree, and the way up in it.
pub(crate) struct Climb<'a> {
    nodes: &'a [Node],
    blocks: &'a [TriangleBlock],
    /// Of each node and of each block, the node above; [`EMPTY`] for the root.
    above_nodes: Vec<u32>,
    above_blocks: Vec<u32>,
}

/// Room for the siblings along the deepest path.
const ROOM: usize = WIDTH * MAX_DEPTH;

/// Subtrees that are to be looked at, depth first, and for which planes, as bits.
struct Open {
    subtrees: [(ChildRef, u32); ROOM],
    count: usize,
}

impl Open {
    #[inline(always)]
    fn push(&mut self, child: ChildRef, planes: u32) {
        // On each level of the tree at most eight wait: there is room.
        self.subtrees[self.count] = (child, planes);
        self.count += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(ChildRef, u32)> {
        self.count = self.count.checked_sub(1)?;
        Some(self.subtrees[self.count])
    }
}

impl<'a> Climb<'a> {
    fn new(nodes: &'a [Node], blocks: &'a [TriangleBlock]) -> Self {
        let (mut above_nodes, mut above_blocks) = (vec![EMPTY; nodes.len()], vec![EMPTY; blocks.len()]);
        for (at, node) in (0u32..).zip(nodes) {
            for &child in node.children.iter().filter(|child| **child != EMPTY) {
                match child & LEAF {
                    0 => above_nodes[child as usize] = at,
                    _ => above_blocks[leaf_index(child)] = at,
                }
            }
        }
        Climb { nodes, blocks, above_nodes, above_blocks }
    }

    /// What lies behind both sides of each triangle of a block.
    #[inline(always)]
    pub fn behind_block(&self, m: impl Measure, block: usize) -> [[Children; 2]; WIDTH] {
        let (mut planes, mut known) = ([Plane::NOTHING; WIDTH], 0);
        for lane in 0..WIDTH {
            // Unused lanes have none.
            if let Some(plane) = Plane::of(self.blocks[block].triangle(lane)) {
                planes[lane] = plane;
                known |= 1 << lane;
            }
        }
        let mut open = Open { subtrees: [(EMPTY, 0); ROOM], count: 0 };
        let front = Sides::of(planes);
        let of_fronts = self.behind_sides(m, &front, known, block, &mut open);
        let of_backs = self.behind_sides(m, &front.turned(), known, block, &mut open);
        std::array::from_fn(|lane| [of_fronts[lane], of_backs[lane]])
    }

    /// Climbs from a block as long as nothing is above planes, those in `planes`. What is below one where that ends lies behind it.
    #[inline(always)]
    fn behind_sides(
        &self,
        m: impl Measure,
        sides: &Sides,
        planes: u32,
        block: usize,
        open: &mut Open,
    ) -> [Children; WIDTH] {
        let mut behind = [Children::NONE; WIDTH];
        let mut visits = MOST_VISITS;
        let (mut child, mut node) = (LEAF | block as u32, self.above_blocks[block]);
        let mut climbing = planes & !self.leaf_above(m, sides, block, planes);
        while node != EMPTY && climbing != 0 {
            let (here, above) = (&self.nodes[node as usize], self.above_nodes[node as usize]);
            // Of each child, below which planes it lies; those below which all do go on.
            let (mut below, mut on) = ([0; WIDTH], climbing);
            for slot in used_slots(here) {
                below[slot] = climbing;
                if here.children[slot] != child {
                    let maybe = climbing & m.box_above(&sides.columns, here.bounds(slot)).maybe;
                    below[slot] &=
                        !maybe | self.below(m, sides, here.children[slot], maybe, &mut visits, open);
                }
                on &= below[slot];
            }
            let ends = if above == EMPTY { climbing } else { climbing & !on };
            for lane in (0..WIDTH).filter(|lane| ends >> lane & 1 != 0) {
                let which = (0..WIDTH).fold(0, |which, slot| which | (below[slot] >> lane & 1) << slot);
                behind[lane] = Children::new(node, which);
            }
            (child, node, climbing) = (node, above, on);
        }
        behind
    }

    /// Of some planes, those above which nothing of a subtree is, as far as that can be seen with so many visits.
    #[inline(always)]
    fn below(
        &self,
        m: impl Measure,
        sides: &Sides,
        child: ChildRef,
        planes: u32,
        visits: &mut u32,
        open: &mut Open,
    ) -> u32 {
        let mut below = planes;
        open.count = 0;
        open.push(child, planes);
        while let Some((child, planes)) = open.pop() {
            let planes = planes & below;
            if planes == 0 {
                continue;
            }
            if *visits == 0 {
                return 0;
            }
            *visits -= 1;
            if child & LEAF != 0 {
                below &= !self.leaf_above(m, sides, leaf_index(child), planes);
                continue;
            }
            let node = &self.nodes[child as usize];
            for slot in used_slots(node) {
                let above = m.box_above(&sides.columns, node.bounds(slot));
                below &= !(above.surely & planes);
                if above.maybe & planes != 0 {
                    open.push(node.children[slot], above.maybe & planes);
                }
            }
        }
        below
    }

    /// Of some planes, those above which corners of a leaf's triangles are.
    #[inline(always)]
    fn leaf_above(&self, m: impl Measure, sides: &Sides, leaf: usize, planes: u32) -> u32 {
        let [a, b, c] = &self.blocks[leaf].vertices;
        let mut found = 0;
        for lane in (0..WIDTH).filter(|lane| planes >> lane & 1 != 0) {
            let plane = &sides.planes[lane];
            let above = m.above(plane, rows(a)) | m.above(plane, rows(b)) | m.above(plane, rows(c));
            found |= u32::from(above != 0) << lane;
        }
        found
    }
}

/// Places of a node's children.
#[inline(always)]
fn used_slots(node: &Node) -> impl Iterator<Item = usize> {
    (0..WIDTH).filter(|slot| node.children[*slot] != EMPTY)
}

#[cfg(test)]
mod tests;
