//! Light that filtering has lost is given back.
//!
//! A filter that is not linear changes the mean of a picture: it takes bright pixels for noise. How
//! far the mean of a block of the noisy picture can be believed is known from the variances of its
//! pixels, which are independent. So each block of the filtered picture is brought towards the mean
//! of the noisy one as far as that is certain, and then the whole picture to its mean.
//!
//! Of all changes with a given sum, that with the least squares has shares in proportion to the
//! pixels' expected squared errors (Lagrange). Errors count relative to values, so a share of the
//! picture's light goes by the square of a value. A pixel without noise, as of a lamp that is seen
//! directly, has lost nothing and gets nothing ([`Doubt`]).

use super::limit::Means;
use film::Image;
use rayon::prelude::*;

/// Side of a block in pixels.
const BLOCK: usize = 64;
/// How far a filter that was trained to keep means is thought to miss them: relative standard
/// deviation of a block.
const EXPECTED_BIAS: f64 = 0.015;
/// A block becomes by no more than this factor lighter or darker.
const MOST_OF_BLOCK: f64 = 1.25;
/// The same of a pixel that gets its share of what the picture has lost. The largest change in a
/// picture of one sample is often that, but only one pixel in a hundred changes by a tenth.
const MOST_OF_PIXEL: f64 = 2.0;
/// The same of the whole picture. More is not lost by filtering: it is a handful of pixels that
/// nobody wants back.
const MOST_OF_PICTURE: f64 = 1.25;
/// The gains of blocks run into each other, so one round does not meet all means.
const ROUNDS: usize = 3;
/// Most steps towards the picture's mean. What is missing then is a factor of all pixels.
const STEPS: usize = 6;
/// A mean is met when no more of it than this is missing.
const MET: f64 = 1e-6;
/// A pixel whose standard deviation is more than this of its value may have lost all that filters
/// lose. Of 0.02, 0.06 and 0.18 the best over twelve scenes with 1 to 256 samples.
const NOISY: f32 = 0.02;
/// Half the side of the square whose mean variance counts: that of one pixel is itself a guess.
const RADIUS: usize = 2;

/// Changes the mean of each colour of `filtered` to that of `noisy`, and towards it block by block.
/// All are linear RGB of one size. Without the `variance` of the noisy values only the picture's
/// mean is restored.
pub fn restore(noisy: &Image, variance: Option<&Image>, filtered: &mut Image) {
    if filtered.data().is_empty() {
        return;
    }
    let doubt = Doubt::new(noisy, variance, filtered);
    if let Some(variance) = variance {
        let wanted = wanted_sums(noisy, variance, filtered);
        for _ in 0..ROUNDS {
            Gains::new(&wanted, &doubt, filtered).apply(&doubt, filtered);
        }
    }
    restore_mean(noisy, &doubt, filtered);
}

/// `before / after`, but at most by the factor `most` from 1; 1 where nothing shines.
fn ratio(before: f64, after: f64, most: f64) -> f64 {
    let ratio = before / after;
    if after > 0.0 && ratio.is_finite() { ratio.clamp(1.0 / most, most) } else { 1.0 }
}

/// The square below which a value is all noise, for each value of the picture.
struct Doubt(Vec<f32>);

impl Doubt {
    /// From the variance, or where nobody knows that, from how far the filter has moved each value.
    fn new(noisy: &Image, variance: Option<&Image>, filtered: &Image) -> Self {
        let moved = || -> Vec<f32> {
            noisy.data().par_iter().zip(filtered.data()).map(|(a, b)| (a - b) * (a - b)).collect()
        };
        let moved = if variance.is_none() { moved() } else { Vec::new() };
        let variance = variance.map_or(moved.as_slice(), Image::data);
        let pitch = 3 * filtered.width() as usize;
        let mut squares = vec![0.0; variance.len()];
        squares.par_chunks_exact_mut(pitch).enumerate().for_each(|(y, row)| {
            let means = Means::new(variance, pitch, y, RADIUS, |v| v.max(0.0));
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                for (colour, square) in pixel.iter_mut().enumerate() {
                    *square = (means.at(x, colour) / (NOISY * NOISY)).min(f32::MAX);
                }
            }
        });
        Self(squares)
    }

    /// The part of value `i` that noise may have: all of it, or less where little is in doubt.
    fn part(&self, i: usize, value: f32) -> f64 {
        f64::from(value.min(self.0[i] / value).max(0.0))
    }

    /// The same, by the square of the value.
    fn square(&self, i: usize, value: f64) -> f64 {
        (value * value).min(f64::from(self.0[i]))
    }
}

/// Brings the mean of each colour of `filtered` to that of `noisy`. Each value `v` becomes
/// `v + λ min(v², doubt)`; Newton's method finds the `λ` of each colour.
fn restore_mean(noisy: &Image, doubt: &Doubt, filtered: &mut Image) {
    let values = filtered.data().len() as f64 / 3.0;
    let mean = noisy.mean();
    let wanted = [0, 1, 2].map(|colour| mean[colour] * values);
    let mut strength = [0.0; 3];
    let mut found = [0.0; 3];
    for step in 0..=STEPS {
        let (sums, slopes) = totals(filtered, doubt, strength);
        found = sums;
        let missing = [0, 1, 2].map(|colour| wanted[colour] - found[colour]);
        let met = |colour: usize| {
            let step = missing[colour] / slopes[colour];
            !(step.is_finite() && missing[colour].abs() > MET * wanted[colour])
        };
        if step == STEPS || (0..3).all(met) {
            break;
        }
        (0..3).filter(|c| !met(*c)).for_each(|c| strength[c] += missing[c] / slopes[c]);
    }
    let rest = [0, 1, 2].map(|colour| ratio(wanted[colour], found[colour], MOST_OF_PICTURE));
    let pitch = 3 * filtered.width() as usize;
    filtered.data_mut().par_chunks_exact_mut(pitch).enumerate().for_each(|(y, row)| {
        for (i, value) in row.iter_mut().enumerate() {
            let share = doubt.square(y * pitch + i, f64::from(*value));
            *value = (rest[i % 3] * changed(f64::from(*value), strength[i % 3] * share)) as f32;
        }
    });
}

/// A value with its share, but not changed by more than [`MOST_OF_PIXEL`].
fn changed(value: f64, share: f64) -> f64 {
    (value + share).max(value / MOST_OF_PIXEL).min(value * MOST_OF_PIXEL)
}

/// The sum of each colour if shares had that `strength`, and how it grows with that. Rows are summed
/// by themselves, so that the bits do not depend on the number of threads.
fn totals(image: &Image, doubt: &Doubt, strength: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let pitch = 3 * image.width() as usize;
    let row = |(y, row): (usize, &[f32])| {
        let (mut sums, mut slopes) = ([0.0; 3], [0.0; 3]);
        for (x, pixel) in row.chunks_exact(3).enumerate() {
            for colour in 0..3 {
                let value = f64::from(pixel[colour]);
                let square = doubt.square(y * pitch + 3 * x + colour, value);
                let share = strength[colour] * square;
                let kept = changed(value, share);
                sums[colour] += kept;
                slopes[colour] += if kept == value + share { square } else { 0.0 };
            }
        }
        (sums, slopes)
    };
    let rows: Vec<_> = image.data().par_chunks_exact(pitch).enumerate().map(row).collect();
    rows.iter().fold(Default::default(), |total: ([f64; 3], [f64; 3]), (sums, slopes)| {
        (added(total.0, *sums), added(total.1, *slopes))
    })
}

fn added(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] + b[i])
}

/// A change for each colour of each block: what is added to a value, divided by its part that may be
/// noise.
struct Gains {
    columns: usize,
    rows: usize,
    blocks: Vec<[f64; 3]>,
}

/// What the sums of the blocks of `filtered` should be: those of `noisy`, as far as these are
/// certain.
fn wanted_sums(noisy: &Image, variance: &Image, filtered: &Image) -> Vec<[f64; 3]> {
    let [noisy, variance, filtered] =
        [noisy, variance, filtered].map(|image| block_sums(image, |_, value| f64::from(value)));
    let wanted = |block: usize, colour: usize| {
        let [before, variance, after] = [&noisy, &variance, &filtered].map(|sums| sums[block][colour]);
        let error = variance.max(0.0) / (after * after).max(f64::MIN_POSITIVE);
        let certain = EXPECTED_BIAS.powi(2) / (EXPECTED_BIAS.powi(2) + error);
        after * (1.0 + certain * (ratio(before, after, MOST_OF_BLOCK) - 1.0))
    };
    (0..noisy.len()).map(|block| [0, 1, 2].map(|colour| wanted(block, colour))).collect()
}

impl Gains {
    /// What brings each block to its wanted sum, if changes were the same all over it.
    fn new(wanted: &[[f64; 3]], doubt: &Doubt, filtered: &Image) -> Self {
        let sums = block_sums(filtered, |_, value| f64::from(value));
        let parts = block_sums(filtered, |i, value| doubt.part(i, value));
        let gain = |block: usize, colour: usize| {
            let missing = wanted[block][colour] - sums[block][colour];
            let gain = missing / parts[block][colour];
            if gain.is_finite() { gain.clamp(1.0 / MOST_OF_BLOCK - 1.0, MOST_OF_BLOCK - 1.0) } else { 0.0 }
        };
        let blocks = (0..sums.len()).map(|block| [0, 1, 2].map(|colour| gain(block, colour))).collect();
        let [columns, rows] = [filtered.width(), filtered.height()].map(|n| (n as usize).div_ceil(BLOCK));
        Self { columns, rows, blocks }
    }

    /// Changes each pixel by the gains of the blocks around it, which are those of the blocks'
    /// centres, and linear between.
    fn apply(&self, doubt: &Doubt, image: &mut Image) {
        let pitch = 3 * image.width() as usize;
        let across: Vec<_> = (0..image.width() as usize).map(|x| between(x, self.columns)).collect();
        image.data_mut().par_chunks_exact_mut(pitch).enumerate().for_each(|(y, row)| {
            let (above, below, v) = between(y, self.rows);
            let of = |row: usize| &self.blocks[row * self.columns..(row + 1) * self.columns];
            let mix = |(a, b): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|i| a[i] * (1.0 - v) + b[i] * v);
            let gains: Vec<_> = of(above).iter().zip(of(below)).map(mix).collect();
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                let (left, right, u) = across[x];
                for (colour, value) in pixel.iter_mut().enumerate() {
                    let gain = gains[left][colour] * (1.0 - u) + gains[right][colour] * u;
                    *value += (gain * doubt.part(y * pitch + 3 * x + colour, *value)) as f32;
                }
            }
        });
    }
}

/// The two of `count` blocks between whose centres a pixel lies, and how near it is to the second.
fn between(pixel: usize, count: usize) -> (usize, usize, f64) {
    let place = ((pixel as f64 + 0.5) / BLOCK as f64 - 0.5).clamp(0.0, (count - 1) as f64);
    let first = place as usize;
    (first, (first + 1).min(count - 1), place - first as f64)
}

/// Sums of what `of` makes of the place and the value, over the pixels of each block, for each
/// colour, row by row.
fn block_sums(image: &Image, of: impl Fn(usize, f32) -> f64 + Sync) -> Vec<[f64; 3]> {
    let pitch = 3 * image.width() as usize;
    let columns = (image.width() as usize).div_ceil(BLOCK);
    let strips = image.data().par_chunks(pitch * BLOCK).enumerate();
    let sums = strips.flat_map_iter(|(strip, values)| {
        let mut sums = vec![[0.0; 3]; columns];
        for (y, row) in values.chunks_exact(pitch).enumerate() {
            let first = (strip * BLOCK + y) * pitch;
            for (i, value) in row.iter().enumerate() {
                sums[i / (3 * BLOCK)][i % 3] += of(first + i, *value);
            }
        }
        sums
    });
    sums.collect()
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
        let sums = [&noisy, &filtered].map(|image| block_sums(image, |_, value| f64::from(value)));
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

    /// Waves that filtering has made 3 % too dark beside a lamp of 50 without noise.
    fn waves_and_lamp() -> [Image; 3] {
        let lamp = |x: u32, y: u32| (80..100).contains(&x) && (50..70).contains(&y);
        let wave = |x: u32, y: u32| 1.0 + 0.5 * (x as f32 * 0.9).sin() * (y as f32 * 0.7).cos();
        let noisy = picture(|x, y| if lamp(x, y) { 50.0 } else { wave(x, y) });
        let variance = picture(|x, y| if lamp(x, y) { 0.0 } else { 0.01 });
        let filtered = picture(|x, y| if lamp(x, y) { 50.0 } else { 0.97 * wave(x, y) });
        [noisy, variance, filtered]
    }

    #[test]
    fn sums_are_kept_and_a_lamp_without_noise_stays() {
        let [noisy, variance, dark] = waves_and_lamp();
        for variance in [Some(&variance), None] {
            let mut filtered = dark.clone();
            restore(&noisy, variance, &mut filtered);
            for (before, after) in noisy.mean().iter().zip(filtered.mean()) {
                assert!((after / before - 1.0).abs() < 1e-5, "{before} {after}");
            }
            assert!((filtered.rgb(90, 60)[0] / 50.0 - 1.0).abs() < 1e-5, "{:?}", filtered.rgb(90, 60));
            assert!(filtered.rgb(10, 10)[0] > dark.rgb(10, 10)[0]);
        }
    }

    /// Noise of a single sample, three times as strong where it is three times as bright.
    #[test]
    fn light_goes_where_it_is_bright() {
        let level = |x: u32| if x < 100 { 1.0 } else { 3.0 };
        let noisy = picture(|x, y| level(x) * if (x + y) % 2 == 0 { 2.0 } else { 0.1 });
        let dark = picture(|x, _| level(x));
        let mut filtered = dark.clone();
        restore(&noisy, None, &mut filtered);
        let gain = |x: u32| filtered.rgb(x, 60)[0] / dark.rgb(x, 60)[0] - 1.0;
        assert!((gain(150) / gain(50) - 3.0).abs() < 1e-3, "{} {}", gain(50), gain(150));
    }

    /// Where nothing but one pixel is in doubt, that does not become a firefly.
    #[test]
    fn no_pixel_takes_all_that_is_missing() {
        let noisy = picture(|_, _| 1.0);
        let variance = picture(|x, y| if (x, y) == (30, 40) { 1.0 } else { 0.0 });
        let mut filtered = picture(|_, _| 0.99);
        restore(&noisy, Some(&variance), &mut filtered);
        assert!((filtered.mean()[0] / noisy.mean()[0] - 1.0).abs() < 1e-5);
        assert!(filtered.rgb(30, 40)[0] < 2.0, "{:?}", filtered.rgb(30, 40));
    }

    #[test]
    fn bits_do_not_depend_on_threads() {
        let [noisy, variance, dark] = waves_and_lamp();
        let on = |threads: usize| {
            let mut filtered = dark.clone();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| restore(&noisy, Some(&variance), &mut filtered));
            filtered
        };
        assert_eq!(on(1), on(3));
    }
}
