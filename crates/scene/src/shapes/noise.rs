//! Seeded noise for generated shapes: pure functions of position and seed, the same on every machine.

use elementary::{cos, sin};
use glam::{Vec2, Vec3};

/// A well-mixed 32-bit hash (the finaliser of Prospector's `lowbias32`).
pub(crate) fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The `index`-th uniform number in `[0, 1)` of the stream `seed`.
pub(crate) fn uniform(seed: u32, index: u32) -> f32 {
    (hash(index ^ hash(seed)) >> 8) as f32 / (1u32 << 24) as f32
}

/// A uniformly distributed unit vector.
pub(crate) fn unit_vector(seed: u32, index: u32) -> Vec3 {
    let z = 2.0 * uniform(seed, 2 * index) - 1.0;
    let phi = std::f32::consts::TAU * uniform(seed, 2 * index + 1);
    let ring = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(ring * cos(phi), ring * sin(phi), z)
}

/// Gradient noise of period 2³² with a feature size of 1, about in `[−1, 1]`.
pub(crate) fn gradient_noise(p: Vec2, seed: u32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let corner = |dx: i32, dy: i32| {
        let (x, y) = ((cell.x as i32).wrapping_add(dx), (cell.y as i32).wrapping_add(dy));
        let angle = std::f32::consts::TAU * uniform(seed ^ hash(x as u32), y as u32);
        Vec2::new(cos(angle), sin(angle)).dot(f - Vec2::new(dx as f32, dy as f32))
    };
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let low = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * fade.x;
    let high = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * fade.x;
    (low + (high - low) * fade.y) * std::f32::consts::SQRT_2
}
