//! The queue of a stream: batches of sixteen rays go through the root stage, and those that it does
//! not finish wait for traversal.

use super::closest_hit::ClosestHit;
use super::hit_sink::Hit16;
use super::ray_setup::{LaneSlabs, Shears, TraversalRay, half_of, sixteen_rays, store_traversal_rays};
use super::ray_stream::{Ray8, RayStream};
use super::root_stage::{ANY_HIT, RAYS, RootStage, store};
use super::stream_output::StreamOutput;
use crate::layout::WIDTH;
use crate::ray::MISS;
use crate::simd::{Arithmetic, Outlined, Simd};

/// The rays of a stream that wait for traversal, and the current batch of sixteen.
pub(super) struct RayQueue<'r, R: ?Sized> {
    pub rays: &'r R,
    pub root_stage: RootStage<'r>,
    /// The extent of the tree at whose root they start.
    extent: &'r [f32; 3],
    lanes: [Ray8; 2],
    /// Hits of the root stage, for closest-hit queries.
    root_hits: Hit16,
    /// Constants for traversal, by ray of the batch.
    pub traversal_rays: [TraversalRay; RAYS],
    /// Closest hits so far, by ray of the batch.
    pub closest: [ClosestHit; RAYS],
    /// Distances at which each ray enters the root's boxes, infinite for misses.
    pub near: [[f32; WIDTH]; RAYS],
    /// Index of the batch's first ray.
    pub first: usize,
    /// Mask of the rays of the batch that wait.
    pending: u32,
    /// Index of the first ray after the batch.
    next_first: usize,
}

impl<'r, R: RayStream + ?Sized> RayQueue<'r, R> {
    pub fn new(rays: &'r R, root_stage: RootStage<'r>, extent: &'r [f32; 3]) -> Self {
        RayQueue {
            rays,
            root_stage,
            extent,
            lanes: [Ray8::INACTIVE; 2],
            root_hits: Hit16::MISSES,
            traversal_rays: [TraversalRay::inactive(); RAYS],
            closest: [ClosestHit { hit: MISS, t_max: -1.0 }; RAYS],
            near: [[f32::INFINITY; WIDTH]; RAYS],
            first: 0,
            pending: 0,
            next_first: 0,
        }
    }

    /// The lane of the next ray to traverse. Rays that the root stage finishes are written to
    /// `output`.
    #[inline(always)]
    pub fn next_ray<S: Simd, const ANY: bool>(
        &mut self,
        s: S,
        output: &mut impl StreamOutput,
    ) -> Option<usize> {
        while self.pending == 0 {
            if self.next_first >= self.rays.len() {
                return None;
            }
            s.call(RunRootStage::<_, _, ANY>(self, output));
        }
        let lane = self.pending.trailing_zeros() as usize % RAYS;
        self.pending &= self.pending - 1;
        Some(lane)
    }

    /// Runs the root stage for the next batch.
    #[inline(always)]
    fn run_root_stage<S: Simd, const ANY: bool>(&mut self, s: S, output: &mut impl StreamOutput) {
        let w = s.sixteen();
        let rays = sixteen_rays(s, self.rays, self.next_first, &mut self.lanes);
        (self.first, self.next_first) = (self.next_first, self.next_first + RAYS);
        self.rays.prefetch(self.next_first);
        self.rays.prefetch(self.next_first + WIDTH);
        let hits = self.root_stage.intersect_polygons::<_, ANY>(w, &rays);
        let mut finished = w.bits(hits.any);
        if !ANY && self.root_stage.has_polygons() {
            // Rays that wait are written again after traversal.
            self.root_stage.store_hits(s, &hits, &mut self.root_hits);
            output.write16(self.first, &self.root_hits);
        }
        if !self.root_stage.is_complete() {
            let slabs = LaneSlabs::new(w, &rays, self.extent);
            let t_max = if ANY { w.select(hits.any, rays.t_max, w.splat(-1.0)) } else { hits.t };
            let (near, pending) = self.root_stage.intersect_boxes(w, &rays, &slabs, t_max);
            store_traversal_rays(s, &rays, &slabs, &Shears::new(w, &rays), pending, &mut self.traversal_rays);
            self.store_entry_distances(s, &near, pending);
            let mut ends = [0.0; RAYS];
            store(s, t_max, &mut ends);
            for lane in bits(pending) {
                self.closest[lane] = ClosestHit { hit: self.root_hits.get(lane), t_max: ends[lane] };
            }
            self.pending = pending;
            finished &= !pending;
        }
        if ANY {
            for lane in bits(finished) {
                output.write(self.first + lane, &ANY_HIT);
            }
        }
    }

    /// Stores the entry distances by ray. Each half is only stored if a ray of it is pending.
    #[inline(always)]
    fn store_entry_distances<S: Simd>(
        &mut self,
        s: S,
        near: &[<S::Sixteen as Arithmetic>::F; WIDTH],
        pending: u32,
    ) {
        for half in 0..2 {
            if pending >> (half * WIDTH) & 255 != 0 {
                let rows = s.transposed(half_of(s, near, half));
                for ray in 0..WIDTH {
                    s.store(rows[ray], &mut self.near[half * WIDTH + ray]);
                }
            }
        }
    }
}

/// The call of [`RayQueue::run_root_stage`].
struct RunRootStage<'c, 'r, R: ?Sized, A, const ANY: bool>(&'c mut RayQueue<'r, R>, &'c mut A);

impl<R: RayStream + ?Sized, S: Simd, A: StreamOutput, const ANY: bool> Outlined<S>
    for RunRootStage<'_, '_, R, A, ANY>
{
    #[inline(always)]
    fn run(self, s: S) {
        self.0.run_root_stage::<S, ANY>(s, self.1);
    }
}

/// Indices of the set bits.
#[inline(always)]
fn bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (bit < 32).then_some(bit % RAYS)
    })
}
