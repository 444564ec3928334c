//! Cutting a render into dispatches that are short enough for drivers' watchdogs and for cancelling, and long enough to
//! keep the device busy.

use crate::film::{Batch, BatchPixels, ListedPixel};
use backend::PixelSamples;
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
            self.chunk = (pace.budget() / area.max(1)).clamp(1, most) as u32;
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

/// Entries of a list that one dispatch may work on: what every device with a ray tracing pipeline can start in a row.
const MOST_LISTED: u64 = 1 << 22;

/// Samples for a list of pixels, level by level: all pixels of a level get the same number of samples, so that invocations
/// that run side by side do the same.
#[derive(Clone, Debug)]
pub struct Levels {
    /// What is still to be done, by squares of a workgroup's size.
    left: Vec<PixelSamples>,
    /// Samples of each pixel of the next level: a power of two.
    samples: u32,
}

/// Pixels that get the same number of samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Level {
    /// The pixels; none is there twice.
    pub pixels: Vec<ListedPixel>,
    /// Samples of each of them.
    pub samples: u32,
}

impl Levels {
    /// For pixels of a window of `width` pixels, of which each gets at most `most` samples at a time: a power of two.
    pub fn new(width: u32, pixels: &[PixelSamples], most: u32) -> Self {
        let mut left = pixels.to_vec();
        left.sort_by_key(|p| {
            let (x, y) = (p.pixel % width, p.pixel / width);
            (y / LEAST_ROWS, x / LEAST_ROWS, y, x)
        });
        Self { left, samples: most }
    }
}

impl Iterator for Levels {
    type Item = Level;

    fn next(&mut self) -> Option<Level> {
        self.left.retain(|p| p.count > 0);
        let most = self.left.iter().map(|p| p.count).max()?;
        while self.samples > most {
            self.samples /= 2;
        }
        let samples = self.samples;
        let level = self.left.iter_mut().filter(|p| p.count >= samples).map(|p| {
            let listed = ListedPixel { pixel: p.pixel, first_sample: p.first };
            (p.first, p.count) = (p.first + samples, p.count - samples);
            listed
        });
        Some(Level { pixels: level.collect(), samples })
    }
}

/// Fewest samples of a pixel that a dispatch for listed pixels makes, if it wants as many.
const LEAST_LISTED_SAMPLES: u32 = 4;

/// Walks through the samples of a level: all its pixels with a part of their samples at a time. A list may be too short to keep a
/// device busy; then a dispatch takes as long as the samples of one pixel take after each other, and only fewer of those make
/// it shorter, not fewer pixels.
#[derive(Clone, Copy, Debug)]
pub struct ListPlan {
    pixels: u32,
    samples: u32,
    /// Samples that all pixels have.
    done: u32,
    /// Samples that all pixels are getting now, and the first pixel that is still to get them.
    chunk: u32,
    first: u32,
}

impl ListPlan {
    /// For a list of `pixels` pixels of which each gets `samples` samples.
    pub fn new(pixels: u32, samples: u32) -> Self {
        Self { pixels, samples, done: 0, chunk: 0, first: 0 }
    }

    /// The next batch; `None` when there is nothing left.
    pub fn next(&mut self, pace: &Pace) -> Option<Batch> {
        let left = self.samples - self.done;
        if left == 0 || self.pixels == 0 {
            return None;
        }
        if self.first == 0 {
            let affordable = (pace.budget() / u64::from(self.pixels)).min(u64::from(left)) as u32;
            self.chunk = affordable.max(LEAST_LISTED_SAMPLES.min(left));
        }
        let affordable = (pace.budget() / u64::from(self.chunk)).max(1).next_multiple_of(64);
        let count = affordable.min(MOST_LISTED).min(u64::from(self.pixels - self.first)) as u32;
        let pixels = BatchPixels::Listed { first: self.first, count };
        let batch = Batch { pixels, first_sample: self.done, sample_count: self.chunk };
        self.first += count;
        if self.first == self.pixels {
            (self.first, self.done) = (0, self.done + self.chunk);
        }
        Some(batch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_hold_every_sample_once_and_in_order() {
        let wanted = [0, 1, 4, 12, 300, 999, 64];
        let pixels: Vec<_> =
            (0..500).map(|i| PixelSamples { pixel: i, first: 8, count: wanted[i as usize % 7] }).collect();
        let mut next = vec![8; 500];
        let mut levels = 0;
        for level in Levels::new(25, &pixels, MOST_SAMPLES) {
            levels += 1;
            for p in &level.pixels {
                assert_eq!(p.first_sample, next[p.pixel as usize]);
                next[p.pixel as usize] += level.samples;
            }
        }
        assert!(pixels.iter().all(|p| next[p.pixel as usize] == 8 + p.count));
        assert!(levels < 16, "{levels}");
    }

    /// First entry and number of entries.
    fn entries(batch: &Batch) -> (u32, u32) {
        let BatchPixels::Listed { first, count } = batch.pixels else { panic!("rows: {batch:?}") };
        (first, count)
    }

    /// Every sample of every entry exactly once, whatever the pace.
    #[test]
    fn lists_are_worked_off_once() {
        for cost in [1e-12, 1e-7, 2e-6, 1e-4, 1.0] {
            for (pixels, samples) in [(1, 256), (700, 1), (999, 64), (5000, 4), (0, 8)] {
                let mut plan = ListPlan::new(pixels, samples);
                let mut next = vec![0; pixels as usize];
                while let Some(batch) = plan.next(&Pace { cost }) {
                    let (first, count) = entries(&batch);
                    for given in &mut next[first as usize..(first + count) as usize] {
                        assert_eq!(*given, batch.first_sample, "{cost}: {pixels}, {samples}");
                        *given += batch.sample_count;
                    }
                }
                assert!(next.iter().all(|&n| n == samples), "{cost}: {pixels}, {samples}");
            }
        }
    }

    /// A device that is not busy takes as long for a few pixels as for many. Whoever gives it less and less because it seems slow
    /// waits that long again and again.
    #[test]
    fn short_lists_do_not_take_long() {
        const AT_A_TIME: u32 = 65_536;
        const LATENCY: f64 = 5e-4;
        let mut pace = Pace { cost: LATENCY / f64::from(AT_A_TIME) };
        let mut longest: f64 = 0.0;
        let lists =
            [(3000, 256), (1000, 256), (1000, 256), (1000, 256), (200, 256), (20_000, 64), (800_000, 8)];
        for (pixels, samples) in lists {
            let mut plan = ListPlan::new(pixels, samples);
            let mut taken = 0.0;
            while let Some(batch) = plan.next(&pace) {
                let waves = f64::from(entries(&batch).1.div_ceil(AT_A_TIME));
                let seconds = waves * f64::from(batch.sample_count) * LATENCY;
                pace.learn(
                    u64::from(batch.sample_count) * u64::from(entries(&batch).1),
                    Duration::from_secs_f64(seconds),
                );
                (taken, longest) = (taken + seconds, longest.max(seconds));
            }
            let least = f64::from(pixels.div_ceil(AT_A_TIME) * samples) * LATENCY;
            assert!(
                taken < 2.0 * least,
                "{pixels} pixels of {samples} samples: {taken} s instead of {least}"
            );
        }
        assert!(longest < 0.2, "a dispatch of {longest} s");
    }

    /// First row and number of rows.
    fn rows(batch: &Batch) -> (u32, u32) {
        let BatchPixels::Rows { first, count } = batch.pixels else { panic!("a list: {batch:?}") };
        (first, count)
    }

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
    fn dispatches_get_as_long_as_they_should() {
        let mut pace = Pace::default();
        let true_cost = 5e-9;
        for _ in 0..12 {
            let mut plan = Plan::new(1920, 1080, 0..10_000);
            let batch = plan.next(&pace, 1024).expect("work");
            let samples = 1920 * u64::from(rows(&batch).1) * u64::from(batch.sample_count);
            pace.learn(samples, Duration::from_secs_f64(samples as f64 * true_cost));
        }
        let mut plan = Plan::new(1920, 1080, 0..10_000);
        let batch = plan.next(&pace, 1024).expect("work");
        let seconds = f64::from(1920 * rows(&batch).1) * f64::from(batch.sample_count) * true_cost;
        assert!((0.02..0.05).contains(&seconds), "{seconds} s: {batch:?}");
    }
}
