//! Building a bounding volume hierarchy over boxes of primitives.
//!
//! 1. [`presplit`]: references to large, slanted triangles are split ([`Quality::High`], shaders).
//! 2. [`binned_sah`]: a binary tree by the binned surface area heuristic.
//! 3. [`reinsertion`]: the largest nodes are moved to better places (trees for shaders).
//! 4. [`collapse`]: the binary tree becomes an eight-wide one, stored depth first.
//!
//! [`builder`] runs steps 2 to 4. The input is a list of [`PrimitiveRef`]; the result,
//! [`WideTree`], has ranges of reordered references as leaves, of which the caller makes leaf
//! blocks.

mod binary_node;
mod binned_sah;
mod builder;
mod collapse;
mod presplit;
mod primitive_ref;
mod reinsertion;
mod settings;

pub(crate) use builder::{BinaryTree, build};
pub(crate) use collapse::WideTree;
pub(crate) use presplit::{EmptyArea, PresplitSettings, Presplits};
pub(crate) use primitive_ref::PrimitiveRef;
pub use settings::Quality;
pub(crate) use settings::{LeafCost, MAX_BRUTE_FORCE_BLOCKS, Settings};
