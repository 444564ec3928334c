//! Do two noisy images have the same expectation?

use std::fmt::Write as _;
use std::path::PathBuf;

use film::{ExrCompression, ExrFile, Image, ImageError, Precision, linear_to_srgb, metrics};

use crate::{Estimate, SIGNIFICANCE, normal_quantile, output_dir, sidak};

/// The block size that tests the whole image as one block.
pub const WHOLE_IMAGE: usize = usize::MAX;

/// How to compare two estimates. Start from [`Comparison::new`] and change what a scene needs, saying why.
///
/// One z-test per channel of each block: `z = Σ(mean_a - mean_b) / √Σ(variance_a + variance_b)`. A block fails beyond the
/// `z` that correct renders exceed anywhere with a chance of 0.1 % (Šidák correction over all tests of the call).
///
/// **Power.** With a relative standard error `e` per pixel in each image, a block of `n` pixels notices a relative error
/// of brightness of about `√2·(z + 1)·e/√n`, where `z` is about 5.5 for thousands of blocks and 3.4 for one. On 64×64 pixels
/// of uniform noise at 64 samples (`e` = 7 %), that is 65 % for single pixels, 7 % for blocks of 8×8, and 0.7 % for
/// the whole image. So run 1, 8 and [`WHOLE_IMAGE`]: small blocks find a broken pixel, large ones find lost energy.
///
/// **Few samples.** The variance of a pixel is itself an estimate. Below some 64 samples a pixel it is so rough that correct
/// renders fail at one-pixel blocks; larger blocks average it.
///
/// **Fireflies** break the normal approximation: a pixel that missed its rare bright paths has too low a mean *and* too
/// low a variance. Take more samples, raise [`variance_floor`](Self::variance_floor), or allow a share of single pixels
/// to fail.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// What is compared: for messages, and for the folder of pictures.
    pub name: String,
    /// Side of the square blocks, in pixels; what is larger than the image is cut to its size. Incomplete
    /// blocks at the right and bottom edges are not tested.
    pub block: usize,
    /// The least variance of a pixel and channel, as a share of its mean over the image. Default 0.01.
    pub variance_floor: f64,
    /// The least standard deviation of a pixel, relative to its value: rounding, which statistics know nothing
    /// of. Default 1e-5.
    pub rounding: f64,
    /// The share of the tests that may fail at one-pixel blocks; zero for larger blocks whatever this says. Default 0.
    pub failing_share: f64,
    /// Whether a failure leaves pictures in [`output_dir`]. Default true.
    pub pictures: bool,
}

/// The block and channel with the largest `|z|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstBlock {
    /// Column and row of its top left pixel.
    pub at: (u32, u32),
    /// 0, 1 or 2.
    pub channel: usize,
    /// Its z score: positive where the first image is brighter.
    pub z: f64,
    /// The first image's mean over the block.
    pub mean_a: f64,
    /// The second image's mean over the block.
    pub mean_b: f64,
    /// The standard error of their difference.
    pub standard_error: f64,
}

/// What a comparison found.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The number of tests: three times the number of blocks.
    pub tests: usize,
    /// How many failed.
    pub failures: usize,
    /// How many were allowed to.
    pub allowed: usize,
    /// The largest `|z|` that passes.
    pub z_max: f64,
    /// The block that is furthest off.
    pub worst: WorstBlock,
    /// Width and height of a block, in pixels.
    pub block: (usize, usize),
    /// The z score with the largest magnitude over the channels of each block, row by row.
    pub z: Vec<f64>,
}

impl Report {
    /// Whether the images agree.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.failures <= self.allowed
    }
}

/// Asserts that two independent renders have the same expected image, with the defaults of [`Comparison`]: a correct
/// renderer fails with a chance below 0.1 %.
///
/// # Panics
/// If they do not, naming the worst block and where pictures were left; or if their sizes differ or a value is not
/// finite.
#[track_caller]
pub fn assert_same_expectation(a: &Estimate, b: &Estimate, block: usize) {
    let thread = std::thread::current();
    Comparison::new(thread.name().unwrap_or("comparison"), block).assert(a, b);
}

impl Comparison {
    /// The default comparison by blocks of `block` × `block` pixels.
    #[must_use]
    pub fn new(name: impl Into<String>, block: usize) -> Self {
        Self {
            name: name.into(),
            block,
            variance_floor: 0.01,
            rounding: 1e-5,
            failing_share: 0.0,
            pictures: true,
        }
    }

    /// Compares, without judging.
    ///
    /// # Panics
    /// If the sizes differ, there are no pixels, or a value is not finite.
    #[must_use]
    #[track_caller]
    pub fn run(&self, a: &Estimate, b: &Estimate) -> Report {
        assert_eq!((a.width, a.height), (b.width, b.height), "{}: the images differ in size", self.name);
        assert!(!a.mean.is_empty() && self.block > 0, "{}: nothing to compare", self.name);
        for (which, estimate) in [("first", a), ("second", b)] {
            let values = estimate.mean.iter().chain(&estimate.variance);
            assert!(values.flatten().all(|v| v.is_finite()), "{}: NaN in the {which} image", self.name);
        }
        let (width, height) = (a.width as usize, a.height as usize);
        let block = (self.block.min(width), self.block.min(height));
        let blocks = (width / block.0, height / block.1);
        let tests = 3 * blocks.0 * blocks.1;
        let z_max = -normal_quantile(sidak(SIGNIFICANCE, tests) / 2.0);

        let pixels = a.mean.len() as f64;
        let floor: [f64; 3] = std::array::from_fn(|c| {
            let sum = a.variance.iter().chain(&b.variance).map(|v| v[c]).sum::<f64>();
            self.variance_floor * sum / pixels
        });
        let variance = |i: usize, c: usize| {
            let rounding = self.rounding * a.mean[i][c].abs().max(b.mean[i][c].abs());
            (a.variance[i][c] + b.variance[i][c]).max(floor[c]).max(rounding * rounding)
        };

        let mut worst: Option<WorstBlock> = None;
        let (mut failures, mut scores) = (0, Vec::with_capacity(blocks.0 * blocks.1));
        for (by, bx) in (0..blocks.1).flat_map(|by| (0..blocks.0).map(move |bx| (by, bx))) {
            let mut block_z = 0.0_f64;
            for channel in 0..3 {
                let (mut sum_a, mut sum_b, mut sum_variance) = (0.0, 0.0, 0.0);
                for y in by * block.1..(by + 1) * block.1 {
                    for i in y * width + bx * block.0..y * width + (bx + 1) * block.0 {
                        sum_a += a.mean[i][channel];
                        sum_b += b.mean[i][channel];
                        sum_variance += variance(i, channel);
                    }
                }
                // Without any variance, only black against black agrees.
                let difference = sum_a - sum_b;
                let z = if difference == 0.0 { 0.0 } else { difference / sum_variance.sqrt() };
                failures += usize::from(z.abs() > z_max);
                if z.abs() > block_z.abs() {
                    block_z = z;
                }
                if worst.is_none_or(|w| z.abs() > w.z.abs()) {
                    let n = (block.0 * block.1) as f64;
                    let at = ((bx * block.0) as u32, (by * block.1) as u32);
                    let standard_error = sum_variance.sqrt() / n;
                    worst = Some(WorstBlock {
                        at,
                        channel,
                        z,
                        mean_a: sum_a / n,
                        mean_b: sum_b / n,
                        standard_error,
                    });
                }
            }
            scores.push(block_z);
        }
        let share = if block == (1, 1) { self.failing_share } else { 0.0 };
        let allowed = (share * tests as f64) as usize;
        let Some(worst) = worst else { panic!("{}: nothing to compare", self.name) };
        Report { tests, failures, allowed, z_max, worst, block, z: scores }
    }

    /// Compares, and panics if the images have different expectations.
    ///
    /// # Panics
    /// See [`assert_same_expectation`].
    #[track_caller]
    pub fn assert(&self, a: &Estimate, b: &Estimate) {
        let report = self.run(a, b);
        if !report.passed() {
            panic!("{}", self.message(a, b, &report));
        }
    }

    fn message(&self, a: &Estimate, b: &Estimate, report: &Report) -> String {
        let w = &report.worst;
        let percent = |a: f64, b: f64| 100.0 * (a / b - 1.0);
        let (all_a, all_b) = (a.mean_colour(), b.mean_colour());
        let mut text = format!(
            "{}: the expected images differ: {} of {} tests by blocks of {}×{} pixels failed, {} allowed (|z| > {:.2})\n",
            self.name,
            report.failures,
            report.tests,
            report.block.0,
            report.block.1,
            report.allowed,
            report.z_max
        );
        let _ = writeln!(
            text,
            "  worst: block at ({}, {}), {}: {:.6} against {:.6} ({:+.2} %), standard error {:.6}, z = {:+.1}",
            w.at.0,
            w.at.1,
            ["red", "green", "blue"][w.channel],
            w.mean_a,
            w.mean_b,
            percent(w.mean_a, w.mean_b),
            w.standard_error,
            w.z
        );
        let ratio: [f64; 3] = std::array::from_fn(|c| percent(all_a[c], all_b[c]));
        let _ = writeln!(text, "  whole image: {all_a:.6?} against {all_b:.6?} ({ratio:+.3?} %)");
        if self.pictures {
            let _ = match self.write_pictures(a, b, report) {
                Ok(dir) => write!(text, "  pictures: {}", dir.display()),
                Err(error) => write!(text, "  no pictures: {error}"),
            };
        }
        text
    }

    fn write_pictures(&self, a: &Estimate, b: &Estimate, report: &Report) -> Result<PathBuf, ImageError> {
        let dir = output_dir(&self.name);
        std::fs::create_dir_all(&dir).map_err(|source| ImageError::Write { path: dir.clone(), source })?;
        let (actual, expected) = (a.to_image(), b.to_image());
        for (name, image) in [("actual", &actual), ("expected", &expected)] {
            let path = dir.join(name);
            let exr = ExrFile::from_image(image, Precision::Float);
            exr.write(&path.with_extension("exr"), ExrCompression::Zip)?;
            image
                .map(|v| linear_to_srgb(v.clamp(0.0, 1.0)))
                .write_png_encoded(&path.with_extension("png"))?;
        }
        if let Ok(picture) = metrics::difference_picture(&expected, &actual, 0.1) {
            picture.write_png_encoded(&dir.join("difference.png"))?;
        }
        self.z_picture(a, report).write_png_encoded(&dir.join("z.png"))?;
        Ok(dir)
    }

    /// Grey where blocks agree, red where the first image is brighter, blue where it is darker, fully so where
    /// the test fails.
    fn z_picture(&self, a: &Estimate, report: &Report) -> Image {
        let columns = a.width as usize / report.block.0;
        Image::from_fn(a.width, a.height, |x, y| {
            let (bx, by) = (x as usize / report.block.0, y as usize / report.block.1);
            let z = if bx < columns { report.z.get(by * columns + bx) } else { None };
            let Some(z) = z else { return [0.0; 3] };
            let t = (z / report.z_max).clamp(-1.0, 1.0) as f32;
            [0.5 + 0.5 * t, 0.5 - 0.5 * t.abs(), 0.5 - 0.5 * t]
        })
    }
}

#[cfg(test)]
mod tests;
