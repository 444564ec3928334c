//! From a point of the world to where a camera's picture shows it: the way back of the camera's rays.

use glam::{DVec2, DVec3};
use optics::camera::{CAMERA_ORTHOGRAPHIC, CAMERA_PANORAMA, CameraFrame};
use optics::distortion::lens_film;
use optics::{Vec3f, vec3f};
use std::f64::consts::{PI, TAU};

/// Where a picture of `width` × `height` pixels shows something: column and row, (0, 0) at the upper left corner and pixel
/// centres at halves. `None` for what is behind a perspective or at the place of any camera.
///
/// `offset`: the thing's position relative to [`CameraFrame::origin`], or, for what is infinitely far away, its direction.
pub fn project(frame: &CameraFrame, width: u32, height: u32, offset: DVec3) -> Option<DVec2> {
    let [right, up, forward] = [frame.right, frame.up, frame.forward].map(vector);
    let (half_width, half_height) = (f64::from(frame.half_size.x), f64::from(frame.half_size.y));
    let film = if frame.kind == CAMERA_PANORAMA {
        let direction = offset.try_normalize()?;
        let azimuth = direction.dot(right).atan2(direction.dot(forward));
        let elevation = direction.dot(up).clamp(-1.0, 1.0).asin();
        DVec2::new(0.5 + azimuth / TAU, 0.5 - elevation / PI)
    } else {
        let axis = up.cross(right);
        let depth = offset.dot(axis);
        // The film's centre may be off the axis.
        let center = DVec2::new(forward.dot(right), forward.dot(up));
        if frame.kind != CAMERA_ORTHOGRAPHIC && !frame.distortion.is_none() {
            return through_lens(
                frame,
                width,
                height,
                DVec3::new(offset.dot(right), -offset.dot(up), depth),
                center,
            );
        }
        let at_one = if frame.kind == CAMERA_ORTHOGRAPHIC {
            DVec2::new(offset.dot(right), offset.dot(up))
        } else if depth > 0.0 {
            DVec2::new(offset.dot(right), offset.dot(up)) / depth - center
        } else {
            return None;
        };
        DVec2::new(0.5 + 0.5 * at_one.x / half_width, 0.5 - 0.5 * at_one.y / half_height)
    };
    Some(film * DVec2::new(f64::from(width), f64::from(height)))
}

/// The same through a lens. `offset`: to the right, down, along the axis. `center`: of the film, to the right and up.
fn through_lens(frame: &CameraFrame, width: u32, height: u32, offset: DVec3, center: DVec2) -> Option<DVec2> {
    let unit = offset.try_normalize()?.as_vec3();
    let seen = lens_film(frame.distortion, vec3f(unit.x, unit.y, unit.z));
    let at = DVec2::new(f64::from(seen.direction.x), -f64::from(seen.direction.y)) - center;
    let half = DVec2::new(f64::from(frame.half_size.x), f64::from(frame.half_size.y));
    let film = DVec2::new(0.5 + 0.5 * at.x / half.x, 0.5 - 0.5 * at.y / half.y);
    seen.valid.then_some(film * DVec2::new(f64::from(width), f64::from(height)))
}

/// How far a point is along a camera's axis, metres; for a panorama, which has none, the distance.
pub(crate) fn depth_along_axis(frame: &CameraFrame, offset: DVec3) -> f64 {
    if frame.kind == CAMERA_PANORAMA {
        return offset.length();
    }
    offset.dot(vector(frame.up).cross(vector(frame.right)))
}

/// An optics vector in double precision.
pub(crate) fn vector(v: Vec3f) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::{Camera, Distortion, Projection, camera_frame, picture_ray};
    use glam::{Vec2, Vec3};

    #[test]
    fn projection_is_the_way_back_of_the_rays_of_every_camera() {
        let (width, height) = (320, 200);
        let projections = [
            Projection::Perspective { fov_y: 0.9 },
            Projection::Orthographic { height: 3.0 },
            Projection::Panorama,
            Projection::Intrinsics { focal: Vec2::new(1.1, 1.7), center: Vec2::new(0.45, 0.61) },
        ];
        let lenses = [
            None,
            Some(Distortion::BrownConrady { k: [-0.2, 0.05, 0.0, 0.01, 0.0, 0.0], p: [0.001, -0.002] }),
            Some(Distortion::Fisheye { k: [-0.02, 0.003, 0.0, 0.0] }),
        ];
        for (projection, distortion) in projections.into_iter().flat_map(|p| lenses.map(|l| (p, l))) {
            let mut camera =
                Camera::perspective("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 0.5, 1.0), 1.0);
            (camera.projection, camera.distortion, camera.skew) = (projection, distortion, 0.02);
            let frame = camera_frame(&camera, width, height);
            for (x, y) in [(0.5, 0.5), (319.5, 10.5), (100.25, 199.5), (160.0, 100.0)] {
                let ray = picture_ray(&frame, width, height, x, y);
                let point = Vec3::from(ray.origin) + Vec3::from(ray.direction) * 7.0;
                let offset = (point - camera.eye).as_dvec3();
                let back = project(&frame, width, height, offset).expect("in front");
                let error = back.distance(DVec2::new(f64::from(x), f64::from(y)));
                assert!(error < 1e-2, "{projection:?}: ({x}, {y}) came back as {back}");
                assert!(depth_along_axis(&frame, offset) > 0.0);
            }
        }
    }

    #[test]
    fn what_is_behind_a_camera_is_not_in_its_picture() {
        let frame = camera_frame(&Camera::perspective("c", Vec3::ZERO, Vec3::X, 1.0), 8, 8);
        assert_eq!(project(&frame, 8, 8, DVec3::NEG_X), None);
        assert_eq!(project(&frame, 8, 8, DVec3::X), Some(DVec2::splat(4.0)));
    }
}
