//! How cameras map directions to pictures: all that differs between projections stands here.

use elementary::{sin, tan};
use glam::Vec2;
use optics::camera::{
    CAMERA_CUBEMAP, CAMERA_FISHEYE, CAMERA_ORTHOGRAPHIC, CAMERA_PANORAMA, CAMERA_PERSPECTIVE,
};
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;

/// How a camera maps directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", rename_all_fields = "kebab-case", tag = "kind")]
pub enum Projection {
    /// Perspective with a full vertical field of view, radians, in `(0, π)`.
    Perspective {
        /// Full vertical field of view, radians.
        fov_y: f32,
    },
    /// Parallel rays; the picture is `height` metres high.
    Orthographic {
        /// Height of the picture in world units.
        height: f32,
    },
    /// Equirectangular: 360° × 180°.
    Panorama,
    /// Equidistant fisheye: a circle that touches the picture's longer sides. Outside of it the picture is black.
    Fisheye {
        /// Full angle of the circle, radians, in `(0, 2π]`.
        fov: f32,
    },
    /// Six square faces side by side, each 90° wide: right, left, up, down, forward, back.
    Cubemap,
    /// Perspective as a calibrated camera has it, in fractions of the picture's width and height, so that it holds at
    /// every resolution. With a pinhole matrix in pixels: `focal = (fx / width, fy / height)`.
    Intrinsics {
        /// Focal length along the picture's width and height, positive.
        focal: Vec2,
        /// Where the optical axis meets the picture; `(0, 0)` is the upper left corner, `(1, 1)` the lower right.
        center: Vec2,
    },
}

/// What a number of a projection measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Radians here; users are shown degrees.
    Angle,
    /// Metres.
    Length,
}

/// The number that a user may set of a projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectionParameter {
    /// Its key in scene files and in Python.
    pub key: &'static str,
    /// What the viewer calls it.
    pub label: &'static str,
    /// What it measures.
    pub quantity: Quantity,
    /// Least and largest value as users give it: degrees or metres.
    pub range: [f32; 2],
    /// What it is where nothing is said, degrees or metres. `None`: it has to be said.
    pub default: Option<f32>,
}

impl ProjectionParameter {
    const FOV_Y: Self = Self {
        key: "fov",
        label: "Field of view",
        quantity: Quantity::Angle,
        range: [0.01, 179.0],
        default: Some(45.0),
    };
    const HEIGHT: Self = Self {
        key: "height",
        label: "Height",
        quantity: Quantity::Length,
        range: [1e-9, 1e12],
        default: None,
    };
    const FOV: Self = Self { range: [0.01, 360.0], default: Some(180.0), ..Self::FOV_Y };

    /// A number as users give it, degrees or metres, as it is kept; `None` outside of the range.
    pub fn from_user(&self, number: f32) -> Option<f32> {
        let value = if self.quantity == Quantity::Angle { number.to_radians() } else { number };
        (self.range[0]..=self.range[1]).contains(&number).then_some(value)
    }
}

impl Projection {
    /// Those that files, programs and users call by name, with usual numbers.
    pub const NAMED: [Self; 5] = [
        Self::Perspective { fov_y: 45.0f32.to_radians() },
        Self::Orthographic { height: 2.0 },
        Self::Panorama,
        Self::Fisheye { fov: PI },
        Self::Cubemap,
    ];

    /// The projection of a name, with usual numbers.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMED.into_iter().find(|projection| projection.name() == name)
    }

    /// The names of [`Projection::NAMED`], for messages.
    pub fn names() -> String {
        Self::NAMED.map(|projection| projection.name()).join(", ")
    }

    /// What files, programs and users call it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Perspective { .. } => "perspective",
            Self::Orthographic { .. } => "orthographic",
            Self::Panorama => "panorama",
            Self::Fisheye { .. } => "fisheye",
            Self::Cubemap => "cubemap",
            Self::Intrinsics { .. } => "intrinsics",
        }
    }

    /// Which of the optics' `CAMERA_…` makes its rays.
    pub fn camera_kind(&self) -> u32 {
        match self {
            Self::Perspective { .. } | Self::Intrinsics { .. } => CAMERA_PERSPECTIVE,
            Self::Orthographic { .. } => CAMERA_ORTHOGRAPHIC,
            Self::Panorama => CAMERA_PANORAMA,
            Self::Fisheye { .. } => CAMERA_FISHEYE,
            Self::Cubemap => CAMERA_CUBEMAP,
        }
    }

    /// Whether it is that of a pinhole, which a lens may bend.
    pub fn is_perspective(&self) -> bool {
        self.camera_kind() == CAMERA_PERSPECTIVE
    }

    /// The number that a user may set, and its value.
    pub fn parameter(&self) -> Option<(ProjectionParameter, f32)> {
        let mut own = *self;
        own.parameter_mut().map(|(parameter, value)| (parameter, *value))
    }

    /// As [`Projection::parameter`], to be changed.
    pub fn parameter_mut(&mut self) -> Option<(ProjectionParameter, &mut f32)> {
        match self {
            Self::Perspective { fov_y } => Some((ProjectionParameter::FOV_Y, fov_y)),
            Self::Orthographic { height } => Some((ProjectionParameter::HEIGHT, height)),
            Self::Fisheye { fov } => Some((ProjectionParameter::FOV, fov)),
            Self::Panorama | Self::Cubemap | Self::Intrinsics { .. } => None,
        }
    }

    /// Half of the film's width and height, as the optics' `CameraFrame` wants it. `aspect`: width divided by height.
    pub fn half_size(&self, aspect: f32) -> Vec2 {
        let by_height = |half_height: f32| Vec2::new(half_height * aspect, half_height);
        match self {
            Self::Perspective { fov_y } => by_height(tan(fov_y * 0.5)),
            Self::Orthographic { height } => by_height(height * 0.5),
            Self::Panorama | Self::Cubemap => by_height(1.0),
            Self::Fisheye { fov } => by_height(0.5 * fov / aspect.min(1.0)),
            Self::Intrinsics { focal, .. } => Vec2::splat(0.5) / *focal,
        }
    }

    /// Where the optical axis meets the picture; `(0, 0)` is the upper left corner, `(1, 1)` the lower right.
    pub fn center(&self) -> Vec2 {
        if let Self::Intrinsics { center, .. } = self { *center } else { Vec2::splat(0.5) }
    }

    /// Height of what the picture shows at a distance from the camera, metres.
    pub fn seen_height(&self, distance: f32) -> f32 {
        match self {
            Self::Perspective { fov_y } => 2.0 * distance * tan(fov_y * 0.5),
            Self::Orthographic { height } => *height,
            Self::Panorama => distance * PI,
            Self::Fisheye { fov } => distance * fov,
            Self::Cubemap => 2.0 * distance,
            Self::Intrinsics { focal, .. } => distance / focal.y,
        }
    }

    /// The distance from which a sphere fills the picture, metres. One with parallel rays is made as high as it has to be.
    pub fn frame_sphere(&mut self, radius: f32) -> f32 {
        match self {
            Self::Perspective { fov_y } => radius / sin(*fov_y * 0.5).max(1e-3),
            Self::Orthographic { height } => {
                *height = radius * 2.1;
                radius * 3.0
            }
            Self::Fisheye { fov } => radius / sin(fov.min(2.0) * 0.5).max(1e-3),
            Self::Panorama | Self::Cubemap => radius * 1.5,
            Self::Intrinsics { focal, .. } => radius * focal.y * 2.0,
        }
    }
}

/// In one line, for people.
impl std::fmt::Display for Projection {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match (self, self.parameter()) {
            (Self::Perspective { fov_y }, _) => write!(f, "perspective, {:.1}° high", fov_y.to_degrees()),
            (Self::Intrinsics { focal, .. }, _) => {
                write!(f, "calibrated, focal length {:.3} of the picture's height", focal.y)
            }
            (_, Some((ProjectionParameter { quantity: Quantity::Angle, .. }, angle))) => {
                write!(f, "{}, {:.1}° wide", self.name(), angle.to_degrees())
            }
            (_, Some((_, height))) => write!(f, "{}, {height} m high", self.name()),
            (_, None) => f.write_str(self.name()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_projection_is_found_by_its_name_and_has_its_number_in_range() {
        for mut projection in Projection::NAMED {
            assert_eq!(Projection::from_name(projection.name()), Some(projection));
            let Some((parameter, value)) = projection.parameter_mut() else { continue };
            let [low, high] = parameter.range.map(|limit| parameter.from_user(limit).expect("in range"));
            assert!((low..=high).contains(value), "{projection}");
            assert_eq!(parameter.default.and_then(|d| parameter.from_user(d)).unwrap_or(*value), *value);
            assert_eq!(parameter.from_user(parameter.range[1] * 1.5), None);
        }
        assert_eq!(Projection::from_name("intrinsics"), None);
    }

    #[test]
    fn a_fisheye_circle_touches_the_longer_sides() {
        let fisheye = Projection::Fisheye { fov: 3.0 };
        assert_eq!(fisheye.half_size(2.0), Vec2::new(3.0, 1.5));
        assert_eq!(fisheye.half_size(0.5), Vec2::new(1.5, 3.0));
    }
}
