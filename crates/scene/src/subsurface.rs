//! Subsurface scattering by what people see: the colour that comes out of a body, and how far light gets in it.

use crate::Medium;
use glam::Vec3;
use optics::fresnel::fresnel_dielectric;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Light that enters a body, is scattered many times and comes out elsewhere: skin, wax, marble, leaves. The body's colour is
/// that of its material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subsurface {
    /// How far light gets on average before it is scattered, for each channel, metres, positive.
    pub radius: Vec3,
    /// Mean cosine of the angle by which scattered light turns; see [`Medium::anisotropy`].
    pub anisotropy: f32,
}

impl Subsurface {
    /// The shortest radius, metres: shorter ones could not be told from a surface.
    pub const SHORTEST: f32 = 1e-9;

    /// The medium of a body that shows `color` through a surface of index `ior`: of diffuse light that has got in, this share
    /// comes out of a half-space.
    pub fn medium(&self, color: Vec3, ior: f32) -> Medium {
        let ior = ior.max(1.0);
        let g = self.anisotropy;
        // What matters of a phase function deep inside is how far light gets forward: the similarity relation
        // (1 − α) / (1 − g α) = 1 − α', of van de Hulst, "Multiple Light Scattering", 1980, chapter 14.
        let albedo = |c: f32| {
            let isotropic = albedo_behind(ior, c);
            isotropic / (1.0 - g + g * isotropic)
        };
        let albedo = Vec3::new(albedo(color.x), albedo(color.y), albedo(color.z));
        let extinction = self.radius.max(Vec3::splat(Self::SHORTEST)).recip();
        Medium {
            absorption: extinction * (Vec3::ONE - albedo),
            scattering: extinction * albedo,
            anisotropy: g,
            ..Medium::default()
        }
    }
}

/// [`HalfSpace::albedo_that_shows`], which takes milliseconds, for each index and reflectance once: many bodies of a scene
/// are of one colour.
fn albedo_behind(ior: f32, reflectance: f32) -> f32 {
    static KNOWN: Mutex<BTreeMap<[u32; 2], f32>> = Mutex::new(BTreeMap::new());
    const MAX_KNOWN: usize = 1 << 14;
    let key = [ior.to_bits(), reflectance.to_bits()];
    let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(albedo) = known().get(&key) {
        return *albedo;
    }
    let albedo = HalfSpace::behind(ior).albedo_that_shows(reflectance);
    let mut known = known();
    if known.len() >= MAX_KNOWN {
        known.clear();
    }
    known.insert(key, albedo);
    albedo
}

/// Directions in which light inside of a half-space is looked at: midpoints in the cosine.
const DIRECTIONS: usize = 32;

/// A half-space that scatters isotropically, behind a smooth surface, under a uniform sky.
struct HalfSpace {
    cosines: [f32; DIRECTIONS],
    /// Share of light that the surface throws back inwards, by direction.
    internal: [f32; DIRECTIONS],
}

impl HalfSpace {
    fn behind(ior: f32) -> Self {
        let cosines = std::array::from_fn(|i| (i as f32 + 0.5) / DIRECTIONS as f32);
        Self { cosines, internal: cosines.map(|c| fresnel_dielectric(c, 1.0 / ior).reflectance) }
    }

    /// The albedo of single scattering with which `reflectance` of the light that has entered comes out again.
    fn albedo_that_shows(&self, reflectance: f32) -> f32 {
        if reflectance >= 1.0 {
            return 1.0;
        }
        let (mut low, mut high) = (0.0f32, 1.0f32);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            if self.reflectance(middle) < reflectance { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Share of the light that has entered which comes out, for an albedo of single scattering.
    ///
    /// Without a surface, light that comes down from μ' goes up to μ by the kernel α H(μ) H(μ') / (2 (μ + μ')) (Chandrasekhar,
    /// "Radiative Transfer", 1960, section 33). What then meets the surface from inside is thrown back or let out by Fresnel.
    fn reflectance(&self, albedo: f32) -> f32 {
        let (mu, n) = (&self.cosines, DIRECTIONS as f32);
        let h = self.h_function(albedo);
        let up = |down: &[f32; DIRECTIONS]| -> [f32; DIRECTIONS] {
            std::array::from_fn(|i| {
                let sum: f32 = (0..DIRECTIONS).map(|j| h[j] * mu[j] * down[j] / (mu[i] + mu[j])).sum();
                0.5 * albedo * h[i] * sum / n
            })
        };
        // A uniform sky, refracted: all directions that the surface lets through are equally bright.
        let entered: [f32; DIRECTIONS] = self.internal.map(|f| 1.0 - f);
        let flux =
            |radiance: &[f32; DIRECTIONS]| -> f32 { mu.iter().zip(radiance).map(|(m, r)| m * r).sum() };
        let (mut down, mut left) = (entered, 0.0);
        for _ in 0..64 {
            let risen = up(&down);
            left += flux(&std::array::from_fn(|i| (1.0 - self.internal[i]) * risen[i]));
            down = std::array::from_fn(|i| self.internal[i] * risen[i]);
        }
        left / flux(&entered)
    }

    /// Chandrasekhar's H-function for isotropic scattering, by iterating
    /// 1/H(μ) = √(1 − α) + α/2 ∫ μ' H(μ') / (μ + μ') dμ'. Of the old and the new value the mean is taken: alone, the new one
    /// overshoots, and near α = 1 it never settles.
    fn h_function(&self, albedo: f32) -> [f32; DIRECTIONS] {
        let (mu, n) = (&self.cosines, DIRECTIONS as f32);
        let mut h = [1.0; DIRECTIONS];
        for _ in 0..64 {
            h = std::array::from_fn(|i| {
                let sum: f32 = mu.iter().zip(&h).map(|(m, h)| m * h / (mu[i] + m)).sum();
                0.5 * (h[i] + 1.0 / ((1.0 - albedo).max(0.0).sqrt() + 0.5 * albedo * sum / n))
            });
        }
        h
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// α/2 ∫ H dμ = 1 − √(1 − α) (Chandrasekhar 1960, section 38, theorem 1).
    #[test]
    fn the_mean_of_the_h_function_is_known() {
        let space = HalfSpace::behind(1.0);
        for albedo in [0.0f32, 0.1, 0.5, 0.9, 0.999, 1.0] {
            let mean = space.h_function(albedo).iter().sum::<f32>() / DIRECTIONS as f32;
            let (actual, expected) = (0.5 * albedo * mean, 1.0 - (1.0 - albedo).sqrt());
            assert!((actual - expected).abs() < 1e-4, "albedo {albedo}: {actual}, not {expected}");
        }
    }

    /// Without a surface, van de Hulst's formula for diffuse light is known to be right within some thousandths.
    #[test]
    fn half_spaces_reflect_what_is_known_of_them() {
        let space = HalfSpace::behind(1.0);
        for albedo in [0.1f32, 0.3, 0.5, 0.7, 0.9, 0.99, 1.0] {
            let s = (1.0 - albedo).sqrt();
            let expected = (1.0 - 0.139 * s) * (1.0 - s) / (1.0 + 1.17 * s);
            let actual = space.reflectance(albedo);
            assert!((actual - expected).abs() < 4e-3, "albedo {albedo}: {actual}, not {expected}");
        }
    }

    #[test]
    fn the_albedo_is_the_inverse_of_the_reflectance() {
        for ior in [1.0, 1.33, 1.5, 2.4] {
            let space = HalfSpace::behind(ior);
            for color in [0.0f32, 0.02, 0.2, 0.5, 0.8, 0.97, 1.0] {
                let albedo = space.albedo_that_shows(color);
                let back = space.reflectance(albedo);
                assert!((back - color).abs() < 1e-3, "index {ior}: {color} became {back} by albedo {albedo}");
            }
        }
    }

    #[test]
    fn white_bodies_absorb_nothing_and_black_ones_scatter_nothing() {
        let wax = Subsurface { radius: Vec3::new(0.1, 0.01, 0.0), anisotropy: 0.3 };
        let medium = wax.medium(Vec3::new(1.0, 0.0, 0.5), 1.4);
        assert_eq!(medium.absorption.x, 0.0);
        assert!(medium.scattering.y < 1e-2 * medium.absorption.y, "{medium:?}");
        assert!(medium.is_valid());
    }
}
