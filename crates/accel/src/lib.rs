//! Bounding volume hierarchies: build, refit, SIMD traversal.
//!
//! Two levels: a [`Blas`] holds the triangles or spheres of one object, a [`Tlas`] holds instances of them. Both
//! answer [`Tlas::closest`] and [`Tlas::any`], for one ray or for a stream of rays. This crate knows no materials:
//! a [`HitFilter`] decides about candidate hits where a surface has holes.
//!
//! The kernels for AVX-512, AVX2 and NEON are chosen when the program runs, see [`Kernel`]; a scalar twin, written
//! with the formulas of `optics::intersect`, takes over elsewhere and checks them in tests.

// Loops over axes and lanes index several arrays at once.
#![allow(
    clippy::needless_range_loop,
    reason = "lanes and axes are numbered; several arrays go by one number"
)]

mod aabb;
mod behind;
mod blas;
mod build;
mod cover;
pub mod encode;
mod face;
mod handful;
mod huge_pages;
mod kernel;
mod layout;
mod ray;
mod simd;
mod streams;
mod tlas;

pub use aabb::Aabb;
pub use behind::Side;
pub use blas::{Blas, Geometry, Sphere};
pub use build::Quality;
pub use huge_pages::HugePages;
pub use kernel::Kernel;
pub use ray::{Hit, HitFilter, MISS, Masked, Opaque, Ray};
pub use streams::{HitColumns, HitRow, HitStream, RayColumns, RayLanes, RayStream};
pub use tlas::{Coherence, Instance, Tlas};
