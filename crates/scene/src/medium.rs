//! Media that light is absorbed and scattered in, and that may shine: smoke, milk, fog, flames.

use glam::Vec3;

/// A participating medium. Coefficients are m⁻¹, linear RGB, ≥ 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Medium {
    /// Absorption coefficient.
    pub absorption: Vec3,
    /// Scattering coefficient.
    pub scattering: Vec3,
    /// Radiance that a metre of the medium emits, W·sr⁻¹·m⁻³.
    pub emission: Vec3,
    /// Mean cosine of the angle by which scattered light turns, in `(−1, 1)`: 0 is isotropic, positive forwards. The phase
    /// function is that of Henyey and Greenstein.
    pub anisotropy: f32,
}

impl Medium {
    /// The largest anisotropy, either way: nearer to ±1 the phase function is no function in single precision.
    pub const MOST_ANISOTROPIC: f32 = 0.99;

    /// Whether all numbers are such that light can be followed.
    pub fn is_valid(&self) -> bool {
        let coefficients = [self.absorption, self.scattering, self.emission];
        coefficients.iter().all(|c| c.is_finite() && c.min_element() >= 0.0)
            && self.anisotropy.abs() <= Self::MOST_ANISOTROPIC
    }
}

/// A medium that fills the whole scene outside of bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Fog {
    /// What it consists of.
    pub medium: Medium,
    /// There is fog below this height only, metres; infinite: everywhere. Fog that is everywhere lets nothing through from
    /// infinitely far away.
    pub top: f32,
}
