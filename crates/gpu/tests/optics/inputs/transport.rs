//! Media, bodies, paths and what is estimated with them.

use super::*;
use optics::constants::NONE;
use optics::estimator::Moments;
use optics::guiding::{self, GuideDescent, GuideWalk, guide_descent_step, guide_walk_step};
use optics::interiors::{Interiors, Surroundings, interiors_enter, interiors_nothing};
use optics::mis::MisHeuristic;
use optics::path::PathState;
use optics::random::PixelSampler;
use optics::vertex::Roulette;
use optics::volume::{GridPlace, Medium};
use optics::{Vec3f, Vec4f, vec3f, vec4f};

/// Mean cosines of phase functions.
pub fn anisotropy(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1e-4, -1e-4, 0.5, 0.9, -0.9]).unwrap_or_else(|| i.between(-0.95, 0.95))
}

/// Coefficients of each channel, m⁻¹.
pub fn coefficients(i: &mut Inputs) -> Vec3f {
    vec3f(size(i), size(i), size(i))
}

pub fn medium(i: &mut Inputs) -> Medium {
    Medium {
        absorption: coefficients(i),
        scattering: coefficients(i),
        emission: radiance(i),
        anisotropy: anisotropy(i),
    }
}

/// A material of a body.
pub fn body(i: &mut Inputs) -> u32 {
    i.below(6) as u32
}

pub fn body_or_none(i: &mut Inputs) -> u32 {
    i.edge(&[NONE]).unwrap_or_else(|| body(i))
}

pub fn priority(i: &mut Inputs) -> i32 {
    i.below(5) as i32 - 2
}

/// None to five bodies that were entered, of which four are remembered.
pub fn interiors(i: &mut Inputs) -> Interiors {
    (0..i.below(6)).fold(interiors_nothing(), |inside, _| interiors_enter(inside, body(i), priority(i)))
}

pub fn surroundings(i: &mut Inputs) -> Surroundings {
    Surroundings { around: interiors(i), passed: interiors(i), forgotten: i.below(2) as u32 }
}

pub fn mis_heuristic(i: &mut Inputs) -> MisHeuristic {
    let one_or_none = |i: &mut Inputs| if flag(i) { 1.0 } else { 0.0 };
    MisHeuristic { lights: one_or_none(i), bsdfs: one_or_none(i), squared: flag(i) }
}

pub fn path(i: &mut Inputs) -> PathState {
    PathState {
        throughput: albedo(i),
        radiance: radiance(i),
        pdf: density(i),
        specular: flag(i),
        eta_scale: i.between(0.5, 2.0),
        depth: 1 + i.below(12) as u32,
    }
}

pub fn depth(i: &mut Inputs) -> u32 {
    1 + i.below(12) as u32
}

/// Between two cells of a grid.
pub fn between_cells(i: &mut Inputs) -> GridPlace {
    GridPlace { cell: 3, next: 4, beyond: share(i) }
}

pub fn roulette(i: &mut Inputs) -> Roulette {
    Roulette { start: depth(i), min_survival: i.between(0.01, 1.0) }
}

pub fn moments(i: &mut Inputs) -> Moments {
    let count = i.edge(&[0.0, 1.0, 2.0]).unwrap_or_else(|| (1.0 + i.uniform() * 100.0).floor());
    if count == 0.0 {
        Moments { count, mean: 0.0, m2: 0.0 }
    } else {
        Moments { count, mean: positive(i), m2: positive(i) }
    }
}

pub fn sampler(i: &mut Inputs) -> PixelSampler {
    PixelSampler { kind: sampler_kind(i), scramble: bits(i), index: i.below(1 << 20) as u32 }
}

/// Probabilities of a node's children, which sum to one; none of them below a twentieth.
pub fn quad_weights(i: &mut Inputs) -> Vec4f {
    let all = [0; 4].map(|_| i.between(0.05, 1.0));
    let sum: f32 = all.iter().sum();
    let [x, y, z, w] = all.map(|weight| weight / sum);
    vec4f(x, y, z, w)
}

/// Probabilities of following a guide.
pub fn fraction(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 0.25, 0.5]).unwrap_or_else(|| i.between(0.0, 0.75))
}

/// Some steps of a way down a tree over directions.
pub fn guide_walk(i: &mut Inputs) -> GuideWalk {
    (0..i.below(4)).fold(guiding::guide_walk(unit2(i)), |walk, _| guide_walk_step(walk, quad_weights(i)))
}

pub fn guide_descent(i: &mut Inputs) -> GuideDescent {
    let begin = guiding::guide_descent(direction(i));
    (0..i.below(4)).fold(begin, |descent, _| guide_descent_step(descent, quad_weights(i)))
}
