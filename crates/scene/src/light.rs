//! Punctual and directional lights.

use crate::Photometry;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A light without a surface of its own. Emissive meshes and spheres are lights through their material instead.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Light {
    /// Name from the file.
    pub name: String,
    /// Geometry and strength.
    pub kind: LightKind,
    /// How the intensity of a point or spot depends on direction, beside what the kind says; the kind's intensity is that where the
    /// profile is greatest.
    pub profile: Option<Photometry>,
}

impl Light {
    /// A light without a profile.
    pub fn new(name: impl Into<String>, kind: LightKind) -> Self {
        Self { name: name.into(), kind, profile: None }
    }
}

/// Where a light's energy comes from and where it goes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// A point that shines equally in all directions.
    Point {
        /// World position, metres.
        position: Vec3,
        /// Radiant intensity, linear RGB, W/sr (candela in glTF).
        intensity: Vec3,
    },
    /// A point that shines into a cone.
    Spot {
        /// World position, metres.
        position: Vec3,
        /// Unit direction in which it shines.
        direction: Vec3,
        /// Radiant intensity on the axis, linear RGB, W/sr.
        intensity: Vec3,
        /// Angle from the axis up to which the intensity is constant, radians, less than `outer_angle`.
        inner_angle: f32,
        /// Angle from the axis at which the intensity reaches zero, radians, at most π/2.
        outer_angle: f32,
    },
    /// Infinitely far away.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, linear RGB, W/m² (lux in glTF).
        irradiance: Vec3,
        /// Full angle under which the source is seen, radians; 0 gives hard shadows.
        angular_diameter: f32,
    },
}
