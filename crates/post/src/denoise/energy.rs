//! Light that filtering has lost is given back.
//!
//! A filter that is not linear changes the mean of a picture: it takes bright pixels for noise. How far the mean of a block of
//! the noisy picture can be believed is known from the variances of its pixels, which are independent. So each block of the
//! filtered picture is brought towards the mean of the noisy one as far as that is certain, and the whole picture to its mean.

use film::Image;

/// Side of a block in pixels.
const BLOCK: usize = 64;
/// How far a filter that was trained to keep means is thought to miss them: relative standard deviation of a block.
const EXPECTED_BIAS: f64 = 0.015;
/// A block becomes by no more than this factor lighter or darker.
const MOST_OF_BLOCK: f64 = 1.25;
/// The same of the whole picture. More is not lost by filtering: it is a handful of pixels that nobody wants back.
const MOST_OF_PICTURE: f64 = 1.25;
/// The gains of blocks run into each other, so one round does not meet all means.
const ROUNDS: usize = 3;

/// Changes the mean of each colour of `filtered` to that of `noisy`, and towards it block by block. All are linear RGB of one
/// size. Without the `variance` of the noisy values only the picture's mean is restored.
pub fn restore(noisy: &Image, variance: Option<&Image>, filtered: &mut Image) {
    if let Some(variance) = variance {
        let wanted = wanted_sums(noisy, variance, filtered);
        for _ in 0..ROUNDS {
            Gains::new(&wanted, filtered).apply(filtered);
        }
    }
    let means = noisy.mean().into_iter().zip(filtered.mean());
    let gains: Vec<f32> = means.map(|(before, after)| ratio(before, after, MOST_OF_PICTURE) as f32).collect();
    for pixel in filtered.data_mut().chunks_exact_mut(3) {
        pixel.iter_mut().zip(&gains).for_each(|(value, gain)| *value *= gain);
    }
}

/// `before / after`, but at most by the factor `most` from 1; 1 where nothing shines.
fn ratio(before: f64, after: f64, most: f64) -> f64 {
    let ratio = before / after;
    if after > 0.0 && ratio.is_finite() { ratio.clamp(1.0 / most, most) } else { 1.0 }
}

/// A factor for each colour of each block.
struct Gains {
    columns: usize,
    rows: usize,
    blocks: Vec<[f64; 3]>,
}

/// What the sums of the blocks of `filtered` should be: those of `noisy`, as far as these are certain.
fn wanted_sums(noisy: &Image, variance: &Image, filtered: &Image) -> Vec<[f64; 3]> {
    let [noisy, variance, filtered] = [noisy, variance, filtered].map(block_sums);
    let wanted = |block: usize, colour: usize| {
        let [before, variance, after] = [&noisy, &variance, &filtered].map(|sums| sums[block][colour]);
        let error = variance.max(0.0) / (after * after).max(f64::MIN_POSITIVE);
        let certain = EXPECTED_BIAS.powi(2) / (EXPECTED_BIAS.powi(2) + error);
        after * (1.0 + certain * (ratio(before, after, MOST_OF_BLOCK) - 1.0))
    };
    (0..noisy.len()).map(|block| [0, 1, 2].map(|colour| wanted(block, colour))).collect()
}

impl Gains {
    /// What brings each block to its wanted sum, if gains were the same all over it.
    fn new(wanted: &[[f64; 3]], filtered: &Image) -> Self {
        let sums = block_sums(filtered);
        let gain =
            |block: usize, colour: usize| ratio(wanted[block][colour], sums[block][colour], MOST_OF_BLOCK);
        let blocks = (0..sums.len()).map(|block| [0, 1, 2].map(|colour| gain(block, colour))).collect();
        let [columns, rows] = [filtered.width(), filtered.height()].map(|n| (n as usize).div_ceil(BLOCK));
        Self { columns, rows, blocks }
    }

    /// Multiplies each pixel by the gains of the blocks around it, which are those of the blocks' centres, and linear between.
    fn apply(&self, image: &mut Image) {
        let width = image.width() as usize;
        for (y, row) in image.data_mut().chunks_exact_mut(3 * width).enumerate() {
            let (above, below, v) = between(y, self.rows);
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                let (left, right, u) = between(x, self.columns);
                for (colour, value) in pixel.iter_mut().enumerate() {
                    let at = |x: usize, y: usize| self.blocks[y * self.columns + x][colour];
                    let upper = at(left, above) * (1.0 - u) + at(right, above) * u;
                    let lower = at(left, below) * (1.0 - u) + at(right, below) * u;
                    *value *= (upper * (1.0 - v) + lower * v) as f32;
                }
            }
        }
    }
}

/// The two of `count` blocks between whose centres a pixel lies, and how near it is to the second.
fn between(pixel: usize, count: usize) -> (usize, usize, f64) {
    let place = ((pixel as f64 + 0.5) / BLOCK as f64 - 0.5).clamp(0.0, (count - 1) as f64);
    let first = place as usize;
    (first, (first + 1).min(count - 1), place - first as f64)
}

/// Sums of each colour over the pixels of each block, row by row.
fn block_sums(image: &Image) -> Vec<[f64; 3]> {
    let [columns, rows] = [image.width(), image.height()].map(|n| (n as usize).div_ceil(BLOCK));
    let mut sums = vec![[0.0; 3]; columns * rows];
    for (y, row) in image.data().chunks_exact(3 * image.width() as usize).enumerate() {
        for (x, pixel) in row.chunks_exact(3).enumerate() {
            let sum = &mut sums[y / BLOCK * columns + x / BLOCK];
            sum.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += f64::from(*value));
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(value: impl Fn(u32, u32) -> f32) -> Image {
        Image::from_fn(200, 130, |x, y| [value(x, y), 2.0 * value(x, y), 0.5])
    }

    /// The left is 2 % too dark, the right 2 % too light: the mean alone would not tell.
    #[test]
    fn certain_blocks_get_their_light_back() {
        let noisy = picture(|x, _| 1.0 + 0.3 * (x as f32 * 0.9).sin());
        let variance = noisy.map(|_| 1e-3);
        let mut filtered = picture(|x, _| if x < 100 { 0.98 } else { 1.02 });
        restore(&noisy, Some(&variance), &mut filtered);
        let sums = [&noisy, &filtered].map(block_sums);
        for (before, after) in sums[0].iter().zip(&sums[1]) {
            for colour in 0..3 {
                assert!((after[colour] / before[colour] - 1.0).abs() < 0.01, "{before:?} {after:?}");
            }
        }
    }

    /// The speck is a tenth of its block's light, and the block is known to a tenth.
    #[test]
    fn what_is_uncertain_changes_little_but_the_mean() {
        let noisy = picture(|x, y| if (x, y) == (30, 40) { 400.0 } else { 1.0 });
        let variance = picture(|x, y| if (x, y) == (30, 40) { 160_000.0 } else { 0.1 });
        let mut filtered = picture(|_, _| 1.0);
        restore(&noisy, Some(&variance), &mut filtered);
        let [first, last] = [filtered.rgb(30, 40)[0], filtered.rgb(190, 120)[0]];
        assert!((first / last - 1.0).abs() < 0.02, "{first} {last}");
        assert!((filtered.mean()[0] / noisy.mean()[0] - 1.0).abs() < 1e-3);
    }

    #[test]
    fn black_stays_black() {
        for noisy in [picture(|_, _| 0.0), picture(|_, _| 1.0)] {
            let mut filtered = noisy.map(|_| 0.0);
            restore(&noisy, Some(&noisy), &mut filtered);
            assert!(filtered.data().iter().all(|v| *v == 0.0));
        }
    }

    #[test]
    fn single_pixels_have_gains() {
        let one = Image::from_fn(1, 1, |_, _| [1.0, 1.0, 1.0]);
        let mut filtered = one.map(|v| v * 1.1);
        restore(&one, None, &mut filtered);
        assert!((filtered.rgb(0, 0)[0] - 1.0).abs() < 1e-6);
    }
}
