//! Paths, and the statistics of what they bring.
pub mod direct_light;
pub mod estimator;
pub mod interiors;
pub mod medium;
pub mod path;
pub mod vertex;
pub mod volume;
