//! Choosing a light by the irradiance that it can bring to a vertex: what a tree of lights knows of a group of them, and how one
//! step down the tree is taken. The tree itself is the scene's; that of few lights is one node, a list.
//!
//! Irradiance is estimated without shadows. Where the estimate is wrong, a list of lights has a guarantee: see [`child_weight`].
//!
//! Source: Conty Estévez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018, with the bounds
//! of Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 12.6.3; defensive mixtures: Hesterberg,
//! "Weighted Average Importance Sampling and Defensive Mixture Distributions", Technometrics 37(2), 1995.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod light_tree {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Children of a node of a tree of lights.
    pub const LIGHT_NODE_WIDTH: u32 = 8u32;
    /// 32-bit words that a node takes: for each number of a [`LightGroup`], in their order, and for a link one word a child, and
    /// then the place of the node.
    pub const LIGHT_NODE_WORDS: u32 = 105u32;
    /// Of the words of a node, the first link.
    pub const LIGHT_NODE_LINKS: u32 = 96u32;
    /// Of the words of a node, its place: eight times the index of its parent, plus which child of that it is.
    pub const LIGHT_NODE_PLACE: u32 = 104u32;
    /// Bit of a child's link: it is a single light, whose index the other bits are; else they are the index of a node.
    pub const LIGHT_NODE_LEAF: u32 = 0x80000000u32;
    /// The bits of a child's link that are an index.
    pub const LIGHT_NODE_INDEX: u32 = 0x7fffffffu32;
    /// What importances are cut off at: sums of weights of eight children are finite.
    pub const MOST_IMPORTANT: f32 = 1e30;
    /// [`LightGroup::back`] of lights that are infinitely far away.
    pub const INFINITELY_FAR: f32 = 0.0;
    /// Added to the cosine at a receiver. Normals are rounded ([`octahedral_encode`]), and no light that grazes a surface may have
    /// an importance of 0.
    pub const COSINE_SLACK: f32 = 2e-4;
    /// Of a tree of more than one node, the share of choices that are uniform over all lights. No light is chosen less often than
    /// with this share divided by the number of lights, whatever importances say.
    pub const UNIFORM_SHARE: f32 = 0.125;
    /// How many times the variance of a uniform choice a child's contribution may have where the
    /// children of a node are defended: see [`child_weight`].
    pub const MOST_VARIANCE: f32 = 1.8;
    /// Of surfaces that light can reach from all sides, in place of [`octahedral_encode`].
    pub const ALL_SIDES: u32 = 0u32;

    /// Where a group of lights is, and where it shines.
    ///
    /// Lights that are infinitely far away have `back` [`INFINITELY_FAR`], and the axis opposite to `center`, with no spread.
    #[derive(Clone, Copy, Debug)]
    pub struct LightGroup {
        /// Centre of a sphere around the lights, world space. Infinitely far: unit axis of a cone of directions towards the lights.
        pub center: Vec3f,
        /// Radius of that sphere. Infinitely far: sine of the cone's half angle, 1 for all directions.
        pub radius: f32,
        /// Sum of the lights' greatest radiant intensities, W/sr in the strongest channel; 0: there is no light. Infinitely far: sum
        /// of irradiances at normal incidence, W/m².
        pub intensity: f32,
        /// Unit axis of a cone around the lights' main directions.
        pub axis: Vec3f,
        /// Cosine of that cone's half angle.
        pub cos_spread: f32,
        /// Sine of that angle.
        pub sin_spread: f32,
        /// Cosine of the angle from its main direction up to which a light emits.
        pub cos_emission: f32,
        /// −1 if the lights emit around the opposite directions, too; else 1, or [`INFINITELY_FAR`].
        pub back: f32,
    }

    /// cos(max(0, a − b)) of angles in `[0, π]` given by their cosines and sines.
    pub fn cos_of_difference(cos_a: f32, sin_a: f32, cos_b: f32, sin_b: f32) -> f32 {
        select(cos_a * cos_b + sin_a * sin_b, 1.0, cos_a > cos_b)
    }

    /// sin(max(0, a − b)) of angles in `[0, π]` given by their cosines and sines.
    pub fn sin_of_difference(cos_a: f32, sin_a: f32, cos_b: f32, sin_b: f32) -> f32 {
        select(sin_a * cos_b - cos_a * sin_b, 0.0, cos_a > cos_b)
    }

    /// An estimate of the irradiance that a group of lights brings to a point, W/m² in the strongest channel, if nothing is in
    /// between. Zero only where it brings nothing, at most [`MOST_IMPORTANT`].
    ///
    /// It has no branches, so that a loop over groups becomes vector instructions.
    ///
    /// - `p`: the point. `normal`: unit normal on the side that light can reach, or zero if it can reach both.
    pub fn light_importance(lights: LightGroup, p: Vec3f, normal: Vec3f) -> f32 {
        // From what is infinitely far away all points are in one direction, and none is nearer than another.
        let to_point = p * select(1.0, 0.0, lights.back == INFINITELY_FAR) - lights.center;
        let distance2 = max(dot(to_point, to_point), 1e-30);
        let inverse_distance = 1.0 / sqrt(distance2);
        // Half the angle under which the sphere is seen from the point: from inside everything is possible.
        let sine = lights.radius * inverse_distance;
        let outside = sine < 1.0;
        let sin_seen = select(0.0, sine, outside);
        let cos_seen = select(-1.0, safe_sqrt(1.0 - sine * sine), outside);

        // The least angle between a light's main direction and the direction to the point.
        let along = dot(lights.axis, to_point) * inverse_distance;
        let cos_w = max(min(max(along, along * lights.back), 1.0), -1.0);
        let sin_w = safe_sqrt(1.0 - cos_w * cos_w);
        let cos_x = cos_of_difference(cos_w, sin_w, lights.cos_spread, lights.sin_spread);
        let sin_x = sin_of_difference(cos_w, sin_w, lights.cos_spread, lights.sin_spread);
        let cos_least = cos_of_difference(cos_x, sin_x, cos_seen, sin_seen);
        // Lights that are not cosine emitters shine sideways, too: never below a small share.
        let facing = select(0.0, max(cos_least, 0.05), cos_least > lights.cos_emission);

        // The least angle between the normal and a direction towards the lights.
        let has_side = dot(normal, normal) > 0.0;
        let cos_i = max(min(-dot(to_point, normal) * inverse_distance, 1.0), -1.0);
        let sin_i = safe_sqrt(1.0 - cos_i * cos_i);
        let cos_nearest = cos_of_difference(cos_i, sin_i, cos_seen, sin_seen);
        let received = select(1.0, max(cos_nearest + COSINE_SLACK, 0.0), has_side);

        // Within the sphere the centre's distance says nothing.
        let spread2 = max(distance2, lights.radius * lights.radius);
        min(lights.intensity * facing * received / spread2, MOST_IMPORTANT)
    }

    /// What the children of a node promise together.
    #[derive(Clone, Copy, Debug)]
    pub struct NodeImportance {
        /// Sum of their importances.
        pub sum: f32,
        /// How many have an importance above 0.
        pub count: f32,
    }

    /// That of no children.
    pub fn node_importance_zero() -> NodeImportance {
        NodeImportance { sum: 0.0, count: 0.0 }
    }

    /// Counts one more child.
    pub fn node_importance_add(node: NodeImportance, importance: f32) -> NodeImportance {
        NodeImportance { sum: node.sum + importance, count: node.count + select(0.0, 1.0, importance > 0.0) }
    }

    /// The weight in proportion to which a child is chosen.
    ///
    /// - `defends`: whether a wrong importance may cost no more than a factor b, [`MOST_VARIANCE`].
    ///   Then a child with the share s of the importances of n children has the probability
    ///   (1 + (b − 1) (n − 1) s) / (1 + b (n − 1)), which is least for s = 0. A contribution f that
    ///   is chosen with probability p has the variance E\[f²\]/p − E\[f\]², and E\[f\]² is at most
    ///   E\[f²\]. So the variance is at most b times that of a choice with p = 1/n, however weak the
    ///   light is and whatever hides the others.
    pub fn child_weight(importance: f32, node: NodeImportance, defends: bool) -> f32 {
        let by_share = (MOST_VARIANCE - 1.0) * (node.count - 1.0) * importance;
        let defended = select(0.0, node.sum + by_share, importance > 0.0);
        select(importance, defended, defends)
    }

    /// Sum of the weights of all children of a node.
    pub fn node_weight(node: NodeImportance, defends: bool) -> f32 {
        node.sum * select(1.0, 1.0 + MOST_VARIANCE * (node.count - 1.0), defends)
    }

    /// Probability of choosing a child, by its weight and the sum of all weights.
    pub fn light_share(weight: f32, sum: f32) -> f32 {
        select(0.0, weight / sum, sum > 0.0)
    }

    /// The child that a number has chosen of those seen so far.
    #[derive(Clone, Copy, Debug)]
    pub struct ChildChoice {
        /// Which one; meaningless while `weight` is 0.
        pub child: u32,
        /// Its weight.
        pub weight: f32,
        /// Sum of the weights of the children before it.
        pub before: f32,
        /// Sum of the weights of all children so far.
        pub end: f32,
    }

    /// No child yet.
    pub fn child_choice_none() -> ChildChoice {
        ChildChoice { child: 0u32, weight: 0.0, before: 0.0, end: 0.0 }
    }

    /// Looks at one more child: the last one that begins at or before the number is chosen. Without branches, as importances are.
    ///
    /// - `chosen`: the number that chooses, times the sum of all weights.
    pub fn child_choice_add(choice: ChildChoice, child: u32, weight: f32, chosen: f32) -> ChildChoice {
        // What promises nothing is never chosen, even if rounding puts the number beyond the last weight.
        let taken = choice.end <= chosen && weight > 0.0;
        ChildChoice {
            child: select(choice.child, child, taken),
            weight: select(choice.weight, weight, taken),
            before: select(choice.before, choice.end, taken),
            end: choice.end + weight,
        }
    }

    /// What is left of a number that has chosen a child: a fresh uniform number in `[0, 1)`. `chosen`: see [`child_choice_add`].
    pub fn child_remainder(choice: ChildChoice, chosen: f32) -> f32 {
        max(min((chosen - choice.before) / max(choice.weight, 1e-37), ONE_MINUS_EPSILON), 0.0)
    }

    /// Probability of choosing a light in a tree, `uniform_share` of whose choices are uniform over `count` lights, and that
    /// chooses it with probability `by_importance` else.
    pub fn light_choice_probability(by_importance: f32, uniform_share: f32, count: f32) -> f32 {
        by_importance + (1.0 / count - by_importance) * uniform_share
    }

    /// The light that a number in `[0, 1)` chooses of `count` alike.
    pub fn uniform_light(u: f32, count: u32) -> u32 {
        min(u32(u * f32(count)), count - 1u32)
    }

    /// What `uniform_light` leaves of the number: a fresh one in `[0, 1)`.
    pub fn uniform_remainder(u: f32, count: u32) -> f32 {
        min(max(u * f32(count) - f32(uniform_light(u, count)), 0.0), ONE_MINUS_EPSILON)
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

    /// A unit vector in 32 bits; never [`ALL_SIDES`]. The error is below 10⁻⁴ radians.
    /// Source: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014.
    pub fn octahedral_encode(v: Vec3f) -> u32 {
        let scale = 1.0 / (abs(v.x) + abs(v.y) + abs(v.z));
        let x = v.x * scale;
        let y = v.y * scale;
        let folded_x = (1.0 - abs(y)) * select(-1.0, 1.0, x >= 0.0);
        let folded_y = (1.0 - abs(x)) * select(-1.0, 1.0, y >= 0.0);
        let below = v.z < 0.0;
        let low =
            u32(nearest_integer(clamp(select(x, folded_x, below) * 32767.0 + 32767.0, 0.0, 65534.0))) + 1u32;
        let high =
            u32(nearest_integer(clamp(select(y, folded_y, below) * 32767.0 + 32767.0, 0.0, 65534.0))) + 1u32;
        low | (high << 16u32)
    }

    /// What the choice of a light is to know of a surface of unit `normal`. `transmits`: whether light can arrive from
    /// below.
    pub fn sampling_normal(normal: Vec3f, transmits: bool) -> u32 {
        if transmits {
            return ALL_SIDES;
        }
        octahedral_encode(normal)
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

    /// The number that is left for the light after a choice of probability `probability`, with the bits that the choice has
    /// used up filled from `rest`, another number in `[0, 1)`.
    pub fn refill(remainder: f32, probability: f32, rest: f32) -> f32 {
        let last_bit = min(5.9604644775390625e-8 / max(probability, 1e-30), 1.0);
        let below = floor(remainder / last_bit) * last_bit;
        min(below + rest * last_bit, ONE_MINUS_EPSILON)
    }
}
