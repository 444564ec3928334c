//! The signals that are filtered: light apart from the surface's colour, diffuse and specular apart.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod signal {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// The least reflectance that light is divided by: what is darker hides its own noise.
    pub const LEAST_REFLECTANCE: f32 = 0.02;

    /// Share of the light scattered at a vertex that comes from its diffuse lobe, by channel, in `[0, 1]`.
    ///
    /// - `whole`: value times cosine of all lobes. `others`: the same of all but the diffuse one.
    pub fn diffuse_share(whole: Vec3f, others: Vec3f) -> Vec3f {
        let share = vec3f(1.0, 1.0, 1.0) - others / max(whole, vec3f(1e-30, 1e-30, 1e-30));
        let inside = clamp(share, vec3f(0.0, 0.0, 0.0), vec3f(1.0, 1.0, 1.0));
        select(vec3f(0.0, 0.0, 0.0), inside, max_component(whole) > 0.0)
    }

    /// What light is divided by before it is filtered: a reflectance, kept away from zero.
    pub fn divisor(reflectance: Vec3f) -> Vec3f {
        max(reflectance, vec3f(LEAST_REFLECTANCE, LEAST_REFLECTANCE, LEAST_REFLECTANCE))
    }

    /// Reflected radiance without the surface's colour; [`remodulate`] is the inverse.
    pub fn demodulate(radiance: Vec3f, reflectance: Vec3f) -> Vec3f {
        radiance / divisor(reflectance)
    }

    /// Reflected radiance from what [`demodulate`] has made of it.
    pub fn remodulate(light: Vec3f, reflectance: Vec3f) -> Vec3f {
        light * divisor(reflectance)
    }

    /// Squares of luminances, as of light that was demodulated: means, diffuse and specular.
    ///
    /// - `sums`: of squares of the luminances of radiance, over `count` samples. `diffuse`, `specular`: reflectances.
    pub fn demodulated_squares(sums: Vec2f, count: f32, diffuse: Vec3f, specular: Vec3f) -> Vec2f {
        let luminances = vec2f(luminance(divisor(diffuse)), luminance(divisor(specular)));
        sums / max(count, 1.0) / (luminances * luminances)
    }

    /// The mean of `count` samples; of none, the sum.
    pub fn found_mean(sum: Vec3f, count: u32) -> Vec3f {
        sum * (1.0 / max(f32(count), 1.0))
    }

    /// Light of one sample, from the diffuse and from the other lobes of the first surface.
    #[derive(Clone, Copy, Debug)]
    pub struct SplitLight {
        /// Radiance from the diffuse lobe.
        pub diffuse: Vec3f,
        /// Radiance from the others.
        pub specular: Vec3f,
        /// From the first surface to the second, metres; 0 if there is none.
        pub hit_distance: f32,
    }

    /// Adds radiance, of which the diffuse lobe has a `share`; see [`diffuse_share`].
    pub fn split_light_add(light: SplitLight, share: Vec3f, radiance: Vec3f) -> SplitLight {
        SplitLight {
            diffuse: light.diffuse + share * radiance,
            specular: light.specular + (1.0 - share) * radiance,
            hit_distance: light.hit_distance,
        }
    }

    /// Light that a frame's samples have brought to a pixel, as it was found: sums.
    #[derive(Clone, Copy, Debug)]
    pub struct FoundLight {
        /// Radiance from the diffuse lobe.
        pub diffuse: Vec3f,
        /// Samples of this frame.
        pub count: u32,
        /// Radiance from the other lobes.
        pub specular: Vec3f,
        /// Of the distances from the first surface to the second, metres.
        pub hit_distance: f32,
        /// Of the squares of the luminance, diffuse and specular.
        pub squares: Vec2f,
        /// Samples of the pixel in all frames so far.
        pub drawn: u32,
        /// Samples wanted in this frame.
        pub wanted: u32,
    }

    /// Adds the light of a sample that was drawn.
    pub fn found_light_add(found: FoundLight, light: SplitLight) -> FoundLight {
        let mut next = found;
        next.diffuse = found.diffuse + light.diffuse;
        next.specular = found.specular + light.specular;
        next.count = found.count + 1u32;
        next.hit_distance = found.hit_distance + min(light.hit_distance, FAR);
        next.squares = found.squares + vec2f(sqr(luminance(light.diffuse)), sqr(luminance(light.specular)));
        next
    }

    /// What is filtered: light relative to a white, for 16 bits to hold it.
    #[derive(Clone, Copy, Debug)]
    pub struct Signal {
        /// Light of the diffuse lobe.
        pub diffuse: Vec3f,
        /// Standard deviation of its luminance.
        pub diffuse_deviation: f32,
        /// Light of the other lobes.
        pub specular: Vec3f,
        /// Standard deviation of its luminance.
        pub specular_deviation: f32,
    }

    /// The largest 16-bit floating-point number.
    pub const LARGEST_HALF: f32 = 65504.0;

    /// A signal that 16 bits can hold.
    pub fn signal_in_halves(s: Signal) -> Signal {
        Signal {
            diffuse: min(s.diffuse, vec3f(LARGEST_HALF, LARGEST_HALF, LARGEST_HALF)),
            diffuse_deviation: min(s.diffuse_deviation, LARGEST_HALF),
            specular: min(s.specular, vec3f(LARGEST_HALF, LARGEST_HALF, LARGEST_HALF)),
            specular_deviation: min(s.specular_deviation, LARGEST_HALF),
        }
    }

    /// Light of a signal that is relative to `white`.
    pub fn signal_light(light: Vec3f, white: f32) -> Vec3f {
        light * white
    }

    /// Radiance of a signal that is relative to `white`, by the reflectances of its surface.
    pub fn signal_radiance(s: Signal, white: f32, diffuse: Vec3f, specular: Vec3f) -> Vec3f {
        remodulate(signal_light(s.diffuse, white), diffuse)
            + remodulate(signal_light(s.specular, white), specular)
    }

    /// A colour brought into the range in which pictures are shown, for means that single bright pixels must not rule;
    /// [`expand`] is the inverse. Source: Karis, "High Quality Temporal Supersampling", SIGGRAPH course 2014.
    pub fn compress(c: Vec3f) -> Vec3f {
        c * (1.0 / (1.0 + max(max_component(c), 0.0)))
    }

    /// A colour from what [`compress`] has made of it.
    pub fn expand(c: Vec3f) -> Vec3f {
        c * (1.0 / max(1.0 - max_component(c), 1e-6))
    }

    /// A colour brought down to a luminance of `limit` if it is brighter: what remains of a firefly.
    pub fn limit_luminance(c: Vec3f, limit: f32) -> Vec3f {
        let y = luminance(c);
        c * select(1.0, max(limit, 0.0) / max(y, 1e-30), y > limit)
    }

    /// YCoCg of linear RGB: luma, and two differences in which neighbours are much alike.
    pub fn ycocg_encode(c: Vec3f) -> Vec3f {
        vec3f(0.25 * c.x + 0.5 * c.y + 0.25 * c.z, 0.5 * c.x - 0.5 * c.z, 0.5 * c.y - 0.25 * c.x - 0.25 * c.z)
    }

    /// Linear RGB of YCoCg.
    pub fn ycocg_decode(c: Vec3f) -> Vec3f {
        let low = c.x - c.z;
        vec3f(low + c.y, c.x + c.z, low - c.y)
    }
}

#[cfg(test)]
mod tests {
    use super::signal::*;
    use crate::{vec2f, vec3f};

    #[test]
    fn what_is_taken_apart_is_put_together() {
        for c in [vec3f(0.0, 0.0, 0.0), vec3f(0.3, 2.0, 1e-6), vec3f(9e4, 1.0, 0.5)] {
            for albedo in [vec3f(0.0, 0.5, 1.0), vec3f(1.0, 1.0, 1.0), vec3f(1e-3, 0.02, 0.7)] {
                let back = remodulate(demodulate(c, albedo), albedo);
                let there = ycocg_decode(ycocg_encode(c));
                for (a, b) in [(back.x, c.x), (back.y, c.y), (back.z, c.z)] {
                    assert!((a - b).abs() <= 1e-6 * b.abs(), "{a} {b}");
                }
                for (a, b) in [(there.x, c.x), (there.y, c.y), (there.z, c.z)] {
                    assert!((a - b).abs() <= 1e-6 * (c.x + c.y + c.z), "{a} {b}");
                }
            }
        }
    }

    #[test]
    fn what_is_compressed_expands_again() {
        for c in [vec3f(0.0, 0.0, 0.0), vec3f(0.5, 2.0, 0.0), vec3f(90.0, 1.0, 30.0)] {
            let (small, back) = (compress(c), expand(compress(c)));
            assert!(crate::math::max_component(small) < 1.0);
            for (a, b) in [(back.x, c.x), (back.y, c.y), (back.z, c.z)] {
                assert!((a - b).abs() <= 1e-4 * b.abs(), "{a} {b}");
            }
        }
    }

    #[test]
    fn lobes_share_all_of_the_light() {
        let share = diffuse_share(vec3f(1.0, 0.5, 0.0), vec3f(0.25, 0.5, 0.0));
        assert_eq!((share.x, share.y), (0.75, 0.0));
        assert!((0.0..=1.0).contains(&share.z));
        let black = diffuse_share(vec3f(0.0, 0.0, 0.0), vec3f(0.0, 0.0, 0.0));
        assert_eq!((black.x, black.y, black.z), (0.0, 0.0, 0.0));
    }

    #[test]
    fn light_is_split_and_none_is_lost() {
        let none =
            SplitLight { diffuse: vec3f(0.0, 0.0, 0.0), specular: vec3f(0.0, 0.0, 0.0), hit_distance: 2.0 };
        let light = split_light_add(none, vec3f(0.25, 0.0, 1.0), vec3f(4.0, 2.0, 3.0));
        assert_eq!((light.diffuse.x, light.diffuse.y, light.diffuse.z), (1.0, 0.0, 3.0));
        assert_eq!((light.specular.x, light.specular.y, light.specular.z), (3.0, 2.0, 0.0));
        let found = FoundLight {
            diffuse: vec3f(1.0, 1.0, 1.0),
            count: 3,
            specular: vec3f(0.0, 0.0, 0.0),
            hit_distance: 1.0,
            squares: vec2f(0.0, 0.0),
            drawn: 7,
            wanted: 4,
        };
        let found = found_light_add(found, light);
        assert_eq!((found.diffuse.x, found.count, found.hit_distance, found.drawn), (2.0, 4, 3.0, 7));
    }

    #[test]
    fn fireflies_keep_their_colour() {
        let c = limit_luminance(vec3f(100.0, 50.0, 25.0), 2.0);
        assert!((crate::math::luminance(c) - 2.0).abs() < 1e-5);
        assert!((c.x / c.y - 2.0).abs() < 1e-5);
        assert_eq!(limit_luminance(vec3f(1.0, 1.0, 1.0), 2.0).x, 1.0);
    }
}
