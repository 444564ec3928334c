//! From the media of a scene's materials, and its fog, to their records.

use super::SceneTables;
use super::medium::{FogRecord, GridRecord, MediumRecord};
use crate::{DensityGrid, Medium, Model, Scene};
use optics::constants::FAR;
use std::collections::HashMap;

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
}
