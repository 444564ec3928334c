//! What is looked up of the scene for a hit: records, points of surfaces, texels, holes.

pub(crate) mod filter;
pub(crate) mod hit_records;
pub(crate) mod surface;
pub(crate) mod texture;
pub(crate) mod texture_points;
pub(crate) mod triangles;
