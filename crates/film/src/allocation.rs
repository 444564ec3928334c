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
//!
//! What is decided for a pixel are functions of the optics ([`optics::rounds`]), which GPUs run on films of their own.

use crate::{Film, PixelStats, Rect};
use optics::rounds::{
    ROUND_RADIUS, neighbour_weight, neighbours_add, neighbours_none, neighbours_say, samples_deserved,
    samples_of_round,
};
use optics::{Vec3f, vec3f};
use rayon::prelude::*;

/// Pixels whose samples are added up by one thread: sums do not depend on the number of threads.
const CHUNK: usize = 1 << 14;

/// How many samples each pixel of a film should have.
#[derive(Clone, Debug)]
pub struct Allocation {
    /// `√v` of each pixel of the window.
    weights: Vec<f32>,
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
        let floor = floor.unwrap_or_else(|| film.error_floor()) as f32;
        let estimates: Vec<Estimate> = pixels.par_iter().map(Estimate::of).collect();
        let neighbours = Neighbours { estimates: &estimates, window: film.window(), floor };
        let weights = (0..pixels.len()).into_par_iter().map(|i| neighbours.weight(i)).collect();
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
        let scale = self.scale(total as f64) as f32;
        let added = |(&weight, &taken): (&f32, &u64)| {
            let taken = taken as f32;
            samples_of_round(samples_deserved(scale, weight, taken), taken)
        };
        let extra: Vec<u32> = self.weights.par_iter().zip(&self.taken).map(added).collect();
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
            let of = |(&weight, &taken): (&f32, &u64)| {
                f64::from(samples_deserved(scale as f32, weight, taken as f32))
            };
            let chunks = self.weights.par_chunks(CHUNK).zip(self.taken.par_chunks(CHUNK));
            let sums: Vec<f64> = chunks.map(|(w, n)| w.iter().zip(n).map(of).sum()).collect();
            sums.iter().sum()
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
    mean: Vec3f,
    /// Of one sample.
    variance: Vec3f,
}

impl Estimate {
    fn of(pixel: &PixelStats) -> Self {
        let single = |v: [f64; 3]| vec3f(v[0] as f32, v[1] as f32, v[2] as f32);
        Self { mean: single(pixel.mean()), variance: single(pixel.variance().unwrap_or_default()) }
    }
}

/// What neighbours say about pixels.
struct Neighbours<'a> {
    estimates: &'a [Estimate],
    window: Rect,
    floor: f32,
}

impl Neighbours<'_> {
    /// The root of the relative variance of a sample of pixel `index`, as its neighbours have it. One if it has none.
    fn weight(&self, index: usize) -> f32 {
        let width = self.window.width as usize;
        let (x, y) = ((index % width) as u32, (index / width) as u32);
        let range = |at: u32, end: u32| at.saturating_sub(ROUND_RADIUS)..(at + ROUND_RADIUS + 1).min(end);
        let mut neighbours = neighbours_none();
        for row in range(y, self.window.height) {
            for column in range(x, self.window.width) {
                let weight = neighbour_weight(column as f32 - x as f32, row as f32 - y as f32);
                let neighbour = &self.estimates[row as usize * width + column as usize];
                neighbours = neighbours_add(neighbours, weight, neighbour.mean, neighbour.variance);
            }
        }
        neighbours_say(neighbours, self.floor)
    }
}

#[cfg(test)]
mod tests;
