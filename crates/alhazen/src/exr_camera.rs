//! Cameras for compositing programs: the standard attributes of OpenEXR.

use film::{ExrCamera, ExrMatrix};
use glam::{Mat4, Vec3, Vec4};
use optics::camera::CameraFrame;
use optics::distortion::{DISTORTION_BROWN_CONRADY, DISTORTION_FISHEYE};
use scene::Projection;
use serde_json::json;
use std::collections::BTreeMap;

/// The key among the metadata of a picture under which its camera is, as [`camera_text`] writes it. A text, since it
/// travels with parts of pictures, which know no scene.
pub(crate) const CAMERA_FRAME: &str = "camera_frame";

/// Names of projections that the standard attributes know.
const PERSPECTIVE: &str = "perspective";
const ORTHOGRAPHIC: &str = "orthographic";
const PANORAMA: &str = "panorama";

/// A camera as JSON; all numbers come back with the same bits.
pub(crate) fn camera_text(frame: &CameraFrame) -> String {
    let projection = Projection::NAMED.iter().find(|projection| projection.camera_kind() == frame.kind);
    let projection = projection.map_or(PERSPECTIVE, Projection::name);
    json!({
        "projection": projection,
        "origin": frame.origin.to_array(),
        "right": frame.right.to_array(),
        "up": frame.up.to_array(),
        "forward": frame.forward.to_array(),
        "half_size": [frame.half_size.x, frame.half_size.y],
        "lens_radius": frame.lens_radius,
        "focus_distance": frame.focus_distance,
        "distortion": distortion(frame),
    })
    .to_string()
}

/// The lens by the names of OpenCV; null for a pinhole. The standard attributes know no lenses: they describe the pinhole.
fn distortion(frame: &CameraFrame) -> serde_json::Value {
    let d = frame.distortion;
    let ([k1, k2, k3, k4], [k5, k6, p1, p2]) = (d.radial.to_array(), d.rest.to_array());
    match d.model {
        DISTORTION_BROWN_CONRADY => json!({
            "model": "brown-conrady", "k": [k1, k2, k3, k4, k5, k6], "p": [p1, p2], "skew": d.skew,
        }),
        DISTORTION_FISHEYE => json!({ "model": "fisheye", "k": [k1, k2, k3, k4], "skew": d.skew }),
        _ => serde_json::Value::Null,
    }
}

/// What a file of a picture with these metadata says of its camera; `None` if they do not name one.
pub(crate) fn exr_camera(metadata: &BTreeMap<String, String>) -> Option<ExrCamera> {
    let frame: serde_json::Value = serde_json::from_str(metadata.get(CAMERA_FRAME)?).ok()?;
    let number = |value: &serde_json::Value| value.as_f64().map(|v| v as f32);
    let vector = |key: &str| -> Option<Vec3> {
        let v = frame[key].as_array()?;
        Some(Vec3::new(number(v.first()?)?, number(v.get(1)?)?, number(v.get(2)?)?))
    };
    let (origin, right, up) = (vector("origin")?, vector("right")?, vector("up")?);
    // What a film that is shifted aside adds to the axis is in the plane of the film.
    let axis = up.cross(right);
    let forward = vector("forward")?;
    let center = [forward.dot(right), forward.dot(up)];
    let (half_width, half_height) = (number(&frame["half_size"][0])?, number(&frame["half_size"][1])?);
    let to_camera = world_to_camera(origin, right, up, axis);
    let projection = frame["projection"].as_str()?;
    let to_film = match projection {
        PERSPECTIVE => Some(perspective(center, half_width, half_height)),
        ORTHOGRAPHIC => Some(parallel(half_width, half_height)),
        _ => None,
    };
    let has_lens = number(&frame["lens_radius"])? > 0.0 && projection == PERSPECTIVE;
    Some(ExrCamera {
        world_to_camera: for_rows(&to_camera),
        world_to_ndc: to_film.map(|to_film| for_rows(&(to_film * to_camera))),
        screen_window: (projection == PERSPECTIVE).then_some((center, 2.0 * half_width)),
        focus: number(&frame["focus_distance"]).filter(|_| has_lens),
        panorama: projection == PANORAMA,
    })
}

/// Into the left-handed space of a camera at `origin`: right, up, forward. Matrices here are for column vectors.
fn world_to_camera(origin: Vec3, right: Vec3, up: Vec3, axis: Vec3) -> Mat4 {
    let row = |v: Vec3| v.extend(-v.dot(origin));
    Mat4::from_cols(row(right), row(up), row(axis), Vec4::W).transpose()
}

/// From camera space to the picture, with `center` and half size of the film at distance 1. Its z is 1 − 1/distance.
fn perspective(center: [f32; 2], half_width: f32, half_height: f32) -> Mat4 {
    let (sx, sy) = (0.5 / half_width, -0.5 / half_height);
    Mat4::from_cols(
        Vec4::new(sx, 0.0, 0.0, 0.0),
        Vec4::new(0.0, sy, 0.0, 0.0),
        Vec4::new(0.5 - sx * center[0], 0.5 - sy * center[1], 1.0, 1.0),
        Vec4::new(0.0, 0.0, -1.0, 0.0),
    )
}

/// As [`perspective`], for parallel rays. Its z is the distance.
fn parallel(half_width: f32, half_height: f32) -> Mat4 {
    Mat4::from_cols(
        Vec4::new(0.5 / half_width, 0.0, 0.0, 0.0),
        Vec4::new(0.0, -0.5 / half_height, 0.0, 0.0),
        Vec4::Z,
        Vec4::new(0.5, 0.5, 0.0, 1.0),
    )
}

/// The columns of a matrix for column vectors are the rows of one for row vectors.
fn for_rows(matrix: &Mat4) -> ExrMatrix {
    matrix.to_cols_array_2d()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{camera_frame, picture_ray};
    use glam::Vec2;
    use scene::Camera;

    const SIZE: (u32, u32) = (320, 200);

    fn attributes(camera: &Camera) -> (CameraFrame, ExrCamera) {
        let frame = camera_frame(camera, SIZE.0, SIZE.1);
        let metadata = BTreeMap::from([(CAMERA_FRAME.to_owned(), camera_text(&frame))]);
        (frame, exr_camera(&metadata).unwrap())
    }

    /// A point times a matrix for row vectors, divided by w.
    fn times(p: Vec3, matrix: &ExrMatrix) -> Vec3 {
        let p = p.extend(1.0).to_array();
        let out: [f32; 4] = std::array::from_fn(|c| (0..4).map(|r| p[r] * matrix[r][c]).sum());
        Vec3::new(out[0], out[1], out[2]) / out[3]
    }

    #[test]
    fn points_land_on_the_pixels_whose_rays_hit_them() {
        let mut camera = Camera::perspective("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 0.5, 1.0), 0.8);
        let shifted = Projection::Intrinsics { focal: Vec2::new(0.9, 1.4), center: Vec2::new(0.4, 0.7) };
        let projections = [camera.projection, Projection::Orthographic { height: 3.0 }, shifted];
        for projection in projections {
            camera.projection = projection;
            let (frame, exr) = attributes(&camera);
            for (x, y) in [(0.0, 0.0), (320.0, 200.0), (12.5, 160.0), (200.0, 7.0)] {
                let ray = picture_ray(&frame, SIZE.0, SIZE.1, x, y);
                for distance in [0.3, 4.0, 50.0] {
                    let point = Vec3::from(ray.origin) + Vec3::from(ray.direction) * distance;
                    let ndc = times(point, &exr.world_to_ndc.unwrap());
                    let at = Vec2::new(ndc.x * SIZE.0 as f32, ndc.y * SIZE.1 as f32);
                    assert!(
                        at.distance(Vec2::new(x, y)) < 0.02,
                        "{projection:?}: ({x}, {y}) came back as {at}"
                    );
                    let seen = times(point, &exr.world_to_camera);
                    assert!(seen.z > 0.0, "{projection:?}: {point} is in front, but at {seen}");
                    if let Some((center, width)) = exr.screen_window {
                        let u = (seen.x / seen.z - center[0]) / width + 0.5;
                        assert!((u * SIZE.0 as f32 - x).abs() < 0.02, "{projection:?}: {u} for {x}");
                    }
                }
            }
        }
    }

    #[test]
    fn camera_space_is_left_handed() {
        let camera = Camera::perspective("c", Vec3::new(0.0, 1.0, 5.0), Vec3::new(0.0, 1.0, 0.0), 0.8);
        let (_, exr) = attributes(&camera);
        let seen = times(Vec3::new(2.0, 4.0, 4.0), &exr.world_to_camera);
        assert!(seen.distance(Vec3::new(2.0, 3.0, 1.0)) < 1e-6, "{seen}");
        assert_eq!((exr.focus, exr.panorama), (None, false));
    }

    #[test]
    fn lenses_and_panoramas_say_so() {
        let mut camera = Camera::perspective("c", Vec3::ZERO, Vec3::X, 0.8);
        (camera.lens_radius, camera.focus_distance) = (0.1, 7.25);
        assert_eq!(attributes(&camera).1.focus, Some(7.25));
        camera.projection = Projection::Panorama;
        let (_, exr) = attributes(&camera);
        assert_eq!((exr.panorama, exr.world_to_ndc, exr.screen_window), (true, None, None));
        assert_eq!(exr_camera(&BTreeMap::new()), None);
        let damaged = BTreeMap::from([(CAMERA_FRAME.to_owned(), "{\"origin\": [1]}".to_owned())]);
        assert_eq!(exr_camera(&damaged), None);
    }
}
