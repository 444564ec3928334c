//! Walking a tree of eight boxes a node, for any instruction set.

use super::{STACK, Slabs};
use crate::layout::{ChildRef, EMPTY, LEAF, Node, WIDTH};
use crate::simd::Simd;
use std::mem::MaybeUninit;

/// What a ray needs for testing boxes, in all lanes.
pub(super) struct Boxes<S: Simd> {
    inverse: [S::F; 3],
    near_offset: [S::F; 3],
    far_offset: [S::F; 3],
    near_side: [usize; 3],
    t_min: S::F,
}

impl<S: Simd> Boxes<S> {
    #[inline(always)]
    pub fn new(s: S, slabs: &Slabs) -> Self {
        Boxes {
            inverse: super::leaves::splats(s, slabs.inverse),
            near_offset: super::leaves::splats(s, slabs.near_offset),
            far_offset: super::leaves::splats(s, slabs.far_offset),
            near_side: slabs.near_side,
            t_min: s.splat(slabs.t_min),
        }
    }

    /// Where the ray enters each child's box, and for which of them that is before it leaves it or ends at `t_max`.
    #[inline(always)]
    pub fn meet(&self, s: S, node: &Node, t_max: S::F) -> (S::F, S::M) {
        let [i, n, f] = [&self.inverse, &self.near_offset, &self.far_offset];
        let [near_x, near_y, near_z] = self.near_side;
        let x0 = s.mul_add(s.load(&node.planes[0][near_x & 1]), i[0], n[0]);
        let y0 = s.mul_add(s.load(&node.planes[1][near_y & 1]), i[1], n[1]);
        let z0 = s.mul_add(s.load(&node.planes[2][near_z & 1]), i[2], n[2]);
        let x1 = s.mul_add(s.load(&node.planes[0][(near_x & 1) ^ 1]), i[0], f[0]);
        let y1 = s.mul_add(s.load(&node.planes[1][(near_y & 1) ^ 1]), i[1], f[1]);
        let z1 = s.mul_add(s.load(&node.planes[2][(near_z & 1) ^ 1]), i[2], f[2]);
        // An axis that gives NaN (overflow) drops out, because `max` and `min` return the second operand then.
        let near = s.max(s.max(x0, y0), s.max(z0, self.t_min));
        let far = s.min(s.min(x1, y1), s.min(z1, t_max));
        (near, s.le(near, far))
    }
}

/// Memory of a [`Stack`] with room for `N` entries. It is never initialised as a whole: that would cost more than a ray.
pub(super) struct StackMemory<const N: usize> {
    distances: MaybeUninit<[u32; N]>,
    children: MaybeUninit<[ChildRef; N]>,
}

impl<const N: usize> StackMemory<N> {
    pub const UNINIT: Self =
        StackMemory { distances: MaybeUninit::uninit(), children: MaybeUninit::uninit() };
}

/// Children to be visited later, nearest on top, with the distances at which they were seen.
pub(super) struct Stack<'m, const N: usize> {
    memory: &'m mut StackMemory<N>,
    size: usize,
}

impl<'m, const N: usize> Stack<'m, N> {
    #[inline(always)]
    pub fn new(memory: &'m mut StackMemory<N>) -> Self {
        Stack { memory, size: 0 }
    }

    #[inline(always)]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Forgets everything.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.size = 0;
    }

    /// Remembers the children in `inside` (`bits` of it, not zero) but one, and returns that one: the nearest if
    /// `ORDERED`. `near` are their distances.
    #[inline(always)]
    pub fn descend<S: Simd, const ORDERED: bool>(
        &mut self,
        s: S,
        node: &Node,
        near: S::F,
        inside: S::M,
        bits: u32,
    ) -> ChildRef {
        if bits & (bits - 1) == 0 {
            return node.children[bits.trailing_zeros() as usize & 7];
        }
        debug_assert!(self.size + WIDTH <= N);
        // SAFETY: a path of at most MAX_DEPTH nodes leaves at most seven siblings each on the stack, for each level of
        // structures that shares it, and `N` has room for one vector beyond (`validate` checks the depth in debug
        // builds).
        let (distances, children) = unsafe {
            (
                &mut *self.memory.distances.as_mut_ptr().cast::<u32>().add(self.size).cast::<[u32; WIDTH]>(),
                &mut *self.memory.children.as_mut_ptr().cast::<u32>().add(self.size).cast::<[u32; WIDTH]>(),
            )
        };
        self.size += bits.count_ones() as usize - 1;
        if ORDERED {
            let keys = s.keys(near, inside);
            // The nearest child is known long before the others are sorted.
            let nearest = node.children[s.least_key(keys) as usize & 7];
            let sorted = s.sorted(keys);
            s.store_u(sorted, distances);
            s.store_u(s.permute(s.load_u(&node.children), sorted), children);
            nearest
        } else {
            s.store_u(s.compress(s.load_u(&node.children), inside, bits), children);
            node.children[(31 - bits.leading_zeros()) as usize & 7]
        }
    }

    /// The next child above entry `base`; if `ORDERED`, the next that was seen before `limit`.
    #[inline(always)]
    pub fn pop<const ORDERED: bool>(&mut self, base: usize, limit: f32) -> Option<ChildRef> {
        while self.size > base {
            self.size -= 1;
            // SAFETY: the entries below the old `size` have been written.
            let (child, distance) = unsafe {
                let child = *self.memory.children.as_ptr().cast::<ChildRef>().add(self.size);
                let distance =
                    if ORDERED { *self.memory.distances.as_ptr().cast::<u32>().add(self.size) } else { 0 };
                (child, distance)
            };
            // The lane in the key's low bits makes the distance at most eight units in the last place larger.
            if !ORDERED || f32::from_bits(distance & !7) < limit {
                return Some(child);
            }
        }
        None
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
    let mut memory = StackMemory::<STACK>::UNINIT;
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
            if visitor.leaf(s, (child & !LEAF) as usize) {
                return true;
            }
            if V::ORDERED {
                t_max = s.splat(visitor.t_max());
            }
        }
        let limit = visitor.t_max();
        let next = if V::ORDERED { stack.pop::<true>(0, limit) } else { stack.pop::<false>(0, limit) };
        match next {
            Some(c) => child = c,
            None => return false,
        }
    }
}
