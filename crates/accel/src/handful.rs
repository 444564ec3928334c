//! A handful of triangles as rays in lanes are tested with it: corners that are shared are there once, and triangles that
//! share an edge are tested together.
//!
//! Those that lie in a side of the object's bounds, as walls, floors and ceilings do, come last: whoever goes from one point within
//! the bounds to another does not cross them.

use crate::aabb::Aabb;
use crate::layout::{ChildRef, EMPTY, LEAF, NO_PRIMITIVE, Node, TriangleBlock, WIDTH, leaf_index};

/// Most triangles of an object that are tested one after the other. Measured: with more, walking a tree is faster.
const MAX_TRIANGLES: usize = 96;

/// Most triangles of a larger object's root that are tested so. A ray meets the boxes of many of them anyway.
const MAX_ROOT_TRIANGLES: usize = 32;

/// Most corners: room for them is made for every stream.
pub(crate) const MAX_CORNERS: usize = 128;

/// All children of a node, as bits of their places.
pub(crate) const ALL_CHILDREN: u32 = (1 << WIDTH) - 1;

/// A few triangles.
pub(crate) struct Handful {
    pub corners: Vec<[f32; 3]>,
    /// Those that lie in sides of the object's bounds are the last ones.
    pub faces: Vec<Face>,
    /// The faces that do not.
    pub inner: Share,
    /// Children of the root, as bits of their places, that hold these triangles and nothing else.
    pub children: u32,
}

/// So many of the first faces, and so many of the first corners, among which are all of theirs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Share {
    pub faces: usize,
    pub corners: usize,
}

/// The number of one of at most [`MAX_CORNERS`] corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Corner(u8);

impl Corner {
    fn new(number: usize) -> Option<Corner> {
        (number < MAX_CORNERS).then_some(Corner(number as u8))
    }

    /// What `all` has at this place.
    #[inline(always)]
    pub fn at<T>(self, all: &[T; MAX_CORNERS]) -> &T {
        // SAFETY: a `Corner` is made for numbers below `MAX_CORNERS` only.
        unsafe { all.get_unchecked(usize::from(self.0)) }
    }
}

/// One triangle, or two that share an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Face {
    /// The corners a, b, c and d: the triangles are abc and acd. Where there is no second triangle, d is a.
    pub corners: [Corner; 4],
    /// Ids of the triangles.
    pub ids: [u32; 2],
    /// Which corner of its triangle, in the order in which it was given, a is.
    pub first: [u8; 2],
}

/// A triangle by the numbers of its corners.
struct Triangle {
    corners: [Corner; 3],
    id: u32,
}

impl Handful {
    /// All triangles of an object, if they are few, or else those of leaves right below its root, the largest first, up to a few.
    pub fn new(nodes: &[Node], root: ChildRef, blocks: &[TriangleBlock], bounds: &Aabb) -> Handful {
        if blocks.len() <= MAX_TRIANGLES
            && let Some(all) = Handful::of(blocks.iter(), MAX_TRIANGLES, ALL_CHILDREN, bounds)
        {
            return all;
        }
        let mut handful =
            Handful { corners: Vec::new(), faces: Vec::new(), inner: Share::default(), children: 0 };
        let Some(root) = nodes.get(root as usize) else { return handful };
        let is_leaf = |slot: &usize| root.children[*slot] != EMPTY && root.children[*slot] & LEAF != 0;
        let mut leaves: Vec<usize> = (0..WIDTH).filter(is_leaf).collect();
        let area = |slot: usize| root.bounds(slot).half_area();
        leaves.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
        for count in 1..=leaves.len() {
            let first = &leaves[..count];
            let children = first.iter().fold(0, |bits, slot| bits | 1 << slot);
            let blocks = first.iter().map(|&slot| &blocks[leaf_index(root.children[slot])]);
            match Handful::of(blocks, MAX_ROOT_TRIANGLES, children, bounds) {
                Some(more) => handful = more,
                None => break,
            }
        }
        handful
    }

    /// Whether there are no other triangles.
    pub fn is_all(&self) -> bool {
        self.children == ALL_CHILDREN
    }

    /// The triangles of some blocks, if they are at most so many.
    fn of<'b>(
        blocks: impl Iterator<Item = &'b TriangleBlock>,
        most: usize,
        children: u32,
        bounds: &Aabb,
    ) -> Option<Handful> {
        let lanes = blocks.flat_map(|block| (0..WIDTH).map(move |lane| (block, lane)));
        let lanes = lanes.filter(|(block, lane)| block.ids[*lane] != NO_PRIMITIVE);
        let mut corners: Vec<[f32; 3]> = Vec::new();
        let mut triangles: Vec<Triangle> = Vec::new();
        for (block, lane) in lanes {
            let id = block.ids[lane];
            if triangles.iter().any(|t| t.id == id) {
                // Parts of a triangle may be in several blocks, each with the whole of it.
                continue;
            }
            let numbers = block.triangle(lane).map(|corner| {
                let same = |other: &[f32; 3]| other.map(f32::to_bits) == corner.map(f32::to_bits);
                corners.iter().position(same).unwrap_or_else(|| {
                    corners.push(corner);
                    corners.len() - 1
                })
            });
            if triangles.len() == most {
                return None;
            }
            let [a, b, c] = numbers.map(Corner::new);
            triangles.push(Triangle { corners: [a?, b?, c?], id });
        }
        let mut handful = Handful { corners, faces: faces(triangles), inner: Share::default(), children };
        handful.put_inner_first(bounds);
        Some(handful)
    }

    /// Moves faces in the sides of the bounds to the end, and the corners of all others to the beginning.
    fn put_inner_first(&mut self, bounds: &Aabb) {
        let points = |face: &Face| face.corners.map(|corner| self.corners[usize::from(corner.0)]);
        let (inner, outer): (Vec<Face>, Vec<Face>) =
            self.faces.iter().partition(|face| !is_in_a_side(&points(face), bounds));
        self.inner.faces = inner.len();
        // The old numbers of the corners, in their new order.
        let mut order: Vec<Corner> = Vec::new();
        for (number, face) in inner.iter().chain(&outer).enumerate() {
            for corner in face.corners {
                if !order.contains(&corner) {
                    order.push(corner);
                }
            }
            if number < inner.len() {
                self.inner.corners = order.len();
            }
        }
        let renumbered = |corner: Corner| {
            let number = order.iter().position(|old| *old == corner).expect("all have been entered");
            Corner::new(number).expect("there are no more than before")
        };
        let faces = inner.into_iter().chain(outer);
        self.faces = faces.map(|face| Face { corners: face.corners.map(renumbered), ..face }).collect();
        self.corners = order.iter().map(|old| self.corners[usize::from(old.0)]).collect();
    }

    /// Bytes of memory that this occupies.
    pub fn memory_bytes(&self) -> usize {
        self.corners.capacity() * size_of::<[f32; 3]>() + self.faces.capacity() * size_of::<Face>()
    }
}

/// Whether some points lie in one of the sides of a box.
fn is_in_a_side(points: &[[f32; 3]], bounds: &Aabb) -> bool {
    (0..3).any(|axis| {
        [bounds.min, bounds.max].iter().any(|side| points.iter().all(|point| point[axis] == side[axis]))
    })
}

/// Pairs triangles, each with the first one behind it that it can be paired with.
fn faces(mut triangles: Vec<Triangle>) -> Vec<Face> {
    let mut faces = Vec::new();
    while !triangles.is_empty() {
        let first = triangles.remove(0);
        let found = triangles.iter().enumerate().find_map(|(i, second)| Some((i, paired(&first, second)?)));
        faces.push(match found {
            Some((i, face)) => {
                triangles.remove(i);
                face
            }
            None => {
                let [a, b, c] = first.corners;
                Face { corners: [a, b, c, a], ids: [first.id, NO_PRIMITIVE], first: [0; 2] }
            }
        });
    }
    faces
}

/// The face of two triangles, if they share an edge and go around it in opposite directions, as neighbours do.
fn paired(first: &Triangle, second: &Triangle) -> Option<Face> {
    let turned = |corners: [Corner; 3], turn: usize| [0, 1, 2].map(|i: usize| corners[(i + turn) % 3]);
    let turns = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
    turns.into_iter().find_map(|(i, j)| {
        let ([a, b, c], [a2, c2, d]) = (turned(first.corners, i), turned(second.corners, j));
        // Turned so far, the corner that was given first is the last but so many.
        let face = Face { corners: [a, b, c, d], ids: [first.id, second.id], first: [i as u8, j as u8] };
        ((a, c) == (a2, c2)).then_some(face)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::Block;

    fn block(triangles: &[[[f32; 3]; 3]], first_id: u32) -> TriangleBlock {
        let mut block = TriangleBlock::EMPTY;
        for (lane, triangle) in triangles.iter().enumerate() {
            block.set_triangle(lane, triangle);
            block.ids[lane] = first_id + lane as u32;
        }
        block
    }

    fn all(blocks: &[TriangleBlock]) -> Option<Handful> {
        let bounds = blocks.iter().fold(Aabb::EMPTY, |all, block| all.union(block.bounds()));
        let handful = Handful::new(&[], LEAF, blocks, &bounds);
        handful.is_all().then_some(handful)
    }

    #[test]
    fn neighbours_are_tested_together() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]];
        let handful = all(&[block(&[[b, c, a], [d, a, c]], 5)]).expect("few enough");
        assert_eq!(handful.corners.len(), 4);
        let [face] = handful.faces[..] else { panic!("{:?}", handful.faces) };
        let corners = face.corners.map(|c| handful.corners[usize::from(c.0)]);
        assert_eq!((corners, face.ids), ([a, b, c, d], [5, 6]));
        // a is the third of b, c, a and the second of d, a, c.
        assert_eq!(face.first, [2, 1]);
    }

    /// A floor, a wall, and a table between them whose corners come first.
    #[test]
    fn what_lies_in_the_sides_of_the_bounds_comes_last() {
        let quad = |a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]| [[a, b, c], [a, c, d]];
        let floor = quad([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 4.0], [0.0, 0.0, 4.0]);
        let table = quad([1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [2.0, 1.0, 2.0], [1.0, 1.0, 2.0]);
        let wall = quad([4.0, 0.0, 0.0], [4.0, 3.0, 0.0], [4.0, 3.0, 4.0], [4.0, 0.0, 4.0]);
        let handful = all(&[block(&[floor, table, wall].concat(), 0)]).expect("few enough");
        assert_eq!((handful.faces.len(), handful.corners.len()), (3, 10));
        assert_eq!(handful.inner, Share { faces: 1, corners: 4 });
        assert_eq!(handful.faces.iter().map(|face| face.ids).collect::<Vec<_>>(), [[2, 3], [0, 1], [4, 5]]);
        for (face, quad) in handful.faces.iter().zip([table, floor, wall]) {
            let [a, b, c, d] = face.corners.map(|corner| handful.corners[usize::from(corner.0)]);
            assert_eq!([[a, b, c], [a, c, d]], quad);
        }
        assert!(handful.faces[0].corners.iter().all(|corner| usize::from(corner.0) < handful.inner.corners));
    }

    #[test]
    fn strangers_and_neighbours_of_the_other_winding_stay_alone() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]];
        let handful = all(&[block(&[[a, b, c], [a, d, c]], 0)]).expect("few enough");
        assert_eq!(handful.faces.len(), 2);
        for face in &handful.faces {
            assert_eq!(face.ids[1], NO_PRIMITIVE);
            assert_eq!(face.corners[3], face.corners[0]);
        }
    }

    #[test]
    fn many_are_no_handful() {
        let triangle = |i: usize| [[i as f32, 0.0, 0.0], [i as f32, 1.0, 0.0], [i as f32, 0.0, 1.0]];
        let blocks = |n: usize| -> Vec<TriangleBlock> {
            (0..n)
                .step_by(8)
                .map(|i| block(&[0, 1, 2, 3, 4, 5, 6, 7].map(|k| triangle(i + k)), i as u32))
                .collect()
        };
        assert!(all(&blocks(40)).is_some());
        // 48 triangles of three corners each.
        assert!(all(&blocks(48)).is_none());
        assert!(all(&blocks(104)).is_none());
    }

    #[test]
    fn of_many_the_largest_at_the_root_are_taken() {
        let triangle =
            |i: usize, size: f32| [[i as f32, 0.0, 0.0], [i as f32, size, 0.0], [i as f32, 0.0, size]];
        // Leaves of eight, each larger than the one before, and one child that is no leaf.
        let leaf = |n: usize| {
            block(&[0, 1, 2, 3, 4, 5, 6, 7].map(|k| triangle(8 * n + k, 1.0 + n as f32)), 8 * n as u32)
        };
        let blocks: Vec<TriangleBlock> = (0..20).map(leaf).collect();
        let mut root = Node::EMPTY;
        for slot in 0..7 {
            root.set_bounds(slot, &blocks[slot].bounds());
            root.children[slot] = if slot == 5 { 1 } else { LEAF | slot as u32 };
        }
        let handful = Handful::new(&[root, Node::EMPTY], 0, &blocks, &Aabb::EMPTY);
        assert!(!handful.is_all());
        assert_eq!(handful.children, 0b101_1100, "four leaves of eight");
        let mut ids: Vec<u32> =
            handful.faces.iter().flat_map(|face| face.ids).filter(|id| *id != NO_PRIMITIVE).collect();
        ids.sort();
        let expected: Vec<u32> = [2, 3, 4, 6].into_iter().flat_map(|n| 8 * n..8 * n + 8).collect();
        assert_eq!(ids, expected);
    }
}
