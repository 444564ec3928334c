//! Root triangles: the triangles of an object that the root stage of a stream tests before
//! traversal. Neighbours in a plane are merged to quadrilaterals.
//!
//! Polygons that lie in a side of the object's bounds, such as walls, floors and ceilings, come
//! last. A segment between two points inside the bounds cannot cross them.

use super::planar_polygon::{PlanarPolygon, PolygonTriangle};
use crate::aabb::Aabb;
use crate::layout::{ChildRef, EMPTY, LEAF, NO_PRIMITIVE, Node, TriangleBlock, WIDTH, leaf_index};

/// Objects of at most this many triangles have no tree for streams. With more, traversal is faster
/// (measured).
const MAX_OBJECT_TRIANGLES: usize = 96;

/// Most root triangles of a larger object. A ray hits the boxes of many of them anyway.
const MAX_ROOT_TRIANGLES: usize = 32;

/// The mask of all children of a node.
pub(crate) const ALL_CHILDREN: u32 = (1 << WIDTH) - 1;

/// Triangles of an object, and which children of its root they replace.
pub(crate) struct RootTriangles {
    /// Those that lie in a side of the object's bounds come last.
    pub polygons: Vec<PlanarPolygon>,
    /// Number of polygons that do not lie in a side of the bounds.
    pub inner: usize,
    /// Two triangles for each polygon, then [`PolygonTriangle::NONE`].
    pub triangles: Vec<PolygonTriangle>,
    /// Mask of the root's children that hold these triangles and nothing else.
    pub replaced_children: u32,
}

/// An original triangle.
struct Triangle {
    corners: [[f32; 3]; 3],
    id: u32,
}

/// A polygon and its original triangles.
struct Source {
    polygon: PlanarPolygon,
    triangles: [PolygonTriangle; 2],
    in_a_side: bool,
}

impl RootTriangles {
    /// All triangles of an object, if there are few. Otherwise the triangles of leaves directly
    /// below its root, in order of size, up to a limit.
    pub fn new(nodes: &[Node], root: ChildRef, blocks: &[TriangleBlock], bounds: &Aabb) -> RootTriangles {
        if blocks.len() <= MAX_OBJECT_TRIANGLES
            && let Some(all) = RootTriangles::of(blocks.iter(), MAX_OBJECT_TRIANGLES, ALL_CHILDREN, bounds)
        {
            return all;
        }
        let mut root_triangles = RootTriangles {
            polygons: Vec::new(),
            inner: 0,
            triangles: vec![PolygonTriangle::NONE],
            replaced_children: 0,
        };
        let Some(root) = nodes.get(root as usize) else { return root_triangles };
        let is_leaf = |slot: &usize| root.children[*slot] != EMPTY && root.children[*slot] & LEAF != 0;
        let mut leaves: Vec<usize> = (0..WIDTH).filter(is_leaf).collect();
        let area = |slot: usize| root.bounds(slot).half_area();
        leaves.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
        for count in 1..=leaves.len() {
            let first = &leaves[..count];
            let children = first.iter().fold(0, |bits, slot| bits | 1 << slot);
            let blocks = first.iter().map(|&slot| &blocks[leaf_index(root.children[slot])]);
            match RootTriangles::of(blocks, MAX_ROOT_TRIANGLES, children, bounds) {
                Some(more) => root_triangles = more,
                None => break,
            }
        }
        root_triangles
    }

    /// Whether the object has no other triangles.
    pub fn is_whole_object(&self) -> bool {
        self.replaced_children == ALL_CHILDREN
    }

    /// The triangles of some blocks. `None` if there are more than `most`, or if one is too
    /// slender.
    fn of<'b>(
        blocks: impl Iterator<Item = &'b TriangleBlock>,
        most: usize,
        children: u32,
        bounds: &Aabb,
    ) -> Option<RootTriangles> {
        let lanes = blocks.flat_map(|block| (0..WIDTH).map(move |lane| (block, lane)));
        let mut triangles: Vec<Triangle> = Vec::new();
        for (block, lane) in lanes.filter(|(block, lane)| block.ids[*lane] != NO_PRIMITIVE) {
            let id = block.ids[lane];
            if triangles.iter().any(|t| t.id == id) {
                // A split triangle is in several blocks.
                continue;
            }
            if triangles.len() == most {
                return None;
            }
            triangles.push(Triangle { corners: block.triangle(lane), id });
        }
        let (outer, inner): (Vec<Source>, Vec<Source>) =
            merge_triangles(triangles, bounds)?.into_iter().partition(|source| source.in_a_side);
        let all = || inner.iter().chain(&outer);
        Some(RootTriangles {
            polygons: all().map(|source| source.polygon).collect(),
            inner: inner.len(),
            triangles: all().flat_map(|source| source.triangles).chain([PolygonTriangle::NONE]).collect(),
            replaced_children: children,
        })
    }

    /// Memory on the heap, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.polygons.capacity() * size_of::<PlanarPolygon>()
            + self.triangles.capacity() * size_of::<PolygonTriangle>()
    }
}

/// Whether all points lie in one side of a box.
fn is_in_a_side<const N: usize>(points: &[[f32; 3]; N], bounds: &Aabb) -> bool {
    (0..3).any(|axis| {
        [bounds.min, bounds.max].iter().any(|side| points.iter().all(|point| point[axis] == side[axis]))
    })
}

/// Merges each triangle with the first later triangle that forms a quadrilateral with it. `None` if
/// a triangle cannot be a polygon.
fn merge_triangles(mut triangles: Vec<Triangle>, bounds: &Aabb) -> Option<Vec<Source>> {
    let size = (0..3).map(|axis| bounds.max[axis] - bounds.min[axis]).fold(0.0, f32::max);
    let mut sources = Vec::new();
    while !triangles.is_empty() {
        let first = triangles.remove(0);
        let found = triangles
            .iter()
            .enumerate()
            .find_map(|(i, second)| Some((i, quadrilateral(&first, second, bounds, size)?)));
        sources.push(match found {
            Some((i, source)) => {
                triangles.remove(i);
                source
            }
            None => Source {
                polygon: PlanarPolygon::new(first.corners, None, size)?,
                triangles: [PolygonTriangle { id: first.id, first_corner: 0.0 }, PolygonTriangle::NONE],
                in_a_side: is_in_a_side(&first.corners, bounds),
            },
        });
    }
    Some(sources)
}

/// The quadrilateral of two triangles, if they share an edge, have the same winding, and are planar
/// and convex.
fn quadrilateral(first: &Triangle, second: &Triangle, bounds: &Aabb, size: f32) -> Option<Source> {
    let turned = |corners: [[f32; 3]; 3], turn: usize| [0, 1, 2].map(|i: usize| corners[(i + turn) % 3]);
    let same = |x: [f32; 3], y: [f32; 3]| x.map(f32::to_bits) == y.map(f32::to_bits);
    let turns = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
    turns.into_iter().find_map(|(i, j)| {
        let ([a, b, c], [a2, c2, d]) = (turned(first.corners, i), turned(second.corners, j));
        if !same(a, a2) || !same(c, c2) {
            return None;
        }
        Some(Source {
            polygon: PlanarPolygon::new([a, b, c], Some(d), size)?,
            triangles: [
                PolygonTriangle { id: first.id, first_corner: i as f32 },
                PolygonTriangle { id: second.id, first_corner: j as f32 },
            ],
            in_a_side: is_in_a_side(&[a, b, c, d], bounds),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::LeafBlock;

    fn block(triangles: &[[[f32; 3]; 3]], first_id: u32) -> TriangleBlock {
        let mut block = TriangleBlock::EMPTY;
        for (lane, triangle) in triangles.iter().enumerate() {
            block.set_triangle(lane, triangle);
            block.ids[lane] = first_id + lane as u32;
        }
        block
    }

    fn all(blocks: &[TriangleBlock]) -> Option<RootTriangles> {
        let bounds = blocks.iter().fold(Aabb::EMPTY, |all, block| all.union(block.bounds()));
        let root_triangles = RootTriangles::new(&[], LEAF, blocks, &bounds);
        root_triangles.is_whole_object().then_some(root_triangles)
    }

    fn ids(root_triangles: &RootTriangles) -> Vec<[u32; 2]> {
        let (pairs, last) = root_triangles.triangles.as_chunks();
        assert_eq!(last, [PolygonTriangle::NONE]);
        assert_eq!(pairs.len(), root_triangles.polygons.len());
        pairs.iter().map(|pair: &[PolygonTriangle; 2]| pair.map(|named| named.id)).collect()
    }

    #[test]
    fn neighbours_are_tested_together() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let root_triangles = all(&[block(&[[b, c, a], [d, a, c]], 5)]).expect("few enough");
        assert_eq!(ids(&root_triangles), [[5, 6]]);
        assert_eq!(
            root_triangles.polygons[0],
            PlanarPolygon::new([a, b, c], Some(d), 1.0).expect("it is flat")
        );
        // a is the third of b, c, a and the second of d, a, c.
        assert_eq!(
            [root_triangles.triangles[0].first_corner, root_triangles.triangles[1].first_corner],
            [2.0, 1.0]
        );
    }

    /// A floor, a wall, and a table between them whose corners come first.
    #[test]
    fn what_lies_in_the_sides_of_the_bounds_comes_last() {
        let quad = |a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]| [[a, b, c], [a, c, d]];
        let floor = quad([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 4.0], [0.0, 0.0, 4.0]);
        let table = quad([1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [2.0, 1.0, 2.0], [1.0, 1.0, 2.0]);
        let wall = quad([4.0, 0.0, 0.0], [4.0, 3.0, 0.0], [4.0, 3.0, 4.0], [4.0, 0.0, 4.0]);
        let root_triangles = all(&[block(&[floor, table, wall].concat(), 0)]).expect("few enough");
        assert_eq!(root_triangles.inner, 1);
        assert_eq!(ids(&root_triangles), [[2, 3], [0, 1], [4, 5]]);
        for (polygon, quad) in root_triangles.polygons.iter().zip([table, floor, wall]) {
            assert_eq!(polygon.corner, quad[0][0]);
        }
    }

    #[test]
    fn strangers_and_neighbours_that_are_bent_or_of_the_other_winding_stay_alone() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let [bent, far] = [[0.0, 1.0, 0.5], [5.0, 5.0, 5.0]];
        for second in [[a, d, c], [a, c, bent], [a, d, far]] {
            let root_triangles = all(&[block(&[[a, b, c], second], 0)]).expect("few enough");
            let mut ids = ids(&root_triangles);
            ids.sort();
            assert_eq!(ids, [[0, NO_PRIMITIVE], [1, NO_PRIMITIVE]]);
            assert!(root_triangles.triangles.iter().all(|named| named.first_corner == 0.0));
        }
    }

    #[test]
    fn objects_of_many_triangles_have_a_tree() {
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
        let root_triangles = RootTriangles::new(&[root, Node::EMPTY], 0, &blocks, &Aabb::EMPTY);
        assert!(!root_triangles.is_whole_object());
        assert_eq!(root_triangles.replaced_children, 0b101_1100, "four leaves of eight");
        let mut ids: Vec<u32> = ids(&root_triangles).concat();
        ids.retain(|id| *id != NO_PRIMITIVE);
        ids.sort();
        let expected: Vec<u32> = [2, 3, 4, 6].into_iter().flat_map(|n| 8 * n..8 * n + 8).collect();
        assert_eq!(ids, expected);
    }
}
