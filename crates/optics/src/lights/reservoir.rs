//! Choosing one of some candidates that come one after the other, in proportion to their weights.
//!
//! The candidates of a vertex are light samples: each weighs what it would bring by itself if nothing were in between.
//!
//! Source: Talbot, Cline and Egbert, "Importance Resampling for Global Illumination", EGSR 2005; Chao, "A General Purpose
//! Unequal Probability Sampling Plan", Biometrika 1982, for the choice without a list.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod reservoir {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// The candidates so far.
    #[derive(Clone, Copy, Debug)]
    pub struct Reservoir {
        /// Number of the one that is kept; meaningless while `sum` is 0.
        pub chosen: u32,
        /// Its weight.
        pub weight: f32,
        /// Sum of all weights.
        pub sum: f32,
        /// A uniform number in `[0, 1)`, whatever has been chosen.
        pub remainder: f32,
    }

    /// Weight of a candidate by what it would contribute: its strongest channel, so that no colour is left out.
    pub fn candidate_weight(contribution: Vec3f) -> f32 {
        max_component(contribution)
    }

    /// Density of a candidate as one of `count`, by its density `pdf` once its light is chosen and the `probability` of that.
    ///
    /// Candidates may depend on each other: sums of expected values do not ask for independence.
    pub fn candidate_pdf(pdf: f32, probability: f32, count: u32) -> f32 {
        pdf * (probability * f32(count))
    }

    /// Where on its light candidate `number` lies: points that are spread, moved by two uniform numbers `u`.
    /// Source: Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
    pub fn candidate_place(u: Vec2f, number: u32) -> Vec2f {
        let x = u.x + f32(number) * 0.7548777;
        let y = u.y + f32(number) * 0.5698403;
        vec2f(min(x - floor(x), ONE_MINUS_EPSILON), min(y - floor(y), ONE_MINUS_EPSILON))
    }

    /// What is left of a number `u` in `[0, 1)` that has chosen one of `count` candidates: a fresh one.
    pub fn candidate_fraction(u: f32, count: u32) -> f32 {
        fract(u * f32(count))
    }

    /// Density with which `count` candidates together find a direction: each chooses its light with a `probability`, and then the
    /// direction with density `pdf`.
    pub fn candidates_pdf(count: u32, probability: f32, pdf: f32) -> f32 {
        f32(count) * probability * pdf
    }

    /// How many of `count` candidates are expected to be what is chosen with a `probability`.
    pub fn expected_candidates(count: u32, probability: f32) -> f32 {
        f32(count) * probability
    }

    /// Probability with which a tile of pixels chooses a light: a share of the choices goes by what lights bring to one point of it.
    ///
    /// - `by_importance`: probability of the light there. `uniform`: of [`tile_uniform_probability`].
    pub fn tile_light_probability(tree_share: f32, by_importance: f32, uniform: f32) -> f32 {
        tree_share * by_importance + uniform
    }

    /// Probability with which a tile of pixels chooses each of `count` lights because it chooses among all alike.
    pub fn tile_uniform_probability(tree_share: f32, count: u32) -> f32 {
        (1.0 - tree_share) / f32(count)
    }

    /// No candidates yet; `u`: a uniform number in `[0, 1)` that makes all choices.
    pub fn reservoir_empty(u: f32) -> Reservoir {
        Reservoir { chosen: 0u32, weight: 0.0, sum: 0.0, remainder: u }
    }

    /// Adds candidate `number`, which takes the place of the one kept with probability `weight` over the sum of all weights.
    /// Weights that are not positive and finite never do.
    pub fn reservoir_add(r: Reservoir, number: u32, weight: f32) -> Reservoir {
        let mut next = r;
        if !(is_finite(weight) && weight > 0.0) {
            return next;
        }
        next.sum = r.sum + weight;
        let share = weight / next.sum;
        if r.remainder < share {
            next.chosen = number;
            next.weight = weight;
            next.remainder = min(r.remainder / share, ONE_MINUS_EPSILON);
        } else {
            next.remainder = min((r.remainder - share) / max(1.0 - share, 1e-30), ONE_MINUS_EPSILON);
        }
        next
    }

    /// What the chosen candidate brings, for all of them; see [`reservoir_factor`].
    pub fn reservoir_contribution(r: Reservoir, contribution: Vec3f) -> Vec3f {
        contribution * reservoir_factor(r)
    }

    /// By how much more the chosen candidate has to count, as it stands for all: one over the probability of its choice.
    /// 0 if there is none.
    pub fn reservoir_factor(r: Reservoir) -> f32 {
        select(0.0, r.sum / r.weight, r.sum > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::reservoir::*;

    /// What a row of candidates makes of one random number.
    fn choose(weights: &[f32], u: f32) -> Reservoir {
        (0..).zip(weights).fold(reservoir_empty(u), |r, (i, w)| reservoir_add(r, i, *w))
    }

    #[test]
    fn candidates_are_chosen_in_proportion_and_count_as_all_of_them() {
        let weights = [0.0, 3.0, 1.0, f32::NAN, 0.5, f32::INFINITY, 3.5, -1.0];
        let n = 80_000;
        let (mut counts, mut mean, mut remainders) = ([0u32; 8], 0.0, 0.0);
        for i in 0..n {
            let r = choose(&weights, (i as f32 + 0.5) / n as f32);
            counts[r.chosen as usize] += 1;
            mean += f64::from(weights[r.chosen as usize] * reservoir_factor(r));
            remainders += f64::from(r.remainder);
        }
        let share = |i: usize| f64::from(counts[i]) / f64::from(n);
        for (i, expected) in [0.0, 3.0, 1.0, 0.0, 0.5, 0.0, 3.5, 0.0].into_iter().enumerate() {
            assert!((share(i) - expected / 8.0).abs() < 1e-3, "{i}: {}", share(i));
        }
        assert!((mean / f64::from(n) - 8.0).abs() < 1e-3, "{mean}");
        assert!((remainders / f64::from(n) - 0.5).abs() < 1e-2, "{remainders}");
    }

    #[test]
    fn without_candidates_nothing_counts() {
        assert_eq!(reservoir_factor(choose(&[], 0.5)), 0.0);
        assert_eq!(reservoir_factor(choose(&[0.0, 0.0], 0.0)), 0.0);
        assert_eq!(reservoir_factor(choose(&[1e-30], 0.999)), 1.0);
    }
}
