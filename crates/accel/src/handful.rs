//! A handful of triangles as rays in lanes are tested with it: those that share an edge in one plane are tested together.
//!
//! Those that lie in a side of the object's bounds, as walls, floors and ceilings do, come last: whoever goes from one point within
//! the bounds to another does not cross them.

use crate::aabb::Aabb;
use crate::face::{Face, Named};
use crate::layout::{ChildRef, EMPTY, LEAF, NO_PRIMITIVE, Node, TriangleBlock, WIDTH, leaf_index};

/// Most triangles of an object that are tested one after the other. Measured: with more, walking a tree is faster.
const MAX_TRIANGLES: usize = 96;

/// Most triangles of a larger object's root that are tested so. A ray meets the boxes of many of them anyway.
const MAX_ROOT_TRIANGLES: usize = 32;

/// All children of a node, as bits of their places.
pub(crate) const ALL_CHILDREN: u32 = (1 << WIDTH) - 1;

/// A few triangles.
pub(crate) struct Handful {
    /// Those that lie in sides of the object's bounds are the last ones.
    pub faces: Vec<Face>,
    /// How many do not.
    pub inner: usize,
    /// The triangles of each face, and a last one that is none.
    pub triangles: Vec<Named>,
    /// Children of the root, as bits of their places, that hold these triangles and nothing else.
    pub children: u32,
}

/// A triangle as it was given.
struct Triangle {
    corners: [[f32; 3]; 3],
    id: u32,
}

/// A face with what it was made of.
struct Part {
    face: Face,
    triangles: [Named; 2],
    in_a_side: bool,
}

impl Handful {
    /// All triangles of an object, if they are few, or else those of leaves right below its root, the largest first, up to a few.
    pub fn new(nodes: &[Node], root: ChildRef, blocks: &[TriangleBlock], bounds: &Aabb) -> Handful {
        if blocks.len() <= MAX_TRIANGLES
            && let Some(all) = Handful::of(blocks.iter(), MAX_TRIANGLES, ALL_CHILDREN, bounds)
        {
            return all;
        }
        let mut handful = Handful { faces: Vec::new(), inner: 0, triangles: vec![Named::NONE], children: 0 };
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

    /// The triangles of some blocks, if they are at most so many and all can be tested so.
    fn of<'b>(
        blocks: impl Iterator<Item = &'b TriangleBlock>,
        most: usize,
        children: u32,
        bounds: &Aabb,
    ) -> Option<Handful> {
        let lanes = blocks.flat_map(|block| (0..WIDTH).map(move |lane| (block, lane)));
        let mut triangles: Vec<Triangle> = Vec::new();
        for (block, lane) in lanes.filter(|(block, lane)| block.ids[*lane] != NO_PRIMITIVE) {
            let id = block.ids[lane];
            if triangles.iter().any(|t| t.id == id) {
                // Parts of a triangle may be in several blocks, each with the whole of it.
                continue;
            }
            if triangles.len() == most {
                return None;
            }
            triangles.push(Triangle { corners: block.triangle(lane), id });
        }
        let (outer, inner): (Vec<Part>, Vec<Part>) =
            parts(triangles, bounds)?.into_iter().partition(|part| part.in_a_side);
        let all = || inner.iter().chain(&outer);
        Some(Handful {
            faces: all().map(|part| part.face).collect(),
            inner: inner.len(),
            triangles: all().flat_map(|part| part.triangles).chain([Named::NONE]).collect(),
            children,
        })
    }

    /// Bytes of memory that this occupies.
    pub fn memory_bytes(&self) -> usize {
        self.faces.capacity() * size_of::<Face>() + self.triangles.capacity() * size_of::<Named>()
    }
}

/// Whether some points lie in one of the sides of a box.
fn is_in_a_side<const N: usize>(points: &[[f32; 3]; N], bounds: &Aabb) -> bool {
    (0..3).any(|axis| {
        [bounds.min, bounds.max].iter().any(|side| points.iter().all(|point| point[axis] == side[axis]))
    })
}

/// Faces of each triangle with the first one behind it that it can be paired with, or alone. `None` if one can be neither.
fn parts(mut triangles: Vec<Triangle>, bounds: &Aabb) -> Option<Vec<Part>> {
    let size = (0..3).map(|axis| bounds.max[axis] - bounds.min[axis]).fold(0.0, f32::max);
    let mut parts = Vec::new();
    while !triangles.is_empty() {
        let first = triangles.remove(0);
        let found = triangles
            .iter()
            .enumerate()
            .find_map(|(i, second)| Some((i, paired(&first, second, bounds, size)?)));
        parts.push(match found {
            Some((i, part)) => {
                triangles.remove(i);
                part
            }
            None => Part {
                face: Face::new(first.corners, None, size)?,
                triangles: [Named { id: first.id, first: 0.0 }, Named::NONE],
                in_a_side: is_in_a_side(&first.corners, bounds),
            },
        });
    }
    Some(parts)
}

/// The face of two triangles, if they share an edge, go around it in opposite directions, as neighbours do, and are flat and convex.
fn paired(first: &Triangle, second: &Triangle, bounds: &Aabb, size: f32) -> Option<Part> {
    let turned = |corners: [[f32; 3]; 3], turn: usize| [0, 1, 2].map(|i: usize| corners[(i + turn) % 3]);
    let same = |x: [f32; 3], y: [f32; 3]| x.map(f32::to_bits) == y.map(f32::to_bits);
    let turns = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
    turns.into_iter().find_map(|(i, j)| {
        let ([a, b, c], [a2, c2, d]) = (turned(first.corners, i), turned(second.corners, j));
        if !same(a, a2) || !same(c, c2) {
            return None;
        }
        Some(Part {
            face: Face::new([a, b, c], Some(d), size)?,
            triangles: [Named { id: first.id, first: i as f32 }, Named { id: second.id, first: j as f32 }],
            in_a_side: is_in_a_side(&[a, b, c, d], bounds),
        })
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

    fn ids(handful: &Handful) -> Vec<[u32; 2]> {
        let (pairs, last) = handful.triangles.as_chunks();
        assert_eq!(last, [Named::NONE]);
        assert_eq!(pairs.len(), handful.faces.len());
        pairs.iter().map(|pair: &[Named; 2]| pair.map(|named| named.id)).collect()
    }

    #[test]
    fn neighbours_are_tested_together() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let handful = all(&[block(&[[b, c, a], [d, a, c]], 5)]).expect("few enough");
        assert_eq!(ids(&handful), [[5, 6]]);
        assert_eq!(handful.faces[0], Face::new([a, b, c], Some(d), 1.0).expect("it is flat"));
        // a is the third of b, c, a and the second of d, a, c.
        assert_eq!([handful.triangles[0].first, handful.triangles[1].first], [2.0, 1.0]);
    }

    /// A floor, a wall, and a table between them whose corners come first.
    #[test]
    fn what_lies_in_the_sides_of_the_bounds_comes_last() {
        let quad = |a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]| [[a, b, c], [a, c, d]];
        let floor = quad([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 4.0], [0.0, 0.0, 4.0]);
        let table = quad([1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [2.0, 1.0, 2.0], [1.0, 1.0, 2.0]);
        let wall = quad([4.0, 0.0, 0.0], [4.0, 3.0, 0.0], [4.0, 3.0, 4.0], [4.0, 0.0, 4.0]);
        let handful = all(&[block(&[floor, table, wall].concat(), 0)]).expect("few enough");
        assert_eq!(handful.inner, 1);
        assert_eq!(ids(&handful), [[2, 3], [0, 1], [4, 5]]);
        for (face, quad) in handful.faces.iter().zip([table, floor, wall]) {
            assert_eq!(face.corner, quad[0][0]);
        }
    }

    #[test]
    fn strangers_and_neighbours_that_are_bent_or_of_the_other_winding_stay_alone() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let [bent, far] = [[0.0, 1.0, 0.5], [5.0, 5.0, 5.0]];
        for second in [[a, d, c], [a, c, bent], [a, d, far]] {
            let handful = all(&[block(&[[a, b, c], second], 0)]).expect("few enough");
            let mut ids = ids(&handful);
            ids.sort();
            assert_eq!(ids, [[0, NO_PRIMITIVE], [1, NO_PRIMITIVE]]);
            assert!(handful.triangles.iter().all(|named| named.first == 0.0));
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
        assert!(all(&blocks(96)).is_some());
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
        let mut ids: Vec<u32> = ids(&handful).concat();
        ids.retain(|id| *id != NO_PRIMITIVE);
        ids.sort();
        let expected: Vec<u32> = [2, 3, 4, 6].into_iter().flat_map(|n| 8 * n..8 * n + 8).collect();
        assert_eq!(ids, expected);
    }
}
