//! Cutting a render into dispatches that are short enough for drivers' watchdogs and for cancelling, and long enough to
//! keep the device busy.

use crate::film::Batch;
use std::ops::Range;
use std::time::Duration;

/// How long a dispatch should take. Two are under way at a time, so cancelling takes at most about twice this.
const TARGET: Duration = Duration::from_millis(40);
/// What a sample of a pixel is thought to cost before anything has been measured.
const FIRST_GUESS: f64 = 2.0e-6;
/// Rows of the smallest dispatch: those of a workgroup.
const LEAST_ROWS: u32 = 8;
/// Most samples of a pixel in one dispatch.
const MOST_SAMPLES: u32 = 256;

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
pub struct Plan {
    width: u32,
    height: u32,
    samples: Range<u32>,
    /// The samples that all rows are getting now.
    chunk: u32,
    row: u32,
}

impl Plan {
    /// For a window of `width` × `height` pixels.
    pub fn new(width: u32, height: u32, samples: Range<u32>) -> Self {
        Self { width, height, samples, chunk: 0, row: 0 }
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
            self.chunk = (pace.budget() / area.max(1)).clamp(1, most) as u32;
        }
        let row_cost = u64::from(self.width) * u64::from(self.chunk);
        let left = self.height - self.row;
        let affordable = (pace.budget() / row_cost.max(1)).min(u64::from(left)) as u32;
        let whole_groups = (affordable / LEAST_ROWS * LEAST_ROWS).max(LEAST_ROWS);
        let rows = if affordable == left { left } else { whole_groups.min(left) };
        let batch = Batch {
            first_row: self.row,
            row_count: rows,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Every sample of every row exactly once, whatever the pace.
    #[test]
    fn plans_cover_everything_once() {
        for cost in [1e-12, 3e-9, 1e-6, 1e-3, 1.0] {
            let pace = Pace { cost };
            let mut plan = Plan::new(70, 37, 5..75);
            let mut seen = vec![0u32; 37 * 80];
            let mut batches = 0;
            while let Some(b) = plan.next(&pace, 1024) {
                batches += 1;
                for row in b.first_row..b.first_row + b.row_count {
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
    fn dispatches_get_as_long_as_they_should() {
        let mut pace = Pace::default();
        let true_cost = 5e-9;
        for _ in 0..12 {
            let mut plan = Plan::new(1920, 1080, 0..10_000);
            let batch = plan.next(&pace, 1024).expect("work");
            let samples = 1920 * u64::from(batch.row_count) * u64::from(batch.sample_count);
            pace.learn(samples, Duration::from_secs_f64(samples as f64 * true_cost));
        }
        let mut plan = Plan::new(1920, 1080, 0..10_000);
        let batch = plan.next(&pace, 1024).expect("work");
        let seconds = f64::from(1920 * batch.row_count) * f64::from(batch.sample_count) * true_cost;
        assert!((0.02..0.05).contains(&seconds), "{seconds} s: {batch:?}");
    }
}
