//! What is still to be made of a picture, in pieces that members take.

use backend::PixelSamples;
use std::ops::Range;

/// Samples of all pixels of a window, and samples of some.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Todo {
    /// Of every pixel.
    pub samples: Vec<Range<u32>>,
    /// Of some.
    pub pixels: Vec<PixelSamples>,
}

impl Todo {
    /// These samples of every pixel.
    pub fn of_samples(range: Range<u32>) -> Self {
        Self { samples: std::iter::once(range).collect(), pixels: Vec::new() }
    }

    pub fn is_empty(&self) -> bool {
        self.samples.is_empty() && self.pixels.is_empty()
    }

    /// Samples of all pixels together, in a window of `area` pixels.
    pub fn amount(&self, area: u64) -> u64 {
        let whole: u64 = self.samples.iter().map(|r| r.len() as u64).sum();
        whole * area + self.pixels.iter().map(|p| u64::from(p.count)).sum::<u64>()
    }

    /// Puts something back.
    pub fn append(&mut self, mut other: Self) {
        self.samples.append(&mut other.samples);
        self.pixels.append(&mut other.pixels);
    }

    /// Takes about `wanted` samples away: of every pixel at least one, or of some pixels.
    pub fn take(&mut self, wanted: u64, area: u64) -> Self {
        let mut piece = Self::default();
        if let Some(range) = self.samples.last_mut() {
            let count = (wanted / area.max(1)).clamp(1, range.len().max(1) as u64) as u32;
            // In their order: a pixel's first samples are made first.
            let end = range.start.saturating_add(count).min(range.end);
            piece.samples.push(range.start..end);
            range.start = end;
            if range.start == range.end {
                self.samples.pop();
            }
            return piece;
        }
        let mut sum = 0;
        let count = self.pixels.iter().rev().take_while(|p| {
            let fits = sum < wanted.max(1);
            sum += u64::from(p.count);
            fits
        });
        let count = count.count();
        piece.pixels = self.pixels.split_off(self.pixels.len() - count);
        piece
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_is_taken_once() {
        let area = 10;
        let pixels: Vec<_> = (0..7).map(|pixel| PixelSamples { pixel, first: 3, count: pixel }).collect();
        let mut todo = Todo { samples: vec![20..21, 0..17], pixels: pixels.clone() };
        let all = todo.amount(area);
        assert_eq!(all, 180 + 21);
        let (mut taken, mut made) = (0, Todo::default());
        while !todo.is_empty() {
            let piece = todo.take(45, area);
            assert!(piece.samples.len() + piece.pixels.len().min(1) == 1, "{piece:?}");
            taken += piece.amount(area);
            made.append(piece);
        }
        assert_eq!(taken, all);
        made.pixels.sort_by_key(|p| p.pixel);
        assert_eq!(made.pixels, pixels);
        let mut samples: Vec<u32> = made.samples.into_iter().flatten().collect();
        samples.sort_unstable();
        assert_eq!(samples, (0..17).chain([20]).collect::<Vec<_>>());
    }
}
