//! Vectors in double precision, and solid angles of triangles by them: what single precision is compared with.

use optics::Vec3f;
use std::f64::consts::PI;

/// A vector in double precision.
pub type V = [f64; 3];

/// A vector of the optics.
pub fn wide(v: Vec3f) -> V {
    v.to_array().map(f64::from)
}

/// Inner product.
pub fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Outer product.
pub fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The vector of length 1 in the same direction.
pub fn unit(v: V) -> V {
    v.map(|c| c / dot(v, v).sqrt())
}

/// Solid angle of a triangle seen from the origin. Source: Van Oosterom and Strackee 1983.
pub fn solid_angle(t: [V; 3]) -> f64 {
    let [a, b, c] = t.map(unit);
    let angle = 2.0 * dot(a, cross(b, c)).abs().atan2(1.0 + dot(a, b) + dot(b, c) + dot(c, a));
    angle.rem_euclid(4.0 * PI)
}
