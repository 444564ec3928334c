//! Paths that have left the scene.
//!
//! What they find there is little work. Were they left among the others, lanes that compute surfaces would be idle for each of
//! them: in pictures with much sky that is every second one.

use crate::batch::lanes::{LANES, Vectors, first_lanes};
use crate::shade::path_batch::{Context, PathBatch};
use crate::simd::Instructions;
use scene::tables::NONE;

/// The share of paths, one in so many, that must have left before it pays to move the others together.
const SHARE: usize = 8;

impl PathBatch {
    /// Lets go of the paths whose rays have hit nothing, where many have and the sky is no light to be sampled. The others move together.
    #[inline(always)]
    pub(crate) fn shade_misses<I: Instructions>(&mut self, i: I, context: &Context) {
        let count = self.paths.len();
        let rows = || (0..count).step_by(LANES);
        let missed: u32 = rows().map(|first| self.missed(i, first, count).count_ones()).sum();
        if !context.scene.plain_sky || missed as usize * SHARE < count {
            return;
        }
        let mut kept = 0;
        for first in rows() {
            let sky = self.missed(i, first, count);
            self.find_plain_sky(context, sky, first);
            let others = first_lanes(count - first) & !sky;
            self.paths.move_lanes(i, first, others, kept);
            self.hits.move_lanes(i, first, others, kept);
            kept += others.count_ones() as usize;
        }
        self.paths.truncate(kept);
    }

    /// Which lanes of the row from `first` on, of `count` paths in all, have hit nothing, as bits.
    #[inline(always)]
    fn missed<I: Instructions>(&self, i: I, first: usize, count: usize) -> u32 {
        first_lanes(count - first) & i.equal(self.hits.lanes(first).primitive, NONE)
    }

    /// Adds what paths that have left the scene find in a sky that is no light to be sampled.
    #[inline(always)]
    pub(crate) fn find_plain_sky(&mut self, context: &Context, mut mask: u32, first: usize) {
        let sky = &context.scene.tables.environment;
        if mask == 0 || sky.is_black() {
            return;
        }
        let (directions, throughputs) =
            (self.paths.direction.lanes(first), self.paths.throughput.lanes(first));
        let mut found = Vectors::<LANES>::default();
        for lane in 0..LANES {
            found.set(lane, throughputs.get(lane) * sky.gradient(directions.get(lane)));
        }
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            self.radiance[self.paths.slot.get(first + lane) as usize] += found.get(lane);
        }
    }
}
