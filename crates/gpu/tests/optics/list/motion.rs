//! Functions of what moves while the shutter is open.

use super::*;

/// Matrices of rotations, stretches and places up to some metres.
const MATRICES: Tolerance = Tolerance {
    absolute: 1e-4,
    relative: 1e-4,
    exceptions: 0.0,
    why: "sines and cosines are the driver's, and products that nearly cancel each other are added",
};

/// Lights up to ten thousand metres away, moved.
const MOVED_LIGHTS: Tolerance = Tolerance {
    absolute: 0.05,
    relative: 1e-3,
    exceptions: 0.01,
    why: "edges and places of lights are of very different sizes, and what is added nearly cancels",
};

functions! {
    motion:
    // geometry/motion.rs
    motion::motion_place(time: share, segments: depth) within CANCELLING;
    motion::motion_at(s: motion_segment, fraction: share) within MATRICES;
    motion::affine_point(m: affine, p: direction) within MATRICES;
    motion::affine_vector(m: affine, v: direction) within MATRICES;
    motion::affine_product(a: affine, b: affine) within MATRICES;
    motion::affine_inverse(m: affine) within MATRICES;
    // geometry/moving_camera.rs
    moving_camera::camera_in_motion(middle: camera, s: camera_segment, fraction: share) within MATRICES;
    // geometry/shutter.rs
    shutter::shutter_fraction(rise: edge_of_shutter, fall: edge_of_shutter, u: unit) within MATRICES;
    shutter::shutter_time(s: shutter, at: unit2, size: film_size, u: unit) within MATRICES;
    // lights/moving_light.rs
    moving_light::moved_light(light: light, m: affine) within MOVED_LIGHTS;
}
