//! Random inputs with edge cases: what a function's arguments are drawn from. `list.rs` names these functions.

mod geometry;
mod lights;
mod materials;
mod motion;
mod realtime;
mod textures;
mod transport;

pub use geometry::*;
pub use lights::*;
pub use materials::*;
pub use motion::*;
pub use realtime::*;
pub use textures::*;
pub use transport::*;

use optics::ggx::MIN_ALPHA;
use optics::{Vec2f, Vec3f, vec2f, vec3f};
use testkit::Random;

/// One in so many numbers is an edge case.
const EDGE_SHARE: u64 = 4;

/// Where inputs come from: the same ones in every run.
pub struct Inputs(Random);

impl Inputs {
    /// Inputs for the function called `name`.
    pub fn new(name: &str) -> Self {
        let seed = name
            .bytes()
            .fold(1469598103934665603, |h: u64, b| (h ^ u64::from(b)).wrapping_mul(1099511628211));
        Self(Random::new(seed))
    }

    fn uniform(&mut self) -> f32 {
        self.0.uniform_f32()
    }

    fn below(&mut self, n: u64) -> u64 {
        self.0.bits() % n
    }

    fn edge<T: Copy>(&mut self, edges: &[T]) -> Option<T> {
        let is_edge = self.below(EDGE_SHARE) == 0;
        is_edge.then(|| edges[self.below(edges.len() as u64) as usize])
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.uniform()
    }
}

/// A uniform random number in `[0, 1)`.
pub fn unit(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 0.25, 0.5, 0.75, 1e-10, 0.999_999_94]).unwrap_or_else(|| i.uniform())
}

pub fn unit2(i: &mut Inputs) -> Vec2f {
    vec2f(unit(i), unit(i))
}

/// In `[0, 1]`.
pub fn share(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1.0, 0.5, 1e-6]).unwrap_or_else(|| i.uniform())
}

pub fn share2(i: &mut Inputs) -> Vec2f {
    vec2f(share(i), share(i))
}

/// Any sign and magnitude that a picture has.
pub fn real(i: &mut Inputs) -> f32 {
    let sign = if i.below(2) == 0 { 1.0 } else { -1.0 };
    i.edge(&[0.0, -0.0, 1.0, -1.0, 0.5, 1e4]).unwrap_or_else(|| sign * 10.0_f32.powf(i.between(-5.0, 4.0)))
}

/// As [`real`], and what is no number.
pub fn anything(i: &mut Inputs) -> f32 {
    i.edge(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE])
        .unwrap_or_else(|| real(i))
}

pub fn anything3(i: &mut Inputs) -> Vec3f {
    vec3f(anything(i), anything(i), anything(i))
}

pub fn positive(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1.0, 1e-5, 1e4]).unwrap_or_else(|| 10.0_f32.powf(i.between(-5.0, 4.0)))
}

/// Below zero.
pub fn negative(i: &mut Inputs) -> f32 {
    -size(i)
}

/// Distances and sizes, not zero.
pub fn size(i: &mut Inputs) -> f32 {
    i.edge(&[1.0, 1e-2, 1e2]).unwrap_or_else(|| 10.0_f32.powf(i.between(-2.0, 2.0)))
}

/// A number of turns.
pub fn turns(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 0.25, 0.5, 0.75, 1.0, -0.5]).unwrap_or_else(|| i.between(-2.0, 2.0))
}

/// A cosine of an angle to a surface's normal, in `[0, 1]`.
pub fn cosine(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1.0, 1e-4, 0.5]).unwrap_or_else(|| i.uniform())
}

/// A cosine in `[−1, 1]`.
pub fn signed_cosine(i: &mut Inputs) -> f32 {
    i.edge(&[0.0, 1.0, -1.0, 1e-4, -1e-4]).unwrap_or_else(|| i.between(-1.0, 1.0))
}

/// 1 − cosine of a cone's half angle.
pub fn one_minus_cos(i: &mut Inputs) -> f32 {
    i.edge(&[1.0, 2.0, 1e-5]).unwrap_or_else(|| 10.0_f32.powf(i.between(-5.0, 0.3)))
}

/// A GGX width.
pub fn alpha(i: &mut Inputs) -> f32 {
    i.edge(&[MIN_ALPHA, 1.0, 0.5, 0.01]).unwrap_or_else(|| i.between(MIN_ALPHA, 1.0))
}

/// Index of refraction of one side relative to the other.
pub fn eta(i: &mut Inputs) -> f32 {
    i.edge(&[1.5, 1.0 / 1.5, 1.01, 2.4]).unwrap_or_else(|| i.between(0.4, 2.5))
}

/// An index of refraction that a material has.
pub fn ior(i: &mut Inputs) -> f32 {
    i.edge(&[1.0, 1.5, 2.4]).unwrap_or_else(|| i.between(1.0, 2.5))
}

pub fn bits(i: &mut Inputs) -> u32 {
    i.edge(&[0, 1, u32::MAX, 0x8000_0000]).unwrap_or_else(|| i.0.bits() as u32)
}

/// A number of entries.
pub fn count(i: &mut Inputs) -> u32 {
    i.edge(&[1, 2, 4096]).unwrap_or_else(|| 1 + i.below(1000) as u32)
}

/// An index that is small.
pub fn index(i: &mut Inputs) -> u32 {
    i.below(64) as u32
}

pub fn axis(i: &mut Inputs) -> u32 {
    i.below(3) as u32
}

pub fn sampler_kind(i: &mut Inputs) -> u32 {
    i.below(3) as u32
}

pub fn tone_mapper(i: &mut Inputs) -> u32 {
    i.below(6) as u32
}

pub fn flag(i: &mut Inputs) -> bool {
    i.below(2) == 0
}

/// A unit vector.
pub fn direction(i: &mut Inputs) -> Vec3f {
    let axes = [
        vec3f(0.0, 0.0, 1.0),
        vec3f(0.0, 0.0, -1.0),
        vec3f(1.0, 0.0, 0.0),
        vec3f(0.0, 1.0, 0.0),
        vec3f(0.0, -1.0, 0.0),
        vec3f(0.6, 0.0, 0.8),
    ];
    i.edge(&axes).unwrap_or_else(|| optics::warp::sample_sphere(vec2f(i.uniform(), i.uniform())))
}

/// A unit vector that has an azimuth around the y axis: at the poles any number will do for it.
pub fn off_pole(i: &mut Inputs) -> Vec3f {
    let d = direction(i);
    if d.y.abs() > 0.9999 { vec3f(0.6, 0.8, 0.0) } else { d }
}

/// A unit vector above the surface of its frame.
pub fn upper(i: &mut Inputs) -> Vec3f {
    let d = direction(i);
    if d.z.abs() < 1e-3 { vec3f(0.0, 0.0, 1.0) } else { vec3f(d.x, d.y, d.z.abs()) }
}

/// 1 or −1: which side of a surface is seen.
pub fn side(i: &mut Inputs) -> f32 {
    if i.below(2) == 0 { 1.0 } else { -1.0 }
}

/// Barycentric weights of a point of a triangle.
pub fn weights(i: &mut Inputs) -> Vec3f {
    let (u, v) = (share(i), share(i));
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    vec3f(1.0 - u - v, u, v)
}

/// A point near the origin.
pub fn point(i: &mut Inputs) -> Vec3f {
    i.edge(&[vec3f(0.0, 0.0, 0.0), vec3f(1.0, 0.0, 0.0), vec3f(-0.5, 0.5, 0.5)])
        .unwrap_or_else(|| vec3f(i.between(-1.0, 1.0), i.between(-1.0, 1.0), i.between(-1.0, 1.0)))
}

/// A point far from the others.
pub fn far_point(i: &mut Inputs) -> Vec3f {
    point(i) + vec3f(3.0, 1.0, -2.0)
}

/// A point on a plane.
pub fn point2(i: &mut Inputs) -> Vec2f {
    vec2f(i.between(-4.0, 4.0), i.between(-4.0, 4.0))
}

/// A reflectance.
pub fn albedo(i: &mut Inputs) -> Vec3f {
    vec3f(share(i), share(i), share(i))
}

/// Radiance.
pub fn radiance(i: &mut Inputs) -> Vec3f {
    vec3f(positive(i), positive(i), positive(i))
}

/// Radiance and what rounding makes of it.
pub fn signed_color(i: &mut Inputs) -> Vec3f {
    vec3f(real(i), real(i), real(i))
}

/// A texel of a normal map, in `[0, 1]`.
pub fn texel(i: &mut Inputs) -> Vec3f {
    i.edge(&[vec3f(0.5, 0.5, 1.0), vec3f(0.0, 0.0, 0.5)])
        .unwrap_or_else(|| vec3f(i.uniform(), i.uniform(), i.uniform()))
}

/// A density over solid angle.
pub fn density(i: &mut Inputs) -> f32 {
    positive(i)
}

pub fn exposure(i: &mut Inputs) -> f32 {
    i.edge(&[1.0, 0.0]).unwrap_or_else(|| i.between(0.1, 4.0))
}
