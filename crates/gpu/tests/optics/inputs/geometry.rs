//! Frames, cameras and rays.

use super::*;
use optics::camera::{CAMERA_PANORAMA, CameraFrame};
use optics::distortion::Distortion;
use optics::frame::{Frame, frame_from_normal};
use optics::intersect::{RayShear, ray_shear};
use optics::{Vec2f, Vec3f, vec2f, vec3f};

pub fn frame(i: &mut Inputs) -> Frame {
    frame_from_normal(direction(i))
}

/// 1 or −1.
pub fn sign(i: &mut Inputs) -> f32 {
    if flag(i) { 1.0 } else { -1.0 }
}

pub fn sign_or_none(i: &mut Inputs) -> f32 {
    i.edge(&[0.0]).unwrap_or_else(|| sign(i))
}

pub fn camera(i: &mut Inputs) -> CameraFrame {
    let f = frame(i);
    let lens_radius = i.edge(&[0.0]).unwrap_or_else(|| i.uniform() * 0.1);
    CameraFrame {
        kind: i.below(5) as u32,
        origin: point(i),
        right: f.tangent,
        up: f.bitangent,
        forward: f.normal,
        half_size: vec2f(i.between(0.1, 2.0), i.between(0.1, 2.0)),
        lens_radius,
        focus_distance: size(i),
        distortion: optics::distortion::no_distortion(),
    }
}

/// A projection without a plane film.
pub fn wide_kind(i: &mut Inputs) -> u32 {
    CAMERA_PANORAMA + i.below(3) as u32
}

/// Angles at the sides of a fisheye's film.
pub fn half_angles(i: &mut Inputs) -> Vec2f {
    vec2f(i.between(0.1, 3.1), i.between(0.1, 3.1))
}

/// A lens without folds where it is looked at, of either model.
pub fn distortion(i: &mut Inputs) -> Distortion {
    let skew = i.between(-0.05, 0.05);
    let mut k = || i.between(-0.02, 0.05);
    let k: [f32; 6] = std::array::from_fn(|_| k());
    if i.below(2) == 0 {
        return Distortion::fisheye([k[0], k[1], k[2], k[3]], skew);
    }
    Distortion::brown_conrady(k, [i.between(-0.01, 0.01), i.between(-0.01, 0.01)], skew)
}

/// A place of the film near the axis, in focal lengths.
pub fn film_point(i: &mut Inputs) -> Vec2f {
    vec2f(i.between(-0.5, 0.5), i.between(-0.5, 0.5))
}

/// A direction in front of a camera.
pub fn ahead(i: &mut Inputs) -> Vec3f {
    vec3f(i.between(-0.7, 0.7), i.between(-0.7, 0.7), i.between(0.5, 1.5))
}

/// The shear of a ray's direction.
pub fn shear(i: &mut Inputs) -> RayShear {
    ray_shear(direction(i))
}
