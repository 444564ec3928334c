//! Cameras as the user describes them, and the paths they move along.

use crate::projection::Projection;
use elementary::{cos, sin};
use glam::{Affine3A, Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// How a lens bends lines that a pinhole shows straight, with the coefficients of OpenCV's calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", tag = "model")]
pub enum Distortion {
    /// Brown and Conrady's model with a rational radial factor.
    BrownConrady {
        /// k1 to k6: the first three of the numerator, the others of the denominator.
        #[serde(default)]
        k: [f32; 6],
        /// p1 and p2, tangential.
        #[serde(default)]
        p: [f32; 2],
    },
    /// Kannala and Brandt's fisheye: a polynomial in the angle to the axis.
    Fisheye {
        /// k1 to k4.
        #[serde(default)]
        k: [f32; 4],
    },
}

impl Distortion {
    /// The model of OpenCV's list of coefficients: `k1, k2, p1, p2[, k3[, k4, k5, k6]]`, or, for a fisheye, `k1, k2, k3, k4`.
    /// `None` for another number of them, or one that is not finite.
    pub fn from_opencv(coefficients: &[f64], fisheye: bool) -> Option<Self> {
        if coefficients.iter().any(|c| !(*c as f32).is_finite()) {
            return None;
        }
        let at = |i: usize| coefficients.get(i).map_or(0.0, |c| *c as f32);
        match (fisheye, coefficients.len()) {
            (true, 4) => Some(Self::Fisheye { k: [at(0), at(1), at(2), at(3)] }),
            (false, 4 | 5 | 8) => {
                Some(Self::BrownConrady { k: [at(0), at(1), at(4), at(5), at(6), at(7)], p: [at(2), at(3)] })
            }
            _ => None,
        }
    }

    /// Whether all coefficients are finite.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::BrownConrady { k, p } => k.iter().chain(p).all(|c| c.is_finite()),
            Self::Fisheye { k } => k.iter().all(|c| c.is_finite()),
        }
    }
}

/// A camera in world space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name from the file, or "default".
    pub name: String,
    /// Position, metres.
    pub eye: Vec3,
    /// Point that is looked at; the optical axis is `target − eye`.
    pub target: Vec3,
    /// Approximate up direction; need not be perpendicular to the axis.
    pub up: Vec3,
    /// Projection.
    pub projection: Projection,
    /// Width divided by height, where the file says so.
    pub aspect: Option<f32>,
    /// Radius of the lens, metres; 0 is a pinhole. From an f-number: focal length / (2 · f-number).
    pub lens_radius: f32,
    /// Distance from the eye to the plane in focus, along the axis, metres.
    pub focus_distance: f32,
    /// Movement over time; `None` stands still.
    pub path: Option<CameraPath>,
    /// Where it is while the shutter is open, at equally spaced moments; empty if it stands still.
    /// See [`crate::Scene::open_shutter`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keys: Vec<CameraKey>,
    /// Of a perspective camera: how its lens bends lines. What lies outside of the lens' field is black.
    pub distortion: Option<Distortion>,
    /// Of a perspective camera: how far the picture's columns lean, s / fx of a matrix of intrinsics.
    pub skew: f32,
}

/// Where a camera is at a moment while the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraKey {
    /// See [`Camera::eye`].
    pub eye: Vec3,
    /// See [`Camera::target`].
    pub target: Vec3,
    /// See [`Camera::up`].
    pub up: Vec3,
    /// The projection, if it changes meanwhile.
    pub projection: Option<Projection>,
}

/// How a camera moves. Times are in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum CameraPath {
    /// A circle around the vertical axis through `center`, looking at the camera's `target`.
    Orbit {
        /// Centre of the circle on the ground plane of the orbit.
        center: Vec3,
        /// Radius, metres.
        radius: f32,
        /// Height above `center`, metres.
        height: f32,
        /// Amplitude of a sine added to the height, metres; one oscillation a turn.
        bob: f32,
        /// Seconds for a whole turn.
        period: f32,
        /// Angle at time 0, radians, from +Z towards +X.
        start: f32,
    },
}

impl Camera {
    /// A pinhole camera with the given full vertical field of view (radians).
    pub fn perspective(name: impl Into<String>, eye: Vec3, target: Vec3, fov_y: f32) -> Self {
        Self {
            name: name.into(),
            eye,
            target,
            up: Vec3::Y,
            projection: Projection::Perspective { fov_y },
            aspect: None,
            lens_radius: 0.0,
            focus_distance: (target - eye).length().max(1e-6),
            path: None,
            keys: Vec::new(),
            distortion: None,
            skew: 0.0,
        }
    }

    /// From world space to the camera's: x to the right, y up, z against the direction of view. The identity where the
    /// camera looks nowhere.
    pub fn world_to_camera(&self) -> Affine3A {
        let back = (self.eye - self.target).try_normalize();
        let right = back.and_then(|back| self.up.cross(back).try_normalize().map(|right| (back, right)));
        let Some((back, right)) = right else { return Affine3A::IDENTITY };
        let axes = Mat3::from_cols(right, back.cross(right), back);
        Affine3A::from_mat3_translation(axes, self.eye).inverse()
    }

    /// Moves the camera by `by`.
    pub(crate) fn shift(&mut self, by: Vec3) {
        self.eye += by;
        self.target += by;
        for key in &mut self.keys {
            key.eye += by;
            key.target += by;
        }
        if let Some(CameraPath::Orbit { center, .. }) = &mut self.path {
            *center += by;
        }
    }

    /// Where the camera is at `time` seconds.
    pub fn at(&self, time: f32) -> Self {
        let mut camera = self.clone();
        if let Some(CameraPath::Orbit { center, radius, height, bob, period, start }) = self.path {
            let turn = std::f32::consts::TAU * time / period;
            let angle = start + turn;
            camera.eye =
                center + Vec3::new(radius * sin(angle), height + bob * sin(turn), radius * cos(angle));
        }
        camera
    }
}
