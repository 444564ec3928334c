//! How far an image is from a reference.
//!
//! The first image is always the reference. All metrics but [`flip`] compare linear values; tone mapping would hide
//! errors in the dark and in the bright.

use crate::Image;
use crate::flip::error_map;
use crate::srgb::{linear_to_srgb, to_u8};
use elementary::{exp2, log10, powi};

/// What is added to the squared reference in [`rel_mse`], as in Mitsuba's tests and much of the literature.
pub const REL_MSE_EPSILON: f64 = 1e-2;

/// Why two images cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// The images differ in size.
    #[error("the picture has {}×{} pixels, the reference {}×{}", actual.0, actual.1, reference.0, reference.1)]
    Size {
        /// Width and height of the reference.
        reference: (u32, u32),
        /// Width and height of the other image.
        actual: (u32, u32),
    },
    /// There are no pixels.
    #[error("there are no pixels to compare")]
    Empty,
    /// A value is NaN or infinite: no metric means anything then.
    #[error("the {which} has a value that is not finite, first in pixel ({x}, {y})")]
    NotFinite {
        /// `"reference"` or `"picture"`.
        which: &'static str,
        /// Column of the first such pixel.
        x: u32,
        /// Row of the first such pixel.
        y: u32,
    },
}

/// Mean squared error over all pixels and the three colours: `mean((a - r)²)`.
///
/// # Errors
/// [`MetricError`] if the images cannot be compared.
pub fn mse(reference: &Image, actual: &Image) -> Result<f64, MetricError> {
    mean_over(reference, actual, |r, a| (a - r) * (a - r))
}

/// Relative mean squared error over all pixels and the three colours: `mean((a - r)² / (r² + 0.01))`.
///
/// The constant ([`REL_MSE_EPSILON`]) suits pictures of ordinary brightness, around one. It keeps black pixels from
/// dividing by zero, and it means that the metric changes when both images are scaled.
///
/// # Errors
/// [`MetricError`] if the images cannot be compared.
pub fn rel_mse(reference: &Image, actual: &Image) -> Result<f64, MetricError> {
    mean_over(reference, actual, |r, a| (a - r) * (a - r) / (r * r + REL_MSE_EPSILON))
}

/// Peak signal-to-noise ratio in decibels, `10·log₁₀(1 / MSE)`, over sRGB-encoded values cut off to `[0, 1]` at exposure
/// zero, so that the peak is one. Infinite for images that look the same.
///
/// # Errors
/// [`MetricError`] if the images cannot be compared.
pub fn psnr(reference: &Image, actual: &Image) -> Result<f64, MetricError> {
    let encode = |v: f64| f64::from(linear_to_srgb((v as f32).clamp(0.0, 1.0)));
    let mse = mean_over(reference, actual, |r, a| powi(encode(a) - encode(r), 2))?;
    Ok(-10.0 * log10(mse))
}

/// The result of [`flip`].
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Mean error, in `[0, 1]`: the one number that FLIP's authors recommend.
    pub mean: f64,
    /// Largest error of a pixel, in `[0, 1]`.
    pub max: f64,
    /// The error of each pixel, in `[0, 1]`; one channel.
    pub map: Image,
}

/// LDR-FLIP: the difference that a viewer notices when flipping between the two images, who sees 67 pixels per degree
/// (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020).
///
/// Both images are multiplied by 2^`exposure_stops`, cut off to `[0, 1]`, encoded as sRGB and rounded to 8 bits. No tone
/// mapping: apply it before, and compare with zero stops, to compare what a tone-mapped picture looks like. What is
/// brighter than one in both images counts as equal.
///
/// # Errors
/// [`MetricError`] if the images cannot be compared.
pub fn flip(reference: &Image, actual: &Image, exposure_stops: f32) -> Result<Flip, MetricError> {
    check(reference, actual)?;
    let (width, height) = (reference.width(), reference.height());
    let scale = exp2(exposure_stops);
    let encode = |image: &Image| -> Vec<[u8; 3]> {
        let code = |v: f32| to_u8(linear_to_srgb((v * scale).clamp(0.0, 1.0)));
        image.to_rgb().data().chunks_exact(3).map(|p| [code(p[0]), code(p[1]), code(p[2])]).collect()
    };
    let errors = error_map(width as usize, &encode(reference), &encode(actual));
    let mean = errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64;
    let max = errors.iter().copied().fold(0.0, f32::max);
    let mut map = Image::black(width, height, 1);
    map.data_mut().copy_from_slice(&errors);
    Ok(Flip { mean, max: f64::from(max), map })
}

/// A picture of the signed differences `actual - reference`, linear RGB: zero where the images agree.
///
/// # Errors
/// [`MetricError`] if the images differ in size or have no pixels.
pub fn difference(reference: &Image, actual: &Image) -> Result<Image, MetricError> {
    check_size(reference, actual)?;
    let mut result = actual.to_rgb();
    result.data_mut().iter_mut().zip(reference.to_rgb().data()).for_each(|(a, r)| *a -= r);
    Ok(result)
}

/// A picture for people, display-encoded: grey where the images agree, red where `actual` is brighter, blue where it is
/// darker, fully so at a relative difference of `range` (for example 0.1) of each pixel's mean.
///
/// # Errors
/// [`MetricError`] if the images differ in size or have no pixels.
pub fn difference_picture(reference: &Image, actual: &Image, range: f32) -> Result<Image, MetricError> {
    check_size(reference, actual)?;
    Ok(Image::from_fn(reference.width(), reference.height(), |x, y| {
        let level = |image: &Image| image.rgb(x, y).iter().sum::<f32>() / 3.0;
        let (r, a) = (level(reference), level(actual));
        let floor = REL_MSE_EPSILON.sqrt() as f32;
        let t = (a - r) / (r.abs().max(floor) * range.max(f32::MIN_POSITIVE));
        if t.is_nan() {
            return [1.0, 1.0, 0.0];
        }
        let (warm, cold) = (t.clamp(0.0, 1.0) * 0.5, (-t).clamp(0.0, 1.0) * 0.5);
        [0.5 + warm - cold, 0.5 - warm - cold, 0.5 - warm + cold]
    }))
}

fn check_size(reference: &Image, actual: &Image) -> Result<(), MetricError> {
    let size = |image: &Image| (image.width(), image.height());
    if size(reference) != size(actual) {
        return Err(MetricError::Size { reference: size(reference), actual: size(actual) });
    }
    if reference.data().is_empty() { Err(MetricError::Empty) } else { Ok(()) }
}

fn check(reference: &Image, actual: &Image) -> Result<(), MetricError> {
    check_size(reference, actual)?;
    for (which, image) in [("reference", reference), ("picture", actual)] {
        if let Some(at) = image.data().iter().position(|v| !v.is_finite()) {
            let (pixel, width) = (at / image.channels(), image.width() as usize);
            return Err(MetricError::NotFinite {
                which,
                x: (pixel % width) as u32,
                y: (pixel / width) as u32,
            });
        }
    }
    Ok(())
}

fn mean_over(reference: &Image, actual: &Image, f: impl Fn(f64, f64) -> f64) -> Result<f64, MetricError> {
    check(reference, actual)?;
    let (reference, actual) = (reference.to_rgb(), actual.to_rgb());
    let pairs = reference.data().iter().zip(actual.data());
    let sum: f64 = pairs.map(|(&r, &a)| f(f64::from(r), f64::from(a))).sum();
    Ok(sum / reference.data().len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(v: f32) -> Image {
        Image::from_fn(32, 32, |_, _| [v; 3])
    }

    #[test]
    fn formulas() {
        let (r, a) = (flat(0.5), flat(0.6));
        let close = |actual: f64, expected: f64| (actual - expected).abs() < 1e-6 * expected;
        assert!(close(mse(&r, &a).unwrap(), 0.01));
        assert!(close(rel_mse(&r, &a).unwrap(), 0.01 / 0.26));
        let step = f64::from(linear_to_srgb(0.6) - linear_to_srgb(0.5));
        assert!(close(psnr(&r, &a).unwrap(), -20.0 * step.log10()));
        assert_eq!(difference(&r, &a).unwrap().data()[0], 0.6 - 0.5);
    }

    #[test]
    fn equal_images_have_no_error() {
        let image = Image::from_fn(24, 16, |x, y| [x as f32 / 8.0, y as f32 / 16.0, 0.1]);
        assert_eq!(mse(&image, &image), Ok(0.0));
        assert_eq!(rel_mse(&image, &image), Ok(0.0));
        assert_eq!(psnr(&image, &image), Ok(f64::INFINITY));
        let flip = flip(&image, &image, 0.0).unwrap();
        assert_eq!((flip.mean, flip.max), (0.0, 0.0));
        assert!(difference_picture(&image, &image, 0.1).unwrap().data().iter().all(|&v| v == 0.5));
    }

    #[test]
    fn flip_grows_with_the_difference_and_points_at_it() {
        let reference = flat(0.2);
        let with_spot = |v: f32| {
            Image::from_fn(32, 32, |x, y| {
                [if (12..16).contains(&x) && (12..16).contains(&y) { v } else { 0.2 }; 3]
            })
        };
        let small = flip(&reference, &with_spot(0.25), 0.0).unwrap();
        let large = flip(&reference, &with_spot(0.9), 0.0).unwrap();
        assert!(
            0.0 < small.mean && small.mean < large.mean && large.mean < 1.0,
            "{} {}",
            small.mean,
            large.mean
        );
        assert!(large.map.pixel(13, 13)[0] > 0.3);
        assert!(large.map.pixel(0, 31)[0] < 0.01);
        let black_and_white = flip(&flat(0.0), &flat(1.0), 0.0).unwrap();
        assert!(black_and_white.mean > 0.9, "{}", black_and_white.mean);
        let darkened = flip(&flat(0.0), &flat(1.0), -20.0).unwrap();
        assert_eq!(darkened.mean, 0.0);
    }

    #[test]
    fn what_cannot_be_compared_is_an_error() {
        let image = flat(0.5);
        let size = MetricError::Size { reference: (32, 32), actual: (4, 4) };
        assert_eq!(mse(&image, &Image::black(4, 4, 3)), Err(size.clone()));
        assert_eq!(difference(&image, &Image::black(4, 4, 3)), Err(size));
        let empty = Image::black(0, 4, 3);
        assert_eq!(rel_mse(&empty, &empty), Err(MetricError::Empty));
        let mut broken = image.clone();
        broken.data_mut()[3 * 33 + 1] = f32::NAN;
        assert_eq!(flip(&image, &broken, 0.0), Err(MetricError::NotFinite { which: "picture", x: 1, y: 1 }));
        assert_eq!(difference_picture(&image, &broken, 0.1).unwrap().rgb(1, 1), [1.0, 1.0, 0.0]);
    }
}
