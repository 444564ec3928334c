//! Frames, rays, intersections and cameras.
pub mod bounds;
pub mod camera;
pub mod distortion;
pub mod frame;
pub mod intersect;
pub mod offset;
pub mod shape;
pub mod terminator;
pub mod wide_projection;
