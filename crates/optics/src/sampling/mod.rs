//! Random numbers, and what they are turned into.
pub mod alias_table;
pub mod random;
pub mod rounds;
pub mod spherical_rectangle;
pub mod spherical_triangle;
pub mod warp;
