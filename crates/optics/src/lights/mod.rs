//! Where light comes from.
pub mod falloff;
pub mod light;
pub mod sky;
pub mod tree;
