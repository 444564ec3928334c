//! An image that knows how sure it is.

use std::path::Path;

use film::{Film, Image, ImageError};

/// How far the values of a reference image may be from the truth, as standard deviations per pixel and channel; the
/// two add up as independent errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceError {
    /// In units of radiance.
    pub absolute: f64,
    /// As a share of the value. Half-float files have at least [`ReferenceError::HALF`].
    pub relative: f64,
}

impl ReferenceError {
    /// The relative rounding error of a value stored as a half float: 2⁻¹¹/√3.
    pub const HALF: f64 = 2.82e-4;
}

/// An estimate of an expected image: mean and variance of that mean for each pixel and channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// Linear RGB radiance, `width × height` pixels, row 0 at the top.
    pub mean: Vec<[f64; 3]>,
    /// Variance of each mean (not of one sample): its square root is the standard error.
    pub variance: Vec<[f64; 3]>,
}

impl Estimate {
    /// The estimate on a film, whose window becomes the whole image. The variance is estimated from the samples as if
    /// they were independent: with a low-discrepancy sampler it is too large, and tests lose power.
    ///
    /// # Panics
    /// If a pixel has fewer than two samples.
    #[must_use]
    pub fn from_film(film: &Film) -> Self {
        let window = film.window();
        let variance = film.pixels().iter().enumerate().map(|(i, pixel)| {
            let samples = pixel.count();
            pixel.variance_of_mean().unwrap_or_else(|| {
                panic!("pixel {i} has only {samples} samples, which say nothing about its variance")
            })
        });
        Self {
            width: window.width,
            height: window.height,
            variance: variance.collect(),
            mean: film.pixels().iter().map(film::PixelStats::mean).collect(),
        }
    }

    /// The estimate that averages several independent renders of the same scene, for example with different seeds. The
    /// variance comes from how they differ, so it is right for any sampler; take at least eight.
    ///
    /// # Panics
    /// If there are fewer than two films, or their windows differ in size.
    #[must_use]
    pub fn from_renders(films: &[Film]) -> Self {
        assert!(films.len() >= 2, "one render says nothing about its variance");
        let (window, n) = (films[0].window(), films.len() as f64);
        let same_size = |f: &Film| (f.window().width, f.window().height) == (window.width, window.height);
        assert!(films.iter().all(same_size), "the renders differ in size");
        let (mut mean, mut variance) = (Vec::new(), Vec::new());
        for i in 0..window.area() {
            let means: Vec<[f64; 3]> = films.iter().map(|f| f.pixels()[i].mean()).collect();
            let m: [f64; 3] = std::array::from_fn(|c| means.iter().map(|m| m[c]).sum::<f64>() / n);
            let square = |c: usize| means.iter().map(|x| (x[c] - m[c]).powi(2)).sum::<f64>();
            variance.push(std::array::from_fn(|c| square(c) / (n - 1.0) / n));
            mean.push(m);
        }
        Self { width: window.width, height: window.height, mean, variance }
    }

    /// A converged image, with its error.
    #[must_use]
    pub fn from_image(image: &Image, error: ReferenceError) -> Self {
        let rgb = image.to_rgb();
        let mean: Vec<[f64; 3]> =
            rgb.data().chunks_exact(3).map(|p| std::array::from_fn(|c| f64::from(p[c]))).collect();
        let variance =
            |m: &[f64; 3]| m.map(|m| error.absolute * error.absolute + (error.relative * m).powi(2));
        Self {
            width: image.width(),
            height: image.height(),
            variance: mean.iter().map(variance).collect(),
            mean,
        }
    }

    /// A reference image with the settings beside it: `PATH.exr` and `PATH.json`, whose `std_error_mean_pixel` is the
    /// standard error of a pixel, averaged over the image. As noise mostly grows with the square root of the radiance,
    /// the variance is spread over pixels in proportion to it.
    ///
    /// # Errors
    /// If the image cannot be opened, or the settings cannot be read or do not have the number.
    pub fn open_reference(path_without_extension: &Path) -> Result<Self, ImageError> {
        let image = Image::open(path_without_extension.with_extension("exr"))?;
        let path = path_without_extension.with_extension("json");
        let text = std::fs::read_to_string(&path)
            .map_err(|source| ImageError::Read { path: path.clone(), source })?;
        let settings: serde_json::Value = serde_json::from_str(&text)
            .map_err(|e| ImageError::Decode { path: path.clone(), reason: e.to_string() })?;
        let error = settings["std_error_mean_pixel"].as_f64().ok_or_else(|| ImageError::Decode {
            path,
            reason: "there is no number `std_error_mean_pixel`".into(),
        })?;
        let mut estimate = Self::from_image(&image, ReferenceError::default());
        let level = estimate.level();
        for (variance, mean) in estimate.variance.iter_mut().zip(&estimate.mean) {
            *variance = mean.map(|m| error * error * m.abs() / level.max(f64::MIN_POSITIVE));
        }
        Ok(estimate)
    }

    /// The same means, with no variance below the mean of the variances within `radius` pixels.
    ///
    /// Where light comes by rare bright samples, a pixel that happened to miss them underestimates its mean *and* its
    /// variance, and would fail tests of single pixels. Its neighbours know better. Where neighbours differ, as at
    /// edges, tests lose some power.
    #[must_use]
    pub fn with_variance_of_neighbours(mut self, radius: u32) -> Self {
        self.variance = self.at_least_the_mean_around(&self.variance, radius);
        self
    }

    /// The same means, with no variance below the noise that is seen within `radius` pixels.
    ///
    /// The error of a reference image is often known as one number, though its noise differs from place to place. What
    /// is measured is what a filter leaves that takes away everything linear (Immerkær, "Fast Noise Variance
    /// Estimation", 1996): at edges it is too large, and tests lose some power there.
    #[must_use]
    pub fn with_measured_noise(mut self, radius: u32) -> Self {
        let (width, height) = (self.width as usize, self.height as usize);
        let inside = |i: usize, end: usize| i.clamp(1, end.saturating_sub(2).max(1));
        let square = |i: usize| {
            let (x, y) = (inside(i % width, width), inside(i / width, height));
            let mut sum = [0.0; 3];
            for (dy, dx) in (0..9).map(|k| (k / 3, k % 3)) {
                let weight = [1.0, -2.0, 1.0][dx] * [1.0, -2.0, 1.0][dy];
                let pixel = (y + dy - 1).min(height - 1) * width + (x + dx - 1).min(width - 1);
                (0..3).for_each(|c| sum[c] += weight * self.mean[pixel][c]);
            }
            sum.map(|s: f64| s * s / 36.0)
        };
        let noise: Vec<[f64; 3]> = (0..self.mean.len()).map(square).collect();
        self.variance = self.at_least_the_mean_around(&noise, radius);
        self
    }

    /// The variances, each no less than the mean of `values` within `radius` pixels.
    fn at_least_the_mean_around(&self, values: &[[f64; 3]], radius: u32) -> Vec<[f64; 3]> {
        let (width, height, r) = (self.width as usize, self.height as usize, radius as usize);
        let around = |at: usize, end: usize| at.saturating_sub(r)..(at + r + 1).min(end);
        let pooled = |i: usize| {
            let (x, y) = (i % width, i / width);
            let pixels = around(y, height).flat_map(|y| around(x, width).map(move |x| y * width + x));
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for pixel in pixels {
                (0..3).for_each(|c| sum[c] += values[pixel][c]);
                count += 1.0;
            }
            std::array::from_fn(|c| self.variance[i][c].max(sum[c] / count))
        };
        (0..self.variance.len()).map(pooled).collect()
    }

    /// The means as an image.
    #[must_use]
    pub fn to_image(&self) -> Image {
        let width = self.width as usize;
        Image::from_fn(self.width, self.height, |x, y| {
            self.mean[y as usize * width + x as usize].map(|m| m as f32)
        })
    }

    /// The mean of each channel over the image.
    #[must_use]
    pub fn mean_colour(&self) -> [f64; 3] {
        let n = self.mean.len().max(1) as f64;
        std::array::from_fn(|c| self.mean.iter().map(|m| m[c]).sum::<f64>() / n)
    }

    /// The mean of the absolute values over all pixels and channels.
    fn level(&self) -> f64 {
        let n = (3 * self.mean.len()).max(1) as f64;
        self.mean.iter().flatten().map(|m| m.abs()).sum::<f64>() / n
    }
}
