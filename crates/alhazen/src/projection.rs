//! From a point of the world to where a camera's picture shows it: the way back of the camera's rays.

use glam::{DVec2, DVec3};
use optics::camera::{CAMERA_ORTHOGRAPHIC, CAMERA_PERSPECTIVE, CameraFrame, wide_film, wide_sees};
use optics::distortion::lens_film;
use optics::{Vec3f, vec3f};

/// Where a picture of `width` × `height` pixels shows something: column and row, (0, 0) at the upper left corner and pixel
/// centres at halves. `None` for what is behind a perspective, outside of a fisheye's circle, or at the place of any camera.
///
/// `offset`: the thing's position relative to [`CameraFrame::origin`], or, for what is infinitely far away, its direction.
pub fn picture_point(frame: &CameraFrame, width: u32, height: u32, offset: DVec3) -> Option<DVec2> {
    let [right, up, forward] = [frame.right, frame.up, frame.forward].map(vector);
    let (half_width, half_height) = (f64::from(frame.half_size.x), f64::from(frame.half_size.y));
    let (aside, above) = (offset.dot(right), offset.dot(up));
    let depth = offset.dot(up.cross(right));
    // The film's centre may be off the axis.
    let center = DVec2::new(forward.dot(right), forward.dot(up));
    let on_film = |at: DVec2| DVec2::new(0.5 + 0.5 * at.x / half_width, 0.5 - 0.5 * at.y / half_height);
    let film = match frame.kind {
        CAMERA_ORTHOGRAPHIC => on_film(DVec2::new(aside, above)),
        CAMERA_PERSPECTIVE if frame.distortion.is_none() => {
            on_film((depth > 0.0).then(|| DVec2::new(aside, above) / depth - center)?)
        }
        CAMERA_PERSPECTIVE => {
            let unit = DVec3::new(aside, -above, depth).try_normalize()?.as_vec3();
            let seen = lens_film(frame.distortion, vec3f(unit.x, unit.y, unit.z));
            let at = DVec2::new(f64::from(seen.direction.x), -f64::from(seen.direction.y));
            on_film(seen.valid.then_some(at - center)?)
        }
        kind => {
            let unit = DVec3::new(aside, above, depth).try_normalize()?.as_vec3();
            let film = wide_film(kind, vec3f(unit.x, unit.y, unit.z), frame.half_size);
            let is_seen = wide_sees(kind, film, frame.half_size);
            is_seen.then(|| DVec2::new(f64::from(film.x), f64::from(film.y)))?
        }
    };
    Some(film * DVec2::new(f64::from(width), f64::from(height)))
}

/// How far a point is along a camera's axis, metres; for a panorama and the like, which see to all sides, the distance.
pub fn depth_along_axis(frame: &CameraFrame, offset: DVec3) -> f64 {
    if ![CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC].contains(&frame.kind) {
        return offset.length();
    }
    offset.dot(vector(frame.up).cross(vector(frame.right)))
}

/// An optics vector in double precision.
fn vector(v: Vec3f) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{camera_frame, picture_ray};
    use glam::{Vec2, Vec3};
    use scene::{Camera, Distortion, Projection};

    #[test]
    fn projection_is_the_way_back_of_the_rays_of_every_camera() {
        let (width, height) = (320, 200);
        let projections = [
            Projection::Perspective { fov_y: 0.9 },
            Projection::Orthographic { height: 3.0 },
            Projection::Panorama,
            Projection::Fisheye { fov: 3.5 },
            Projection::Fisheye { fov: 6.0 },
            Projection::Cubemap,
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
            for (x, y) in [(0.5, 0.5), (319.5, 10.5), (100.25, 199.5), (160.5, 100.0)] {
                let ray = picture_ray(&frame, width, height, x, y);
                if ray.t_max == 0.0 {
                    continue; // the corners of a fisheye
                }
                let point = Vec3::from(ray.origin) + Vec3::from(ray.direction) * 7.0;
                let offset = (point - camera.eye).as_dvec3();
                let back = picture_point(&frame, width, height, offset).expect("in front");
                let error = back.distance(DVec2::new(f64::from(x), f64::from(y)));
                assert!(error < 1e-2, "{projection:?}: ({x}, {y}) came back as {back}");
                assert!(depth_along_axis(&frame, offset) > 0.0);
            }
        }
    }

    #[test]
    fn what_is_behind_a_camera_is_not_in_its_picture() {
        let frame = camera_frame(&Camera::perspective("c", Vec3::ZERO, Vec3::X, 1.0), 8, 8);
        assert_eq!(picture_point(&frame, 8, 8, DVec3::NEG_X), None);
        assert_eq!(picture_point(&frame, 8, 8, DVec3::X), Some(DVec2::splat(4.0)));
    }
}
