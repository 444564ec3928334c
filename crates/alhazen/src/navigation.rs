//! How a camera follows the mouse, the fingers and the keyboard, whatever the window is.

use elementary::{atan, atan2, hypot, pow, tan};
use glam::{Quat, Vec2, Vec3};
use scene::{Camera, CameraPath, Projection};
use std::f32::consts::{PI, TAU};

/// Directions nearer to the pole than this (radians) are not reached: there is no "up" beyond.
const POLE: f32 = 0.01;
/// The target stays at least this far away, metres.
const NEAREST: f32 = 1e-5;

/// Turns the camera about its target.
///
/// - `drag`: how far the pointer went, in heights of the picture; right and down are positive. A whole height is half a turn.
pub fn orbit(camera: &mut Camera, drag: Vec2) {
    let offset = camera.eye - camera.target;
    camera.eye = camera.target + turned(offset, camera.up, drag);
    camera.path = None;
}

/// Turns the camera's gaze about its eye: mouse look. `drag` as in [`orbit`].
pub fn look(camera: &mut Camera, drag: Vec2) {
    let axis = camera.target - camera.eye;
    camera.target = camera.eye + turned(axis, camera.up, drag * Vec2::new(0.5, -0.5));
    camera.path = None;
}

/// `v` turned about `up` by the drag's x and towards the pole by its y, short of the pole.
fn turned(v: Vec3, up: Vec3, drag: Vec2) -> Vec3 {
    let Some(up) = up.try_normalize() else { return v };
    let yaw = Quat::from_axis_angle(up, -drag.x * PI);
    let v = yaw * v;
    let Some(side) = up.cross(v).try_normalize() else { return v };
    let polar = up.angle_between(v);
    // Dragging down lifts the camera: the world follows the pointer.
    let wanted = (polar - drag.y * PI).clamp(POLE, PI - POLE);
    Quat::from_axis_angle(side, wanted - polar) * v
}

/// Moves camera and target along the picture, so that the point under the pointer stays there.
///
/// - `drag`: in heights of the picture.
pub fn pan(camera: &mut Camera, drag: Vec2) {
    let (right, up) = picture_axes(camera);
    let shift = (right * -drag.x + up * drag.y) * picture_height(camera);
    camera.eye += shift;
    camera.target += shift;
    camera.path = None;
}

/// Goes towards the target, `steps` notches of a wheel; negative goes away. Each notch is a tenth of the distance.
pub fn dolly(camera: &mut Camera, steps: f32) {
    let factor = pow(0.9f32, steps.clamp(-60.0, 60.0));
    if let Projection::Orthographic { height } = &mut camera.projection {
        *height = (*height * factor).clamp(1e-6, 1e9);
    }
    let offset = camera.eye - camera.target;
    let distance = (offset.length() * factor).clamp(NEAREST, 1e9);
    if let Some(direction) = offset.try_normalize() {
        // What is in focus goes along when it is the target.
        let focuses_target = (camera.focus_distance - offset.length()).abs() < 1e-3 * offset.length();
        camera.eye = camera.target + direction * distance;
        if focuses_target {
            camera.focus_distance = distance;
        }
    }
    camera.path = None;
}

/// Moves camera and target, as a flying observer does.
///
/// - `motion`: right, up and forward, in metres.
pub fn fly(camera: &mut Camera, motion: Vec3) {
    let forward = (camera.target - camera.eye).normalize_or(Vec3::NEG_Z);
    let (right, _) = picture_axes(camera);
    let shift = right * motion.x + camera.up.normalize_or(Vec3::Y) * motion.y + forward * motion.z;
    camera.eye += shift;
    camera.target += shift;
    camera.path = None;
}

/// Looks at a box from the direction in which the camera looks now, so that all of it is in the picture.
pub fn frame(camera: &mut Camera, low: Vec3, high: Vec3) {
    let center = (low + high) * 0.5;
    let radius = ((high - low).length() * 0.5).max(NEAREST);
    let direction = (camera.eye - camera.target).normalize_or(Vec3::Z);
    let distance = camera.projection.frame_sphere(radius);
    camera.target = center;
    camera.eye = center + direction * distance;
    camera.focus_distance = distance;
    camera.path = None;
}

/// Orthographic instead of perspective, or the other way round, with the target as large as before.
pub fn toggle_projection(camera: &mut Camera) {
    let distance = (camera.target - camera.eye).length().max(NEAREST);
    camera.projection = match camera.projection {
        Projection::Perspective { fov_y } => {
            Projection::Orthographic { height: 2.0 * distance * tan(fov_y * 0.5) }
        }
        Projection::Orthographic { height } => {
            let fov_y = (2.0 * atan(0.5 * height / distance)).clamp(0.02, PI - 0.02);
            Projection::Perspective { fov_y }
        }
        _ => Projection::Perspective { fov_y: 45f32.to_radians() },
    };
}

/// An orbit that begins where the camera is now.
///
/// - `bob`: metres that the camera rises and falls.
/// - `period`: seconds for a turn.
pub fn orbit_path(camera: &Camera, bob: f32, period: f32) -> CameraPath {
    let offset = camera.eye - camera.target;
    CameraPath::Orbit {
        center: camera.target,
        radius: hypot(offset.x, offset.z).max(NEAREST),
        height: offset.y,
        bob,
        period,
        start: atan2(offset.x, offset.z).rem_euclid(TAU),
    }
}

/// Unit vectors to the right and to the top of the picture.
fn picture_axes(camera: &Camera) -> (Vec3, Vec3) {
    let axis = (camera.target - camera.eye).normalize_or(Vec3::NEG_Z);
    let right = axis.cross(camera.up).try_normalize().unwrap_or(Vec3::X);
    (right, right.cross(axis))
}

/// Height of the picture in the plane of the target, metres.
fn picture_height(camera: &Camera) -> f32 {
    camera.projection.seen_height((camera.target - camera.eye).length())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::perspective("c", Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 1.0)
    }

    #[test]
    fn orbits_keep_the_distance_and_stop_at_the_poles() {
        let mut c = camera();
        orbit(&mut c, Vec2::new(0.5, 0.0));
        assert!(c.eye.distance(Vec3::new(-5.0, 0.0, 0.0)) < 1e-4, "{}", c.eye);
        for _ in 0..20 {
            orbit(&mut c, Vec2::new(0.1, 0.3));
        }
        assert!((c.eye.length() - 5.0).abs() < 1e-3);
        assert!(c.eye.y > 4.99 && c.eye.x.hypot(c.eye.z) > 0.01, "above, but not at the pole: {}", c.eye);
        for _ in 0..20 {
            orbit(&mut c, Vec2::new(0.0, -0.3));
        }
        assert!(c.eye.y < -4.99);
    }

    #[test]
    fn looking_keeps_the_eye() {
        let mut c = camera();
        look(&mut c, Vec2::new(0.2, 0.1));
        assert_eq!(c.eye, Vec3::new(0.0, 0.0, 5.0));
        assert!(c.target.x > 0.5, "dragging right looks right: {}", c.target);
        assert!(c.target.y < -0.1, "dragging down looks down: {}", c.target);
    }

    #[test]
    fn panning_moves_the_target_with_the_pointer() {
        let mut c = camera();
        let height = picture_height(&c);
        pan(&mut c, Vec2::new(0.25, 0.5));
        assert!(c.target.distance(Vec3::new(-0.25 * height, 0.5 * height, 0.0)) < 1e-4, "{}", c.target);
        assert!((c.eye - c.target).distance(Vec3::new(0.0, 0.0, 5.0)) < 1e-5);
    }

    #[test]
    fn dollying_never_reaches_the_target_and_keeps_it_in_focus() {
        let mut c = camera();
        dolly(&mut c, 1.0);
        assert!((c.eye.z - 4.5).abs() < 1e-5 && (c.focus_distance - 4.5).abs() < 1e-5);
        (0..50).for_each(|_| dolly(&mut c, 60.0));
        assert!(c.eye != c.target && c.eye.is_finite());
        c.focus_distance = 2.0;
        dolly(&mut c, -1.0);
        assert_eq!(c.focus_distance, 2.0, "a focus that was set stays");
    }

    #[test]
    fn flying_goes_where_the_camera_looks() {
        let mut c = camera();
        fly(&mut c, Vec3::new(1.0, 2.0, 3.0));
        assert!(c.eye.distance(Vec3::new(1.0, 2.0, 2.0)) < 1e-5, "{}", c.eye);
        assert!((c.target - c.eye).distance(Vec3::new(0.0, 0.0, -5.0)) < 1e-5);
    }

    #[test]
    fn framing_sees_the_whole_box() {
        let (low, high) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(3.0, 6.0, 5.0));
        let mut c = camera();
        frame(&mut c, low, high);
        let f = crate::camera_frame(&c, 100, 100);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let v = Vec3::new(pick(0), pick(1), pick(2)) - c.eye;
            let [x, y, z] = [f.right, f.up, f.forward].map(|a| v.dot(Vec3::from(a.to_array())));
            assert!(x.abs() < z * f.half_size.x && y.abs() < z * f.half_size.y, "corner {corner}");
        }
    }

    #[test]
    fn projections_toggle_with_the_target_as_large_as_before() {
        let mut c = camera();
        let before = picture_height(&c);
        toggle_projection(&mut c);
        assert!((picture_height(&c) - before).abs() < 1e-4);
        toggle_projection(&mut c);
        let Projection::Perspective { fov_y } = c.projection else { panic!("perspective again") };
        assert!((fov_y - 1.0).abs() < 1e-5);
    }

    #[test]
    fn an_orbit_begins_where_the_camera_is() {
        let mut c = Camera::perspective("c", Vec3::new(3.0, 2.0, -1.0), Vec3::new(0.5, 0.5, 0.5), 1.0);
        c.path = Some(orbit_path(&c, 0.5, 8.0));
        assert!(c.at(0.0).eye.distance(c.eye) < 1e-5, "{}", c.at(0.0).eye);
        assert!(c.at(8.0).eye.distance(c.eye) < 1e-4);
        assert!(c.at(2.0).eye.y > c.eye.y + 0.49, "bobs up");
    }
}
