//! Where the answers of a stream go.

use crate::layout::NO_PRIMITIVE;
use crate::ray::Hit;
use crate::streams::{HitRow, HitStream};

/// Takes answers. Rays that hit nothing need get none.
pub(super) trait Answers {
    /// Of one ray, by its number.
    fn one(&mut self, number: usize, hit: &Hit);

    /// Of sixteen rays from `first` on, or of as many as there are.
    fn row(&mut self, first: usize, hits: &HitRow);
}

/// All of a hit is kept.
pub(super) struct NearestHits<'h, H: ?Sized>(pub &'h mut H);

impl<H: HitStream + ?Sized> Answers for NearestHits<'_, H> {
    #[inline(always)]
    fn one(&mut self, number: usize, hit: &Hit) {
        self.0.set(number, hit);
    }

    #[inline(always)]
    fn row(&mut self, first: usize, hits: &HitRow) {
        self.0.set_row(first, hits);
    }
}

/// Only whether there is a hit is kept.
pub(super) struct Occlusion<'a>(pub &'a mut [bool]);

impl Answers for Occlusion<'_> {
    #[inline(always)]
    fn one(&mut self, number: usize, hit: &Hit) {
        self.0[number] = !hit.is_miss();
    }

    #[inline(always)]
    fn row(&mut self, first: usize, hits: &HitRow) {
        for (any, primitive) in self.0[first..].iter_mut().zip(hits.primitive) {
            *any = primitive != NO_PRIMITIVE;
        }
    }
}
