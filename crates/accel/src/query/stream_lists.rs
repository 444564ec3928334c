//! RayLists of the rays in flight, by what they do next.

use crate::layout::{ChildRef, INSTANCE, LEAF};

/// Rays in flight. With fewer, rays wait for their own results; with more, their states exceed the
/// first-level cache.
pub(super) const IN_FLIGHT: usize = 24;

/// Index of a ray in flight.
#[derive(Clone, Copy, Default)]
pub(super) struct RayId(u32);

impl RayId {
    /// All rays in flight.
    pub fn all() -> impl Iterator<Item = RayId> {
        (0..IN_FLIGHT as u32).map(RayId)
    }

    /// The state of this ray.
    #[inline(always)]
    pub fn select<T>(self, in_flight: &mut [T; IN_FLIGHT]) -> &mut T {
        // SAFETY: indices are below `IN_FLIGHT`: they come from `all`, or are zero.
        unsafe { in_flight.get_unchecked_mut(self.0 as usize) }
    }
}

/// Rays of a list. [`ListLengths`] has its length.
#[derive(Default)]
pub(super) struct RayList([RayId; IN_FLIGHT]);

impl RayList {
    #[inline(always)]
    pub fn get(&self, at: usize) -> RayId {
        debug_assert!(at < IN_FLIGHT);
        // SAFETY: a list has at most `IN_FLIGHT` rays, because a ray is in one list at a time.
        unsafe { *self.0.get_unchecked(at) }
    }

    /// Writes a ray that is in no list to position `at`.
    #[inline(always)]
    pub fn put(&mut self, at: usize, id: RayId) {
        debug_assert!(at < IN_FLIGHT);
        // SAFETY: `at` is the length of a list of other rays, so it is below `IN_FLIGHT`.
        unsafe { *self.0.get_unchecked_mut(at) = id };
    }
}

/// The lists of one round.
#[derive(Default)]
pub(super) struct RayLists {
    /// Rays at nodes.
    pub nodes: RayList,
    /// Rays at leaves of objects.
    pub leaves: RayList,
    /// Those of `leaves` that have closer hits.
    pub found: RayList,
    /// All other rays: at a leaf of the top level, or at an end.
    pub others: RayList,
}

/// Lengths of the lists, in a struct of their own so that they stay in registers.
#[derive(Clone, Copy, Default)]
pub(super) struct ListLengths {
    pub nodes: usize,
    pub leaves: usize,
    pub others: usize,
}

impl RayLists {
    /// Puts a ray that visits `child` next into its list. There is no branch: the ray is written
    /// behind the end of each list, and one length is increased.
    #[inline(always)]
    pub fn insert(&mut self, lengths: &mut ListLengths, id: RayId, child: ChildRef) {
        let (is_node, is_other) = (child < LEAF, child >= INSTANCE);
        self.nodes.put(lengths.nodes, id);
        lengths.nodes += usize::from(is_node);
        self.leaves.put(lengths.leaves, id);
        lengths.leaves += usize::from(!is_node & !is_other);
        self.others.put(lengths.others, id);
        lengths.others += usize::from(is_other);
    }
}
