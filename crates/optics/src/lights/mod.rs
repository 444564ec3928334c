//! Where light comes from.
pub mod equirect;
pub mod falloff;
pub mod light;
pub mod node;
pub mod portal;
pub mod portal_triangle;
pub mod profile;
pub mod reservoir;
pub mod shaft;
pub mod sky;
pub mod tree;
