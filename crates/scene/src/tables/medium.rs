//! Records of media.

use crate::Medium;
use optics::constants::{FAR, NONE};

/// A medium; see [`Medium`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MediumRecord {
    /// Absorption coefficient, m⁻¹.
    pub absorption: [f32; 3],
    /// Scattering coefficient, m⁻¹.
    pub scattering: [f32; 3],
    /// Radiance that a metre emits.
    pub emission: [f32; 3],
    /// Mean cosine of the phase function.
    pub anisotropy: f32,
    /// Whether it is the inside of something that looks like a surface: paths through it count as one vertex, however often
    /// they scatter.
    pub subsurface: bool,
    /// Index into `grids` of its density, or [`NONE`]: 1 everywhere.
    pub grid: u32,
}

/// Where densities are. Cells are ordered with x fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridRecord {
    /// Index of the first value in `densities`.
    pub first: u32,
    /// Cells along x, y and z.
    pub size: [u32; 3],
    /// Lower corner, world space.
    pub low: [f32; 3],
    /// Upper corner, world space.
    pub high: [f32; 3],
    /// The largest density.
    pub largest: f32,
}

/// What fills the space between bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FogRecord {
    /// Index into `media`, or [`NONE`].
    pub medium: u32,
    /// There is fog below this height only; at most ±[`FAR`].
    pub top: f32,
}

impl Default for FogRecord {
    fn default() -> Self {
        Self { medium: NONE, top: FAR }
    }
}

impl MediumRecord {
    /// The record of a medium in a body that absorbs besides.
    pub(super) fn new(medium: &Medium, absorption: [f32; 3]) -> Self {
        Self {
            absorption: (medium.absorption + glam::Vec3::from(absorption)).to_array(),
            scattering: medium.scattering.to_array(),
            emission: medium.emission.to_array(),
            anisotropy: medium.anisotropy,
            subsurface: false,
            grid: NONE,
        }
    }
}
