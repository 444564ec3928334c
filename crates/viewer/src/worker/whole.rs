//! A part of a picture, put where it is in the whole: whoever looks at pictures sees them whole, also where only a crop of
//! them is rendered.

use alhazen::{Film, Image, Rect};
use egui::{Color32, ColorImage};

/// What is not rendered: as dark as what is around the picture.
const NOT_RENDERED: Color32 = Color32::from_gray(18);

/// Where a part of a picture is.
#[derive(Clone, Copy, Debug)]
pub struct Whole {
    part: Rect,
    size: [usize; 2],
}

impl Whole {
    /// The picture that a film is a part of; `None` where it is all of it.
    pub fn of(film: &Film) -> Option<Self> {
        let part = film.window();
        let size = [film.width(), film.height()];
        let is_all = part == Rect::full(size[0], size[1]);
        (!is_all).then_some(Self { part, size: size.map(|side| side as usize) })
    }

    /// Display values, dark where nothing is rendered.
    pub fn display(&self, part: &ColorImage) -> ColorImage {
        ColorImage::new(self.size, self.around(&part.pixels, 1, NOT_RENDERED))
    }

    /// Numbers, 0 where nothing is rendered.
    pub fn image(&self, part: &Image) -> Image {
        let channels = part.channels();
        let mut whole = Image::black(self.size[0] as u32, self.size[1] as u32, channels);
        whole.data_mut().copy_from_slice(&self.around(part.data(), channels, 0.0));
        whole
    }

    /// Counts of samples, 0 where nothing is rendered.
    pub fn counts(&self, part: &[u32]) -> Vec<u32> {
        self.around(part, 1, 0)
    }

    /// Values of the part, `each` of a pixel, in those of the whole.
    fn around<T: Copy>(&self, part: &[T], each: usize, outside: T) -> Vec<T> {
        let mut whole = vec![outside; self.size[0] * self.size[1] * each];
        let width = self.part.width as usize * each;
        let rows = part.chunks_exact(width.max(1)).zip(self.part.y as usize..);
        for (row, y) in rows {
            let first = (y * self.size[0] + self.part.x as usize) * each;
            whole[first..first + width].copy_from_slice(row);
        }
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_lie_where_they_are_in_the_whole() {
        let part = Rect { x: 1, y: 2, width: 2, height: 1 };
        let whole = Whole { part, size: [4, 3] };
        assert_eq!(whole.counts(&[5, 6]), [0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 6, 0]);
        let image = whole.image(&Image::from_fn(2, 1, |x, _| [1.0 + x as f32; 3]));
        assert_eq!((image.width(), image.height()), (4, 3));
        assert_eq!([image.rgb(1, 2), image.rgb(2, 2), image.rgb(3, 2)], [[1.0; 3], [2.0; 3], [0.0; 3]]);
        let shown = whole.display(&ColorImage::filled([2, 1], Color32::WHITE));
        assert_eq!((shown.size, shown.pixels[9], shown.pixels[8]), ([4, 3], Color32::WHITE, NOT_RENDERED));
    }
}
