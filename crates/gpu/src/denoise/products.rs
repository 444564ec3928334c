//! What multiplies, and numbers of how many bits.

use super::matrices;
use crate::{Gpu, MatrixUnits};
use wgpu::Features;

/// Numbers that layers hand on to each other, and their weights. Sums always have 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    /// 16-bit floats.
    Half,
    /// 32-bit floats.
    Full,
}

impl Numbers {
    /// Bytes of one.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Half => 2,
            Self::Full => 4,
        }
    }
}

/// What multiplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Products {
    /// Every invocation by itself.
    Lanes(Numbers),
    /// The device's matrix units.
    Matrices(MatrixUnits),
}

impl Products {
    /// The fastest that a device can.
    pub fn best(gpu: &Gpu) -> Self {
        matrices::usable(gpu).map_or_else(|| Self::best_lanes(gpu), Self::Matrices)
    }

    /// The fastest without matrix units.
    pub fn best_lanes(gpu: &Gpu) -> Self {
        let has_half = gpu.features.contains(Features::SHADER_F16);
        Self::Lanes(if has_half { Numbers::Half } else { Numbers::Full })
    }

    /// What layers hand on.
    pub fn numbers(self) -> Numbers {
        match self {
            Self::Lanes(numbers) => numbers,
            Self::Matrices(_) => Numbers::Half,
        }
    }
}
