//! Numbers that several modules share.

use wgsl_rs::wgsl;

#[wgsl]
#[allow(clippy::excessive_precision)]
pub mod constants {
    /// π.
    pub const PI: f32 = 3.14159265358979;
    /// 2π, a whole turn.
    pub const TAU: f32 = 6.28318530717959;
    /// 1 / π: a Lambertian surface of albedo 1 reflects this share of irradiance as radiance.
    pub const INV_PI: f32 = 0.318309886183791;
    /// π / 2.
    pub const HALF_PI: f32 = 1.5707963267949;
    /// π / 4.
    pub const QUARTER_PI: f32 = 0.785398163397448;
    /// 2⁻³²: maps a `u32` to `[0, 1]`.
    pub const TWO_POW_MINUS_32: f32 = 2.3283064365387e-10;
    /// The largest `f32` below 1.
    pub const ONE_MINUS_EPSILON: f32 = 0.99999994;
    /// Stands for infinity: WGSL has no infinite literals, and squares of it must not overflow.
    pub const FAR: f32 = 1.0e18;
    /// "No index" in tables of `u32`.
    pub const NONE: u32 = 0xffffffffu32;
}
