//! What noise does not explain stays.
//!
//! A network that has been trained on noisy pictures smooths a little even where there is nothing to smooth. The film knows how
//! far each pixel can be from the truth, so a filtered pixel is kept within two standard deviations of the noisy one. As
//! samples are added, the result goes to the mean of the samples, whatever the network has not learned.

use film::Image;
use rayon::prelude::*;

/// How many standard deviations a pixel may be moved. Less costs where samples are few, and the deviation is itself a guess;
/// more keeps what the network smooths away. Of 1, 1.5, 2, 3 and 4 the best over five scenes with 4, 16 and 64 samples.
const DEVIATIONS: f32 = 2.0;

/// Half the side of the square whose mean variance a pixel has at least: one that has found no light yet is not certain.
const RADIUS: usize = 2;

/// Moves the values of `filtered` to within [`DEVIATIONS`] of those of `noisy`. All are RGB of one size.
pub fn limit(noisy: &Image, variance: &Image, filtered: &mut Image) {
    let (width, height) = (noisy.width() as usize, noisy.height() as usize);
    if width == 0 || height == 0 {
        return;
    }
    let pitch = 3 * width;
    filtered.data_mut().par_chunks_exact_mut(pitch).enumerate().for_each(|(y, row)| {
        let rows = y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height);
        let columns = column_sums(&variance.data()[rows.start * pitch..rows.end * pitch], pitch);
        for x in 0..width {
            let around = x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(width);
            let share = 1.0 / (around.len() * rows.len()) as f32;
            for colour in 0..3 {
                let sum: f32 = around.clone().map(|x| columns[3 * x + colour]).sum();
                let i = y * pitch + 3 * x + colour;
                let reach = DEVIATIONS * variance.data()[i].max(share * sum).max(0.0).sqrt();
                let (value, centre) = (&mut row[3 * x + colour], noisy.data()[i].max(0.0));
                // Also false for what is no number.
                if reach < (*value - centre).abs() {
                    *value = centre + reach.copysign(*value - centre);
                }
            }
        }
    });
}

/// Sums over rows of `pitch` values.
fn column_sums(rows: &[f32], pitch: usize) -> Vec<f32> {
    let mut sums = vec![0.0; pitch];
    for row in rows.chunks_exact(pitch) {
        sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
    }
    sums
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
        assert!((filtered.rgb(4, 3)[0] - 2.0 * (0.24f32).sqrt()).abs() < 1e-5, "{:?}", filtered.rgb(4, 3));
    }
}
