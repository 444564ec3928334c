//! Candidate hits of a leaf block, and what closest-hit and any-hit queries do with them.

use super::closest_hit::ClosestHit;
use crate::layout::WIDTH;
use crate::ray::{Candidate, Hit, HitFilter};
use crate::simd::Simd;

/// Eight candidate hits; those in `mask` are inside the ray's interval.
pub(super) struct Candidates<S: Simd> {
    pub mask: S::M,
    /// The mask as bits, not zero.
    pub bits: u32,
    pub t: S::F,
    pub u: S::F,
    pub v: S::F,
    /// See [`Candidate::outward`] and [`Candidate::direction`]; zero if no filter asks.
    pub outward: [S::F; 3],
    pub direction: [S::F; 3],
}

impl<S: Simd> Candidates<S> {
    /// The candidates one by one, as filters see them, with their ray parameters.
    #[inline(always)]
    fn of_filter(&self, s: S, ids: &[u32; WIDTH], instance: u32) -> impl Iterator<Item = (f32, Candidate)> {
        let mut numbers = [[0.0; WIDTH]; 9];
        let ([x, y, z], [dx, dy, dz]) = (self.outward, self.direction);
        for (lanes, numbers) in [self.t, self.u, self.v, x, y, z, dx, dy, dz].into_iter().zip(&mut numbers) {
            s.store(lanes, numbers);
        }
        let (mut bits, ids) = (self.bits, *ids);
        std::iter::from_fn(move || {
            if bits == 0 {
                return None;
            }
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let [t, u, v, x, y, z, dx, dy, dz] = numbers.map(|numbers| numbers[lane]);
            let (outward, direction) = ([x, y, z], [dx, dy, dz]);
            Some((t, Candidate { instance, primitive: ids[lane], u, v, direction, outward }))
        })
    }

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
        if !F::OPAQUE {
            for (t, candidate) in self.of_filter(s, ids, instance) {
                if t < best.t_max && filter.accept(&candidate) {
                    let Candidate { primitive, u, v, .. } = candidate;
                    *best = ClosestHit { hit: Hit { t, u, v, primitive, instance }, t_max: t };
                }
            }
            return;
        }
        let (mut us, mut vs) = ([0.0; WIDTH], [0.0; WIDTH]);
        s.store(self.u, &mut us);
        s.store(self.v, &mut vs);
        let t = s.least(s.select(self.mask, s.splat(f32::INFINITY), self.t));
        let lane = s.bits(s.and(self.mask, s.le(self.t, s.splat(t)))).trailing_zeros() as usize & 7;
        if t < best.t_max {
            best.t_max = t;
            best.hit = Hit { t, u: us[lane], v: vs[lane], primitive: ids[lane], instance };
        }
    }

    /// Whether the filter accepts any candidate.
    #[inline(always)]
    pub fn any<F: HitFilter>(&self, s: S, ids: &[u32; WIDTH], instance: u32, filter: &F) -> bool {
        F::OPAQUE || self.of_filter(s, ids, instance).any(|(_, candidate)| filter.accept(&candidate))
    }
}

/// Intersects a ray with leaf blocks of one kind.
pub(super) trait LeafIntersector<S: Simd> {
    /// Passes hits with block `index` between the ray's start and `t_max` to `handler`, if there
    /// are any.
    fn intersect<H: HitHandler<S>>(&self, s: S, index: usize, t_max: f32, handler: &mut H);
}

pub(super) trait HitHandler<S: Simd> {
    /// Whether a filter looks at candidates, so that they have to be whole.
    const FILTERS: bool;

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
    const FILTERS: bool = !F::OPAQUE;

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
    const FILTERS: bool = !F::OPAQUE;

    #[inline(always)]
    fn handle(&mut self, s: S, candidates: &Candidates<S>, ids: &[u32; WIDTH]) {
        self.any |= candidates.any(s, ids, self.instance, self.filter);
    }
}
