//! Choosing among many lights by where they are: what a tree of lights knows of a group, and how much that promises.
//!
//! Source: Conty Estévez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018, with the bounds
//! of Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 12.6.3. The tree itself is the scene's.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod light_tree {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// 32-bit words that a node of a tree of lights takes.
    pub const LIGHT_NODE_WORDS: u32 = 10u32;
    /// Bit of a node's link: it is a single light, whose index the other bits are; else they are its first child.
    pub const LIGHT_NODE_LEAF: u32 = 0x80000000u32;
    /// Bit of a node's link: its lights shine from both sides.
    pub const LIGHT_NODE_TWO_SIDED: u32 = 0x40000000u32;
    /// The bits of a node's link that are an index.
    pub const LIGHT_NODE_INDEX: u32 = 0x3fffffffu32;
    /// Of surfaces that light can reach from all sides, in place of [`octahedral_encode`].
    pub const ALL_SIDES: u32 = 0u32;

    /// Where a group of lights is, and where it shines.
    #[derive(Clone, Copy, Debug)]
    pub struct LightBounds {
        /// Corners of a box around the lights, world space.
        pub low: Vec3f,
        /// See `low`.
        pub high: Vec3f,
        /// Sum of the lights' greatest radiant intensities.
        pub intensity: f32,
        /// Unit axis of a cone around the lights' main directions.
        pub axis: Vec3f,
        /// Cosine of that cone's half angle.
        pub cos_spread: f32,
        /// Cosine of the angle from its main direction up to which a light emits.
        pub cos_emission: f32,
        /// Whether the lights emit around the opposite directions, too.
        pub two_sided: bool,
    }

    /// cos(max(0, a − b)) of angles in `[0, π]` given by their cosines and sines.
    pub fn cos_of_difference(cos_a: f32, sin_a: f32, cos_b: f32, sin_b: f32) -> f32 {
        select(cos_a * cos_b + sin_a * sin_b, 1.0, cos_a > cos_b)
    }

    /// sin(max(0, a − b)) of angles in `[0, π]` given by their cosines and sines.
    pub fn sin_of_difference(cos_a: f32, sin_a: f32, cos_b: f32, sin_b: f32) -> f32 {
        select(sin_a * cos_b - cos_a * sin_b, 0.0, cos_a > cos_b)
    }

    /// An estimate of how much a group of lights brings to a point, up to a factor that is the same for all groups. Zero only
    /// where it brings nothing.
    ///
    /// - `p`: the point. `normal`: unit normal on the side that light can reach, or zero if it can reach both.
    pub fn light_importance(bounds: LightBounds, p: Vec3f, normal: Vec3f) -> f32 {
        let center = (bounds.low + bounds.high) * 0.5;
        let half_diagonal = (bounds.high - bounds.low) * 0.5;
        let radius2 = dot(half_diagonal, half_diagonal);
        let to_point = p - center;
        let distance2 = dot(to_point, to_point);
        // Half the angle under which the box is seen from the point: from inside its sphere everything is possible.
        let outside = distance2 > radius2 && distance2 > 0.0;
        let sin2_seen = select(1.0, radius2 / max(distance2, 1e-30), outside);
        let cos_seen = select(-1.0, safe_sqrt(1.0 - sin2_seen), outside);
        let sin_seen = select(0.0, sqrt(sin2_seen), outside);
        let direction = to_point * (1.0 / sqrt(max(distance2, 1e-30)));

        // The least angle between a light's main direction and the direction to the point.
        let along = dot(bounds.axis, direction);
        let cos_w = clamp(select(along, abs(along), bounds.two_sided), -1.0, 1.0);
        let sin_w = safe_sqrt(1.0 - cos_w * cos_w);
        let sin_spread = safe_sqrt(1.0 - bounds.cos_spread * bounds.cos_spread);
        let cos_x = cos_of_difference(cos_w, sin_w, bounds.cos_spread, sin_spread);
        let sin_x = sin_of_difference(cos_w, sin_w, bounds.cos_spread, sin_spread);
        let cos_least = cos_of_difference(cos_x, sin_x, cos_seen, sin_seen);
        if cos_least <= bounds.cos_emission {
            return 0.0;
        }
        // Lights that are not cosine emitters shine sideways, too: never below a small share.
        let facing = max(cos_least, 0.05);

        // The least angle between the normal and a direction towards the lights.
        let has_side = dot(normal, normal) > 0.0;
        let cos_i = clamp(-dot(direction, normal), -1.0, 1.0);
        let sin_i = safe_sqrt(1.0 - cos_i * cos_i);
        let cos_best = cos_of_difference(cos_i, sin_i, cos_seen, sin_seen);
        let received = select(1.0, cos_best, has_side);
        if received <= 0.0 {
            return 0.0;
        }
        // Within the box the centre's distance says nothing.
        bounds.intensity * facing * received / max(max(distance2, radius2), 1e-30)
    }

    /// Which of two groups a number chose.
    #[derive(Clone, Copy, Debug)]
    pub struct LightBranch {
        /// Whether it is the second.
        pub second: bool,
        /// Probability of that; 0: neither can bring anything.
        pub probability: f32,
        /// A fresh uniform number in `[0, 1)` made of what the choice did not use.
        pub remainder: f32,
    }

    /// Chooses one of two groups in proportion to their importances; `u` in `[0, 1)`.
    pub fn light_branch(first: f32, second: f32, u: f32) -> LightBranch {
        let sum = first + second;
        // Infinite sums come from lights that overflow: half and half is as good as anything.
        let share = select(0.0, select(0.5, first / sum, is_finite(sum)), sum > 0.0);
        if u < share {
            return LightBranch {
                second: false,
                probability: share,
                remainder: min(u / share, ONE_MINUS_EPSILON),
            };
        }
        LightBranch {
            second: true,
            probability: select(0.0, 1.0 - share, sum > 0.0),
            remainder: min((u - share) / max(1.0 - share, 1e-30), ONE_MINUS_EPSILON),
        }
    }

    /// Probability with which [`light_branch`] takes the second group, if `takes_second`, or the first.
    pub fn light_branch_probability(first: f32, second: f32, takes_second: bool) -> f32 {
        let branch = light_branch(first, second, select(0.0, 1.0, takes_second));
        select(0.0, branch.probability, branch.second == takes_second)
    }

    /// A unit vector in 32 bits; never [`ALL_SIDES`]. The error is below 10⁻⁴ radians.
    /// Source: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014.
    pub fn octahedral_encode(v: Vec3f) -> u32 {
        let scale = 1.0 / (abs(v.x) + abs(v.y) + abs(v.z));
        let x = v.x * scale;
        let y = v.y * scale;
        let folded_x = (1.0 - abs(y)) * select(-1.0, 1.0, x >= 0.0);
        let folded_y = (1.0 - abs(x)) * select(-1.0, 1.0, y >= 0.0);
        let below = v.z < 0.0;
        let low = u32(clamp(select(x, folded_x, below) * 32767.0 + 32767.5, 0.0, 65534.0)) + 1u32;
        let high = u32(clamp(select(y, folded_y, below) * 32767.0 + 32767.5, 0.0, 65534.0)) + 1u32;
        low | (high << 16u32)
    }

    /// The inverse of [`octahedral_encode`]; zero for [`ALL_SIDES`].
    pub fn octahedral_decode(code: u32) -> Vec3f {
        let x = (f32(code & 0xffffu32) - 32768.0) * (1.0 / 32767.0);
        let y = (f32(code >> 16u32) - 32768.0) * (1.0 / 32767.0);
        let z = 1.0 - abs(x) - abs(y);
        let fold = max(-z, 0.0);
        let unfolded = vec3f(x - select(-fold, fold, x >= 0.0), y - select(-fold, fold, y >= 0.0), z);
        let unit = normalize(unfolded);
        vec3f(
            select(unit.x, 0.0, code == ALL_SIDES),
            select(unit.y, 0.0, code == ALL_SIDES),
            select(unit.z, 0.0, code == ALL_SIDES),
        )
    }

    /// Two cosines in 32 bits, each rounded down: cones become wider, never narrower.
    pub fn cosines_encode(cos_spread: f32, cos_emission: f32) -> u32 {
        let spread = u32(clamp((cos_spread + 1.0) * 32767.5, 0.0, 65535.0));
        let emission = u32(clamp((cos_emission + 1.0) * 32767.5, 0.0, 65535.0));
        spread | (emission << 16u32)
    }

    /// The first cosine of [`cosines_encode`].
    pub fn cos_spread_decode(code: u32) -> f32 {
        f32(code & 0xffffu32) * (1.0 / 32767.5) - 1.0
    }

    /// The second cosine of [`cosines_encode`].
    pub fn cos_emission_decode(code: u32) -> f32 {
        f32(code >> 16u32) * (1.0 / 32767.5) - 1.0
    }

    /// The bounds that a node's words stand for.
    ///
    /// - `axis`: by [`octahedral_encode`]. `cosines`: by [`cosines_encode`]. `link`: `LIGHT_NODE_…` bits and an index.
    pub fn light_bounds(
        low: Vec3f,
        high: Vec3f,
        intensity: f32,
        axis: u32,
        cosines: u32,
        link: u32,
    ) -> LightBounds {
        LightBounds {
            low: low,
            high: high,
            intensity: intensity,
            axis: octahedral_decode(axis),
            cos_spread: cos_spread_decode(cosines),
            cos_emission: cos_emission_decode(cosines),
            two_sided: (link & LIGHT_NODE_TWO_SIDED) != 0u32,
        }
    }

    /// The number that is left for the light after a choice of probability `probability`, with the bits that the choice has
    /// used up filled from `rest`, another number in `[0, 1)`.
    pub fn refill(remainder: f32, probability: f32, rest: f32) -> f32 {
        let last_bit = min(5.9604644775390625e-8 / max(probability, 1e-30), 1.0);
        let below = floor(remainder / last_bit) * last_bit;
        min(below + rest * last_bit, ONE_MINUS_EPSILON)
    }
}
