//! Paths, and the statistics of what they bring.
pub mod estimator;
pub mod interiors;
pub mod medium;
pub mod path;
pub mod volume;
