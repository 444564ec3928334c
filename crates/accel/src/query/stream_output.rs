//! What a stream writes for each ray: a closest hit, or whether there is any hit.

use super::hit_sink::{Hit16, HitSink};
use crate::layout::NO_PRIMITIVE;
use crate::ray::Hit;

/// The output of a stream. It is initialised to misses, so misses need not be written.
pub(super) trait StreamOutput {
    /// Writes the hit of ray `index`.
    fn write(&mut self, index: usize, hit: &Hit);

    /// Writes the hits of sixteen rays from `first` on. Those beyond the end are dropped.
    fn write16(&mut self, first: usize, hits: &Hit16);
}

/// Stores closest hits.
pub(super) struct ClosestHits<'h, H: ?Sized>(pub &'h mut H);

impl<H: HitSink + ?Sized> StreamOutput for ClosestHits<'_, H> {
    #[inline(always)]
    fn write(&mut self, index: usize, hit: &Hit) {
        self.0.set(index, hit);
    }

    #[inline(always)]
    fn write16(&mut self, first: usize, hits: &Hit16) {
        self.0.set16(first, hits);
    }
}

/// Stores whether there is any hit.
pub(super) struct Occlusion<'a>(pub &'a mut [bool]);

impl StreamOutput for Occlusion<'_> {
    #[inline(always)]
    fn write(&mut self, index: usize, hit: &Hit) {
        self.0[index] = !hit.is_miss();
    }

    #[inline(always)]
    fn write16(&mut self, first: usize, hits: &Hit16) {
        for (any, primitive) in self.0[first..].iter_mut().zip(hits.primitive) {
            *any = primitive != NO_PRIMITIVE;
        }
    }
}
