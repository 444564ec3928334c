//! The waveform of a picture: of each of its columns, how often each display value is in it.

use egui::{Color32, ColorImage};

/// Width and height of the waveform, pixels.
pub const SIZE: [usize; 2] = [256, 128];

/// The waveform of display values: black at the bottom, white at the top, red, green and blue added
/// up. A column of the waveform stands for neighbouring columns of the picture.
pub fn waveform(shown: &ColorImage) -> ColorImage {
    let [width, height] = SIZE;
    let columns = shown.size[0].max(1);
    let mut counts = vec![[0u32; 3]; width * height];
    for row in shown.pixels.chunks_exact(columns) {
        for (x, pixel) in row.iter().enumerate() {
            let column = x * width / columns;
            for (channel, value) in [pixel.r(), pixel.g(), pixel.b()].into_iter().enumerate() {
                let line = (height - 1) - usize::from(value) * (height - 1) / 255;
                counts[line * width + column][channel] += 1;
            }
        }
    }
    // A value that a thirtieth of a column has is as bright as can be; the rest by its square root,
    // so that a few pixels are seen.
    let of_column = shown.pixels.len() as f32 / width.min(columns) as f32;
    let level = |n: u32| ((n as f32 / of_column.max(1.0) * 30.0).min(1.0).sqrt() * 255.0) as u8;
    let pixels = counts.into_iter().map(|[r, g, b]| Color32::from_rgb(level(r), level(g), level(b)));
    ColorImage::new(SIZE, pixels.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_a_diagonal() {
        let ramp = |i: usize| Color32::from_rgb((i % 256) as u8, 0, 255);
        let shown = ColorImage::new([256, 4], (0..256 * 4).map(ramp).collect());
        let waveform = waveform(&shown);
        let at = |x: usize, y: usize| waveform.pixels[y * SIZE[0] + x];
        assert_eq!((at(0, 127).r(), at(255, 0).r(), at(0, 0).r(), at(128, 127).r()), (255, 255, 0, 0));
        assert!((0..256).all(|x| at(x, 127).g() == 255 && at(x, 0).b() == 255));
        assert_eq!((at(128, 64).r(), at(128, 60).r()), (255, 0));
    }

    #[test]
    fn narrow_pictures_have_one_too() {
        let waveform = waveform(&ColorImage::new([2, 1], vec![Color32::WHITE, Color32::BLACK]));
        let lit = waveform.pixels.iter().filter(|p| p.g() > 0).count();
        assert_eq!(lit, 2);
    }
}
