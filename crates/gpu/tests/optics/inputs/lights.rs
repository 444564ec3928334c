//! Lights, what is known of groups of them, and how one is chosen.

use super::*;
use optics::equirect::EquirectPlace;
use optics::light::{LIGHT_PROJECTOR, LIGHT_RECTANGLE, Light, LightSample};
use optics::light_profile::ProfileCell;
use optics::light_tree::{
    ALL_SIDES, ChildChoice, INFINITELY_FAR, LightGroup, NodeImportance, octahedral_encode,
};
use optics::reservoir::Reservoir;
use optics::spherical_rectangle::{SphericalRectangle, spherical_rectangle_new};
use optics::spherical_triangle::{SphericalTriangle, spherical_triangle_new};
use optics::vector::cross;
use optics::{Vec2u, Vec3f, vec2f, vec3f};

/// A place in an image of any size.
pub fn equirect_place(i: &mut Inputs) -> EquirectPlace {
    optics::equirect::equirect_place(vec2f(i.uniform(), i.uniform()), count(i), count(i))
}

/// Column and row.
pub fn pixel(i: &mut Inputs) -> Vec2u {
    Vec2u { x: i.below(100) as u32, y: i.below(100) as u32 }
}

/// A sample of a light that shines.
pub fn light_sample(i: &mut Inputs) -> LightSample {
    LightSample {
        wi: direction(i),
        distance: size(i),
        radiance: radiance(i),
        pdf: i.between(0.1, 10.0),
        delta: flag(i),
        barycentrics: vec2f(i.uniform(), i.uniform()),
    }
}

pub fn light(i: &mut Inputs) -> Light {
    let (kind, position, edge1, edge2) = (i.below(8) as u32, far_point(i), point(i), point(i));
    Light {
        kind,
        position,
        edge1,
        edge2: if kind == LIGHT_RECTANGLE { cross(edge1, edge2) } else { edge2 },
        emission: radiance(i),
        size: i.between(0.01, 0.5),
        two_sided: flag(i),
    }
}

/// Edges at right angles, the longer one first.
fn edges_of_rectangle(i: &mut Inputs) -> [Vec3f; 2] {
    let (there, a, b) = (frame(i), size(i), size(i));
    [there.tangent * a.max(b), there.bitangent * a.min(b)]
}

/// A light that is a rectangle.
pub fn rectangle(i: &mut Inputs) -> Light {
    let [edge1, edge2] = edges_of_rectangle(i);
    Light { kind: LIGHT_RECTANGLE, edge1, edge2, ..light(i) }
}

/// A light that throws a picture.
pub fn projector(i: &mut Inputs) -> Light {
    let [edge1, edge2] = edges_of_rectangle(i);
    Light { kind: LIGHT_PROJECTOR, edge1, edge2, ..light(i) }
}

/// A triangle that can be sampled by solid angle.
pub fn spherical_triangle(i: &mut Inputs) -> SphericalTriangle {
    loop {
        let seen = spherical_triangle_new(point(i) - point(i), point(i), point(i));
        if seen.solid_angle > 0.0 {
            return seen;
        }
    }
}

/// A rectangle that can be sampled by solid angle.
pub fn spherical_rectangle(i: &mut Inputs) -> SphericalRectangle {
    loop {
        let [edge1, edge2] = edges_of_rectangle(i);
        let seen = spherical_rectangle_new(point(i) - point(i), edge1, edge2);
        if seen.solid_angle > 0.0 {
            return seen;
        }
    }
}

/// Rows of a table of directions.
pub fn rows(i: &mut Inputs) -> u32 {
    2 + i.below(180) as u32
}

/// Columns of a table of directions.
pub fn columns(i: &mut Inputs) -> u32 {
    1 + i.below(72) as u32
}

pub fn profile_cell(i: &mut Inputs) -> ProfileCell {
    let [first, second, third, fourth] = [0; 4].map(|_: u32| i.below(100) as u32);
    ProfileCell { first, second, third, fourth, down: unit(i), across: unit(i) }
}

/// Coefficients of a falloff with distance.
pub fn falloff(i: &mut Inputs) -> Vec3f {
    let physics = vec3f(0.0, 0.0, 1.0);
    let edges = [physics, vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(1.0, 0.09, 0.032)];
    i.edge(&edges).unwrap_or_else(|| vec3f(size(i), size(i), size(i)))
}

/// Candidates, of which there may be none so far.
pub fn reservoir(i: &mut Inputs) -> Reservoir {
    let (chosen, weight, remainder) = (i.below(32) as u32, positive(i), unit(i));
    Reservoir { chosen, weight, sum: weight + positive(i), remainder }
}

pub fn light_group(i: &mut Inputs) -> LightGroup {
    let (center, radius, cos_spread) = (point(i), share(i), signed_cosine(i));
    LightGroup {
        center,
        radius,
        intensity: positive(i),
        axis: direction(i),
        cos_spread,
        sin_spread: (1.0 - cos_spread * cos_spread).max(0.0).sqrt(),
        cos_emission: signed_cosine(i),
        back: [-1.0, 1.0, INFINITELY_FAR][i.below(3) as usize],
    }
}

/// What some children promise together, or none.
pub fn node_importance(i: &mut Inputs) -> NodeImportance {
    let count = i.below(9) as f32;
    NodeImportance { sum: if count > 0.0 { positive(i) } else { 0.0 }, count }
}

pub fn child_choice(i: &mut Inputs) -> ChildChoice {
    let (child, weight, before) = (i.below(8) as u32, positive(i), share(i));
    ChildChoice { child, weight, before, end: before + weight }
}

/// A unit vector, or zero.
pub fn receiver(i: &mut Inputs) -> Vec3f {
    if flag(i) { direction(i) } else { vec3f(0.0, 0.0, 0.0) }
}

/// What a unit vector is encoded as, or nothing.
pub fn octahedral(i: &mut Inputs) -> u32 {
    if flag(i) { octahedral_encode(direction(i)) } else { ALL_SIDES }
}

/// A light infinitely far away: its position is a unit direction, its size 1 − cosine of its half
/// angle.
pub fn sun(i: &mut Inputs) -> Light {
    let size = i.edge(&[0.0, 1.0]).unwrap_or_else(|| 10.0_f32.powf(i.between(-5.0, 0.0)));
    Light { position: direction(i), size, ..light(i) }
}
