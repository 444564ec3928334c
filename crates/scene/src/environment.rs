//! Light from infinitely far away.

use crate::{Daylight, ImageId};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// What a ray sees that leaves the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Environment {
    /// Nothing.
    #[default]
    Black,
    /// The same radiance everywhere, linear RGB.
    Constant(Vec3),
    /// An equirectangular image. Its centre column is seen towards −Z and the upper row towards +Y when `rotation` is 0.
    Image {
        /// Index into [`crate::Scene::images`].
        image: ImageId,
        /// Turns the environment about +Y, counter-clockwise seen from above, radians.
        rotation: f32,
        /// Multiplied into the image.
        intensity: f32,
    },
    /// A two-colour gradient with an optional sun.
    Sky(Sky),
    /// The clear sky of a moment and a place, with its sun.
    Daylight(Daylight),
}

impl Environment {
    /// The sun's disc, if there is one.
    pub fn sun(&self) -> Option<Sun> {
        match self {
            Self::Black | Self::Constant(_) | Self::Image { .. } => None,
            Self::Sky(sky) => sky.sun,
            Self::Daylight(daylight) => Some(daylight.sun()),
        }
    }
}

/// A gradient between horizon and zenith, with a ground colour below and an optional sun disc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sky {
    /// Radiance at the horizon, linear RGB.
    pub horizon: Vec3,
    /// Radiance at the zenith, linear RGB.
    pub zenith: Vec3,
    /// Radiance below the horizon, linear RGB. Equal to `horizon` for a seamless floor.
    pub ground: Vec3,
    /// The sun.
    pub sun: Option<Sun>,
}

/// A sun disc: visible, and sampled as a light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sun {
    /// Unit direction towards the sun.
    pub direction: Vec3,
    /// Irradiance on a surface that faces the sun, linear RGB, W/m².
    pub irradiance: Vec3,
    /// Angular radius of the disc, radians, positive.
    pub angular_radius: f32,
}
