//! Maps from the unit square to the domains that light transport integrates over.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod warp {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// A point on the unit disk, uniform in area; keeps neighbouring numbers near each other.
    /// Source: Shirley and Chiu, "A Low Distortion Map Between Disk and Square", 1997, in the form of Dave Cline.
    pub fn sample_disk(u: Vec2f) -> Vec2f {
        let a = 2.0 * u.x - 1.0;
        let b = 2.0 * u.y - 1.0;
        let wide = abs(a) > abs(b);
        let r = select(b, a, wide);
        let ratio = select(a, b, wide) / select(r, 1.0, r == 0.0);
        // An eighth of a turn for a ratio of 1; the other half of the disk is a quarter turn on.
        let turns = select(0.25 - 0.125 * ratio, 0.125 * ratio, wide);
        cos_sin_turns(turns) * r
    }

    /// A direction above the plane z = 0 with density [`pdf_cosine_hemisphere`] over solid angle.
    pub fn sample_cosine_hemisphere(u: Vec2f) -> Vec3f {
        let d = sample_disk(u);
        // The disk's radius is the larger of |a| and |b|. Taking the height from it rather than from the point does not
        // cancel near the horizon.
        let r = max(abs(2.0 * u.x - 1.0), abs(2.0 * u.y - 1.0));
        vec3f(d.x, d.y, safe_sqrt((1.0 - r) * (1.0 + r)))
    }

    /// Density over solid angle of [`sample_cosine_hemisphere`]; `cos_theta` is the direction's z.
    pub fn pdf_cosine_hemisphere(cos_theta: f32) -> f32 {
        max(cos_theta, 0.0) * INV_PI
    }

    /// A direction uniform over the sphere; its density over solid angle is 1 / (4π).
    pub fn sample_sphere(u: Vec2f) -> Vec3f {
        let z = 1.0 - 2.0 * u.x;
        let r = safe_sqrt(1.0 - z * z);
        let cs = cos_sin_turns(u.y);
        vec3f(r * cs.x, r * cs.y, z)
    }

    /// A direction uniform over the cone around +Z whose half angle has `one_minus_cos` = 1 − cos. Taking 1 − cos
    /// rather than cos keeps narrow cones, such as the sun's, exact.
    pub fn sample_cone(u: Vec2f, one_minus_cos: f32) -> Vec3f {
        let h = u.x * one_minus_cos;
        let r = safe_sqrt(h * (2.0 - h));
        let cs = cos_sin_turns(u.y);
        vec3f(r * cs.x, r * cs.y, 1.0 - h)
    }

    /// Density over solid angle of [`sample_cone`].
    pub fn pdf_cone(one_minus_cos: f32) -> f32 {
        1.0 / (TAU * one_minus_cos)
    }

    /// Barycentric weights of the second and third vertex of a point uniform over a triangle's area.
    /// Source: Heitz, "A Low-Distortion Map Between Triangle and Square", 2019.
    pub fn sample_triangle(u: Vec2f) -> Vec2f {
        if u.y > u.x {
            let x = u.x * 0.5;
            return vec2f(x, u.y - x);
        }
        let y = u.y * 0.5;
        vec2f(u.x - y, y)
    }

    /// What one look into an alias table chose.
    #[derive(Clone, Copy, Debug)]
    pub struct AliasChoice {
        /// The chosen entry.
        pub index: u32,
        /// A fresh uniform number in `[0, 1)` made of what the choice did not use of `u`.
        pub remainder: f32,
    }

    /// The slot of an alias table of `count` entries that `u` in `[0, 1)` falls into.
    pub fn alias_slot(u: f32, count: u32) -> u32 {
        min(u32(u * f32(count)), count - 1u32)
    }

    /// Chooses between a slot of an alias table and its alias.
    ///
    /// - `u`, `count`: as given to [`alias_slot`]; `slot`: its result.
    /// - `threshold`, `other`: the table's entry at `slot`: the share of the slot that is its own, and its alias.
    ///
    /// Source: Walker 1977, with Vose's construction of 1991 for the table.
    pub fn alias_choose(u: f32, count: u32, slot: u32, threshold: f32, other: u32) -> AliasChoice {
        alias_choose_dithered(u, count, slot, threshold, other, 0.0)
    }

    /// As [`alias_choose`], for tables of so many entries that the 24 bits of `u` leave too few for the choice and for
    /// the remainder.
    ///
    /// - `dither`: another number in `[0, 1)`: what comes after the last bit of `u`.
    pub fn alias_choose_dithered(
        u: f32,
        count: u32,
        slot: u32,
        threshold: f32,
        other: u32,
        dither: f32,
    ) -> AliasChoice {
        let last_bit = f32(count) * 5.9604644775390625e-8;
        let x = clamp(u * f32(count) - f32(slot) + dither * last_bit, 0.0, ONE_MINUS_EPSILON);
        if x < threshold {
            return AliasChoice { index: slot, remainder: min(x / threshold, ONE_MINUS_EPSILON) };
        }
        AliasChoice { index: other, remainder: min((x - threshold) / (1.0 - threshold), ONE_MINUS_EPSILON) }
    }
}
