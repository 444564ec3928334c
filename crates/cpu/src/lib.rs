//! The CPU back end: our own acceleration structures and the optics as Rust, on every core.
//!
//! Start reading at [`CpuBackend`]. The heart is `integrate::path`; `integrate::volume` does the same where there are media.
//! From above: `schedule` cuts the picture into work, `integrate` follows paths, `shade` does what happens where they hit and
//! miss, `fetch` looks up what that needs of the scene, and `batch` and `simd` are what all of them compute with.
//!
//! The picture is the same, bit for bit, whatever the number of threads: a sample depends on its pixel and index only, and
//! the film's sums are exact.

mod backend;
mod batch;
mod fetch;
mod guided;
mod integrate;
mod photons;
mod queries;
mod replay;
mod scene;
mod schedule;
mod shade;
mod simd;
mod threads;
mod views;

pub use backend::CpuBackend;
pub use queries::{BeamEcho, Hits, RayError, RayQueries, Rays, SurfacePoint};
pub use replay::{
    FoundLight, LightSampleRecord, LightVisibility, PathEnd, PathRecord, SampleRecord, ScatteringRecord,
    SurfaceRecord, VertexPlace, VertexRecord,
};
