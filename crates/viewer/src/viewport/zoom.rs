//! Where the picture lies in the window, and which of its pixels is where.

use egui::{Pos2, Rect, Vec2, pos2, vec2};

/// The greatest factor: a pixel of a picture of 4K is larger than its value then.
const MOST: f32 = 256.0;

/// How the picture lies in its part of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zoom {
    /// Points a pixel of the picture takes, over what it takes when the picture fills the room; 1 fits.
    pub factor: f32,
    /// The point of the picture that is in the middle, in shares of its size.
    pub center: Vec2,
}

impl Default for Zoom {
    fn default() -> Self {
        Self { factor: 1.0, center: vec2(0.5, 0.5) }
    }
}

impl Zoom {
    /// Where a picture of this aspect (width over height) lies.
    pub fn place(&self, room: Rect, aspect: f32) -> Rect {
        let fit =
            vec2((room.height() * aspect).min(room.width()), (room.width() / aspect).min(room.height()));
        let size = fit * self.factor;
        Rect::from_min_size(room.center() - size * self.center, size)
    }

    /// Zooms by `by`, so that what is at `fixed` (window) stays there.
    pub fn by(&mut self, by: f32, fixed: Pos2, room: Rect, aspect: f32) {
        let before = self.place(room, aspect);
        let at = (fixed - before.min) / before.size();
        let factor = (self.factor * by).clamp(1.0, MOST);
        if factor <= 1.0 {
            *self = Self::default();
            return;
        }
        self.factor = factor;
        let size = self.place(room, aspect).size();
        self.center = at + (room.center() - fixed) / size;
        self.center = self.center.clamp(Vec2::ZERO, vec2(1.0, 1.0));
    }
}

/// The pixel of a picture of `width` × `height` pixels at a point of the window.
pub fn pixel_at(place: Rect, point: Pos2, width: u32, height: u32) -> Option<(u32, u32)> {
    let at = (point - place.min) / place.size();
    let inside = (0.0..1.0).contains(&at.x) && (0.0..1.0).contains(&at.y);
    inside.then_some(((at.x * width as f32) as u32, (at.y * height as f32) as u32))
}

/// Columns and rows of a picture of `width` × `height` pixels that are seen in a part of the window.
pub fn pixels_in(place: Rect, seen: Rect, width: u32, height: u32) -> Option<[std::ops::Range<u32>; 2]> {
    if !seen.is_positive() {
        return None;
    }
    let (low, high) = ((seen.min - place.min) / place.size(), (seen.max - place.min) / place.size());
    let range = |low: f32, high: f32, n: u32| {
        // Rounding makes no pixel of a border.
        let [first, end] = [(low * n as f32 + 1e-3).floor(), (high * n as f32 - 1e-3).ceil()];
        (first.max(0.0) as u32).min(n)..(end.max(0.0) as u32).min(n)
    };
    Some([range(low.x, high.x, width), range(low.y, high.y, height)])
}

/// The part of a texture that lies left of the share `split` of its width, and where it goes.
pub fn left_of(place: Rect, split: f32) -> (Rect, Rect) {
    let x = place.left() + place.width() * split;
    let on_screen = Rect::from_min_max(place.min, pos2(x, place.bottom()));
    (on_screen, Rect::from_min_max(Pos2::ZERO, pos2(split, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: Rect = Rect { min: pos2(100.0, 50.0), max: pos2(500.0, 250.0) };

    #[test]
    fn pictures_fit_and_are_centred() {
        let place = Zoom::default().place(ROOM, 1.0);
        assert_eq!((place.size(), place.center()), (vec2(200.0, 200.0), ROOM.center()));
        assert_eq!(Zoom::default().place(ROOM, 4.0).size(), vec2(400.0, 100.0));
    }

    #[test]
    fn zooming_keeps_what_is_under_the_pointer() {
        let mut zoom = Zoom::default();
        let pointer = pos2(260.0, 120.0);
        let before = pixel_at(zoom.place(ROOM, 1.0), pointer, 1000, 1000);
        zoom.by(3.0, pointer, ROOM, 1.0);
        assert_eq!(pixel_at(zoom.place(ROOM, 1.0), pointer, 1000, 1000), before);
        assert_eq!(zoom.place(ROOM, 1.0).width(), 600.0);
        zoom.by(0.01, pointer, ROOM, 1.0);
        assert_eq!(zoom, Zoom::default());
    }

    #[test]
    fn the_pixels_that_are_seen_are_those_between_the_corners() {
        let place = Rect::from_min_size(pos2(0.0, 0.0), vec2(1000.0, 500.0));
        let seen = Rect::from_min_max(pos2(105.0, 100.0), pos2(300.0, 149.0));
        assert_eq!(pixels_in(place, seen, 100, 50), Some([10..30, 10..15]));
        assert_eq!(pixels_in(place, place.expand(50.0), 100, 50), Some([0..100, 0..50]));
        assert_eq!(pixels_in(place, Rect::NOTHING, 100, 50), None);
    }

    #[test]
    fn points_beside_the_picture_have_no_pixel() {
        let place = Zoom::default().place(ROOM, 1.0);
        assert_eq!(pixel_at(place, pos2(201.0, 51.0), 100, 100), Some((0, 0)));
        assert_eq!(pixel_at(place, pos2(399.0, 249.0), 100, 100), Some((99, 99)));
        assert_eq!(pixel_at(place, pos2(120.0, 100.0), 100, 100), None);
    }
}
