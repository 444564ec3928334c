//! Antialiasing by the pictures before, each of which looked through another place of the pixels.
//!
//! Source: Karis, "High Quality Temporal Supersampling", SIGGRAPH course 2014.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod antialiasing {
    use crate::history::*;
    use crate::signal::*;
    use wgsl_rs::std::*;

    /// Frames that a pixel's picture is the mean of while anything moves.
    pub const MOST_SHOWN_FRAMES: f32 = 8.0;
    /// Standard deviations of the pixels around by which the picture before may differ.
    pub const SHOWN_DEVIATIONS: f32 = 1.25;
    /// Pixels around, the one in the middle included.
    pub const SHOWN_NEIGHBOURS: f32 = 9.0;

    /// Adds a texel of the picture before to a sum of compressed colours; w: least number of frames that count.
    ///
    /// - `before`: radiance; w: frames that it is the mean of. `weight`: its share.
    pub fn shown_add(sum: Vec4f, before: Vec4f, weight: f32) -> Vec4f {
        let c = compress(vec3f(before.x, before.y, before.z)) * weight;
        vec4f(sum.x + c.x, sum.y + c.y, sum.z + c.z, select(sum.w, min(sum.w, before.w), weight > 0.0))
    }

    /// Colours around a pixel, by [`compress`] and [`ycocg_encode`]: their mean and the mean of their squares.
    #[derive(Clone, Copy, Debug)]
    pub struct ShownColors {
        /// The mean of those that were added, as of all.
        pub mean: Vec3f,
        /// That of their squares.
        pub squares: Vec3f,
    }

    /// Adds the radiance of one of the nine pixels.
    pub fn shown_colors_add(sum: ShownColors, radiance: Vec3f) -> ShownColors {
        let c = ycocg_encode(compress(radiance));
        ShownColors { mean: sum.mean + c / SHOWN_NEIGHBOURS, squares: sum.squares + c * c / SHOWN_NEIGHBOURS }
    }

    /// The picture before, compressed, moved to within what the pixels around show.
    pub fn clip_to_shown(past: Vec3f, around: ShownColors) -> Vec3f {
        let reach = box_of_deviations(around.mean, around.squares, SHOWN_DEVIATIONS);
        max(ycocg_decode(clip_to_box(ycocg_encode(past), around.mean, reach)), vec3f(0.0, 0.0, 0.0))
    }

    /// The frame's radiance with those before, while anything moves: mixed as colours are shown; w: frames.
    ///
    /// - `past`: compressed and clipped, the mean of `frames`.
    pub fn shown_in_motion(radiance: Vec3f, past: Vec3f, frames: f32) -> Vec4f {
        let weight = history_weight(frames, 1.0, MOST_SHOWN_FRAMES);
        let c = expand(mix(past, compress(radiance), vec3f(weight, weight, weight)));
        vec4f(c.x, c.y, c.z, min(frames, MOST_SHOWN_FRAMES) + 1.0)
    }

    /// The same while nothing moves: the mean of all frames. `past`: radiance; w: frames.
    pub fn shown_at_rest(radiance: Vec3f, past: Vec4f) -> Vec4f {
        let weight = history_weight(past.w, 1.0, 1e9);
        let c = mix(vec3f(past.x, past.y, past.z), radiance, vec3f(weight, weight, weight));
        vec4f(c.x, c.y, c.z, past.w + 1.0)
    }

    /// What makes this frame the mean of a film: what the film has of the frame before is taken back.
    ///
    /// - `frames`: on the film, this one included, from 1 on.
    pub fn film_replacement(now: Vec3f, before: Vec3f, frames: f32) -> Vec3f {
        now * frames - before * (frames - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::antialiasing::*;
    use crate::{vec3f, vec4f};

    #[test]
    fn frames_at_rest_are_averaged() {
        let mut shown = vec4f(2.0, 2.0, 2.0, 1.0);
        for y in [4.0, 6.0] {
            shown = shown_at_rest(vec3f(y, y, y), shown);
        }
        assert!((shown.x - 4.0).abs() < 1e-5 && shown.w == 3.0);
        assert_eq!(shown_in_motion(vec3f(1.0, 1.0, 1.0), vec3f(0.5, 0.5, 0.5), 100.0).w, 9.0);
    }

    #[test]
    fn films_show_the_last_frame() {
        let (mut sum, mut before) = (0.0, 0.0);
        for (i, y) in [3.0f32, 5.0, 4.0].into_iter().enumerate() {
            let frames = i as f32 + 1.0;
            sum += film_replacement(vec3f(y, y, y), vec3f(before, before, before), frames).x;
            assert!((sum / frames - y).abs() < 1e-5);
            before = y;
        }
    }
}
