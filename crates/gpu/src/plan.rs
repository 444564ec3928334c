//! Cutting a render into dispatches that are short enough for drivers' watchdogs and for cancelling, and long enough to
//! keep the device busy.

use crate::batch::{Batch, BatchPixels};
use std::ops::Range;
use std::time::Duration;

/// How long a dispatch should take. Two are under way at a time, so cancelling takes at most about twice this.
const TARGET: Duration = Duration::from_millis(40);
/// What a sample of a pixel is thought to cost before anything has been measured.
const FIRST_GUESS: f64 = 2.0e-6;
/// Rows of the smallest dispatch: those of a workgroup.
const LEAST_ROWS: u32 = 8;
/// Most samples of a pixel in one dispatch. A power of two.
const MOST_SAMPLES: u32 = 256;
/// The same on software drivers: Mesa's ends the loops of an invocation after 65,536 rounds in all, which are some hundred
/// rays through many instances, and what is left is missing from the picture without a word. A power of two.
const MOST_SAMPLES_OF_SOFTWARE: u32 = 32;

/// Most samples of a pixel in one dispatch; a power of two.
pub fn most_samples(is_software: bool) -> u32 {
    if is_software { MOST_SAMPLES_OF_SOFTWARE } else { MOST_SAMPLES }
}

/// Knows how long samples take, from how long they took.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Seconds a sample of a pixel.
    cost: f64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { cost: FIRST_GUESS }
    }
}

impl Pace {
    /// Learns that `samples` samples of pixels took `elapsed`.
    pub fn learn(&mut self, samples: u64, elapsed: Duration) {
        let measured = elapsed.as_secs_f64() / samples.max(1) as f64;
        // Small dispatches leave a device idle and look expensive, so trust grows in steps.
        self.cost = (0.5 * (self.cost + measured)).clamp(0.25 * self.cost, 4.0 * self.cost).max(1e-12);
    }

    /// Samples of pixels that fit into one dispatch.
    fn budget(&self) -> u64 {
        (TARGET.as_secs_f64() / self.cost) as u64
    }
}

/// Walks through the samples of all rows: all rows with a few samples at a time, so that pictures grow evenly.
#[derive(Clone, Debug)]
pub struct DispatchPlan {
    width: u32,
    height: u32,
    samples: Range<u32>,
    /// The samples that all rows are getting now.
    chunk: u32,
    row: u32,
    /// Whether all rows get as many samples at a time as may be, whatever that takes.
    together: bool,
}

impl DispatchPlan {
    /// For a window of `width` × `height` pixels.
    pub fn new(width: u32, height: u32, samples: Range<u32>) -> Self {
        Self { width, height, samples, chunk: 0, row: 0, together: false }
    }

    /// As [`DispatchPlan::new`], with as many samples of a row in a dispatch as may be: then sums do not depend on how
    /// fast the device is.
    pub fn together(width: u32, height: u32, samples: Range<u32>) -> Self {
        Self { together: true, ..Self::new(width, height, samples) }
    }

    /// The next whole picture, a sample of each pixel; `None` when there is nothing left.
    pub fn next_frame(&mut self) -> Option<Batch> {
        let first_sample = self.samples.next()?;
        let pixels = BatchPixels::Rows { first: 0, count: self.height };
        Some(Batch { pixels, first_sample, sample_count: 1 })
    }

    /// Whether all rows have the same samples: what has been handed out so far is a whole picture.
    pub fn is_even(&self) -> bool {
        self.row == 0
    }

    /// The next batch; `None` when there is nothing left. `most`: samples that a pixel may get before the film is read.
    pub fn next(&mut self, pace: &Pace, most: u32) -> Option<Batch> {
        if self.samples.is_empty() {
            return None;
        }
        let area = u64::from(self.width) * u64::from(self.height);
        if self.row == 0 {
            let left = self.samples.len() as u64;
            let most = u64::from(most.clamp(1, MOST_SAMPLES)).min(left);
            let affordable = if self.together { most } else { pace.budget() / area.max(1) };
            self.chunk = affordable.clamp(1, most) as u32;
        }
        let row_cost = u64::from(self.width) * u64::from(self.chunk);
        let left = self.height - self.row;
        let affordable = (pace.budget() / row_cost.max(1)).min(u64::from(left)) as u32;
        let whole_groups = (affordable / LEAST_ROWS * LEAST_ROWS).max(LEAST_ROWS);
        let rows = if affordable == left { left } else { whole_groups.min(left) };
        let batch = Batch {
            pixels: BatchPixels::Rows { first: self.row, count: rows },
            first_sample: self.samples.start,
            sample_count: self.chunk,
        };
        self.row += rows;
        if self.row == self.height {
            self.row = 0;
            self.samples.start += self.chunk;
        }
        Some(batch)
    }
}

/// Portions that one dispatch may make: what every device with a ray tracing pipeline can start in a row.
const MOST_PORTIONS: u32 = 1 << 22;

/// Walks through portions of equal size.
#[derive(Clone, Copy, Debug)]
pub struct PortionPlan {
    count: u32,
    samples: u32,
    /// Most that there is room for at a time.
    most: u32,
    /// The first that is still to be made.
    first: u32,
}

impl PortionPlan {
    /// For `count` portions of `samples` samples, of which there is room for `most` at a time, at least one.
    pub fn new(count: u32, samples: u32, most: u32) -> Self {
        Self { count, samples, most: most.clamp(1, MOST_PORTIONS), first: 0 }
    }

    /// The next batch; `None` when there is nothing left.
    pub fn next(&mut self, pace: &Pace) -> Option<Batch> {
        if self.first == self.count {
            return None;
        }
        // A workgroup takes as long for one portion as for all that it has room for.
        let affordable = (pace.budget() / u64::from(self.samples)).max(1).next_multiple_of(64);
        let count = affordable.min(u64::from(self.most.min(self.count - self.first))) as u32;
        let pixels = BatchPixels::Portions { first: self.first, count, samples: self.samples };
        self.first += count;
        Some(Batch { pixels, first_sample: 0, sample_count: self.samples })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every portion exactly once, whatever the pace, and never more than there is room for.
    #[test]
    fn portions_are_made_once() {
        for cost in [1e-12, 1e-7, 2e-6, 1e-4, 1.0] {
            for (portions, samples, most) in [(1, 16, 64), (700, 1, 128), (99_999, 16, 50_000), (0, 4, 64)] {
                let mut plan = PortionPlan::new(portions, samples, most);
                let mut next = 0;
                while let Some(batch) = plan.next(&Pace { cost }) {
                    let BatchPixels::Portions { first, count, samples: of_each } = batch.pixels else {
                        panic!("rows: {batch:?}")
                    };
                    assert_eq!((first, of_each, batch.sample_count), (next, samples, samples));
                    assert!((1..=most).contains(&count), "{cost}: {count}");
                    next += count;
                }
                assert_eq!(next, portions, "{cost}: portions of {samples}");
            }
        }
    }

    /// A device that is not busy takes as long for a few portions as for many. Whoever gives it less and less because it seems
    /// slow waits that long again and again.
    #[test]
    fn few_portions_do_not_take_long() {
        const AT_A_TIME: u32 = 65_536;
        const LATENCY: f64 = 5e-4;
        let mut pace = Pace { cost: LATENCY / f64::from(AT_A_TIME) };
        let mut longest: f64 = 0.0;
        let lists = [(48_000, 16), (300, 4), (16_000, 16), (1000, 4), (3200, 16), (80_000, 16), (800_000, 4)];
        for (portions, samples) in lists {
            let mut plan = PortionPlan::new(portions, samples, 1 << 20);
            let mut taken = 0.0;
            while let Some(batch) = plan.next(&pace) {
                let BatchPixels::Portions { count, .. } = batch.pixels else { panic!("rows: {batch:?}") };
                let waves = f64::from(count.div_ceil(AT_A_TIME));
                let seconds = waves * f64::from(samples) * LATENCY;
                pace.learn(u64::from(samples) * u64::from(count), Duration::from_secs_f64(seconds));
                (taken, longest) = (taken + seconds, longest.max(seconds));
            }
            let least = f64::from(portions.div_ceil(AT_A_TIME) * samples) * LATENCY;
            assert!(taken < 2.0 * least, "{portions} portions of {samples}: {taken} s instead of {least}");
        }
        assert!(longest < 0.2, "a dispatch of {longest} s");
    }

    /// First row and number of rows.
    fn rows(batch: &Batch) -> (u32, u32) {
        let BatchPixels::Rows { first, count } = batch.pixels else { panic!("portions: {batch:?}") };
        (first, count)
    }

    /// Every sample of every row exactly once, whatever the pace.
    #[test]
    fn plans_cover_everything_once() {
        for cost in [1e-12, 3e-9, 1e-6, 1e-3, 1.0] {
            let pace = Pace { cost };
            let mut plan = DispatchPlan::new(70, 37, 5..75);
            let mut seen = vec![0u32; 37 * 80];
            let mut batches = 0;
            while let Some(b) = plan.next(&pace, 1024) {
                batches += 1;
                let (first, count) = rows(&b);
                for row in first..first + count {
                    for s in b.first_sample..b.first_sample + b.sample_count {
                        seen[(row * 80 + s) as usize] += 1;
                    }
                }
            }
            assert!(plan.is_even());
            let expected = |i: usize| u32::from((5..75).contains(&(i % 80)));
            assert!(seen.iter().enumerate().all(|(i, &n)| n == expected(i)), "cost {cost}");
            assert_eq!(batches == 1, cost < 1e-7, "cost {cost}: {batches} batches");
        }
    }

    #[test]
    fn samples_that_belong_together_are_made_at_once() {
        for cost in [1e-9, 1e-3] {
            let mut plan = DispatchPlan::together(64, 40, 0..100);
            let mut rows_of = [0; 2];
            while let Some(batch) = plan.next(&Pace { cost }, 64) {
                let half = usize::from(batch.first_sample > 0);
                assert_eq!((batch.first_sample, batch.sample_count), [(0, 64), (64, 36)][half]);
                rows_of[half] += rows(&batch).1;
            }
            assert_eq!(rows_of, [40, 40]);
        }
    }

    #[test]
    fn dispatches_get_as_long_as_they_should() {
        let mut pace = Pace::default();
        let true_cost = 5e-9;
        for _ in 0..12 {
            let mut plan = DispatchPlan::new(1920, 1080, 0..10_000);
            let batch = plan.next(&pace, 1024).expect("work");
            let samples = 1920 * u64::from(rows(&batch).1) * u64::from(batch.sample_count);
            pace.learn(samples, Duration::from_secs_f64(samples as f64 * true_cost));
        }
        let mut plan = DispatchPlan::new(1920, 1080, 0..10_000);
        let batch = plan.next(&pace, 1024).expect("work");
        let seconds = f64::from(1920 * rows(&batch).1) * f64::from(batch.sample_count) * true_cost;
        assert!((0.02..0.05).contains(&seconds), "{seconds} s: {batch:?}");
    }
}
