//! How often values are in a picture, by stops.

use alhazen::{Image, luminance};
use rayon::prelude::*;

/// Stops of the histogram's left and right end; 0 is where linear display values end.
pub const STOPS: [f32; 2] = [-12.0, 4.0];
/// Bins a stop.
const BINS_PER_STOP: f32 = 8.0;
/// All bins.
pub const BINS: usize = 128;

/// The distribution of a picture's values after exposure: red, green, blue and luminance. That of no
/// picture has no bins.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// Shares of the pixels in each bin, in `[0, 1]`, of red, green, blue and luminance.
    pub bins: [Vec<f32>; 4],
    /// Shares of the pixels at or below the left end, of the same.
    pub below: [f32; 4],
    /// Shares of the pixels above 1, of the same.
    pub above_one: [f32; 4],
    /// Least luminance before exposure.
    pub least: f32,
    /// Mean luminance before exposure.
    pub mean: f32,
    /// Greatest luminance before exposure.
    pub greatest: f32,
    /// Pixels with a value that is not finite; they are counted nowhere else.
    pub not_finite: usize,
}

/// Counts of a part of the picture.
#[derive(Clone)]
struct Counts {
    bins: [Vec<u32>; 4],
    below: [u32; 4],
    above_one: [u32; 4],
    least: f32,
    sum: f64,
    greatest: f32,
    finite: usize,
    not_finite: usize,
}

impl Counts {
    fn new() -> Self {
        Self {
            bins: std::array::from_fn(|_| vec![0; BINS]),
            below: [0; 4],
            above_one: [0; 4],
            least: f32::INFINITY,
            sum: 0.0,
            greatest: f32::NEG_INFINITY,
            finite: 0,
            not_finite: 0,
        }
    }

    fn add(mut self, rgb: &[f32], exposure: f32) -> Self {
        let [r, g, b] = [rgb[0], rgb[1], rgb[2]];
        let level = luminance([r, g, b]);
        if !level.is_finite() {
            self.not_finite += 1;
            return self;
        }
        self.finite += 1;
        self.sum += f64::from(level);
        (self.least, self.greatest) = (self.least.min(level), self.greatest.max(level));
        for (channel, value) in [r, g, b, level].into_iter().enumerate() {
            let value = value * exposure;
            self.above_one[channel] += u32::from(value > 1.0);
            match bin(value) {
                Some(bin) => self.bins[channel][bin] += 1,
                None => self.below[channel] += 1,
            }
        }
        self
    }

    fn merge(mut self, other: Self) -> Self {
        for channel in 0..4 {
            let pairs = self.bins[channel].iter_mut().zip(&other.bins[channel]);
            pairs.for_each(|(a, b)| *a += b);
            self.below[channel] += other.below[channel];
            self.above_one[channel] += other.above_one[channel];
        }
        self.least = self.least.min(other.least);
        self.greatest = self.greatest.max(other.greatest);
        self.sum += other.sum;
        self.finite += other.finite;
        self.not_finite += other.not_finite;
        self
    }
}

/// The bin of a value after exposure; what is brighter than the right end is in the last one.
fn bin(value: f32) -> Option<usize> {
    let place = (value.max(1e-30).log2() - STOPS[0]) * BINS_PER_STOP;
    (place >= 0.0).then_some((place as usize).min(BINS - 1))
}

/// The stop in the middle of a bin.
pub fn stop_of(bin: usize) -> f32 {
    STOPS[0] + (bin as f32 + 0.5) / BINS_PER_STOP
}

impl Histogram {
    /// The histogram of a picture of three channels.
    ///
    /// - `exposure`: factor on its values.
    pub fn of(picture: &Image, exposure: f32) -> Self {
        let add = |counts: Counts, rgb: &[f32]| counts.add(rgb, exposure);
        let pixels = picture.data().par_chunks_exact(3);
        let counts = pixels.fold(Counts::new, add).reduce(Counts::new, Counts::merge);
        let share = |n: u32| n as f32 / counts.finite.max(1) as f32;
        let is_empty = counts.finite == 0;
        Self {
            bins: counts.bins.map(|bins| bins.into_iter().map(share).collect()),
            below: counts.below.map(share),
            above_one: counts.above_one.map(share),
            least: if is_empty { 0.0 } else { counts.least },
            mean: (counts.sum / counts.finite.max(1) as f64) as f32,
            greatest: if is_empty { 0.0 } else { counts.greatest },
            not_finite: counts.not_finite,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_counted_by_stops() {
        // A quarter each: black, 0.25 grey, 1 grey, and red of 8.
        let colours = [[0.0; 3], [0.25; 3], [1.0; 3], [8.0, 0.0, 0.0]];
        let picture = Image::from_fn(4, 5, |x, _| colours[x as usize]);
        let histogram = Histogram::of(&picture, 2.0);
        let green = &histogram.bins[1];
        let at = |stop: f32| ((stop - STOPS[0]) * BINS_PER_STOP) as usize;
        assert_eq!((green[at(-1.0)], green[at(1.0)], histogram.below[1]), (0.25, 0.25, 0.5));
        assert_eq!(histogram.bins[0][at(3.0)], 0.0);
        assert_eq!(histogram.bins[0][BINS - 1], 0.25, "brighter than the end is in the last bin");
        assert_eq!(histogram.above_one, [0.5, 0.25, 0.25, 0.5]);
        for channel in 0..4 {
            let sum = histogram.bins[channel].iter().sum::<f32>() + histogram.below[channel];
            assert!((sum - 1.0).abs() < 1e-6);
        }
        assert_eq!((histogram.least, histogram.not_finite), (0.0, 0));
        assert!((stop_of(at(1.0)) - 1.0).abs() < 0.1);
    }

    #[test]
    fn what_is_not_finite_is_counted_alone() {
        let picture = Image::from_fn(2, 1, |x, _| if x == 0 { [f32::NAN; 3] } else { [0.5; 3] });
        let histogram = Histogram::of(&picture, 1.0);
        assert_eq!((histogram.not_finite, histogram.mean), (1, 0.5));
        let empty = Histogram::of(&Image::from_fn(1, 1, |_, _| [f32::INFINITY; 3]), 1.0);
        assert_eq!((empty.least, empty.mean, empty.greatest), (0.0, 0.0, 0.0));
    }
}
