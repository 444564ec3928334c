//! Bounding volume hierarchies: build, refit, SIMD traversal.
//!
//! There are two levels: a [`Blas`] holds the triangles or spheres of one object, a [`Tlas`] holds
//! instances of objects. Both answer closest-hit queries ([`Tlas::closest`]) and any-hit queries
//! ([`Tlas::any`]), for single rays and for streams of rays. This crate knows no materials: a
//! [`HitFilter`] accepts or rejects candidate hits where a surface has holes.
//!
//! Traversal kernels exist for AVX-512, AVX2 and NEON. The fastest that the processor supports is
//! chosen at run time, see [`InstructionSet`]. Scalar kernels with the formulas of
//! `optics::intersect` run on all other processors, and tests compare the SIMD kernels with them.
//!
//! Instances may move while rays leave ([`InstanceMotions`]): each ray then has a time from 0 to 1.
//!
//! Modules, from the lowest to the highest; none uses a module below it in this table:
//!
//! | module | content |
//! |---|---|
//! | `aabb`, `ray`, `layout`, `simd` | boxes, rays and hits, nodes and leaf blocks, vectors |
//! | `build` | from primitive bounds to an eight-wide tree |
//! | `bvh` | [`Blas`] and [`Tlas`] as data |
//! | `query` | traversal of both |
//! | [`encode`] | trees for shaders; it does not use `query` |

// Loops over axes and lanes index several arrays at once.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are numbered; several arrays go by one number"
)]

mod aabb;
mod build;
mod bvh;
pub mod encode;
mod huge_pages;
mod layout;
mod query;
mod ray;
mod simd;

pub use aabb::Aabb;
pub use build::Quality;
pub use bvh::{Blas, Geometry, Instance, InstanceMotions, Sphere, Tlas};
pub use huge_pages::HugePages;
pub use query::{Coherence, Hit16, HitColumns, HitSink, Ray8, RayColumns, RayStream, RayTimes};
pub use ray::{Candidate, Hit, HitFilter, MISS, Masked, Opaque, Ray};
pub use simd::InstructionSet;
