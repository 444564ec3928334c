//! Models that are placed several times.

use crate::{Animation, Groups, Instance, Light};
use glam::{DAffine3, Vec3};
use std::sync::Arc;

/// A file that is part of the scene already: what to place again, and where it was.
pub(super) struct Template {
    pub instances: Vec<Instance>,
    /// Instances are counted from the template's first.
    pub groups: Arc<Groups>,
    pub lights: Vec<Light>,
    /// Instances and lights are counted from the template's first.
    pub animations: Vec<Animation>,
    pub bounds: Option<(Vec3, Vec3)>,
    /// From what all this is relative to to the file's world.
    pub to_world: DAffine3,
}
