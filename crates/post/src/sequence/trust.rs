//! How far the history is believed: as far as noise explains how it differs from the new frame.
//!
//! Frame and history are averaged by the inverse of their variances, as a Kalman filter does. To
//! the history's comes what it is wrong by: light and reflections change where surfaces do not.
//! That shows in the differences around a pixel. Their mean is further from zero, or their mean
//! square larger, than the variances of both say.
//!
//! Variances are means over the surroundings: a pixel's own is large where a bright sample is, and
//! weights that depend on what they weigh lose light.

use super::reproject::Before;
use super::{Past, Surface};
use elementary::powi;
use rayon::prelude::*;

/// Half the side of the square whose pixels are compared.
const RADIUS: usize = 4;

/// As many frames the history counts for at most, while anything moves: what is seen at another
/// angle looks different, and looking up blurs.
const MOST_FRAMES: f32 = 32.0;

/// The same of a view that stands still.
const MOST_STILL_FRAMES: f32 = 1024.0;

/// As many variances the square of the mean difference exceeds zero by chance, while anything
/// moves: what is more shows that the light has changed.
const CHANCE: f32 = 1.0;

/// The same of a view that stands still. Less is taken for a change now and then, and the picture
/// would stop converging.
const STILL_CHANCE: f32 = 6.0;

/// By how much more than expected the mean square of the differences has to be, relatively:
/// variances are estimates.
const MARGIN: f32 = 0.5;

/// Half the side of the square in which edges are looked for.
const EDGE_RADIUS: usize = 2;

/// How much of a pixel at an edge may belong to the other side in the last frame, where it does not
/// in this one.
const EDGE_SHARE: f32 = 0.3;

/// How a pixel's history differs from the new frame. Of a pixel without history all is zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pixel {
    /// Irradiance of the frame, each colour.
    value: [f32; 3],
    /// History minus frame, each colour.
    difference: [f32; 3],
    /// Variance of the frame, sum of the colours.
    own: f32,
    /// The same of the history.
    before: f32,
    /// Whether there is a history: 0 or 1.
    count: f32,
}

impl Pixel {
    /// Of pixel `i` of a frame.
    pub fn new(frame: &Past, before: Option<Before>, i: usize) -> Self {
        let value = frame.irradiance[i];
        let own = frame.variance[i].iter().sum();
        let Some(before) = before else { return Self { value, own, ..Self::default() } };
        Self {
            value,
            difference: std::array::from_fn(|c| before.irradiance[c] - frame.irradiance[i][c]),
            own,
            before: before.variance.iter().sum(),
            count: 1.0,
        }
    }
}

/// What is known of a pixel's history.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trust {
    /// Its share in the pixel, in `[0, 1)`.
    pub weight: f32,
    /// The square of what it may be wrong by, sum of the colours.
    pub wrong: f32,
}

/// How far the history of each pixel is believed. The surroundings are those of the same surface.
pub fn trust(
    pixels: &[Pixel],
    surfaces: &[Surface],
    [width, height]: [usize; 2],
    is_still: bool,
) -> Vec<Trust> {
    let (most, chance) = if is_still { (MOST_STILL_FRAMES, STILL_CHANCE) } else { (MOST_FRAMES, CHANCE) };
    let trust = |i: usize| {
        if pixels[i].count == 0.0 {
            return Trust::default();
        }
        let (x, y) = (i % width, i / width);
        let square = |radius: usize| {
            let columns = x.saturating_sub(radius)..(x + radius + 1).min(width);
            let rows = y.saturating_sub(radius)..(y + radius + 1).min(height);
            rows.flat_map(move |row| row * width + columns.start..row * width + columns.end)
        };
        let is_same = |at: usize| surfaces[at].ids == surfaces[i].ids;
        let mut around = Around::default();
        square(RADIUS).filter(|at| is_same(*at)).for_each(|at| around.add(&pixels[at]));
        let contrast = if is_still { 0.0 } else { contrast(square(EDGE_RADIUS), pixels, is_same) };
        around.trust(most, chance, EDGE_SHARE * EDGE_SHARE * contrast)
    };
    (0..pixels.len()).into_par_iter().map(trust).collect()
}

/// The square of the difference between the light on a surface and beside it, beyond what is noise;
/// 0 inside of a surface.
fn contrast(square: impl Iterator<Item = usize>, pixels: &[Pixel], is_same: impl Fn(usize) -> bool) -> f32 {
    let mut sides = [Side::default(); 2];
    square.for_each(|at| sides[usize::from(is_same(at))].add(&pixels[at]));
    let [beside, own] = sides;
    if beside.count == 0.0 {
        return 0.0;
    }
    let square: f32 = (0..3).map(|c| powi(own.mean(c) - beside.mean(c), 2)).sum();
    (square - own.variance_of_mean() - beside.variance_of_mean()).max(0.0)
}

/// The light on one side of an edge: sums.
#[derive(Clone, Copy, Default)]
struct Side {
    value: [f32; 3],
    variance: f32,
    count: f32,
}

impl Side {
    fn add(&mut self, pixel: &Pixel) {
        (0..3).for_each(|c| self.value[c] += pixel.value[c]);
        self.variance += pixel.own;
        self.count += 1.0;
    }

    fn mean(&self, colour: usize) -> f32 {
        self.value[colour] / self.count
    }

    fn variance_of_mean(&self) -> f32 {
        self.variance / (self.count * self.count)
    }
}

/// Sums over the surroundings of a pixel.
#[derive(Default)]
struct Around {
    difference: [f32; 3],
    square: f32,
    own: f32,
    before: f32,
    count: f32,
}

impl Around {
    fn add(&mut self, pixel: &Pixel) {
        if pixel.count == 0.0 {
            return;
        }
        for c in 0..3 {
            self.difference[c] += pixel.difference[c];
            self.square += pixel.difference[c] * pixel.difference[c];
        }
        self.own += pixel.own;
        self.before += pixel.before;
        self.count += 1.0;
    }

    /// `misplaced`: the square of what the history may be wrong by for where it is looked up.
    fn trust(&self, most: f32, chance: f32, misplaced: f32) -> Trust {
        let mean = |sum: f32| sum / self.count;
        let (own, before) = (mean(self.own), mean(self.before));
        let explained = own + before;
        let square_of_mean: f32 = self.difference.map(|d| mean(d) * mean(d)).iter().sum();
        let shifted = square_of_mean - chance * explained / self.count;
        let scattered = mean(self.square) - (1.0 + MARGIN) * explained;
        let wrong = shifted.max(scattered).max(0.0) + misplaced;
        let uncertain = (before + wrong).max(own / most);
        let weight = own / (own + uncertain);
        if weight.is_finite() { Trust { weight, wrong } } else { Trust::default() }
    }
}
