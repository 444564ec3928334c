//! Many rays, paths and vertices beside each other, and the lanes in which sixteen are computed at once.

pub(crate) mod columns;
pub(crate) mod departures;
pub(crate) mod lanes;
pub(crate) mod samples;
pub(crate) mod streams;
pub(crate) mod vertices;
