//! The table for origin-plane culling: which children of which node are below the plane of a
//! triangle's side. `query/origin_plane_culling.rs` builds it.

use super::root_triangles::ALL_CHILDREN;
use crate::layout::{ChildRef, WIDTH};
use bytemuck::{Pod, Zeroable};
use std::hint::select_unpredictable;

/// A side of a triangle that a ray starts on, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct OriginSide(u32);

impl OriginSide {
    /// The ray does not start on a triangle.
    pub const NONE: OriginSide = OriginSide(u32::MAX);

    /// A side of the triangle with this id. Seen from the front (`is_front`), its corners are in
    /// counter-clockwise order.
    #[inline(always)]
    pub fn of(id: u32, is_front: bool) -> OriginSide {
        OriginSide(id.wrapping_mul(2) | u32::from(!is_front))
    }

    /// The other side of the same triangle.
    #[inline(always)]
    pub fn other(self) -> OriginSide {
        OriginSide(self.0 ^ 1)
    }
}

impl Default for OriginSide {
    fn default() -> Self {
        OriginSide::NONE
    }
}

/// Objects with more triangles or nodes have no table: indices must fit their fields.
pub(crate) const MAX_TRIANGLES: usize = 1 << 30;
pub(crate) const MAX_NODES: usize = 1 << 24;

/// A node and a mask of its children.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct CulledChildren(u32);

impl CulledChildren {
    /// No children.
    pub const NONE: CulledChildren = CulledChildren(0);

    /// The children of node `node` whose bits are set in `mask`.
    pub fn new(node: u32, mask: u32) -> CulledChildren {
        debug_assert!(node < MAX_NODES as u32 && mask < 1 << WIDTH);
        CulledChildren(node << WIDTH | mask)
    }

    /// The mask of culled children of `node`.
    #[inline(always)]
    pub fn mask_at(self, node: ChildRef) -> u32 {
        select_unpredictable(self.0 >> WIDTH == node, self.0 & ALL_CHILDREN, 0)
    }

    /// Node and mask.
    #[cfg(test)]
    pub fn parts(self) -> (usize, u32) {
        ((self.0 >> WIDTH) as usize, self.0 & ALL_CHILDREN)
    }
}

/// For each side of each triangle, the children that rays from that side cannot hit.
pub(crate) struct CullingTable(pub Vec<CulledChildren>);

impl CullingTable {
    /// A table without entries: nothing is culled.
    pub const EMPTY: CullingTable = CullingTable(Vec::new());

    /// Whether nothing is culled.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The children that rays from a side cannot hit.
    #[inline(always)]
    pub fn get(&self, side: OriginSide) -> CulledChildren {
        self.0.get(side.0 as usize).copied().unwrap_or(CulledChildren::NONE)
    }

    /// Memory on the heap, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.0.capacity() * size_of::<CulledChildren>()
    }
}
