//! Shafts: all that shadow rays from a box to a light may pass, which is what a box passes that moves from there to the light.
//!
//! Sources: Haines and Wallace, "Shaft Culling for Efficient Ray-Cast Radiosity", EGWR 1991; Reshetov, Soupikov and Hurley,
//! "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod shaft {
    use crate::light::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// The share of a coordinate's size that rounding may move it by.
    pub const SHAFT_ROUNDING: f32 = 4e-6;

    /// A box that moves: all that it passes is the shaft. World space, metres.
    #[derive(Clone, Copy, Debug)]
    pub struct Shaft {
        /// Its lowest corner at the start.
        pub low: Vec3f,
        /// Its highest corner at the start.
        pub high: Vec3f,
        /// By how much its lowest corner moves until the end.
        pub low_step: Vec3f,
        /// By how much its highest corner moves until the end.
        pub high_step: Vec3f,
        /// Whether it is known at all.
        pub known: bool,
    }

    /// The boxes at both ends of a shaft, in any space.
    #[derive(Clone, Copy, Debug)]
    pub struct ShaftEnds {
        /// Lowest corner at the start.
        pub low: Vec3f,
        /// Highest corner at the start.
        pub high: Vec3f,
        /// Lowest corner at the end.
        pub end_low: Vec3f,
        /// Highest corner at the end.
        pub end_high: Vec3f,
        /// The largest magnitudes of coordinates from which they were made.
        pub size: Vec3f,
    }

    /// One coordinate of [`ShaftEnds`].
    #[derive(Clone, Copy, Debug)]
    pub struct ShaftRow {
        /// The lowest at the start.
        pub low: f32,
        /// The highest at the start.
        pub high: f32,
        /// The lowest at the end.
        pub end_low: f32,
        /// The highest at the end.
        pub end_high: f32,
        /// The largest magnitude from which they were made.
        pub size: f32,
    }

    /// A shaft as boxes are asked for it, with room for all rounding.
    #[derive(Clone, Copy, Debug)]
    pub struct ShaftRay {
        /// Lowest corner at the start.
        pub low: Vec3f,
        /// Highest corner at the start.
        pub high: Vec3f,
        /// One over how far the lowest corner moves.
        pub low_inverse: Vec3f,
        /// One over how far the highest corner moves.
        pub high_inverse: Vec3f,
    }

    /// Where on its way a shaft is in each of four boxes.
    #[derive(Clone, Copy, Debug)]
    pub struct ShaftInterval {
        /// From there on: 0 is the start, 1 the end.
        pub first: Vec4f,
        /// Until there. A box with less than `first` is not touched.
        pub last: Vec4f,
    }

    /// The shaft from a box to all places of a light that are sampled.
    ///
    /// - `low`, `high`: the box. `extent`: of the scene, whose coordinates are no larger.
    pub fn light_shaft(light: Light, low: Vec3f, high: Vec3f, extent: Vec3f) -> Shaft {
        let zero = vec3f(0.0, 0.0, 0.0);
        let size = vec3f(light.size, light.size, light.size);
        let mut end_low = light.position;
        let mut end_high = light.position;
        if light.kind == LIGHT_SPHERE {
            end_low = end_low - size;
            end_high = end_high + size;
        } else if light.kind == LIGHT_TRIANGLE {
            end_low = end_low + min(zero, min(light.edge1, light.edge2));
            end_high = end_high + max(zero, max(light.edge1, light.edge2));
        } else if light.kind == LIGHT_RECTANGLE {
            end_low = end_low + (min(zero, light.edge1) + min(zero, light.edge2));
            end_high = end_high + (max(zero, light.edge1) + max(zero, light.edge2));
        } else if light.kind == LIGHT_DIRECTIONAL {
            // Out of the scene.
            let away = 4.0 * (max_component(extent) + max_component(max(abs(low), abs(high))));
            // The sine of the disc's angular radius.
            let sine = sqrt(light.size * (2.0 - light.size));
            let spread = vec3f(sine, sine, sine);
            return Shaft {
                low: low,
                high: high,
                low_step: away * (light.position - spread),
                high_step: away * (light.position + spread),
                known: true,
            };
        } else if !light_is_point(light.kind) {
            return Shaft { low: low, high: high, low_step: zero, high_step: zero, known: false };
        }
        Shaft { low: low, high: high, low_step: end_low - low, high_step: end_high - high, known: true }
    }

    /// The ends of a shaft in world space.
    pub fn shaft_ends(s: Shaft) -> ShaftEnds {
        let end_low = s.low + s.low_step;
        let end_high = s.high + s.high_step;
        let size = max(max(abs(s.low), abs(s.high)), max(abs(end_low), abs(end_high)));
        ShaftEnds { low: s.low, high: s.high, end_low: end_low, end_high: end_high, size: size }
    }

    /// One coordinate of a shaft's ends in another space, by a row of the map to there; `size`: of [`ShaftEnds`] in world space.
    pub fn shaft_row(row: Vec4f, s: Shaft, size: Vec3f) -> ShaftRow {
        let r = vec3f(row.x, row.y, row.z);
        let reach = abs(r);
        let begin = dot(r, 0.5 * (s.low + s.high)) + row.w;
        let begin_half = dot(reach, 0.5 * (s.high - s.low));
        let end = dot(r, 0.5 * (s.low + s.low_step + s.high + s.high_step)) + row.w;
        let end_half = dot(reach, 0.5 * (s.high + s.high_step - s.low - s.low_step));
        ShaftRow {
            low: begin - begin_half,
            high: begin + begin_half,
            end_low: end - end_half,
            end_high: end + end_half,
            size: dot(reach, size) + abs(row.w),
        }
    }

    /// The ends of a shaft in another space, by the rows of the map to there.
    pub fn shaft_ends_in(s: Shaft, row_x: Vec4f, row_y: Vec4f, row_z: Vec4f) -> ShaftEnds {
        let size = shaft_ends(s).size;
        let x = shaft_row(row_x, s, size);
        let y = shaft_row(row_y, s, size);
        let z = shaft_row(row_z, s, size);
        ShaftEnds {
            low: vec3f(x.low, y.low, z.low),
            high: vec3f(x.high, y.high, z.high),
            end_low: vec3f(x.end_low, y.end_low, z.end_low),
            end_high: vec3f(x.end_high, y.end_high, z.end_high),
            size: vec3f(x.size, y.size, z.size),
        }
    }

    /// Prepares a shaft for boxes of a space whose coordinates are no larger than `extent`.
    pub fn shaft_ray(e: ShaftEnds, extent: Vec3f) -> ShaftRay {
        let room = SHAFT_ROUNDING * (e.size + extent);
        ShaftRay {
            low: e.low - room,
            high: e.high + room,
            low_inverse: 1.0 / never_zero3(e.end_low - e.low),
            high_inverse: 1.0 / never_zero3(e.end_high - e.high),
        }
    }

    /// Never zero, so that its reciprocal is finite.
    pub fn never_zero(x: f32) -> f32 {
        select(x, select(-1e-20, 1e-20, x >= 0.0), abs(x) < 1e-20)
    }

    /// [`never_zero`] of each component.
    pub fn never_zero3(v: Vec3f) -> Vec3f {
        vec3f(never_zero(v.x), never_zero(v.y), never_zero(v.z))
    }

    /// Where on its way a side of the shaft crosses planes of a grid: x times a plane's number, and y.
    ///
    /// - `scale`, `corner`: of the grid. `side`: of the shaft at the start. `inverse`: one over how far it moves.
    pub fn shaft_crossing(scale: f32, corner: f32, side: f32, inverse: f32) -> Vec2f {
        vec2f(scale * inverse, (corner - side) * inverse)
    }

    /// What is left of a shaft's interval within boxes along one axis: its upper side has to be over their lower faces, and its
    /// lower side under their upper ones.
    ///
    /// - `over`, `under`: where these sides cross those faces. `low_inverse`, `high_inverse`: of the axis.
    pub fn shaft_within(
        interval: ShaftInterval,
        over: Vec4f,
        under: Vec4f,
        low_inverse: f32,
        high_inverse: f32,
    ) -> ShaftInterval {
        let mut first = interval.first;
        let mut last = interval.last;
        if high_inverse > 0.0 {
            first = max(first, over);
        } else {
            last = min(last, over);
        }
        if low_inverse > 0.0 {
            last = min(last, under);
        } else {
            first = max(first, under);
        }
        ShaftInterval { first: first, last: last }
    }
}

#[cfg(test)]
mod tests {
    use super::shaft::*;
    use crate::{Vec3f, vec3f, vec4f};

    fn shaft() -> Shaft {
        let (low, high) = (vec3f(-1.0, -1.0, 0.0), vec3f(1.0, 1.0, 0.1));
        Shaft { low, high, low_step: vec3f(1.0, 1.0, 10.0), high_step: vec3f(-1.0, -1.0, 10.0), known: true }
    }

    /// The identity is no other space, but for rounding; a smaller space has smaller coordinates.
    #[test]
    fn shafts_are_the_same_in_every_space() {
        let rows = |s: f32| [vec4f(s, 0.0, 0.0, 0.0), vec4f(0.0, s, 0.0, 0.0), vec4f(0.0, 0.0, s, 0.0)];
        let (world, size) = (shaft_ends(shaft()), vec3f(1.0, 1.0, 10.1));
        for scale in [1.0, 0.01] {
            let [x, y, z] = rows(scale);
            let e = shaft_ends_in(shaft(), x, y, z);
            let pairs =
                [(e.low, world.low), (e.high, world.high), (e.end_low, world.end_low), (e.size, size)];
            for (a, b) in pairs {
                let off = |a: f32, b: f32| (a - scale * b).abs() < 1e-5 * scale;
                assert!(off(a.x, b.x) && off(a.y, b.y) && off(a.z, b.z), "{a:?} {b:?}");
            }
        }
    }

    /// Along z, boxes beside the way and behind it are not touched.
    #[test]
    fn boxes_beside_are_not_touched() {
        let ray = shaft_ray(shaft_ends(shaft()), vec3f(1.0, 1.0, 1.0));
        let touches = |low: Vec3f, high: Vec3f| {
            let mut interval =
                ShaftInterval { first: vec4f(0.0, 0.0, 0.0, 0.0), last: vec4f(1.0, 1.0, 1.0, 1.0) };
            for axis in 0..3 {
                let of = |v: Vec3f| v.to_array()[axis];
                let crossing = |face: f32, side: f32, inverse: f32| {
                    let t = shaft_crossing(1.0, face, side, inverse).y;
                    vec4f(t, t, t, t)
                };
                let over = crossing(of(low), of(ray.high), of(ray.high_inverse));
                let under = crossing(of(high), of(ray.low), of(ray.low_inverse));
                interval = shaft_within(interval, over, under, of(ray.low_inverse), of(ray.high_inverse));
            }
            interval.first.x <= interval.last.x
        };
        assert!(touches(vec3f(-0.1, -0.1, 5.0), vec3f(0.1, 0.1, 6.0)));
        assert!(touches(vec3f(-0.1, -0.1, 10.0), vec3f(0.1, 0.1, 60.0)));
        assert!(!touches(vec3f(0.9, 0.9, 8.0), vec3f(1.1, 1.1, 9.0)), "beside");
        assert!(!touches(vec3f(-0.1, -0.1, 11.0), vec3f(0.1, 0.1, 12.0)), "behind");
    }
}
