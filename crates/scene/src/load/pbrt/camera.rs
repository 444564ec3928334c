//! The camera: perspective or orthographic, with or without a lens.

use super::Builder;
use super::parameters::Parameters;
use crate::animation::{Keyed, KeyedObject};
use crate::{Animation, Camera, Projection};
use elementary::{atan, tan};
use glam::{DAffine3, Vec3};

/// pbrt's size of a film that says nothing.
const DEFAULT_SIZE: [f32; 2] = [1280.0, 720.0];

/// A camera before the size of the film is known.
pub(super) struct PendingCamera {
    camera_to_world: DAffine3,
    /// At the end of its motion.
    end: DAffine3,
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
        let end = self.state.end.inverse();
        self.systems.insert("camera".into(), [camera_to_world, end]);
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
        self.shutter = [p.number_or("shutteropen", 0.0), p.number_or("shutterclose", 1.0)];
        let _ = p.number("frameaspectratio");
        let lens_radius = p.number_or("lensradius", 0.0).max(0.0);
        let focal_distance = p.number_or("focaldistance", 1e6).max(1e-6);
        self.camera = Some(PendingCamera { camera_to_world, end, kind, lens_radius, focal_distance });
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
        let view = |camera_to_world: DAffine3| {
            let to_world = self.mirror * camera_to_world;
            let eye = (to_world.translation - self.scene.origin).as_vec3();
            let forward = to_world.matrix3.z_axis.as_vec3().normalize_or_zero();
            let up = to_world.matrix3.y_axis.as_vec3().normalize_or_zero();
            (eye, forward, up)
        };
        let (eye, forward, up) = view(pending.camera_to_world);
        let last = (pending.end != pending.camera_to_world).then(|| view(pending.end));
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
        if let Some(last) = last {
            self.move_camera([(eye, forward, up), last]);
        }
    }

    /// Lets the camera move between two places: where it is, and its axis and its top.
    fn move_camera(&mut self, places: [(Vec3, Vec3, Vec3); 2]) {
        let place = |(eye, forward, up): (Vec3, Vec3, Vec3)| {
            let camera = Camera { up, ..Camera::perspective("", eye, eye + forward, 1.0) };
            camera.world_to_camera().inverse()
        };
        let keys = places.map(place).to_vec();
        match Keyed::new(KeyedObject::Camera(0), self.times.to_vec(), keys) {
            Ok(keyed) => self.scene.animations.push(Animation { keyed: vec![keyed], ..Animation::default() }),
            Err(error) => self.report.ignored(format!("the motion of the camera: {error}")),
        }
    }
}
