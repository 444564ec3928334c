//! The CPU back end: our own acceleration structures and the optics as Rust, on every core.
//!
//! Start reading at [`CpuBackend`]; `path` is the heart;
//! `volumes` does the same where there are media. The picture is the same, bit for bit, whatever the number of
//! threads: a sample depends on its pixel and index only, and the film's sums are exact.

mod aov;
mod arrive;
mod backend;
mod bands;
mod columns;
mod direct;
mod escape;
mod filter;
mod glossy_lanes;
mod lanes;
mod last_segment;
mod layers;
mod light_lanes;
mod lights;
mod listed;
mod material;
mod passes;
mod path;
mod queries;
mod scatter;
mod scatter_lanes;
mod scattering;
mod scene;
mod simd;
mod sites;
mod streams;
mod surface;
mod texture;
mod triangles;
mod vertices;
mod volumes;
mod waiting;

pub use backend::CpuBackend;
pub use queries::{BeamEcho, Hits, RayError, RayQueries, Rays, SurfacePoint};
