//! Functions of path guiding.

use super::*;

/// Directions and places of trees, whose sides are decided by rounded numbers.
const SQUARES: Tolerance = Tolerance {
    absolute: 1e-5,
    relative: 1e-4,
    exceptions: 0.01,
    why: "which side of an edge a number is on is decided by its last bits, and what is left of it is divided by small shares",
};

functions! {
    guiding:
    // transport/guiding.rs
    guiding::guide_half(p: point, axis: axis, split: signed_cosine) within SQUARES;
    guiding::guide_fold(p: point2) within ROUNDING;
    guiding::guide_square(w: direction) within SQUARES;
    guiding::guide_direction(s: share2) within SQUARES;
    guiding::guide_jacobian(w: direction) within ROUNDING;
    guiding::guide_walk(u: unit2) within EXACT;
    guiding::guide_walk_step(walk: guide_walk, weights: quad_weights) within SQUARES;
    guiding::guide_walk_end(walk: guide_walk) within SQUARES;
    guiding::guide_descent(w: direction) within SQUARES;
    guiding::guide_descent_step(descent: guide_descent, weights: quad_weights) within SQUARES;
    guiding::guide_rest(u: unit, fraction: fraction) within SQUARES;
    guiding::guided_pdf(bsdf_pdf: density, guide_pdf: density, fraction: fraction) within ROUNDING;
    guiding::guided_value(value: bsdf_value, guide_pdf: density, fraction: fraction) within ROUNDING;
    guiding::guided_bsdf_sample(s: scattered, guide_pdf: density, fraction: fraction) within ROUNDING;
    guiding::guided_guide_sample(wo: direction, wi: direction, value: bsdf_value, guide_pdf: density, fraction: fraction) within SQUARES;
    guiding::guided_survival(bsdf_pdf: density, pdf: density) within ROUNDING;
}
