//! Walking a tree of eight boxes a node, for any instruction set.

use super::Slabs;
use super::stack::{Stack, StackMemory};
use crate::layout::{ChildRef, EMPTY, LEAF, Node, Plane, leaf_index};
use crate::simd::Simd;

/// What a ray needs for testing boxes, in all lanes.
pub(super) struct Boxes<S: Simd> {
    inverse: [S::F; 3],
    near_offset: [S::F; 3],
    far_offset: [S::F; 3],
    near_plane: [Plane; 3],
    t_min: S::F,
}

impl<S: Simd> Boxes<S> {
    #[inline(always)]
    pub fn new(s: S, slabs: &Slabs) -> Self {
        Boxes {
            inverse: super::leaves::splats(s, slabs.inverse),
            near_offset: super::leaves::splats(s, slabs.near_offset),
            far_offset: super::leaves::splats(s, slabs.far_offset),
            near_plane: slabs.near_plane,
            t_min: s.splat(slabs.t_min),
        }
    }

    /// Where the ray enters each child's box, and for which of them that is before it leaves it or ends at `t_max`.
    #[inline(always)]
    pub fn meet(&self, s: S, node: &Node, t_max: S::F) -> (S::F, S::M) {
        let [i, n, f] = [&self.inverse, &self.near_offset, &self.far_offset];
        let [x, y, z] = self.near_plane;
        let x0 = s.mul_add(s.load(node.plane(x)), i[0], n[0]);
        let y0 = s.mul_add(s.load(node.plane(y)), i[1], n[1]);
        let z0 = s.mul_add(s.load(node.plane(z)), i[2], n[2]);
        let x1 = s.mul_add(s.load(node.plane(x.opposite())), i[0], f[0]);
        let y1 = s.mul_add(s.load(node.plane(y.opposite())), i[1], f[1]);
        let z1 = s.mul_add(s.load(node.plane(z.opposite())), i[2], f[2]);
        // An axis that gives NaN (overflow) drops out, because `max` and `min` return the second operand then.
        let near = s.max(s.max(x0, y0), s.max(z0, self.t_min));
        let far = s.min(s.min(x1, y1), s.min(z1, t_max));
        (near, s.le(near, far))
    }
}

/// The node that `child` refers to.
#[inline(always)]
pub(super) fn node(nodes: &[Node], child: ChildRef) -> &Node {
    debug_assert!((child as usize) < nodes.len());
    // SAFETY: references to nodes are made by the builder, which numbers the nodes of this very slice (`validate`
    // checks them in debug builds).
    unsafe { nodes.get_unchecked(child as usize) }
}

/// What happens at leaves.
pub(super) trait Visitor<S: Simd> {
    /// Whether children are visited in order of distance.
    const ORDERED: bool;

    /// Where the search ends by now.
    fn t_max(&self) -> f32;

    /// Looks into leaf `index`. True ends the traversal.
    fn leaf(&mut self, s: S, index: usize) -> bool;
}

/// Visits the leaves that the ray meets, until a visit says that it is enough.
#[inline(always)]
pub(super) fn walk<S: Simd, V: Visitor<S>>(
    s: S,
    nodes: &[Node],
    root: ChildRef,
    slabs: &Slabs,
    visitor: &mut V,
) -> bool {
    let mut memory = StackMemory::UNINIT;
    let mut stack = Stack::new(&mut memory);
    let boxes = Boxes::new(s, slabs);
    let mut t_max = s.splat(visitor.t_max());
    let mut child = root;
    loop {
        if child & LEAF == 0 {
            let node = node(nodes, child);
            let (near, inside) = boxes.meet(s, node, t_max);
            let bits = s.bits(inside);
            if bits != 0 {
                child = if V::ORDERED {
                    stack.descend::<S, true>(s, node, near, inside, bits)
                } else {
                    stack.descend::<S, false>(s, node, near, inside, bits)
                };
                continue;
            }
        } else if child != EMPTY {
            // Coordinates near the end of the range of floats may let a ray into unused boxes.
            if visitor.leaf(s, leaf_index(child)) {
                return true;
            }
            if V::ORDERED {
                t_max = s.splat(visitor.t_max());
            }
        }
        let limit = visitor.t_max();
        let next = if V::ORDERED { stack.pop::<true>(limit) } else { stack.pop::<false>(limit) };
        match next {
            Some(c) => child = c,
            None => return false,
        }
    }
}
