//! Records of media.

use super::{MaterialRecord, NONE, SceneTables};
use crate::{DensityGrid, Medium, Model, Scene};
use optics::constants::FAR;
use std::collections::HashMap;

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
    fn new(medium: &Medium, absorption: [f32; 3]) -> Self {
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

impl SceneTables {
    /// Adds the media of materials that are there, and the fog. What is not finite is left out.
    pub(super) fn add_media(&mut self, scene: &Scene) {
        self.nested = scene.materials.iter().any(|m| m.priority.is_some() && m.refracts_into_body());
        let mut grids = Vec::new();
        // Finding the albedo takes a while, and copies of a material have the same.
        let mut solved: HashMap<[u32; 8], Medium> = HashMap::new();
        for (material, record) in scene.materials.iter().zip(&mut self.materials) {
            if let Some(subsurface) = material.subsurface.filter(|_| material.model == Model::Dielectric)
                && record.is_body()
            {
                let (color, ior) = (material.base_color.truncate(), material.ior);
                let [r, g, b] = color.to_array();
                let [x, y, z] = subsurface.radius.to_array();
                let key = [r, g, b, x, y, z, subsurface.anisotropy, ior].map(f32::to_bits);
                let medium = solved.entry(key).or_insert_with(|| subsurface.medium(color, ior)).clone();
                if medium.is_valid() {
                    record.medium = self.media.len() as u32;
                    let inside = MediumRecord::new(&medium, record.absorption.to_array());
                    self.media.push(MediumRecord { subsurface: true, ..inside });
                }
                continue;
            }
            if let Some(medium) = material.medium.as_ref().filter(|m| m.is_valid())
                && record.is_body()
            {
                record.medium = self.media.len() as u32;
                self.media.push(MediumRecord::new(medium, record.absorption.to_array()));
                grids.extend(medium.density.as_deref().map(|grid| (record.medium, grid)));
            }
        }
        if let Some(fog) = scene.fog.as_ref().filter(|f| f.medium.is_valid() && !f.top.is_nan()) {
            self.fog = FogRecord { medium: self.media.len() as u32, top: fog.top.clamp(-FAR, FAR) };
            self.media.push(MediumRecord::new(&fog.medium, [0.0; 3]));
            grids.extend(fog.medium.density.as_deref().map(|grid| (self.fog.medium, grid)));
        }
        grids.into_iter().for_each(|(medium, grid)| self.add_grid(medium, grid));
    }

    fn add_grid(&mut self, medium: u32, grid: &DensityGrid) {
        self.media[medium as usize].grid = self.grids.len() as u32;
        let [low, high] = grid.bounds().map(|p| p.to_array());
        let first = self.densities.len() as u32;
        self.grids.push(GridRecord { first, size: grid.size(), low, high, largest: grid.largest() });
        self.densities.extend_from_slice(grid.values());
    }

    /// Whether there is anything between surfaces that scatters light or shines.
    pub fn has_media(&self) -> bool {
        !self.media.is_empty()
    }

    /// Whether there is anything that light gets into: paths and cameras may be inside.
    pub fn has_bodies(&self) -> bool {
        self.materials.iter().any(MaterialRecord::is_body)
    }

    /// Whether there are ends of media that are no surfaces.
    pub fn has_boundaries(&self) -> bool {
        self.materials.iter().any(MaterialRecord::is_boundary)
    }

    /// Whether paths have to know what they are in: there are media, bodies that overlap, or surfaces that are none.
    pub fn needs_volumes(&self) -> bool {
        self.has_media() || self.nested || self.has_boundaries()
    }
}
