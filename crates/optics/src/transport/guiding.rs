//! Path guiding: directions sampled by what was learned of the light that arrives.
//!
//! A guide is a tree over space, whose leaves have a tree over directions each (SD-tree: Müller, Gross and Novák, "Practical Path
//! Switch for Efficient Light-Transport Simulation", 2017). Who follows a path fetches the nodes and asks these functions what they
//! mean. Directions lie in the unit square by the octahedral map; each node of a tree over directions divides a square in four,
//! child by child: bit 0 says the upper half in x, bit 1 in y.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod guiding {
    use crate::math::*;
    use crate::scatter::*;
    use wgsl_rs::std::*;

    /// The most that roulette's judgement of a path changes at a vertex because its direction was guided.
    pub const MOST_GUIDED_SURVIVAL: f32 = 64.0;
    /// The largest number below one.
    pub const BELOW_ONE: f32 = 0.99999994;

    /// A sampled place in a tree over directions, on the way down.
    #[derive(Clone, Copy, Debug)]
    pub struct GuideWalk {
        /// Uniform numbers for what is left of the way, in `[0, 1)`.
        pub u: Vec2f,
        /// The lower corner of the square that was reached.
        pub corner: Vec2f,
        /// Its side.
        pub size: f32,
        /// Density over the unit square there.
        pub density: f32,
        /// Which child of the last node it is, in `0..4`.
        pub child: u32,
    }

    /// A place in a tree over directions, looked up, on the way down.
    #[derive(Clone, Copy, Debug)]
    pub struct GuideDescent {
        /// Where in the square that was reached, in `[0, 1]`.
        pub place: Vec2f,
        /// Density over the unit square there.
        pub density: f32,
        /// Which child of the last node it is, in `0..4`.
        pub child: u32,
    }

    /// A direction sampled from a guide.
    #[derive(Clone, Copy, Debug)]
    pub struct GuideSample {
        /// Unit direction, world space.
        pub wi: Vec3f,
        /// Its density over solid angle.
        pub pdf: f32,
    }

    /// Which child of a node of the tree over space a point is in, 0 or 1. `axis`: in `0..3`, across which the node is divided at
    /// `split`.
    pub fn guide_half(p: Vec3f, axis: u32, split: f32) -> u32 {
        let yz = select(p.z, p.y, axis == 1u32);
        select(0u32, 1u32, select(yz, p.x, axis == 0u32) >= split)
    }

    /// Folds the lower half of the octahedron outwards, and back.
    pub fn guide_fold(p: Vec2f) -> Vec2f {
        let x = 1.0 - abs(p.y);
        let y = 1.0 - abs(p.x);
        vec2f(select(-x, x, p.x >= 0.0), select(-y, y, p.y >= 0.0))
    }

    /// Where in the unit square a unit direction is.
    pub fn guide_square(w: Vec3f) -> Vec2f {
        let p = w * (1.0 / (abs(w.x) + abs(w.y) + abs(w.z)));
        let flat = vec2f(p.x, p.y);
        let folded = guide_fold(flat);
        let x = select(folded.x, flat.x, w.z >= 0.0);
        let y = select(folded.y, flat.y, w.z >= 0.0);
        vec2f(clamp(x * 0.5 + 0.5, 0.0, 1.0), clamp(y * 0.5 + 0.5, 0.0, 1.0))
    }

    /// The unit direction at a place of the unit square: the inverse of [`guide_square`].
    pub fn guide_direction(s: Vec2f) -> Vec3f {
        let flat = vec2f(s.x * 2.0 - 1.0, s.y * 2.0 - 1.0);
        let z = 1.0 - abs(flat.x) - abs(flat.y);
        let folded = guide_fold(flat);
        let x = select(folded.x, flat.x, z >= 0.0);
        let y = select(folded.y, flat.y, z >= 0.0);
        let p = vec3f(x, y, z);
        p * (1.0 / sqrt(dot(p, p)))
    }

    /// Density over solid angle of a unit direction whose density over the unit square is 1.
    ///
    /// The octahedron's faces are at the distance 1/√3 from the centre and √3 times as large as their shadows on the square of
    /// side 2, so that an area dA of that one is the solid angle dA/|p|³.
    pub fn guide_jacobian(w: Vec3f) -> f32 {
        let norm = abs(w.x) + abs(w.y) + abs(w.z);
        0.25 / (norm * norm * norm)
    }

    /// The beginning of a sampled way down. `u`: uniform numbers in `[0, 1)`.
    pub fn guide_walk(u: Vec2f) -> GuideWalk {
        GuideWalk { u: u, corner: vec2f(0.0, 0.0), size: 1.0, density: 1.0, child: 0u32 }
    }

    /// A step of a sampled way down. `weights`: probabilities of the node's children, which sum to one.
    pub fn guide_walk_step(walk: GuideWalk, weights: Vec4f) -> GuideWalk {
        let low = weights.x + weights.y;
        let high = weights.z + weights.w;
        let share = low / (low + high);
        let upper = walk.u.y >= share;
        let y = select(walk.u.y / share, (walk.u.y - share) / (1.0 - share), upper);
        let left = select(weights.x, weights.z, upper);
        let right = select(weights.y, weights.w, upper);
        let left_share = left / (left + right);
        let beyond = walk.u.x >= left_share;
        let x = select(walk.u.x / left_share, (walk.u.x - left_share) / (1.0 - left_share), beyond);
        let half = walk.size * 0.5;
        let right_by = select(0.0, half, beyond);
        let up_by = select(0.0, half, upper);
        GuideWalk {
            u: vec2f(min(x, BELOW_ONE), min(y, BELOW_ONE)),
            corner: vec2f(walk.corner.x + right_by, walk.corner.y + up_by),
            size: half,
            density: walk.density * 4.0 * select(left, right, beyond),
            child: select(0u32, 1u32, beyond) + select(0u32, 2u32, upper),
        }
    }

    /// The direction where a sampled way ends.
    pub fn guide_walk_end(walk: GuideWalk) -> GuideSample {
        let s = vec2f(walk.corner.x + walk.u.x * walk.size, walk.corner.y + walk.u.y * walk.size);
        let wi = guide_direction(s);
        GuideSample { wi: wi, pdf: walk.density * guide_jacobian(wi) }
    }

    /// The beginning of the way down to a unit direction.
    pub fn guide_descent(w: Vec3f) -> GuideDescent {
        GuideDescent { place: guide_square(w), density: 1.0, child: 0u32 }
    }

    /// A step of the way down to a direction. `weights`: as for [`guide_walk_step`].
    pub fn guide_descent_step(descent: GuideDescent, weights: Vec4f) -> GuideDescent {
        let twice = vec2f(descent.place.x * 2.0, descent.place.y * 2.0);
        let beyond = twice.x >= 1.0;
        let upper = twice.y >= 1.0;
        let left = select(weights.x, weights.z, upper);
        let right = select(weights.y, weights.w, upper);
        GuideDescent {
            place: vec2f(twice.x - select(0.0, 1.0, beyond), twice.y - select(0.0, 1.0, upper)),
            density: descent.density * 4.0 * select(left, right, beyond),
            child: select(0u32, 1u32, beyond) + select(0u32, 2u32, upper),
        }
    }

    /// The number that is left of one below which the guide was not chosen, in `[0, 1)`. `fraction`: probability of the guide.
    pub fn guide_rest(u: f32, fraction: f32) -> f32 {
        clamp((u - fraction) / (1.0 - fraction), 0.0, BELOW_ONE)
    }

    /// Density of a direction that is sampled by the guide with the probability `fraction`, by the BSDF otherwise.
    pub fn guided_pdf(bsdf_pdf: f32, guide_pdf: f32, fraction: f32) -> f32 {
        mix(bsdf_pdf, guide_pdf, fraction)
    }

    /// What a BSDF says of a direction, where a guide takes part in sampling.
    pub fn guided_value(value: BsdfValue, guide_pdf: f32, fraction: f32) -> BsdfValue {
        BsdfValue { value_cos: value.value_cos, pdf: guided_pdf(value.pdf, guide_pdf, fraction) }
    }

    /// A direction that the BSDF was sampled for, where a guide could have been. `guide_pdf`: with which density.
    pub fn guided_bsdf_sample(s: BsdfSample, guide_pdf: f32, fraction: f32) -> BsdfSample {
        let mut out = s;
        if s.pdf <= 0.0 {
            return out;
        }
        if s.delta {
            // No guide finds it.
            out.weight = s.weight * (1.0 / (1.0 - fraction));
            return out;
        }
        out.pdf = guided_pdf(s.pdf, guide_pdf, fraction);
        out.weight = s.weight * (s.pdf / out.pdf);
        out
    }

    /// A direction that was sampled from a guide.
    ///
    /// - `wo`, `wi`: in the shading frame. `value`: what the BSDF says of them.
    pub fn guided_guide_sample(
        wo: Vec3f,
        wi: Vec3f,
        value: BsdfValue,
        guide_pdf: f32,
        fraction: f32,
    ) -> BsdfSample {
        let pdf = guided_pdf(value.pdf, guide_pdf, fraction);
        if max_component(value.value_cos) <= 0.0 || pdf <= 0.0 {
            return no_sample();
        }
        BsdfSample {
            wi: wi,
            weight: value.value_cos * (1.0 / pdf),
            pdf: pdf,
            delta: false,
            transmitted: wo.z * wi.z < 0.0,
        }
    }

    /// By how much more a path is worth than its throughput tells, for roulette: directions from which much light comes are
    /// sampled more often and count less each, and must not die of it. A path so lives as if the BSDF had sampled it.
    ///
    /// Source: what Vorba and Křivánek, "Adjoint-driven Russian roulette and splitting", 2016, expect of a path, for a guide that
    /// has learned all of it.
    pub fn guided_survival(bsdf_pdf: f32, pdf: f32) -> f32 {
        min(pdf, bsdf_pdf * MOST_GUIDED_SURVIVAL) / max(bsdf_pdf, 1e-20)
    }
}

#[cfg(test)]
mod tests {
    use super::guiding::*;
    use crate::scatter::{BsdfSample, BsdfValue};
    use crate::vector::{dot, length};
    use crate::{Vec2f, Vec3f, vec2f, vec3f, vec4f};

    fn grid(n: u32) -> impl Iterator<Item = Vec2f> {
        let at = move |i: u32| (i as f32 + 0.5) / n as f32;
        (0..n * n).map(move |i| vec2f(at(i % n), at(i / n)))
    }

    #[test]
    fn the_square_is_the_sphere() {
        let n = 256;
        let mut whole = 0.0f64;
        let mut middle = [0.0f64; 3];
        for s in grid(n) {
            let w = guide_direction(s);
            assert!((length(w) - 1.0).abs() < 1e-6);
            let back = guide_square(w);
            assert!((back.x - s.x).abs() < 1e-6 && (back.y - s.y).abs() < 1e-6, "{s:?}: {back:?}");
            // A square is as large a solid angle as its density is low.
            let angle = 1.0 / f64::from(guide_jacobian(w)) / f64::from(n * n);
            whole += angle;
            for (sum, x) in middle.iter_mut().zip(w.to_array()) {
                *sum += angle * f64::from(x);
            }
        }
        assert!((whole - 4.0 * std::f64::consts::PI).abs() < 1e-3, "{whole}");
        assert!(middle.iter().all(|x| x.abs() < 1e-6), "{middle:?}");
    }

    #[test]
    fn walks_have_the_density_that_descents_find() {
        let weights = [vec4f(0.1, 0.2, 0.3, 0.4), vec4f(0.7, 0.0, 0.1, 0.2), vec4f(0.0, 0.0, 1.0, 0.0)];
        for u in grid(64) {
            let walk = weights.iter().fold(guide_walk(u), |walk, w| guide_walk_step(walk, *w));
            let sample = guide_walk_end(walk);
            let mut descent = guide_descent(sample.wi);
            descent = weights.iter().fold(descent, |descent, w| guide_descent_step(descent, *w));
            let pdf = descent.density * guide_jacobian(sample.wi);
            assert!(sample.pdf > 0.0 && (pdf / sample.pdf - 1.0).abs() < 1e-5, "{u:?}: {pdf} {sample:?}");
            assert_eq!(walk.child, 2);
        }
    }

    #[test]
    fn halves_are_divided_by_the_axis_named() {
        let p = vec3f(1.0, 2.0, 3.0);
        for (axis, x) in [(0, 1.0), (1, 2.0), (2, 3.0)] {
            assert_eq!((guide_half(p, axis, x), guide_half(p, axis, x + 0.1)), (1, 0));
        }
    }

    #[test]
    fn mixtures_keep_what_is_expected() {
        // Two directions: the BSDF samples the first with the density 3, a guide both.
        let wo = vec3f(0.0, 0.0, 1.0);
        let value = |pdf: f32| BsdfValue { value_cos: vec3f(0.6, 0.3, 0.0), pdf };
        let weight = value(3.0).value_cos * (1.0 / 3.0);
        let s = BsdfSample { wi: wo, weight, pdf: 3.0, delta: false, transmitted: false };
        let (by_bsdf, by_guide) =
            (guided_bsdf_sample(s, 1.0, 0.25), guided_guide_sample(wo, wo, value(3.0), 1.0, 0.25));
        assert!((by_bsdf.pdf - 2.5).abs() < 1e-6 && (by_guide.pdf - 2.5).abs() < 1e-6);
        let gap: Vec3f = by_bsdf.weight - by_guide.weight;
        assert!(dot(gap, gap) < 1e-12 && (by_guide.weight.x - 0.24).abs() < 1e-6);
        // What only the BSDF finds counts for the times that it is not asked.
        let mirror = guided_bsdf_sample(BsdfSample { delta: true, ..s }, 7.0, 0.25);
        assert!((mirror.weight.x - s.weight.x / 0.75).abs() < 1e-6);
        // Without a guide nothing changes, bit for bit.
        let same = guided_bsdf_sample(s, 9.0, 0.0);
        assert_eq!((same.pdf, same.weight.x, guide_rest(0.3, 0.0)), (s.pdf, s.weight.x, 0.3));
        assert!(
            guided_guide_sample(wo, wo, BsdfValue { value_cos: wo * 0.0, pdf: 1.0 }, 1.0, 0.5).pdf <= 0.0
        );
        assert!((guided_survival(0.5, 2.0) - 4.0).abs() < 1e-6);
        assert!((guided_survival(0.0, 2.0)).abs() < 1e-6);
    }
}
