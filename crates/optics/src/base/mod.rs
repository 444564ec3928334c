//! Numbers and small functions that everything else uses.
pub mod constants;
pub mod math;
