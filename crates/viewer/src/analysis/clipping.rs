//! Zebra stripes over what is clipped: too bright to be told from white, or black.

use egui::{Color32, ColorImage};
use rayon::prelude::*;

/// Stripes over what is too bright.
const BRIGHT: Color32 = Color32::from_rgb(255, 60, 40);
/// Stripes over what is black.
const DARK: Color32 = Color32::from_rgb(40, 110, 255);
/// Width of a stripe, pixels.
const STRIPE: usize = 4;

/// What of a picture is clipped.
#[derive(Clone, Debug, PartialEq)]
pub struct Clipping {
    /// Stripes to lay over the picture: as large as it, and transparent elsewhere.
    pub stripes: ColorImage,
    /// The share of pixels with a channel at the greatest display value, in `[0, 1]`.
    pub bright: f32,
    /// The share of pixels whose channels are all at the least display value, in `[0, 1]`.
    pub dark: f32,
}

impl Clipping {
    /// Looks for display values at the ends of their range.
    pub fn of(shown: &ColorImage) -> Self {
        let width = shown.size[0].max(1);
        let of_pixel = |(i, p): (usize, &Color32)| {
            let colour = colour(*p)?;
            let is_striped = ((i % width + i / width) / STRIPE).is_multiple_of(2);
            Some((colour, is_striped))
        };
        let pixels: Vec<_> = shown.pixels.par_iter().enumerate().map(of_pixel).collect();
        let count = |of: Color32| pixels.iter().flatten().filter(|(colour, _)| *colour == of).count();
        let share = |n: usize| n as f32 / pixels.len().max(1) as f32;
        let (bright, dark) = (share(count(BRIGHT)), share(count(DARK)));
        let stripe = |pixel: Option<(Color32, bool)>| match pixel {
            Some((colour, true)) => colour,
            _ => Color32::TRANSPARENT,
        };
        let stripes = pixels.into_iter().map(stripe).collect();
        Self { stripes: ColorImage::new(shown.size, stripes), bright, dark }
    }
}

fn colour(pixel: Color32) -> Option<Color32> {
    let channels = [pixel.r(), pixel.g(), pixel.b()];
    if channels.contains(&u8::MAX) {
        return Some(BRIGHT);
    }
    (channels == [0; 3]).then_some(DARK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_brightest_and_the_darkest_have_stripes() {
        let column = |i: usize| match i % 32 {
            0..8 => Color32::from_rgb(10, 255, 10),
            8..16 => Color32::BLACK,
            _ => Color32::from_rgb(0, 1, 254),
        };
        let shown = ColorImage::new([32, 4], (0..32 * 4).map(column).collect());
        let clipping = Clipping::of(&shown);
        assert_eq!((clipping.bright, clipping.dark), (0.25, 0.25));
        let row = &clipping.stripes.pixels[..32];
        assert!(
            row[..4].iter().all(|p| *p == BRIGHT) && row[4..8].iter().all(|p| *p == Color32::TRANSPARENT)
        );
        assert!(row[8..12].iter().all(|p| *p == DARK));
        assert!(row[16..].iter().all(|p| *p == Color32::TRANSPARENT));
    }
}
