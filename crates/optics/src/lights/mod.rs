//! Where light comes from.
pub mod light;
pub mod sky;
