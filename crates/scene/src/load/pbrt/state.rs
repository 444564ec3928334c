//! What attribute blocks save and restore.

use glam::{DAffine3, Vec3};

/// The state that shapes, lights and materials take their surroundings from.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    /// From where things are defined to pbrt's world, or to the object that is being defined.
    pub transform: DAffine3,
    /// Normals point to the other side.
    pub reversed: bool,
    /// Index into the scene's materials; `None` is the default one.
    pub material: Option<u32>,
    /// Shapes shine.
    pub area_light: Option<AreaLight>,
}

/// What makes shapes shine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AreaLight {
    /// Radiance, linear.
    pub emission: Vec3,
    pub two_sided: bool,
}
