//! Where points lie in the window, now and in the frame before.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod reprojection {
    use wgsl_rs::std::*;

    /// Where a clip position lies in a window of `size` pixels: pixels to the right and down from its upper left corner.
    pub fn window_place(clip: Vec4f, size: Vec2f) -> Vec2f {
        vec2f(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * size
    }

    /// By how many pixels to the right and down a point has moved, by its clip positions; `otherwise` where it is or was not in
    /// front of the camera.
    pub fn window_motion(now: Vec4f, before: Vec4f, size: Vec2f, otherwise: Vec2f) -> Vec2f {
        if now.w <= 0.0 || before.w <= 0.0 {
            return otherwise;
        }
        window_place(now, size) - window_place(before, size)
    }

    /// What a depth buffer holds of a clip position.
    pub fn clip_depth(clip: Vec4f) -> f32 {
        clip.z / clip.w
    }

    /// The upper left of the four texels around a place, whose centres are whole numbers.
    pub fn upper_left_texel(place: Vec2f) -> Vec2f {
        floor(place)
    }

    /// The texel nearest to a place.
    pub fn nearest_texel(place: Vec2f) -> Vec2f {
        round(place)
    }
}

#[cfg(test)]
mod tests {
    use super::reprojection::*;
    use crate::{vec2f, vec4f};

    #[test]
    fn places_are_those_of_the_window() {
        let size = vec2f(200.0, 100.0);
        let middle = window_place(vec4f(0.0, 0.0, 0.5, 2.0), size);
        assert_eq!((middle.x, middle.y), (100.0, 50.0));
        let corner = window_place(vec4f(-2.0, 2.0, 0.5, 2.0), size);
        assert_eq!((corner.x, corner.y), (0.0, 0.0), "upper left");
        let none =
            window_motion(vec4f(0.0, 0.0, 0.0, 1.0), vec4f(0.0, 0.0, 0.0, -1.0), size, vec2f(7.0, 8.0));
        assert_eq!((none.x, none.y), (7.0, 8.0));
    }
}
