//! Encoding for the GPU: a compressed eight-wide hierarchy in three plain arrays.
//!
//! [`EncodedScene::build`] makes nodes, primitives and instances of the objects and their
//! instances. Shaders traverse them as their scalar twins [`EncodedScene::closest`] and
//! [`EncodedScene::any`] do. [`EncodedNode`] documents the format, `traversal.rs` the traversal.
//!
//! The trees differ from those of [`crate::Blas`]: leaves hold one to three primitives, which are
//! tested one by one. Large triangles among small ones are split, so that they are in several
//! leaves.

mod flatten;
mod geometry_ref;
mod instance;
mod node;
mod object;
mod object_tree;
mod primitive;
mod scene;
mod traversal;
mod tree_layout;

pub use instance::{EncodedInstance, INSTANCE_IDENTITY, INSTANCE_SPHERES};
pub use node::EncodedNode;
pub use object::{Object, ObjectInfo, SphereGeometry};
pub use primitive::{EncodedPrimitive, OWNER_SPHERE};
pub use scene::EncodedScene;
pub use traversal::{EncodedHit, TraversalCounts};
