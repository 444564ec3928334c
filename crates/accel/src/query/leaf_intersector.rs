//! Candidate hits of a leaf block, and what closest-hit and any-hit queries do with them.

use super::closest_hit::ClosestHit;
use crate::layout::WIDTH;
use crate::ray::{Hit, HitFilter};
use crate::simd::Simd;

/// Eight candidate hits; those in `mask` are inside the ray's interval.
pub(super) struct Candidates<S: Simd> {
    pub mask: S::M,
    /// The mask as bits, not zero.
    pub bits: u32,
    pub t: S::F,
    pub u: S::F,
    pub v: S::F,
}

impl<S: Simd> Candidates<S> {
    /// Keeps the closest candidate that the filter accepts.
    #[inline(always)]
    pub fn keep_closest<F: HitFilter>(
        &self,
        s: S,
        ids: &[u32; WIDTH],
        instance: u32,
        filter: &F,
        best: &mut ClosestHit,
    ) {
        let (mut us, mut vs) = ([0.0; WIDTH], [0.0; WIDTH]);
        s.store(self.u, &mut us);
        s.store(self.v, &mut vs);
        if F::OPAQUE {
            let t = s.least(s.select(self.mask, s.splat(f32::INFINITY), self.t));
            let lane = s.bits(s.and(self.mask, s.le(self.t, s.splat(t)))).trailing_zeros() as usize & 7;
            if t < best.t_max {
                best.t_max = t;
                best.hit = Hit { t, u: us[lane], v: vs[lane], primitive: ids[lane], instance };
            }
            return;
        }
        let mut ts = [0.0; WIDTH];
        s.store(self.t, &mut ts);
        let mut bits = self.bits;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let (t, u, v) = (ts[lane], us[lane], vs[lane]);
            if t < best.t_max && filter.accept(instance, ids[lane], u, v) {
                best.t_max = t;
                best.hit = Hit { t, u, v, primitive: ids[lane], instance };
            }
        }
    }

    /// Whether the filter accepts any candidate.
    #[inline(always)]
    pub fn any<F: HitFilter>(&self, s: S, ids: &[u32; WIDTH], instance: u32, filter: &F) -> bool {
        if F::OPAQUE {
            return true;
        }
        let (mut us, mut vs) = ([0.0; WIDTH], [0.0; WIDTH]);
        s.store(self.u, &mut us);
        s.store(self.v, &mut vs);
        let mut bits = self.bits;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            if filter.accept(instance, ids[lane], us[lane], vs[lane]) {
                return true;
            }
        }
        false
    }
}

/// Intersects a ray with leaf blocks of one kind.
pub(super) trait LeafIntersector<S: Simd> {
    /// Passes hits with block `index` between the ray's start and `t_max` to `handler`, if there
    /// are any.
    fn intersect(&self, s: S, index: usize, t_max: f32, handler: &mut impl HitHandler<S>);
}

pub(super) trait HitHandler<S: Simd> {
    /// Handles the hits of a block whose primitives have these ids.
    fn handle(&mut self, s: S, candidates: &Candidates<S>, ids: &[u32; WIDTH]);
}

/// Closest hit: keeps the closest candidate.
pub(super) struct KeepClosest<'a, F> {
    pub instance: u32,
    pub filter: &'a F,
    pub best: &'a mut ClosestHit,
}

impl<S: Simd, F: HitFilter> HitHandler<S> for KeepClosest<'_, F> {
    #[inline(always)]
    fn handle(&mut self, s: S, candidates: &Candidates<S>, ids: &[u32; WIDTH]) {
        candidates.keep_closest(s, ids, self.instance, self.filter, self.best);
    }
}

/// Any hit: remembers whether there is a candidate.
pub(super) struct FindAny<'a, F> {
    pub instance: u32,
    pub filter: &'a F,
    pub any: bool,
}

impl<S: Simd, F: HitFilter> HitHandler<S> for FindAny<'_, F> {
    #[inline(always)]
    fn handle(&mut self, s: S, candidates: &Candidates<S>, ids: &[u32; WIDTH]) {
        self.any |= candidates.any(s, ids, self.instance, self.filter);
    }
}
