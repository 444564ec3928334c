//! Frames, rays, intersections and cameras.
pub mod camera;
pub mod frame;
pub mod intersect;
pub mod offset;
pub mod shape;
pub mod terminator;
