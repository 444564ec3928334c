//! Columns: many things of a kind, whose numbers of one kind lie beside each other.
//!
//! A batch keeps its rays, paths and hits so, because sixteen neighbours are then sixteen lanes without being moved, and what a stage
//! leaves of sixteen lanes goes to the end of a column at once.

use crate::batch::lanes::{LANES, Lanes, Vectors};
use crate::simd::Instructions;
use bytemuck::Pod;
use optics::{Vec3f, vec3f};

/// Numbers of one kind. How many of them there are, those know who have several columns.
#[derive(Default)]
pub(crate) struct Column<T>(Vec<T>);

impl<T: Pod + Default> Column<T> {
    /// The first `count`.
    #[inline(always)]
    pub fn first(&self, count: usize) -> &[T] {
        &self.0[..count]
    }

    /// The first `count`, to be written.
    #[inline(always)]
    pub fn first_mut(&mut self, count: usize) -> &mut [T] {
        &mut self.0[..count]
    }

    #[inline(always)]
    pub fn get(&self, at: usize) -> T {
        self.0[at]
    }

    #[inline(always)]
    pub fn set(&mut self, at: usize, value: T) {
        self.0[at] = value;
    }

    /// Sixteen in a row.
    #[inline(always)]
    pub fn lanes(&self, at: usize) -> &[T; LANES] {
        self.0[at..].first_chunk().expect("there is room for whole lanes, see `make_room`")
    }

    /// Puts the lanes whose bits are set in `mask` behind the first `at`. Overwrites what is behind them.
    #[inline(always)]
    pub fn append(&mut self, i: impl Instructions, at: usize, mask: u32, lanes: &[T; LANES]) {
        let to = self.0[at..].first_chunk_mut().expect("there is room for whole lanes, see `make_room`");
        i.compress(mask, bytemuck::cast_ref(lanes), bytemuck::cast_mut::<[T; LANES], [u32; LANES]>(to));
    }

    /// Moves the lanes from `first` on whose bits are set in `mask` behind the first `at`, which are not more than `first`.
    #[inline(always)]
    pub fn move_lanes(&mut self, i: impl Instructions, first: usize, mask: u32, at: usize) {
        let lanes = *self.lanes(first);
        self.append(i, at, mask, &lanes);
    }

    /// Sees to it that sixteen can be appended behind the first `count`, and be read wherever one can.
    #[inline(always)]
    pub fn make_room(&mut self, count: usize) {
        if self.0.len() < count + LANES {
            self.grow(count);
        }
    }

    #[cold]
    fn grow(&mut self, count: usize) {
        self.0.resize((2 * count).max(1024) + LANES, T::default());
    }
}

/// Vectors.
#[derive(Default)]
pub(crate) struct VectorColumn {
    pub x: Column<f32>,
    pub y: Column<f32>,
    pub z: Column<f32>,
}

impl VectorColumn {
    #[inline(always)]
    pub fn get(&self, at: usize) -> Vec3f {
        vec3f(self.x.get(at), self.y.get(at), self.z.get(at))
    }

    #[inline(always)]
    pub fn set(&mut self, at: usize, v: Vec3f) {
        self.x.set(at, v.x);
        self.y.set(at, v.y);
        self.z.set(at, v.z);
    }

    /// Sixteen in a row.
    #[inline(always)]
    pub fn lanes(&self, at: usize) -> Vectors {
        Vectors { x: Lanes(*self.x.lanes(at)), y: Lanes(*self.y.lanes(at)), z: Lanes(*self.z.lanes(at)) }
    }

    /// See [`Column::append`].
    #[inline(always)]
    pub fn append(&mut self, i: impl Instructions, at: usize, mask: u32, lanes: &Vectors) {
        self.x.append(i, at, mask, &lanes.x.0);
        self.y.append(i, at, mask, &lanes.y.0);
        self.z.append(i, at, mask, &lanes.z.0);
    }

    /// See [`Column::move_lanes`].
    #[inline(always)]
    pub fn move_lanes(&mut self, i: impl Instructions, first: usize, mask: u32, at: usize) {
        self.x.move_lanes(i, first, mask, at);
        self.y.move_lanes(i, first, mask, at);
        self.z.move_lanes(i, first, mask, at);
    }

    /// See [`Column::make_room`].
    #[inline(always)]
    pub fn make_room(&mut self, count: usize) {
        self.x.make_room(count);
        self.y.make_room(count);
        self.z.make_room(count);
    }

    /// The first `count` of each coordinate.
    #[inline(always)]
    pub fn first(&self, count: usize) -> [&[f32]; 3] {
        [self.x.first(count), self.y.first(count), self.z.first(count)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Stage, call_with_best};

    /// Keeps every third number of a column.
    struct Keep<'a>(&'a mut Column<u32>, usize, &'a mut usize);

    impl Stage for Keep<'_> {
        fn run<I: Instructions>(self, i: I) {
            for first in (0..self.1).step_by(LANES) {
                let there = (first..self.1.min(first + LANES)).filter(|at| at % 3 == 0);
                let mask = there.fold(0, |mask, at| mask | 1 << (at - first));
                self.0.move_lanes(i, first, mask, *self.2);
                *self.2 += mask.count_ones() as usize;
            }
        }
    }

    #[test]
    fn what_is_kept_moves_together() {
        for count in [0, 1, 15, 16, 17, 100, 1000] {
            let mut column = Column::<u32>::default();
            column.make_room(count);
            (0..count).for_each(|at| column.set(at, at as u32));
            let mut kept = 0;
            call_with_best(Keep(&mut column, count, &mut kept));
            let expected: Vec<u32> = (0..count as u32).step_by(3).collect();
            assert_eq!(column.first(kept), expected, "of {count}");
        }
    }
}
