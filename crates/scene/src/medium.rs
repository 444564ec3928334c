//! Media that light is absorbed and scattered in, and that may shine: smoke, milk, fog, flames.

use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A participating medium. Coefficients are m⁻¹, linear RGB, ≥ 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// How dense it is where: all coefficients are multiplied with it. `None` is 1 everywhere.
    #[serde(with = "shared_grid")]
    pub density: Option<Arc<DensityGrid>>,
}

/// Densities on a regular grid, at the centres of its cells; between them they are interpolated linearly, and outside of its
/// bounds they are 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "WrittenGrid", into = "WrittenGrid")]
pub struct DensityGrid {
    size: [u32; 3],
    bounds: [Vec3; 2],
    values: Vec<f32>,
    largest: f32,
}

/// A grid as it is written down.
#[derive(Serialize, Deserialize)]
struct WrittenGrid {
    size: [u32; 3],
    bounds: [Vec3; 2],
    values: Vec<f32>,
}

impl From<DensityGrid> for WrittenGrid {
    fn from(grid: DensityGrid) -> Self {
        Self { size: grid.size, bounds: grid.bounds, values: grid.values }
    }
}

impl TryFrom<WrittenGrid> for DensityGrid {
    type Error = String;

    fn try_from(w: WrittenGrid) -> Result<Self, String> {
        Self::new(w.size, w.bounds, w.values).ok_or_else(|| "a grid of densities is impossible".into())
    }
}

/// Writes a shared grid down like one that is not shared.
mod shared_grid {
    use super::{Arc, DensityGrid, Deserialize, Serialize};

    pub fn serialize<S: serde::Serializer>(
        grid: &Option<Arc<DensityGrid>>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        grid.as_deref().serialize(to)
    }

    pub fn deserialize<'de, D: serde::Deserializer<'de>>(
        from: D,
    ) -> Result<Option<Arc<DensityGrid>>, D::Error> {
        Ok(Option::<DensityGrid>::deserialize(from)?.map(Arc::new))
    }
}

impl DensityGrid {
    /// A grid of `size` cells along x, y and z; x varies fastest in `values`. `None` if there are no cells, not as many values, a
    /// value that is negative or not finite, or nothing between the lower and the upper bounds (world space, metres).
    pub fn new(size: [u32; 3], bounds: [Vec3; 2], values: Vec<f32>) -> Option<Self> {
        let cells = size.iter().try_fold(1usize, |n, &c| n.checked_mul(c as usize))?;
        let [low, high] = bounds;
        let is_box = low.is_finite() && high.is_finite() && (high - low).min_element() > 0.0;
        let largest = values.iter().copied().fold(0.0, f32::max);
        let are_densities = values.iter().all(|v| v.is_finite() && *v >= 0.0);
        (cells > 0 && cells == values.len() && is_box && are_densities).then_some(Self {
            size,
            bounds,
            values,
            largest,
        })
    }

    /// The same densities between other bounds; `None` if there is nothing between them.
    pub fn placed(&self, bounds: [Vec3; 2]) -> Option<Self> {
        Self::new(self.size, bounds, self.values.clone())
    }

    /// Cells along x, y and z.
    pub fn size(&self) -> [u32; 3] {
        self.size
    }

    /// Lower and upper corner, world space, metres.
    pub fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// The densities, x fastest.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The largest density.
    pub fn largest(&self) -> f32 {
        self.largest
    }
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fog {
    /// What it consists of.
    pub medium: Medium,
    /// There is fog below this height only, metres; infinite: everywhere. Fog that is everywhere lets nothing through from
    /// infinitely far away.
    pub top: f32,
}

impl Fog {
    /// The most radiance that fog may have along an endless ray, W·sr⁻¹·m⁻²: as much as a surface may emit.
    const BRIGHTEST: f32 = 1.0e9;

    /// Whether it shines in a colour that it hardly absorbs or scatters: emission over extinction, the radiance of an
    /// endless way through it, is more than can be computed with. Along a horizontal ray, fog with a top is as endless
    /// as fog without.
    pub fn is_endlessly_bright(&self) -> bool {
        let extinction = self.medium.absorption + self.medium.scattering;
        (0..3).any(|i| self.medium.emission[i] > Self::BRIGHTEST * extinction[i])
    }
}
