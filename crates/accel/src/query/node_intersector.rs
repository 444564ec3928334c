//! The slab test: a ray and the eight boxes of a node.

use super::lane_vectors::splats;
use super::slabs::Slabs;
use crate::layout::{ChildRef, Node, NodePlane};
use crate::simd::Simd;

/// Intersects a ray with nodes: [`Slabs`] in all lanes.
pub(super) struct NodeIntersector<S: Simd> {
    inverse: [S::F; 3],
    near_offset: [S::F; 3],
    far_offset: [S::F; 3],
    near_plane: [NodePlane; 3],
    t_min: S::F,
}

impl<S: Simd> NodeIntersector<S> {
    #[inline(always)]
    pub fn new(s: S, slabs: &Slabs) -> Self {
        NodeIntersector {
            inverse: splats(s, slabs.inverse),
            near_offset: splats(s, slabs.near_offset),
            far_offset: splats(s, slabs.far_offset),
            near_plane: slabs.near_plane,
            t_min: s.splat(slabs.t_min),
        }
    }

    /// The distances at which the ray enters the child boxes, and the mask of boxes that it hits
    /// before `t_max`.
    #[inline(always)]
    pub fn intersect(&self, s: S, node: &Node, t_max: S::F) -> (S::F, S::M) {
        let [i, n, f] = [&self.inverse, &self.near_offset, &self.far_offset];
        let [x, y, z] = self.near_plane;
        let x0 = s.mul_add(s.load(node.plane(x)), i[0], n[0]);
        let y0 = s.mul_add(s.load(node.plane(y)), i[1], n[1]);
        let z0 = s.mul_add(s.load(node.plane(z)), i[2], n[2]);
        let x1 = s.mul_add(s.load(node.plane(x.opposite())), i[0], f[0]);
        let y1 = s.mul_add(s.load(node.plane(y.opposite())), i[1], f[1]);
        let z1 = s.mul_add(s.load(node.plane(z.opposite())), i[2], f[2]);
        // An axis that gives NaN (overflow) has no effect: `max` and `min` return the second
        // operand.
        let near = s.max(s.max(x0, y0), s.max(z0, self.t_min));
        let far = s.min(s.min(x1, y1), s.min(z1, t_max));
        (near, s.le(near, far))
    }
}

/// The node that `child` refers to.
#[inline(always)]
pub(super) fn node(nodes: &[Node], child: ChildRef) -> &Node {
    debug_assert!((child as usize) < nodes.len());
    // SAFETY: node references are made by the builder and index the nodes of this slice (`validate`
    // checks them in debug builds).
    unsafe { nodes.get_unchecked(child as usize) }
}
