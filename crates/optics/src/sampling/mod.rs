//! Random numbers, and what they are turned into.
pub mod random;
pub mod warp;
