//! Which pixels deserve more samples.
//!
//! With `v` the variance of one sample of a pixel relative to its squared radiance, and `n` the number of its samples, the
//! relative squared error of a picture is the mean of `v / n`. For a given number of samples in all it is least when `n`
//! is proportional to `√v` (Neyman, "On the Two Different Aspects of the Representative Method", 1934). That is not the
//! allocation that gives all pixels the same error, `n` proportional to `v`: it has the same mean error as equal `n`.
//!
//! **Bias.** A pixel that stops when its own samples look quiet stops too early just when it has missed something bright,
//! so its mean is too dark. Here *a pixel never decides about itself*: its `v` is what its neighbours' samples say, those of
//! a window without its centre. The samples of pixels are independent of each other, so the number that a pixel gets
//! does not depend on what they are, and their plain mean is unbiased. What is left of a dependence goes by two steps: a
//! pixel's samples change how many its neighbours get, and so how well, but not in which direction, the neighbours'
//! variances are known. The level of the whole picture counts, too, with a share of one pixel. Tests look for the bias.
//!
//! The window also is what spreads samples around what is noisy, and what keeps a single bright sample from drawing others to
//! where it happened to fall.

use crate::{Film, PixelStats, Rect};
use rayon::prelude::*;

/// Half the side of the window, in pixels.
const RADIUS: u32 = 2;
/// Standard deviation of the window's weights, in pixels.
const SIGMA: f64 = 1.5;
/// Samples come by so many at a time: a few more or less change little, and points of a sequence come in fours.
const QUANTUM: f64 = 4.0;
/// A round makes the samples of a pixel at most this many times what they were: variances that few samples have found are
/// uncertain.
const GROWTH: f64 = 4.0;

/// How many samples each pixel of a film should have.
#[derive(Clone, Debug)]
pub struct Allocation {
    /// `√v` of each pixel of the window.
    weights: Vec<f64>,
    /// Samples that each pixel has.
    taken: Vec<u64>,
}

impl Allocation {
    /// What a film says so far. `floor` is what is added to the squared radiance that errors are relative to, as in
    /// [`crate::metrics::rel_mse`]; `None` takes that of [`Film::relative_error`].
    ///
    /// `None` if a pixel has fewer than two samples.
    #[must_use]
    pub fn new(film: &Film, floor: Option<f64>) -> Option<Self> {
        let pixels = film.pixels();
        if pixels.iter().any(|p| p.count() < 2) {
            return None;
        }
        let floor = floor.unwrap_or_else(|| film.error_floor());
        let window = film.window();
        let estimates: Vec<Estimate> = pixels.par_iter().map(Estimate::of).collect();
        let variance = |i: usize| relative_variance(&estimates, window, i, floor);
        let weights = (0..pixels.len()).into_par_iter().map(|i| variance(i).sqrt()).collect();
        Some(Self { weights, taken: pixels.iter().map(PixelStats::taken).collect() })
    }

    /// Samples of all pixels so far.
    #[must_use]
    pub fn taken(&self) -> u64 {
        self.taken.iter().sum()
    }

    /// How many samples to add to each pixel, row by row from the top, so that all pixels together have about `total`.
    /// Where all is quiet, every pixel gets the same.
    #[must_use]
    pub fn extra(&self, total: u64) -> Vec<u32> {
        let scale = self.scale(total as f64);
        let wanted = |(weight, taken): (&f64, &u64)| {
            let taken = *taken as f64;
            let extra = (scale * weight).clamp(taken, GROWTH * taken) - taken;
            ((extra / QUANTUM).round() * QUANTUM) as u32
        };
        let extra: Vec<u32> = self.weights.iter().zip(&self.taken).map(wanted).collect();
        let room = total.saturating_sub(self.taken());
        if room > 0 && extra.iter().all(|n| *n == 0) {
            let each = room.div_ceil(self.taken.len().max(1) as u64);
            return vec![u32::try_from(each).unwrap_or(u32::MAX); self.taken.len()];
        }
        extra
    }

    /// The factor on the weights for which pixels have about `total` samples in all; none can give back what it has.
    fn scale(&self, total: f64) -> f64 {
        let of_all = |scale: f64| -> f64 {
            let pixels = self.weights.iter().zip(&self.taken);
            pixels.map(|(w, &n)| (scale * w).clamp(n as f64, GROWTH * n as f64)).sum()
        };
        let mut high = 1.0;
        while of_all(high) < total && high < 1e30 {
            high *= 4.0;
        }
        let mut low = 0.0;
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if of_all(middle) < total { low = middle } else { high = middle }
        }
        low
    }
}

/// What is known of a pixel.
#[derive(Clone, Copy)]
struct Estimate {
    mean: [f64; 3],
    /// Of one sample.
    variance: [f64; 3],
}

impl Estimate {
    fn of(pixel: &PixelStats) -> Self {
        Self { mean: pixel.mean(), variance: pixel.variance().unwrap_or_default() }
    }
}

/// Variance of a sample of pixel `index` relative to its squared radiance, the mean of the colours, as its neighbours have
/// it. One if it has none.
fn relative_variance(estimates: &[Estimate], window: Rect, index: usize, floor: f64) -> f64 {
    let width = window.width as usize;
    let (x, y) = ((index % width) as u32, (index / width) as u32);
    let range = |at: u32, end: u32| at.saturating_sub(RADIUS)..(at + RADIUS + 1).min(end);
    let (mut mean, mut variance, mut sum) = ([0.0; 3], [0.0; 3], 0.0);
    for row in range(y, window.height) {
        for column in range(x, window.width) {
            let (dx, dy) = (f64::from(column) - f64::from(x), f64::from(row) - f64::from(y));
            if dx == 0.0 && dy == 0.0 {
                continue;
            }
            let weight = (-0.5 * (dx * dx + dy * dy) / (SIGMA * SIGMA)).exp();
            let neighbour = &estimates[row as usize * width + column as usize];
            for c in 0..3 {
                mean[c] += weight * neighbour.mean[c];
                variance[c] += weight * neighbour.variance[c];
            }
            sum += weight;
        }
    }
    if sum == 0.0 {
        return 1.0;
    }
    let of_colour = |c: usize| {
        let (mean, variance) = (mean[c] / sum, variance[c] / sum);
        if variance > 0.0 { variance / (mean * mean + floor) } else { 0.0 }
    };
    (0..3).map(of_colour).sum::<f64>() / 3.0
}

#[cfg(test)]
mod tests;
