//! Where light comes from.
pub mod light;
pub mod sky;
pub mod tree;
