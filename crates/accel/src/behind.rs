//! What lies behind the triangles that rays leave.
//!
//! A ray that leaves a triangle stays on the side of the triangle's plane to which it goes. Whatever lies wholly on the other side it
//! cannot meet. Around each triangle that is often much: a ray that is reflected by a sphere, a bottle or the corner of a box begins
//! amidst the boxes of its neighbours, walks down through all of them, and none of those neighbours can be in its way. So for each
//! triangle and each of its sides it is found out once which subtrees around it lie behind; rays that say which side of which triangle
//! they leave ([`crate::RayColumns::leaving`]) are not tested with those.
//!
//! This changes no answer: rays start a little above the surface that they leave, by more than what counts as behind may stick out.

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

/// Nodes and leaves that are looked at for the triangles of a block at most, for all of them together. Most need few; where planes cut
/// through everything, it would be all.
const MOST_VISITS: u32 = 512;

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

    fn turned(self) -> Plane {
        Plane { normal: self.normal.map(|x| -x), ..self }
    }
}

/// Which of eight points are above a plane. Each number is rounded by itself, so that all kernels find the same.
pub(crate) trait Measure: Copy {
    /// Points, by coordinate and lane, whose height may be above the plane's tolerance, as bits: if `surely`, only those where it is above
    /// in spite of all rounding. Not where coordinates are not numbers.
    fn above(self, plane: &Plane, points: [&[f32; WIDTH]; 3], surely: bool) -> u32;
}

/// Lane by lane.
#[derive(Clone, Copy)]
pub(crate) struct OneByOne;

impl Measure for OneByOne {
    fn above(self, plane: &Plane, points: [&[f32; WIDTH]; 3], surely: bool) -> u32 {
        let error = if surely { -ERROR } else { ERROR };
        let is_above = |lane: usize| {
            let part = |axis: usize| plane.normal[axis] * (points[axis][lane] - plane.point[axis]);
            let [x, y, z] = [part(0), part(1), part(2)];
            (x + y + z) + error * (x.abs() + y.abs() + z.abs()) > plane.tolerance
        };
        (0..WIDTH).fold(0, |bits, lane| bits | u32::from(is_above(lane)) << lane)
    }
}

/// All lanes at once.
#[derive(Clone, Copy)]
pub(crate) struct AllAtOnce<S>(pub S);

impl<S: Simd> Measure for AllAtOnce<S> {
    #[inline(always)]
    fn above(self, plane: &Plane, points: [&[f32; WIDTH]; 3], surely: bool) -> u32 {
        let s = self.0;
        let (mut height, mut size) = (s.splat(0.0), s.splat(0.0));
        for axis in 0..3 {
            let away = s.sub(s.load(points[axis]), s.splat(plane.point[axis]));
            let part = s.mul(s.splat(plane.normal[axis]), away);
            let magnitude = s.max(part, s.sub(s.splat(0.0), part));
            (height, size) =
                if axis == 0 { (part, magnitude) } else { (s.add(height, part), s.add(size, magnitude)) };
        }
        let error = s.splat(if surely { -ERROR } else { ERROR });
        s.bits(s.lt(s.splat(plane.tolerance), s.add(height, s.mul(error, size))))
    }
}

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

/// Subtrees that are to be looked at, depth first.
struct Open {
    children: [ChildRef; ROOM],
    count: usize,
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
        let mut behind = [[Children::NONE; 2]; WIDTH];
        let mut open = Open { children: [EMPTY; ROOM], count: 0 };
        let mut visits = MOST_VISITS;
        for lane in 0..WIDTH {
            // Unused lanes have none.
            let Some(plane) = Plane::of(self.blocks[block].triangle(lane)) else { continue };
            for (side, behind) in behind[lane].iter_mut().enumerate() {
                let plane = if side == 0 { plane } else { plane.turned() };
                *behind = self.behind_plane(m, &plane, block, &mut visits, &mut open);
            }
        }
        behind
    }

    /// Climbs from a block as long as nothing is above a plane. What is below it where that ends lies behind.
    #[inline(always)]
    fn behind_plane(
        &self,
        m: impl Measure,
        plane: &Plane,
        block: usize,
        visits: &mut u32,
        open: &mut Open,
    ) -> Children {
        let (mut child, mut node) = (LEAF | block as u32, self.above_blocks[block]);
        let mut behind = Children::NONE;
        if !self.is_below(m, plane, child, visits, open) {
            return behind;
        }
        while node != EMPTY {
            let children = &self.nodes[node as usize].children;
            let used = self.nodes[node as usize].used();
            let mut higher = self.higher_children(m, plane, node);
            let mut below = used & !higher;
            while higher != 0 {
                let slot = higher.trailing_zeros() as usize % WIDTH;
                higher &= higher - 1;
                let known = children[slot] == child;
                if known || self.is_below(m, plane, children[slot], visits, open) {
                    below |= 1 << slot;
                }
            }
            behind = Children::new(node, below);
            if below != used {
                break;
            }
            (child, node) = (node, self.above_nodes[node as usize]);
        }
        behind
    }

    /// Places of a node's children whose boxes reach above a plane, as bits.
    #[inline(always)]
    fn higher_children(&self, m: impl Measure, plane: &Plane, node: u32) -> u32 {
        let node = &self.nodes[node as usize];
        let [x, y, z] = [0, 1, 2].map(|axis: usize| usize::from(plane.normal[axis] >= 0.0));
        // Unused boxes are inverted: what would be their highest corner is as far below as can be.
        m.above(plane, [&node.planes[0][x], &node.planes[1][y], &node.planes[2][z]], false)
    }

    /// Whether the lowest corner of a child's box is above a plane: then so is all that is in it. As bits, by place.
    #[inline(always)]
    fn wholly_above(&self, m: impl Measure, plane: &Plane, node: u32) -> u32 {
        let planes = &self.nodes[node as usize].planes;
        let [x, y, z] = [0, 1, 2].map(|axis: usize| usize::from(plane.normal[axis] < 0.0));
        m.above(plane, [&planes[0][x], &planes[1][y], &planes[2][z]], true)
    }

    /// Whether nothing of a subtree is above a plane, as far as that can be seen with so many visits.
    #[inline(always)]
    fn is_below(
        &self,
        m: impl Measure,
        plane: &Plane,
        child: ChildRef,
        visits: &mut u32,
        open: &mut Open,
    ) -> bool {
        open.children[0] = child;
        open.count = 1;
        while open.count > 0 {
            if *visits == 0 {
                return false;
            }
            *visits -= 1;
            open.count -= 1;
            let child = open.children[open.count];
            if child & LEAF != 0 {
                let [a, b, c] = &self.blocks[leaf_index(child)].vertices;
                let above = m.above(plane, rows(a), false) | m.above(plane, rows(b), false);
                if above | m.above(plane, rows(c), false) != 0 {
                    return false;
                }
                continue;
            }
            let children = &self.nodes[child as usize].children;
            let mut higher = self.higher_children(m, plane, child);
            if higher != 0 && higher & self.wholly_above(m, plane, child) != 0 {
                return false;
            }
            while higher != 0 {
                // On each level of the tree at most eight wait: there is room.
                open.children[open.count] = children[higher.trailing_zeros() as usize];
                open.count += 1;
                higher &= higher - 1;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests;
