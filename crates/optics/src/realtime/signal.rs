//! The signals that are filtered: light apart from the surface's colour, diffuse and specular apart.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod signal {
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
    use crate::vec3f;

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
    fn fireflies_keep_their_colour() {
        let c = limit_luminance(vec3f(100.0, 50.0, 25.0), 2.0);
        assert!((crate::math::luminance(c) - 2.0).abs() < 1e-5);
        assert!((c.x / c.y - 2.0).abs() < 1e-5);
        assert_eq!(limit_luminance(vec3f(1.0, 1.0, 1.0), 2.0).x, 1.0);
    }
}
