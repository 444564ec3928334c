//! Records of media.

use super::{MaterialRecord, ModelTag, NONE, SceneTables};
use crate::{Medium, Scene};
use optics::constants::FAR;

/// A homogeneous medium; see [`Medium`].
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
        }
    }
}

impl SceneTables {
    /// Adds the media of materials that are there, and the fog. What is not finite is left out.
    pub(super) fn add_media(&mut self, scene: &Scene) {
        self.nested = scene.materials.iter().any(|m| m.priority.is_some() && m.refracts_into_body());
        for (material, record) in scene.materials.iter().zip(&mut self.materials) {
            if let Some(medium) = material.medium.as_ref().filter(|m| m.is_valid())
                && record.is_body()
            {
                record.medium = self.media.len() as u32;
                self.media.push(MediumRecord::new(medium, record.absorption));
            }
        }
        if let Some(fog) = scene.fog.as_ref().filter(|f| f.medium.is_valid() && !f.top.is_nan()) {
            self.fog = FogRecord { medium: self.media.len() as u32, top: fog.top.clamp(-FAR, FAR) };
            self.media.push(MediumRecord::new(&fog.medium, [0.0; 3]));
        }
    }

    /// Whether there is anything between surfaces that scatters light or shines.
    pub fn has_media(&self) -> bool {
        !self.media.is_empty()
    }

    /// Whether paths have to know what they are in: there are media, bodies that overlap, or surfaces that are none.
    pub fn needs_volumes(&self) -> bool {
        self.has_media() || self.nested || self.materials.iter().any(MaterialRecord::is_boundary)
    }
}

impl MaterialRecord {
    /// Whether light passes through the surface into a body.
    pub fn is_body(&self) -> bool {
        self.flags & super::MATERIAL_BODY != 0
    }

    /// Whether it is no surface, only the end of a medium.
    pub fn is_boundary(&self) -> bool {
        self.model == ModelTag::Boundary
    }
}
