//! How far a picture is from another one, which is the reference: pixel by pixel, and in one number.
//!
//! The measures are those of tev: error, absolute and squared error, and both relative to the
//! reference.

use crate::worker::heat;
use alhazen::metrics::{self, MetricError, REL_MSE_EPSILON};
use alhazen::{Image, luminance};
use egui::{Color32, ColorImage};
use rayon::prelude::*;

/// What is shown of a difference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Difference {
    /// Brighter is red, darker is blue.
    Signed,
    /// `|a - r|`
    #[default]
    Absolute,
    /// `(a - r)²`
    Squared,
    /// `|a - r| / (|r| + 0.01)`
    RelativeAbsolute,
    /// `(a - r)² / (r² + 0.01)`
    RelativeSquared,
}

/// Differences above this are shown in the last colour; each of the five steps of colour below is a
/// factor of ten.
const GREATEST: f32 = 1.0;
/// Powers of ten that the colours stand for.
const DECADES: f32 = 5.0;

impl Difference {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Signed, Self::Absolute, Self::Squared, Self::RelativeAbsolute, Self::RelativeSquared];

    /// What the user calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Signed => "signed",
            Self::Absolute => "absolute",
            Self::Squared => "squared",
            Self::RelativeAbsolute => "relative absolute",
            Self::RelativeSquared => "relative squared",
        }
    }

    /// Of a value and that of the reference.
    pub fn of(self, actual: f32, reference: f32) -> f32 {
        let error = actual - reference;
        match self {
            Self::Signed => error,
            Self::Absolute => error.abs(),
            Self::Squared => error * error,
            Self::RelativeAbsolute => error.abs() / (reference.abs() + 0.01),
            Self::RelativeSquared => error * error / (reference * reference + REL_MSE_EPSILON as f32),
        }
    }

    /// The colours from the least difference (0) to the greatest (1), and what both ends stand for.
    pub fn scale(self) -> (impl Fn(f32) -> Color32, [&'static str; 3]) {
        let colour = move |t: f32| match self {
            Self::Signed if t < 0.5 => self.colour([-from_share(1.0 - 2.0 * t); 3]),
            Self::Signed => self.colour([from_share(2.0 * t - 1.0); 3]),
            _ => heat(t),
        };
        let labels = match self {
            Self::Signed => ["-1", "0", "+1"],
            _ => ["≤ 1e-5", "3e-3", "≥ 1"],
        };
        (colour, labels)
    }

    /// The colour of a difference of three channels.
    fn colour(self, error: [f32; 3]) -> Color32 {
        let level = luminance(error);
        if level.is_nan() {
            return Color32::from_rgb(255, 0, 255);
        }
        if self == Self::Signed {
            let part = |v: f32| ((1.0 - share(v)) * 255.0) as u8;
            let (warm, cold) = (part(level.max(0.0)), part((-level).max(0.0)));
            // White where both agree, red where it is brighter, blue where it is darker.
            return Color32::from_rgb(cold, warm.min(cold), warm);
        }
        heat(share(level))
    }
}

/// Where a difference is among the colours, in `[0, 1]`, by its logarithm.
fn share(difference: f32) -> f32 {
    (1.0 + (difference.max(1e-20) / GREATEST).log10() / DECADES).clamp(0.0, 1.0)
}

/// The difference at a place among the colours.
fn from_share(share: f32) -> f32 {
    GREATEST * 10f32.powf((share - 1.0) * DECADES)
}

/// A picture of a difference, and its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// In false colours; as large as the picture.
    pub picture: ColorImage,
    /// Mean of the difference over all pixels and channels.
    pub mean: f64,
    /// Greatest luminance of the difference, regardless of its sign, and the pixel that has it.
    pub greatest: (f32, [u32; 2]),
    /// Mean squared error.
    pub mse: f64,
    /// Relative mean squared error.
    pub rel_mse: f64,
    /// Peak signal-to-noise ratio of the pictures encoded as sRGB, decibels; infinite where they are
    /// the same.
    pub psnr: f64,
    /// Mean FLIP error of the pictures at the exposure that they are shown at, in `[0, 1]`.
    pub flip: f64,
}

/// Compares a picture with its reference.
///
/// - `exposure`: factor on values for FLIP, which compares what is seen.
///
/// # Errors
/// When they differ in size, or a value is not finite.
pub fn compare(
    reference: &Image,
    actual: &Image,
    difference: Difference,
    exposure: f32,
) -> Result<Compared, MetricError> {
    let mse = metrics::mse(reference, actual)?;
    let (r, a) = (reference.to_rgb(), actual.to_rgb());
    let pairs = a.data().par_chunks_exact(3).zip(r.data().par_chunks_exact(3));
    let errors: Vec<[f32; 3]> =
        pairs.map(|(a, r)| std::array::from_fn(|c| difference.of(a[c], r[c]))).collect();
    let sum: f64 = errors.iter().flatten().map(|e| f64::from(*e)).sum();
    let levels = errors.iter().map(|e| luminance(*e).abs()).enumerate();
    let greatest = levels.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    let (width, at) = (a.width(), greatest.0 as u32);
    let pixels = errors.par_iter().map(|e| difference.colour(*e)).collect();
    Ok(Compared {
        picture: ColorImage::new([width as usize, a.height() as usize], pixels),
        mean: sum / (errors.len() * 3) as f64,
        greatest: (greatest.1, [at % width, at / width]),
        mse,
        rel_mse: metrics::rel_mse(reference, actual)?,
        psnr: metrics::psnr(reference, actual)?,
        flip: metrics::flip(reference, actual, exposure.max(1e-6).log2())?.mean,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_those_of_their_formulas() {
        let of = |difference: Difference| difference.of(0.5, 0.25);
        assert_eq!(of(Difference::Signed), 0.25);
        assert_eq!(Difference::Signed.of(0.25, 0.5), -0.25);
        assert_eq!(Difference::Absolute.of(0.25, 0.5), 0.25);
        assert_eq!(of(Difference::Squared), 0.0625);
        assert!((of(Difference::RelativeAbsolute) - 0.25 / 0.26).abs() < 1e-6);
        assert!((of(Difference::RelativeSquared) - 0.0625 / 0.0725).abs() < 1e-6);
    }

    #[test]
    fn one_pixel_that_differs_is_found() {
        let reference = Image::from_fn(24, 16, |_, _| [0.5; 3]);
        let mut actual = reference.clone();
        let at = (3 * 24 + 7) * 3;
        actual.data_mut()[at..at + 3].fill(0.6);
        let found = compare(&reference, &actual, Difference::Absolute, 1.0).expect("alike in size");
        assert_eq!(found.greatest.1, [7, 3]);
        assert!((found.greatest.0 - 0.1).abs() < 1e-6, "{}", found.greatest.0);
        assert!((found.mse - 0.01 / (24.0 * 16.0)).abs() < 1e-8 && found.flip > 0.0 && found.psnr > 20.0);
        assert_eq!(found.picture.pixels[3 * 24 + 7], heat(share(0.1)));
        assert_eq!(found.picture.pixels[0], heat(0.0));
        let same = compare(&reference, &reference, Difference::Signed, 1.0).expect("alike in size");
        assert_eq!((same.psnr, same.flip, same.mean), (f64::INFINITY, 0.0, 0.0));
        assert_eq!(same.picture.pixels[0], Color32::WHITE);
        let other = Image::from_fn(16, 16, |_, _| [0.5; 3]);
        assert!(compare(&reference, &other, Difference::Absolute, 1.0).is_err(), "another size");
    }

    #[test]
    fn brighter_is_red_and_darker_is_blue() {
        let brighter = Difference::Signed.colour([1.0; 3]);
        let darker = Difference::Signed.colour([-1.0; 3]);
        assert!(brighter.r() == 255 && brighter.b() == 0, "{brighter:?}");
        assert!(darker.b() == 255 && darker.r() == 0, "{darker:?}");
    }
}
