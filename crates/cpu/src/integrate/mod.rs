//! The integrators: who follows paths, and asks what is hit.

pub(crate) mod direct;
pub(crate) mod last_segment;
pub(crate) mod path;
pub(crate) mod volume;
