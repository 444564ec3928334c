//! The image of an environment: which pixels a direction reads, and sampling it by a table of its pixels.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod equirect {
    use crate::constants::*;
    use crate::image_texture::*;
    use crate::sky::*;
    use wgsl_rs::std::*;

    /// Four pixels that bilinear interpolation reads, and where between their centres.
    #[derive(Clone, Copy, Debug)]
    pub struct EquirectPlace {
        /// Left and right column.
        pub left: u32,
        /// See `left`.
        pub right: u32,
        /// Upper and lower row.
        pub top: u32,
        /// See `top`.
        pub bottom: u32,
        /// Share of the right column, in `[0, 1]`.
        pub across: f32,
        /// Share of the lower row.
        pub down: f32,
    }

    /// What is read at a place of an image: it wraps around horizontally and stops at the poles.
    ///
    /// - `uv`: see [`direction_to_equirect`]. `width`, `height`: of the image, pixels.
    pub fn equirect_place(uv: Vec2f, width: u32, height: u32) -> EquirectPlace {
        let x = uv.x * f32(width) - 0.5;
        let y = clamp(uv.y * f32(height) - 0.5, 0.0, f32(height - 1u32));
        let left = wrap_texel(i32(floor(x)), width, WRAP_REPEAT);
        let top = u32(y);
        EquirectPlace {
            left: left,
            right: select(left + 1u32, 0u32, left + 1u32 == width),
            top: top,
            bottom: min(top + 1u32, height - 1u32),
            across: x - floor(x),
            down: y - floor(y),
        }
    }

    /// The interpolated value of the pixels of a place.
    pub fn equirect_mix(
        p: EquirectPlace,
        top_left: Vec3f,
        top_right: Vec3f,
        bottom_left: Vec3f,
        bottom_right: Vec3f,
    ) -> Vec3f {
        let top = top_left * (1.0 - p.across) + top_right * p.across;
        let bottom = bottom_left * (1.0 - p.across) + bottom_right * p.across;
        top * (1.0 - p.down) + bottom * p.down
    }

    /// Column and row of the pixel at a place of an image.
    pub fn equirect_pixel(uv: Vec2f, width: u32, height: u32) -> Vec2u {
        vec2u(min(u32(uv.x * f32(width)), width - 1u32), min(u32(uv.y * f32(height)), height - 1u32))
    }

    /// Density over solid angle of a direction within a pixel that is chosen with a `probability`.
    ///
    /// - `pixels`: how many the image has. `polar`: v of the direction.
    pub fn equirect_pixel_pdf(probability: f32, pixels: u32, polar: f32) -> f32 {
        equirect_pdf(probability * f32(pixels), polar)
    }

    /// The place within a chosen pixel.
    ///
    /// - `pixel`: column and row. `within`: where in it, in `[0, 1)`.
    pub fn equirect_point(pixel: Vec2u, within: Vec2f, width: u32, height: u32) -> Vec2f {
        vec2f((f32(pixel.x) + within.x) / f32(width), (f32(pixel.y) + within.y) / f32(height))
    }

    /// A number in `[0, 1)` from what is left of one that has chosen a part of `size` among others.
    pub fn rest_of_choice(rest: f32, size: f32) -> f32 {
        clamp(rest / size, 0.0, ONE_MINUS_EPSILON)
    }
}

#[cfg(test)]
mod tests {
    use super::equirect::*;
    use wgsl_rs::std::*;

    #[test]
    fn places_wrap_around_and_stop_at_the_poles() {
        let p = equirect_place(vec2f(0.0, 0.0), 4, 2);
        assert_eq!((p.left, p.right, p.top, p.bottom, p.across, p.down), (3, 0, 0, 1, 0.5, 0.0));
        let p = equirect_place(vec2f(0.999, 1.0), 4, 2);
        assert_eq!((p.left, p.right, p.top, p.bottom, p.down), (3, 0, 1, 1, 0.0));
        let white = vec3f(1.0, 1.0, 1.0);
        let mixed = equirect_mix(equirect_place(vec2f(0.3, 0.6), 4, 2), white, white, white, white);
        assert!((mixed.x - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_point_within_a_pixel_is_in_that_pixel() {
        for (x, y) in [(0, 0), (3, 1), (6, 4)] {
            let uv = equirect_point(vec2u(x, y), vec2f(0.25, 0.75), 7, 5);
            let pixel = equirect_pixel(uv, 7, 5);
            assert_eq!((pixel.x, pixel.y), (x, y));
        }
    }
}
