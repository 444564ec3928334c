//! Small pictures of a moving camera, made as large as they are looked at: without steps between
//! their pixels.

use egui::{Color32, ColorImage};
use rayon::prelude::*;

/// Pictures are made at least so large, pixels, where the whole picture is: from there on the
/// window's bilinear filter leaves no steps to see.
const LEAST: [usize; 2] = [480, 270];

/// The picture at least as large as [`LEAST`], but no larger than `full`; as it is if it is that
/// large.
///
/// - `full`: width and height of the whole picture, pixels.
pub fn upscaled(image: ColorImage, full: [u32; 2]) -> ColorImage {
    let [width, height] = image.size;
    let wanted = (0..2).map(|axis| LEAST[axis] as f32 / image.size[axis].max(1) as f32);
    let possible = (0..2).map(|axis| full[axis] as f32 / image.size[axis].max(1) as f32);
    let factor = wanted.fold(1.0, f32::max).min(possible.fold(f32::INFINITY, f32::min));
    if width * height == 0 || factor <= 1.0 {
        return image;
    }
    let size = image.size.map(|side| (side as f32 * factor).round() as usize);
    let (columns, rows) = (taps(width, size[0]), taps(height, size[1]));
    // Along rows first.
    let mut wide = vec![[0.0f32; 3]; size[0] * height];
    let lines = wide.par_chunks_exact_mut(size[0]).zip(image.pixels.par_chunks_exact(width));
    lines.for_each(|(out, line)| {
        let value = |i: usize| [line[i].r(), line[i].g(), line[i].b()].map(f32::from);
        out.iter_mut().zip(&columns).for_each(|(out, tap)| *out = tap.sum(value));
    });
    let mut pixels = vec![Color32::BLACK; size[0] * size[1]];
    pixels.par_chunks_exact_mut(size[0]).zip(&rows).for_each(|(out, tap)| {
        for (x, out) in out.iter_mut().enumerate() {
            let [r, g, b] = tap.sum(|y| wide[y * size[0] + x]).map(|v| (v + 0.5).clamp(0.0, 255.0) as u8);
            *out = Color32::from_rgb(r, g, b);
        }
    });
    ColorImage::new(size, pixels)
}

/// What a pixel takes from four in a row.
struct Tap {
    places: [usize; 4],
    weights: [f32; 4],
}

impl Tap {
    fn sum(&self, value: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for (place, weight) in self.places.into_iter().zip(self.weights) {
            let value = value(place);
            (0..3).for_each(|c| sum[c] += weight * value[c]);
        }
        sum
    }
}

/// Of each pixel of a row of `to` what it takes from a row of `from`.
fn taps(from: usize, to: usize) -> Vec<Tap> {
    let tap = |i: usize| {
        let at = (i as f32 + 0.5) * from as f32 / to as f32 - 0.5;
        let (first, offset) = (at.floor() as isize - 1, at - at.floor());
        let places = std::array::from_fn(|k| (first + k as isize).clamp(0, from as isize - 1) as usize);
        Tap { places, weights: std::array::from_fn(|k| mitchell(offset + 1.0 - k as f32)) }
    };
    (0..to).map(tap).collect()
}

/// The cubic filter between blur and ringing, with B = C = 1/3.
///
/// Mitchell and Netravali, "Reconstruction Filters in Computer Graphics", SIGGRAPH 1988.
fn mitchell(x: f32) -> f32 {
    let x = x.abs();
    let (x2, x3) = (x * x, x * x * x);
    if x < 1.0 {
        (7.0 * x3 - 12.0 * x2 + 16.0 / 3.0) / 6.0
    } else if x < 2.0 {
        (-7.0 / 3.0 * x3 + 12.0 * x2 - 20.0 * x + 32.0 / 3.0) / 6.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_to_one() {
        for tap in taps(7, 40) {
            assert!((tap.weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn small_pictures_become_large_without_steps() {
        let ramp = |i: usize| Color32::from_gray(((i % 60) * 4) as u8);
        let small = ColorImage::new([60, 34], (0..60 * 34).map(ramp).collect());
        let large = upscaled(small.clone(), [1920, 1080]);
        assert_eq!(large.size, [480, 272]);
        let row = &large.pixels[480 * 100..480 * 101];
        let steps = row.windows(2).map(|pair| i32::from(pair[1].r()) - i32::from(pair[0].r()));
        assert!(steps.clone().all(|step| (0..=1).contains(&step)), "{:?}", steps.collect::<Vec<_>>());
        assert_eq!((row[0].r(), row[479].r()), (0, 236));
        let whole = upscaled(small.clone(), [120, 68]);
        assert_eq!(whole.size, [120, 68], "not larger than the whole picture");
        assert_eq!(upscaled(large.clone(), [1920, 1080]), large, "large enough");
    }
}
