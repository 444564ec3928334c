//! Multiple importance sampling: how light counts that is found in two ways, by sampling lights and by following a
//! direction that the BSDF was sampled for.
//!
//! Source: Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, section 9.2.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod mis {
    use wgsl_rs::std::*;

    /// How samples of lights and samples of BSDFs are weighted against each other.
    #[derive(Clone, Copy, Debug)]
    pub struct MisHeuristic {
        /// 1, or 0 where samples of lights are not to count.
        pub lights: f32,
        /// 1, or 0 where samples of BSDFs are not to count.
        pub bsdfs: f32,
        /// Whether ratios of densities are squared, which is the power heuristic; if not, the balance heuristic.
        pub squared: bool,
    }

    /// The weight of a strategy whose density is `pdf_a` against one whose density is `pdf_b`, both in the same measure,
    /// one sample each. Zero if `pdf_a` is.
    ///
    /// Written as a ratio so that squares of large densities do not overflow.
    pub fn mis_weight(pdf_a: f32, pdf_b: f32, squared: bool) -> f32 {
        let ratio = pdf_b / pdf_a;
        let weight = 1.0 / (1.0 + ratio * select(1.0, ratio, squared));
        select(0.0, weight, pdf_a > 0.0)
    }

    /// What a light sample counts. `light_pdf`: its density over solid angle; `bsdf_pdf`: that with which the BSDF would
    /// have been sampled for its direction.
    pub fn light_sample_weight(h: MisHeuristic, light_pdf: f32, bsdf_pdf: f32) -> f32 {
        mis_weight(light_pdf * h.lights, bsdf_pdf * h.bsdfs, h.squared)
    }

    /// What light counts that a sampled direction meets. `bsdf_pdf`: the density over solid angle of the direction;
    /// `light_pdf`: that with which the light would have been sampled there.
    pub fn bsdf_sample_weight(h: MisHeuristic, bsdf_pdf: f32, light_pdf: f32) -> f32 {
        mis_weight(bsdf_pdf * h.bsdfs, light_pdf * h.lights, h.squared)
    }
}

#[cfg(test)]
mod tests {
    use super::mis::*;

    const DENSITIES: [(f32, f32); 4] = [(1.0, 2.0), (1e30, 1e30), (1e-30, 1e30), (3.0, 0.0)];

    #[test]
    fn weights_sum_to_one_even_for_huge_densities() {
        let all = [(1.0, 1.0, true), (1.0, 1.0, false), (1.0, 0.0, true), (0.0, 1.0, true)];
        for (lights, bsdfs, squared) in all {
            let h = MisHeuristic { lights, bsdfs, squared };
            for (light, bsdf) in DENSITIES {
                let sum = light_sample_weight(h, light, bsdf) + bsdf_sample_weight(h, bsdf, light);
                // Where the only strategy that counts cannot find the light, nobody finds it.
                let expected = if light * lights + bsdf * bsdfs > 0.0 { 1.0 } else { 0.0 };
                assert!((sum - expected).abs() < 1e-6, "{h:?}: weights of {light} and {bsdf} sum to {sum}");
            }
        }
        assert_eq!(mis_weight(0.0, 0.0, true), 0.0);
    }

    #[test]
    fn heuristics_are_those_of_veach() {
        let (a, b) = (3.0, 2.0);
        assert!((mis_weight(a, b, true) - a * a / (a * a + b * b)).abs() < 1e-6);
        assert!((mis_weight(a, b, false) - a / (a + b)).abs() < 1e-6);
    }
}
