//! Origin-plane culling.
//!
//! A ray that starts on a triangle stays on one side of the triangle's plane. It cannot hit
//! anything that lies completely on the other side. For each side of each triangle, [`build_table`]
//! finds children of a node on the way from the triangle to the root that lie below the plane.
//! Streams of rays that carry their [`OriginSide`](crate::OriginSide) skip those children.
//!
//! Hits do not change: rays start farther above the surface than culled geometry may reach.

use crate::aabb::Aabb;
use crate::bvh::{CulledChildren, CullingTable, MAX_NODES, MAX_TRIANGLES};
use crate::layout::{ChildRef, EMPTY, LEAF, MAX_DEPTH, NO_PRIMITIVE, Node, TriangleBlock, WIDTH, leaf_index};
use crate::simd::Simd;
use rayon::prelude::*;

/// The culled children for both sides of each triangle of a block.
pub(super) type BlockSides = [[CulledChildren; 2]; WIDTH];

/// Builds the table of a tree over `triangles` triangles. It is empty if ids are not
/// `0..triangles`. `find_block` computes the entries of a block with [`BottomUpTree::find_block`].
pub(super) fn build_table(
    nodes: &[Node],
    blocks: &[TriangleBlock],
    triangles: usize,
    find_block: impl Fn(&BottomUpTree, usize) -> BlockSides + Sync,
) -> CullingTable {
    let mut ids = blocks.iter().flat_map(|block| block.ids).filter(|id| *id != NO_PRIMITIVE);
    let is_large = triangles > MAX_TRIANGLES || nodes.len() > MAX_NODES;
    if is_large || ids.any(|id| id as usize >= triangles) {
        return CullingTable::EMPTY;
    }
    let tree = BottomUpTree::new(nodes, blocks);
    let all = (0..blocks.len()).into_par_iter().with_min_len(64);
    let found: Vec<BlockSides> = all.map(|block| find_block(&tree, block)).collect();
    let mut table = vec![CulledChildren::NONE; 2 * triangles];
    for (block, found) in blocks.iter().zip(&found) {
        for (id, found) in block.ids.iter().zip(found).filter(|(id, _)| **id != NO_PRIMITIVE) {
            table[2 * *id as usize..][..2].copy_from_slice(found);
        }
    }
    CullingTable(table)
}

/// How far culled geometry may reach above a triangle's plane, relative to the largest magnitude of
/// a coordinate of the triangle: slightly less than the offset of ray origins. It is not zero
/// because corners of planar surfaces are rounded.
const TOLERANCE: f32 = 0.875 / (1 << 22) as f32;

/// Relative error of a height above a plane: of the normal, a difference, a product and the sums.
const ERROR: f32 = 4.0 * f32::EPSILON;

/// Most nodes and leaves that are visited for one side of a block's triangles. Most need few;
/// planes through the whole scene would need all.
const MAX_VISITS: u32 = 1024;

/// The plane of a triangle's side.
#[derive(Clone, Copy)]
pub(crate) struct OriginPlane {
    pub point: [f32; 3],
    /// Unit length, to the side of the ray.
    pub normal: [f32; 3],
    /// Heights up to this do not count as above.
    pub tolerance: f32,
}

impl OriginPlane {
    /// The front side of a triangle; `None` if its normal is undefined.
    fn of([a, b, c]: [[f32; 3]; 3]) -> Option<OriginPlane> {
        let edge = |p: [f32; 3]| [0, 1, 2].map(|k: usize| f64::from(p[k]) - f64::from(a[k]));
        let (p, q) = (edge(b), edge(c));
        let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        let largest = [a, b, c].as_flattened().iter().fold(0.0f32, |m, x| m.max(x.abs()));
        (length > 0.0 && length.is_finite()).then(|| OriginPlane {
            point: a,
            normal: n.map(|x| (x / length) as f32),
            tolerance: TOLERANCE * largest,
        })
    }

    /// The plane of an unused lane.
    const NOTHING: OriginPlane = OriginPlane { point: [0.0; 3], normal: [0.0; 3], tolerance: 0.0 };

    fn turned(self) -> OriginPlane {
        OriginPlane { normal: self.normal.map(|x| -x), ..self }
    }
}

/// The planes of one side of a block's triangles.
struct BlockPlanes {
    planes: [OriginPlane; WIDTH],
    columns: PlaneLanes,
}

/// Planes, by coordinate and lane.
pub(crate) struct PlaneLanes {
    point: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    tolerance: [f32; WIDTH],
}

impl BlockPlanes {
    fn of(planes: [OriginPlane; WIDTH]) -> BlockPlanes {
        let columns = PlaneLanes {
            point: [0, 1, 2].map(|axis: usize| planes.map(|plane| plane.point[axis])),
            normal: [0, 1, 2].map(|axis: usize| planes.map(|plane| plane.normal[axis])),
            tolerance: planes.map(|plane| plane.tolerance),
        };
        BlockPlanes { planes, columns }
    }

    fn turned(&self) -> BlockPlanes {
        BlockPlanes::of(self.planes.map(OriginPlane::turned))
    }
}

/// Which of eight planes a box reaches above, as masks.
#[derive(Clone, Copy)]
pub(crate) struct BoxAbove {
    /// A corner of the box may be above, within rounding.
    maybe: u32,
    /// A whole side of the box is above. A primitive in the box touches that side, so it is above,
    /// too.
    surely: u32,
}

/// Tests against planes. Every operation is rounded separately, so that all instruction sets agree.
pub(crate) trait PlaneTest: Copy {
    /// Mask of the points, by coordinate and lane, that may be above a plane within rounding. NaN
    /// is not above.
    fn above(self, plane: &OriginPlane, points: [&[f32; WIDTH]; 3]) -> u32;

    /// Which planes a box, not empty, reaches above. Overflow counts as above.
    fn box_above(self, planes: &PlaneLanes, bounds: Aabb) -> BoxAbove;
}

/// One lane at a time.
#[derive(Clone, Copy)]
pub(crate) struct ScalarLanes;

impl PlaneTest for ScalarLanes {
    fn above(self, plane: &OriginPlane, points: [&[f32; WIDTH]; 3]) -> u32 {
        let is_above = |lane: usize| {
            let part = |axis: usize| plane.normal[axis] * (points[axis][lane] - plane.point[axis]);
            let [x, y, z] = [part(0), part(1), part(2)];
            (x + y + z) + ERROR * (x.abs() + y.abs() + z.abs()) > plane.tolerance
        };
        (0..WIDTH).fold(0, |bits, lane| bits | u32::from(is_above(lane)) << lane)
    }

    fn box_above(self, planes: &PlaneLanes, bounds: Aabb) -> BoxAbove {
        // As vector instructions treat NaN.
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

/// All lanes with SIMD.
#[derive(Clone, Copy)]
pub(crate) struct SimdLanes<S>(pub S);

impl<S: Simd> SimdLanes<S> {
    /// The sum of the three terms of a height, plus its rounding error.
    #[inline(always)]
    fn height(self, [x, y, z]: [S::F; 3]) -> S::F {
        let s = self.0;
        let magnitude = |part: S::F| s.flip_sign(part, part);
        let size = s.add(s.add(magnitude(x), magnitude(y)), magnitude(z));
        s.add(s.add(s.add(x, y), z), s.mul(s.splat(ERROR), size))
    }
}

impl<S: Simd> PlaneTest for SimdLanes<S> {
    #[inline(always)]
    fn above(self, plane: &OriginPlane, points: [&[f32; WIDTH]; 3]) -> u32 {
        let s = self.0;
        let part = |axis: usize| {
            s.mul(s.splat(plane.normal[axis]), s.sub(s.load(points[axis]), s.splat(plane.point[axis])))
        };
        s.bits(s.lt(s.splat(plane.tolerance), self.height([part(0), part(1), part(2)])))
    }

    #[inline(always)]
    fn box_above(self, planes: &PlaneLanes, bounds: Aabb) -> BoxAbove {
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

/// The mask of all planes.
const ALL_PLANES: u32 = (1 << WIDTH) - 1;

#[inline(always)]
fn rows([x, y, z]: &[[f32; WIDTH]; 3]) -> [&[f32; WIDTH]; 3] {
    [x, y, z]
}

/// A tree with links from children to parents.
pub(crate) struct BottomUpTree<'a> {
    nodes: &'a [Node],
    blocks: &'a [TriangleBlock],
    /// Parents of nodes and of blocks; [`EMPTY`] for the root.
    node_parents: Vec<u32>,
    block_parents: Vec<u32>,
}

/// Room for the siblings along the deepest path.
const STACK_SIZE: usize = WIDTH * MAX_DEPTH;

/// The stack of subtrees to visit, each with a mask of planes.
struct Open {
    subtrees: [(ChildRef, u32); STACK_SIZE],
    count: usize,
}

impl Open {
    #[inline(always)]
    fn push(&mut self, child: ChildRef, planes: u32) {
        // At most eight entries for each level of the tree: they fit.
        self.subtrees[self.count] = (child, planes);
        self.count += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(ChildRef, u32)> {
        self.count = self.count.checked_sub(1)?;
        Some(self.subtrees[self.count])
    }
}

impl<'a> BottomUpTree<'a> {
    fn new(nodes: &'a [Node], blocks: &'a [TriangleBlock]) -> Self {
        let (mut node_parents, mut block_parents) = (vec![EMPTY; nodes.len()], vec![EMPTY; blocks.len()]);
        for (at, node) in (0u32..).zip(nodes) {
            for &child in node.children.iter().filter(|child| **child != EMPTY) {
                match child & LEAF {
                    0 => node_parents[child as usize] = at,
                    _ => block_parents[leaf_index(child)] = at,
                }
            }
        }
        BottomUpTree { nodes, blocks, node_parents, block_parents }
    }

    /// The culled children for both sides of each triangle of a block.
    #[inline(always)]
    pub fn find_block(&self, m: impl PlaneTest, block: usize) -> [[CulledChildren; 2]; WIDTH] {
        let (mut planes, mut known) = ([OriginPlane::NOTHING; WIDTH], 0);
        for lane in 0..WIDTH {
            // Unused lanes have none.
            if let Some(plane) = OriginPlane::of(self.blocks[block].triangle(lane)) {
                planes[lane] = plane;
                known |= 1 << lane;
            }
        }
        let mut open = Open { subtrees: [(EMPTY, 0); STACK_SIZE], count: 0 };
        let front = BlockPlanes::of(planes);
        let of_fronts = self.find_sides(m, &front, known, block, &mut open);
        let of_backs = self.find_sides(m, &front.turned(), known, block, &mut open);
        std::array::from_fn(|lane| [of_fronts[lane], of_backs[lane]])
    }

    /// Goes from a block towards the root for as long as everything below the node is below a
    /// plane. At the node where that ends, the children that are below the plane are culled.
    #[inline(always)]
    fn find_sides(
        &self,
        m: impl PlaneTest,
        sides: &BlockPlanes,
        planes: u32,
        block: usize,
        open: &mut Open,
    ) -> [CulledChildren; WIDTH] {
        let mut behind = [CulledChildren::NONE; WIDTH];
        let mut visits = MAX_VISITS;
        let (mut child, mut node) = (LEAF | block as u32, self.block_parents[block]);
        let mut climbing = planes & !self.leaf_above(m, sides, block, planes);
        while node != EMPTY && climbing != 0 {
            let (here, above) = (&self.nodes[node as usize], self.node_parents[node as usize]);
            // For each child, the planes that it is below. Planes with all children below go on.
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
                behind[lane] = CulledChildren::new(node, which);
            }
            (child, node, climbing) = (node, above, on);
        }
        behind
    }

    /// The planes that a subtree is below, as far as `visits` suffice to tell.
    #[inline(always)]
    fn below(
        &self,
        m: impl PlaneTest,
        sides: &BlockPlanes,
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

    /// The planes that a corner of a leaf's triangles is above.
    #[inline(always)]
    fn leaf_above(&self, m: impl PlaneTest, sides: &BlockPlanes, leaf: usize, planes: u32) -> u32 {
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

/// Slots of a node's children.
#[inline(always)]
fn used_slots(node: &Node) -> impl Iterator<Item = usize> {
    (0..WIDTH).filter(|slot| node.children[*slot] != EMPTY)
}

#[cfg(test)]
mod tests;
