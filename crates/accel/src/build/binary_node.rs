//! The binary tree that the builder makes first.

use super::primitive_ref::Bounds;

/// A node of the binary tree. Nodes are stored depth first: the left child follows its parent.
#[derive(Clone, Copy)]
pub(super) struct BinaryNode {
    pub bounds: Bounds,
    /// The range of primitives below.
    pub first: u32,
    pub count: u32,
    /// Offset of the right child from this node; 0 for a leaf.
    pub right: u32,
    /// The lowest cost of the subtree as `i + 1` children of one wide node. See
    /// [`super::collapse::costs`].
    pub cost: [f32; 7],
}
