//! Queries: closest hit and any hit, for single rays, coherent packets and streams.
//!
//! From top to bottom:
//!
//! - [`methods`]: the methods of `Blas` and `Tlas`; [`dispatch`]: the choice of instruction set;
//!   [`entry_points`]: one set of kernels for each; [`scalar`]: the kernels that tests compare
//!   with.
//! - [`single`]: one ray. [`packet`]: up to 32 coherent rays. [`stream`]: any rays, several in
//!   flight; its rays wait in [`ray_queue`] after [`root_stage`].
//! - [`node_intersector`], [`triangle_intersector`], [`sphere_intersector`], [`traversal_stack`]:
//!   the parts that they share.

mod brute_force;
mod closest_hit;
mod dispatch;
mod entry_points;
mod hit_sink;
mod lane_vectors;
mod leaf_intersector;
mod methods;
mod node_intersector;
mod packet;
mod ray_queue;
mod ray_setup;
mod ray_stream;
mod root_stage;
mod scalar;
mod single;
mod slabs;
mod sphere_intersector;
mod stream;
mod stream_lists;
mod stream_output;
mod traversal_stack;
mod triangle_intersector;

pub use hit_sink::{Hit16, HitColumns, HitSink};
pub use methods::Coherence;
pub use ray_stream::{Ray8, RayColumns, RayStream, RayTimes};
