//! A handful of triangles as rays in lanes are tested with it: corners that are shared are there once, and triangles that
//! share an edge are tested together.

use crate::layout::{NO_PRIMITIVE, TriangleBlock, WIDTH};

/// Most triangles that are tested one after the other. Measured: with more, walking a tree is faster.
pub(crate) const MAX_TRIANGLES: usize = 96;

/// Most corners: room for them is made for every stream.
pub(crate) const MAX_CORNERS: usize = 128;

/// A few triangles.
pub(crate) struct Handful {
    pub corners: Vec<[f32; 3]>,
    pub faces: Vec<Face>,
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
    /// The triangles of some blocks, if they are few.
    pub fn new(blocks: &[TriangleBlock]) -> Option<Handful> {
        if blocks.len() > MAX_TRIANGLES {
            return None;
        }
        let lanes = blocks.iter().flat_map(|block| (0..WIDTH).map(move |lane| (block, lane)));
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
            if triangles.len() == MAX_TRIANGLES {
                return None;
            }
            let [a, b, c] = numbers.map(Corner::new);
            triangles.push(Triangle { corners: [a?, b?, c?], id });
        }
        Some(Handful { corners, faces: faces(triangles) })
    }

    /// Bytes of memory that this occupies.
    pub fn memory_bytes(&self) -> usize {
        self.corners.capacity() * size_of::<[f32; 3]>() + self.faces.capacity() * size_of::<Face>()
    }
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

    fn block(triangles: &[[[f32; 3]; 3]], first_id: u32) -> TriangleBlock {
        let mut block = TriangleBlock::EMPTY;
        for (lane, triangle) in triangles.iter().enumerate() {
            block.set_triangle(lane, triangle);
            block.ids[lane] = first_id + lane as u32;
        }
        block
    }

    #[test]
    fn neighbours_are_tested_together() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]];
        let handful = Handful::new(&[block(&[[b, c, a], [d, a, c]], 5)]).expect("few enough");
        assert_eq!(handful.corners.len(), 4);
        let [face] = handful.faces[..] else { panic!("{:?}", handful.faces) };
        let corners = face.corners.map(|c| handful.corners[usize::from(c.0)]);
        assert_eq!((corners, face.ids), ([a, b, c, d], [5, 6]));
        // a is the third of b, c, a and the second of d, a, c.
        assert_eq!(face.first, [2, 1]);
    }

    #[test]
    fn strangers_and_neighbours_of_the_other_winding_stay_alone() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]];
        let handful = Handful::new(&[block(&[[a, b, c], [a, d, c]], 0)]).expect("few enough");
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
        assert!(Handful::new(&blocks(40)).is_some());
        // 48 triangles of three corners each.
        assert!(Handful::new(&blocks(48)).is_none());
        assert!(Handful::new(&blocks(104)).is_none());
    }
}
