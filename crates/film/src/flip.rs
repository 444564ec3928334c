//! LDR-FLIP: the difference that a viewer notices when flipping between two images.
//!
//! Method: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images", HPG 2020. Filters are separated as in the authors' later reference implementation
//! (`separatedConvolutions.pdf` of <https://github.com/NVlabs/flip>), whose numbers this reproduces.

use crate::srgb::srgb_to_linear;
use elementary::{cbrt, exp, hypot, pow};
use rayon::prelude::*;

/// What a viewer sees 0.7 m away from a 0.7 m wide display of 3840 pixels: the authors' default.
const PIXELS_PER_DEGREE: f32 = 67.0;

/// Exponent of the colour difference.
const COLOR_EXPONENT: f32 = 0.7;
/// Share of the largest colour difference that is mapped to [`COLOR_KNEE_ERROR`].
const COLOR_KNEE: f32 = 0.4;
/// Error at the knee.
const COLOR_KNEE_ERROR: f32 = 0.95;
/// Width of the edge and point detectors in degrees.
const FEATURE_WIDTH: f32 = 0.082;

/// Contrast sensitivity of the eye as Gaussians in frequency: weight and scale of the achromatic, the red-green and
/// (two terms) the blue-yellow channel.
const SENSITIVITY: [(f32, f32); 4] = [(1.0, 0.0047), (1.0, 0.0053), (34.1, 0.04), (13.5, 0.025)];

/// White point D65.
const WHITE: [f32; 3] = [0.950_428_54, 1.0, 1.088_900_4];

/// The error of each pixel, in `[0, 1]`.
///
/// `reference` and `actual` hold sRGB codes, `width` a row, as many in both, at least one row.
pub fn error_map(width: usize, reference: &[[u8; 3]], actual: &[[u8; 3]]) -> Vec<f32> {
    let decode: Vec<f32> = (0..=255_u8).map(|code| srgb_to_linear(f32::from(code) / 255.0)).collect();
    let opponent = |codes: &[[u8; 3]]| -> Vec<[f32; 3]> {
        codes.par_iter().map(|c| xyz_to_opponent(linear_to_xyz(c.map(|v| decode[usize::from(v)])))).collect()
    };
    let images = [opponent(reference), opponent(actual)];
    let [seen_reference, seen_actual] = images.each_ref().map(|image| perceived(width, image));
    let [features_reference, features_actual] = images.each_ref().map(|image| features(width, image));
    let scale = ColorScale::new();
    let pairs = seen_reference.par_iter().zip(&seen_actual);
    pairs
        .zip(features_reference.par_iter().zip(&features_actual))
        .map(|((r, a), (feature_r, feature_a))| {
            let edge = (feature_r[0] - feature_a[0]).abs();
            let point = (feature_r[1] - feature_a[1]).abs();
            let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
            pow(scale.error(r, a), 1.0 - feature)
        })
        .collect()
}

/// What remains of an image in YCxCz after the eye's contrast sensitivity: Hunt-adjusted CIELAB.
fn perceived(width: usize, image: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let taps = sensitivity_taps();
    let spread = |[y, cx, cz]: [f32; 3]| [y, cx, cz, cz];
    let weigh = |sum: &mut [f32; 4], tap: &[f32; 4], value: [f32; 4]| {
        (0..4).for_each(|i| sum[i] += tap[i] * value[i]);
    };
    let across = along_rows(width, image, &taps, |sum, tap, value| weigh(sum, tap, spread(value)));
    let filtered = along_columns(width, &across, &taps, weigh);
    filtered
        .into_par_iter()
        .map(|[y, cx, cz_1, cz_2]| {
            let rgb = xyz_to_linear(opponent_to_xyz([y, cx, cz_1 + cz_2])).map(|v| v.clamp(0.0, 1.0));
            hunt(xyz_to_lab(linear_to_xyz(rgb)))
        })
        .collect()
}

/// How strongly each pixel of an image in YCxCz looks like an edge and like a point.
fn features(width: usize, image: &[[f32; 3]]) -> Vec<[f32; 2]> {
    let taps = feature_taps();
    let across: Vec<[f32; 3]> = along_rows(width, image, &taps, |sum: &mut [f32; 3], tap, value| {
        let luminance = (value[0] + 16.0) / 116.0;
        (0..3).for_each(|i| sum[i] += tap[i] * luminance);
    });
    let derivatives: Vec<[f32; 4]> =
        along_columns(width, &across, &taps, |sum: &mut [f32; 4], tap, value| {
            sum[0] += tap[0] * value[1];
            sum[1] += tap[0] * value[2];
            sum[2] += tap[1] * value[0];
            sum[3] += tap[2] * value[0];
        });
    derivatives.into_par_iter().map(|[dx, ddx, dy, ddy]| [hypot(dx, dy), hypot(ddx, ddy)]).collect()
}

/// Weighs the neighbours in the same row of every pixel; the picture's last column goes on beyond its border.
fn along_rows<I: Copy + Sync, T: Sync, O: Copy + Default + Send>(
    width: usize,
    image: &[I],
    taps: &[T],
    add: impl Fn(&mut O, &T, I) + Sync,
) -> Vec<O> {
    let radius = taps.len() / 2;
    let mut out = vec![O::default(); image.len()];
    out.par_chunks_exact_mut(width).zip(image.par_chunks_exact(width)).for_each(|(out, row)| {
        for (x, sum) in out.iter_mut().enumerate() {
            for (i, tap) in taps.iter().enumerate() {
                let column = (x + i).saturating_sub(radius).min(width - 1);
                add(sum, tap, row[column]);
            }
        }
    });
    out
}

/// As [`along_rows`], over neighbours in the same column.
fn along_columns<I: Copy + Sync, T: Sync, O: Copy + Default + Send>(
    width: usize,
    image: &[I],
    taps: &[T],
    add: impl Fn(&mut O, &T, I) + Sync,
) -> Vec<O> {
    let (radius, height) = (taps.len() / 2, image.len() / width);
    let mut out = vec![O::default(); image.len()];
    out.par_chunks_exact_mut(width).enumerate().for_each(|(y, out)| {
        for (i, tap) in taps.iter().enumerate() {
            let row = (y + i).saturating_sub(radius).min(height - 1);
            let row = &image[row * width..(row + 1) * width];
            out.iter_mut().zip(row).for_each(|(sum, &value)| add(sum, tap, value));
        }
    });
    out
}

/// One dimension of the sensitivity filters. The blue-yellow filter is a sum of two Gaussians and separates only term
/// by term, hence the square root of its weights.
fn sensitivity_taps() -> Vec<[f32; 4]> {
    use std::f32::consts::PI;
    let widest = SENSITIVITY.iter().fold(0.0_f32, |m, &(_, b)| m.max(b));
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let mut taps: Vec<[f32; 4]> = (-radius..=radius)
        .map(|x| {
            let degrees = x as f32 / PIXELS_PER_DEGREE;
            let gaussian = |b: f32| exp(-PI * PI * degrees * degrees / b);
            let plain = |(a, b): (f32, f32)| a * (PI / b).sqrt() * gaussian(b);
            let root = |(a, b): (f32, f32)| (a * (PI / b).sqrt()).sqrt() * gaussian(b);
            let [y, cx, cz_1, cz_2] = SENSITIVITY;
            [plain(y), plain(cx), root(cz_1), root(cz_2)]
        })
        .collect();
    let sums: [f32; 4] = std::array::from_fn(|i| taps.iter().map(|t| t[i]).sum());
    let both = hypot(sums[2], sums[3]);
    let norms = [sums[0], sums[1], both, both];
    taps.iter_mut().for_each(|tap| (0..4).for_each(|i| tap[i] /= norms[i]));
    taps
}

/// One dimension of the detectors: a Gaussian and its first and second derivatives. The Gaussian sums to one; the
/// positive weights of each derivative sum to one and the negative to minus one.
fn feature_taps() -> Vec<[f32; 3]> {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let mut taps: Vec<[f32; 3]> = (-radius..=radius)
        .map(|x| {
            let t = x as f32 / deviation;
            let g = exp(-0.5 * t * t);
            [g, -(x as f32) * g, (t * t - 1.0) * g]
        })
        .collect();
    let sum = |i: usize, sign: f32| taps.iter().map(|t| (t[i] * sign).max(0.0)).sum::<f32>();
    let (rises, falls) = ([sum(0, 1.0), sum(1, 1.0), sum(2, 1.0)], [1.0, sum(1, -1.0), sum(2, -1.0)]);
    for tap in &mut taps {
        (0..3).for_each(|i| tap[i] /= if tap[i] > 0.0 { rises[i] } else { falls[i] });
    }
    taps
}

/// Maps distances between colours to errors.
struct ColorScale {
    /// Largest distance, between green and blue, with the exponent applied.
    largest: f32,
}

impl ColorScale {
    fn new() -> Self {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|c| hunt(xyz_to_lab(linear_to_xyz(c))));
        Self { largest: pow(hyab(&green, &blue), COLOR_EXPONENT) }
    }

    /// Error of a colour in Hunt-adjusted CIELAB, in `[0, 1]`.
    fn error(&self, reference: &[f32; 3], actual: &[f32; 3]) -> f32 {
        let distance = pow(hyab(reference, actual), COLOR_EXPONENT);
        let knee = COLOR_KNEE * self.largest;
        if distance < knee {
            distance * (COLOR_KNEE_ERROR / knee)
        } else {
            COLOR_KNEE_ERROR + (distance - knee) / (self.largest - knee) * (1.0 - COLOR_KNEE_ERROR)
        }
    }
}

/// Distance of large colour differences: city block in lightness, Euclidean in the chromatic plane.
fn hyab(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + hypot(a[1] - b[1], a[2] - b[2])
}

/// Colours look less colourful where it is dark.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

fn linear_to_xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        (10_135_552.0 / 24_577_794.0) * r
            + (8_788_810.0 / 24_577_794.0) * g
            + (4_435_075.0 / 24_577_794.0) * b,
        (2_613_072.0 / 12_288_897.0) * r + (8_788_810.0 / 12_288_897.0) * g + (887_015.0 / 12_288_897.0) * b,
        (1_425_312.0 / 73_733_382.0) * r
            + (8_788_810.0 / 73_733_382.0) * g
            + (70_074_185.0 / 73_733_382.0) * b,
    ]
}

fn xyz_to_linear([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.241_003_3 * x - 1.537_399 * y - 0.498_615_86 * z,
        -0.969_224_33 * x + 1.875_930_1 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_2 * y + 1.057_149 * z,
    ]
}

/// YCxCz: linear, one achromatic and two opponent channels, scaled as CIELAB.
fn xyz_to_opponent(xyz: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = relative_to_white(xyz);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn opponent_to_xyz([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let relative = [y + cx / 500.0, y, y - cz / 200.0];
    std::array::from_fn(|i| relative[i] * WHITE[i])
}

fn xyz_to_lab(xyz: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let compress = |v: f32| {
        if v > DELTA * DELTA * DELTA { cbrt(v) } else { v / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = relative_to_white(xyz).map(compress);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn relative_to_white(xyz: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| xyz[i] / WHITE[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gradient, and the same with coloured stripes and an inverted spot in the middle.
    fn pictures(width: u32, height: u32) -> [Vec<[u8; 3]>; 2] {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let base = |x: u32, y: u32| [x * 7 % 256, y * 11 % 256, (x + y) * 5 % 256];
        let reference = pixels.clone().map(|(x, y)| base(x, y).map(|v| v as u8)).collect();
        let (column, row) = (width / 2, height / 2);
        let changed = |(x, y): (u32, u32)| {
            let stripe = if (x / 3) % 2 == 0 { 40 } else { 0 };
            let spot = (column..column + 3).contains(&x) && (row..row + 3).contains(&y);
            let base = base(x, y);
            std::array::from_fn(|c| {
                let striped = (base[c] + stripe * (c as u32 + 1) / 2).min(255);
                (if spot { 255 - base[c] } else { striped }) as u8
            })
        };
        [reference, pixels.map(changed).collect()]
    }

    /// What `nv_flip::flip(reference, actual, 67.0)` of the crate nv-flip 0.1.2, which wraps NVIDIA's C++, returns for
    /// [`pictures`]: mean, maximum, and the errors in the first pixel, the middle, the last, and (w/4, h-2).
    #[test]
    fn errors_are_those_of_the_reference_implementation() {
        let known = [
            ((32, 24), [0.409603, 0.649841, 0.494519, 0.264697, 0.355380, 0.472149]),
            ((7, 5), [0.827645, 0.980383, 0.582462, 0.974497, 0.901651, 0.769484]),
            ((64, 64), [0.384084, 0.654605, 0.494519, 0.588718, 0.298810, 0.262078]),
        ];
        for ((width, height), expected) in known {
            let [reference, actual] = pictures(width, height);
            let errors = error_map(width as usize, &reference, &actual);
            let at = |x: u32, y: u32| errors[(y * width + x) as usize];
            let mean = errors.iter().sum::<f32>() / errors.len() as f32;
            let max = errors.iter().copied().fold(0.0, f32::max);
            let found = [
                mean,
                max,
                at(0, 0),
                at(width / 2, height / 2),
                at(width - 1, height - 1),
                at(width / 4, height - 2),
            ];
            let close = found.iter().zip(&expected).all(|(f, e)| (f - e).abs() < 2e-5);
            assert!(close, "{width}×{height}: {found:?}, expected {expected:?}");
            assert_eq!(errors, error_map(width as usize, &actual, &reference), "FLIP is symmetric");
        }
    }

    #[test]
    fn filters_are_normalised() {
        let sum = |i: usize| sensitivity_taps().iter().map(|t| t[i]).sum::<f32>();
        assert!((sum(0) - 1.0).abs() < 1e-5 && (sum(1) - 1.0).abs() < 1e-5);
        assert!((sum(2).powi(2) + sum(3).powi(2) - 1.0).abs() < 1e-5);
        let taps = feature_taps();
        assert!((taps.iter().map(|t| t[0]).sum::<f32>() - 1.0).abs() < 1e-5);
        assert!(taps.iter().map(|t| t[1]).sum::<f32>().abs() < 1e-5);
        assert!(taps.iter().map(|t| t[2]).sum::<f32>().abs() < 1e-5);
    }
}
