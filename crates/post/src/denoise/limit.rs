//! What noise does not explain stays.
//!
//! A network that has been trained on noisy pictures smooths a little even where there is nothing to smooth. The film knows how
//! far each pixel can be from the truth, so a filtered pixel is kept within some standard deviations of the noisy one. As
//! samples are added, the result goes to the mean of the samples, whatever the network has not learned.

use film::Image;
use rayon::prelude::*;

/// How many standard deviations a pixel may be moved. Less costs where samples are few, and the deviation is itself a guess;
/// more keeps what the network smooths away. Of 1, 1.5, 2, 3 and 4 the best over five scenes with 4, 16 and 64 samples.
const DEVIATIONS: f32 = 2.0;

/// How many more where none of the pixels around has found light: all of them are black without a variance, because samples
/// were too few to hit a lamp that is small. Without that, black squares stay in dim rooms. Of 0, 4 and 6 the best over nine
/// scenes with 4, 16 and 64 samples.
const MORE_IN_THE_DARK: f32 = 4.0;

/// Half the side of the square whose mean variance a pixel has at least: one that has found no light yet is not certain.
const RADIUS: usize = 10;

/// Half the side of the square in which pixels without a variance are counted.
const DARK_RADIUS: usize = 2;

/// Moves the values of `filtered` to within [`DEVIATIONS`] of those of `noisy`. All are RGB of one size.
pub fn limit(noisy: &Image, variance: &Image, filtered: &mut Image) {
    let (width, height) = (noisy.width() as usize, noisy.height() as usize);
    if width == 0 || height == 0 {
        return;
    }
    let pitch = 3 * width;
    let is_dark = |v: f32| f32::from(u8::from(v <= 0.0));
    filtered.data_mut().par_chunks_exact_mut(pitch).enumerate().for_each(|(y, row)| {
        let means = Means::new(variance.data(), pitch, y, RADIUS, |v| v);
        let dark = Means::new(variance.data(), pitch, y, DARK_RADIUS, is_dark);
        for x in 0..width {
            for colour in 0..3 {
                let i = y * pitch + 3 * x + colour;
                let variance = variance.data()[i].max(means.at(x, colour)).max(0.0);
                let reach = (DEVIATIONS + MORE_IN_THE_DARK * dark.at(x, colour)) * variance.sqrt();
                let (value, centre) = (&mut row[3 * x + colour], noisy.data()[i].max(0.0));
                // Also false for what is no number.
                if reach < (*value - centre).abs() {
                    *value = centre + reach.copysign(*value - centre);
                }
            }
        }
    });
}

/// Means over squares around the pixels of a row, cut off at the edges.
struct Means {
    /// Sums over the square's rows for each column and colour.
    columns: Vec<f32>,
    rows: usize,
    radius: usize,
}

impl Means {
    /// Of what `of` makes of values. `pitch`: values of a row, three for each pixel; `y`: the row.
    fn new(values: &[f32], pitch: usize, y: usize, radius: usize, of: impl Fn(f32) -> f32) -> Self {
        let rows = y.saturating_sub(radius)..(y + radius + 1).min(values.len() / pitch);
        let mut columns = vec![0.0; pitch];
        for row in values[rows.start * pitch..rows.end * pitch].chunks_exact(pitch) {
            columns.iter_mut().zip(row).for_each(|(sum, value)| *sum += of(*value));
        }
        Self { columns, rows: rows.len(), radius }
    }

    /// The mean around pixel `x`.
    fn at(&self, x: usize, colour: usize) -> f32 {
        let around = x.saturating_sub(self.radius)..(x + self.radius + 1).min(self.columns.len() / 3);
        let count = around.len() * self.rows;
        around.map(|x| self.columns[3 * x + colour]).sum::<f32>() / count as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32) -> Image {
        Image::from_fn(9, 7, |_, _| [value, 2.0 * value, 0.0])
    }

    #[test]
    fn without_noise_nothing_changes() {
        let (noisy, mut filtered) = (flat(1.0), flat(1.3));
        limit(&noisy, &flat(0.0), &mut filtered);
        assert_eq!(filtered, noisy);
    }

    #[test]
    fn a_pixel_moves_by_two_deviations_at_most() {
        for (change, expected) in [(0.1, 0.1), (0.5, 0.2), (-0.5, -0.2)] {
            let mut filtered = flat(1.0 + change);
            limit(&flat(1.0), &flat(0.01), &mut filtered);
            let found = filtered.rgb(4, 3)[0] - 1.0;
            assert!((found - expected).abs() < 1e-5, "{change}: {found}");
        }
    }

    /// The neighbours of a dark pixel know better.
    #[test]
    fn what_has_found_no_light_is_not_certain() {
        let dark = |x: u32, y: u32| (x, y) == (4, 3);
        let picture =
            |value: f32| Image::from_fn(9, 7, move |x, y| if dark(x, y) { [0.0; 3] } else { [value; 3] });
        let mut filtered = flat(1.0);
        limit(&picture(1.0), &picture(0.25), &mut filtered);
        let reach = (2.0 + 4.0 / 25.0) * (0.25f32 * 62.0 / 63.0).sqrt();
        assert!((filtered.rgb(4, 3)[0] - reach.min(1.0)).abs() < 1e-5, "{:?}", filtered.rgb(4, 3));
    }

    /// Where few samples hit a lamp, whole squares are black, and what the network makes of their surroundings stays.
    #[test]
    fn black_squares_in_noise_do_not_stay() {
        let lit = |x: u32, y: u32| x.abs_diff(20) > 3 || y.abs_diff(20) > 3;
        let noise = Image::from_fn(41, 41, |x, y| if lit(x, y) { [1.0; 3] } else { [0.0; 3] });
        let mut filtered = Image::from_fn(41, 41, |_, _| [0.8; 3]);
        limit(&noise, &noise, &mut filtered);
        assert_eq!(filtered.rgb(20, 20), [0.8; 3]);
    }
}
