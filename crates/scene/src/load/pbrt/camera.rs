//! The camera: perspective or orthographic, with or without a lens.

use super::Builder;
use super::parameters::Parameters;
use crate::{Camera, Projection};
use elementary::{atan, tan};
use glam::DAffine3;

/// pbrt's size of a film that says nothing.
const DEFAULT_SIZE: [f32; 2] = [1280.0, 720.0];

/// A camera before the size of the film is known.
pub(super) struct PendingCamera {
    camera_to_world: DAffine3,
    kind: PendingKind,
    lens_radius: f32,
    focal_distance: f32,
}

enum PendingKind {
    /// Angle of view along the shorter side, degrees, or half the height of the picture at distance 1.
    Perspective { fov: f32, half_height: Option<f32> },
    /// Half the shorter side, and half the height where the file says it.
    Orthographic { half_height: Option<f32> },
}

impl Builder<'_> {
    pub(super) fn set_camera(&mut self, kind: &str, p: &Parameters) {
        let camera_to_world = self.state.transform.inverse();
        self.systems.insert("camera".into(), camera_to_world);
        // A camera whose axes are right-handed mirrors the picture in pbrt. Then its numbers are those of a world that
        // is not mirrored here.
        if camera_to_world.matrix3.determinant() < 0.0 {
            self.mirror = DAffine3::IDENTITY;
        }
        let window = p.numbers("screenwindow").first_chunk::<4>().map(|[_, _, low, high]| 0.5 * (high - low));
        let half_height = window.filter(|h| h.is_finite() && *h > 0.0);
        let kind = match kind {
            "perspective" => {
                let fov = p.number_or("fov", 90.0);
                let half = tan(0.5 * fov.to_radians());
                PendingKind::Perspective { fov, half_height: half_height.map(|h| h * half) }
            }
            "orthographic" => PendingKind::Orthographic { half_height },
            other => {
                self.report
                    .ignored(format!("{}: {other} cameras are not supported: another one is used", p.place));
                return;
            }
        };
        let _ = (p.number("shutteropen"), p.number("shutterclose"), p.number("frameaspectratio"));
        let lens_radius = p.number_or("lensradius", 0.0).max(0.0);
        let focal_distance = p.number_or("focaldistance", 1e6).max(1e-6);
        self.camera = Some(PendingCamera { camera_to_world, kind, lens_radius, focal_distance });
    }

    /// Puts the camera into the scene, now that the film is known.
    pub(super) fn finish_camera(&mut self) {
        let Some(pending) = self.camera.take() else { return };
        let size = |given: Option<u32>, default: f32| given.filter(|s| *s > 0).map_or(default, |s| s as f32);
        let defaults = &self.scene.defaults;
        let aspect = size(defaults.width, DEFAULT_SIZE[0]) / size(defaults.height, DEFAULT_SIZE[1]);
        // What is given along the shorter side is smaller than along the height of a narrow picture.
        let by_height = |short: f32| if aspect < 1.0 { short / aspect } else { short };
        let projection = match pending.kind {
            PendingKind::Perspective { fov, half_height } => {
                let half = half_height.unwrap_or_else(|| by_height(tan(0.5 * fov.to_radians())));
                Projection::Perspective { fov_y: 2.0 * atan(half) }
            }
            PendingKind::Orthographic { half_height } => {
                Projection::Orthographic { height: 2.0 * half_height.unwrap_or_else(|| by_height(1.0)) }
            }
        };
        let to_world = self.mirror * pending.camera_to_world;
        let eye = (to_world.translation - self.scene.origin).as_vec3();
        let forward = to_world.matrix3.z_axis.as_vec3().normalize_or_zero();
        let up = to_world.matrix3.y_axis.as_vec3().normalize_or_zero();
        if !eye.is_finite() || forward.cross(up).length() < 1e-6 {
            return self.report.ignored("the camera's transform has no inverse: another one is used");
        }
        let camera = Camera::perspective("camera", eye, eye + forward, 1.0);
        self.scene.cameras.push(Camera {
            up,
            projection,
            aspect: Some(aspect),
            lens_radius: pending.lens_radius,
            focus_distance: pending.focal_distance,
            ..camera
        });
    }
}
