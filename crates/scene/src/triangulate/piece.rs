//! A piece of a polygon that every vertical line meets in one interval, filled from left to right.
//!
//! Corners that cannot be part of a triangle yet wait on a stack (Garey, Johnson, Preparata and Tarjan, "Triangulating a
//! Simple Polygon", 1978), so that the time is linear.

use super::sweep::{Pieces, orientation};

/// Three places or corners.
pub(super) type Triangle = [u32; 3];

/// Whether a corner is on the lower or the upper edge of its piece.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Lower,
    Upper,
}

impl Side {
    pub(super) fn opposite(self) -> Self {
        match self {
            Side::Lower => Side::Upper,
            Side::Upper => Side::Lower,
        }
    }
}

/// The part of a piece that is not filled yet: corners on one side, which do not turn inwards, but for the first.
pub(super) struct Piece {
    waiting: Vec<u32>,
    /// The side of the last corner.
    side: Side,
}

impl Piece {
    pub(super) fn begin(place: u32) -> Self {
        Self { waiting: vec![place], side: Side::Lower }
    }

    /// The last corner, and its side.
    pub(super) fn last(&self) -> (u32, Side) {
        (self.waiting[self.waiting.len() - 1], self.side)
    }

    /// Adds the next corner to the right.
    pub(super) fn add(&mut self, place: u32, side: Side, filled: &mut Pieces) {
        if side == self.side {
            self.fill_corners(place, filled);
        } else {
            let (last, _) = self.last();
            self.fill_fan(place, side, filled);
            self.waiting.clear();
            self.waiting.push(last);
        }
        self.waiting.push(place);
        self.side = side;
    }

    /// Ends the piece in the corner where its sides meet.
    pub(super) fn finish(self, place: u32, filled: &mut Pieces) {
        self.fill_fan(place, self.side.opposite(), filled);
    }

    /// Triangles with `place` of the last corners that turn inwards there.
    fn fill_corners(&mut self, place: u32, filled: &mut Pieces) {
        while let [.., a, b] = self.waiting[..] {
            let points = [a, b, place].map(|i| filled.places[i as usize]);
            let turn = orientation(points[0], points[1], points[2]);
            let inwards = match self.side {
                Side::Lower => turn > 0.0,
                Side::Upper => turn < 0.0,
            };
            if !inwards {
                return;
            }
            filled.triangles.push(triangle(a, b, place, self.side.opposite()));
            self.waiting.pop();
        }
    }

    /// Triangles with `place`, which is on the other `side`, of all corners.
    fn fill_fan(&self, place: u32, side: Side, filled: &mut Pieces) {
        filled.triangles.extend(self.waiting.windows(2).map(|pair| triangle(pair[0], pair[1], place, side)));
    }
}

/// A triangle that turns left, of two corners from left to right and one on the given side of them.
fn triangle(a: u32, b: u32, third: u32, side: Side) -> Triangle {
    match side {
        Side::Upper => [a, b, third],
        Side::Lower => [b, a, third],
    }
}
