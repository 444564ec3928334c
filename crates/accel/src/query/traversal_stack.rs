//! Stacks of children to visit.

use crate::layout::{ChildRef, MAX_DEPTH, Node, WIDTH};
use crate::simd::Simd;
use std::mem::MaybeUninit;

/// Entries for the siblings along the deepest path, and for one vector more.
pub(super) const STACK_SIZE: usize = MAX_DEPTH * 7 + 16;

/// Memory of a stack with `N` entries. It is not initialised, which would take longer than a query.
pub(super) struct StackMemory<const N: usize> {
    distances: Lines<[u32; N]>,
    children: Lines<[ChildRef; N]>,
}

/// Alignment to cache lines.
#[repr(align(64))]
struct Lines<T>(MaybeUninit<T>);

/// A vector of entries: distances and children.
type Entries<'m> = (&'m mut [u32; WIDTH], &'m mut [ChildRef; WIDTH]);

impl<const N: usize> StackMemory<N> {
    pub const UNINIT: Self =
        StackMemory { distances: Lines(MaybeUninit::uninit()), children: Lines(MaybeUninit::uninit()) };

    /// The entries from `first` on.
    ///
    /// # Safety
    ///
    /// `first + WIDTH` must be at most `N`. Entries must be written before they are read.
    #[inline(always)]
    unsafe fn entries(&mut self, first: usize) -> Entries<'_> {
        debug_assert!(first + WIDTH <= N);
        // SAFETY: the caller promises that the entries are in the arrays.
        unsafe {
            (
                &mut *self.distances.0.as_mut_ptr().cast::<u32>().add(first).cast::<[u32; WIDTH]>(),
                &mut *self.children.0.as_mut_ptr().cast::<ChildRef>().add(first).cast::<[ChildRef; WIDTH]>(),
            )
        }
    }
}

/// The stack of a single ray: children to visit, closest on top, with their distances.
pub(super) struct Stack<'m> {
    memory: &'m mut StackMemory<STACK_SIZE>,
    size: usize,
}

impl<'m> Stack<'m> {
    #[inline(always)]
    pub fn new(memory: &'m mut StackMemory<STACK_SIZE>) -> Self {
        Stack { memory, size: 0 }
    }

    /// Pushes the children in `inside` (as `bits`, not zero) except one, which is returned: the
    /// closest if `ORDERED`. `near` are their distances.
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
        // SAFETY: each of at most MAX_DEPTH nodes on a path leaves at most seven siblings on the
        // stack, and one more vector fits (`validate` checks the depth in debug builds).
        let (distances, children) = unsafe { self.memory.entries(self.size) };
        self.size += bits.count_ones() as usize - 1;
        if ORDERED {
            let keys = s.keys(near, inside);
            // The closest child is known long before the others are sorted.
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

    /// Pops the next child; if `ORDERED`, the next one closer than `limit`.
    #[inline(always)]
    pub fn pop<const ORDERED: bool>(&mut self, limit: f32) -> Option<ChildRef> {
        while self.size > 0 {
            self.size -= 1;
            // SAFETY: the entries below the old `size` have been written.
            let (child, distance) = unsafe {
                let child = *self.memory.children.0.as_ptr().cast::<ChildRef>().add(self.size);
                let distance =
                    if ORDERED { *self.memory.distances.0.as_ptr().cast::<u32>().add(self.size) } else { 0 };
                (child, distance)
            };
            // The key's low bits hold the lane.
            if !ORDERED || f32::from_bits(distance & !7) < limit {
                return Some(child);
            }
        }
        None
    }
}

/// Marks the end of the entries of one level. No leaf has this index.
pub(super) const END: ChildRef = u32::MAX - 1;

/// Entries for both levels: siblings along the deepest path of each, an [`END`] between the levels,
/// the ends at the bottom, and one vector more.
pub(super) const STREAM_STACK_SIZE: usize = 2 * STACK_SIZE;

/// The stack of a ray in a stream. Operations have no branches. An empty stack returns [`END`]
/// again and again.
pub(super) struct StreamStack<'m> {
    memory: &'m mut StackMemory<STREAM_STACK_SIZE>,
    /// Index of the top entry, at least [`BOTTOM`].
    top: usize,
}

/// The last of the ends at the bottom. They fill a cache line, so that the first entry starts a
/// cache line and vectors of entries may reach below it. Stores that cross cache lines are slow to
/// read back; most stacks stay in one line.
const BOTTOM: usize = 2 * WIDTH - 1;

impl<'m> StreamStack<'m> {
    #[inline(always)]
    pub fn new(memory: &'m mut StackMemory<STREAM_STACK_SIZE>) -> Self {
        for first in (0..=BOTTOM).step_by(WIDTH) {
            // SAFETY: the first entries exist and are only written.
            let (distances, children) = unsafe { memory.entries(first) };
            *distances = [0; WIDTH];
            *children = [END; WIDTH];
        }
        StreamStack { memory, top: BOTTOM }
    }

    /// Removes all entries.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.top = BOTTOM;
    }

    /// Pushes the children in `inside`; if `ORDERED`, the closest on top. `near` are their
    /// distances.
    #[inline(always)]
    pub fn push<S: Simd, const ORDERED: bool>(&mut self, s: S, node: &Node, near: S::F, inside: S::M) {
        // SAFETY: as in `Stack::descend`, for both levels; see `STREAM_STACK_SIZE`. The entries are
        // only written.
        let (distances, children) = unsafe { self.memory.entries(self.top + 1) };
        let bits = s.bits(inside);
        let all = s.load_u(&node.children);
        if ORDERED {
            let sorted = s.sorted(s.keys(near, inside));
            s.store_u(sorted, distances);
            s.store_u(s.permute(all, sorted), children);
        } else {
            s.store_u(s.compress(all, inside, bits), children);
        }
        self.top += bits.count_ones() as usize;
    }

    /// Pushes an end: entries above it belong to the other level.
    #[inline(always)]
    pub fn push_end<S: Simd>(&mut self, s: S) {
        // SAFETY: as in `push`.
        let (distances, children) = unsafe { self.memory.entries(self.top + 1) };
        s.store_u(s.splat_u(0), distances);
        s.store_u(s.splat_u(END), children);
        self.top += 1;
    }

    /// Pops the top entry.
    #[inline(always)]
    pub fn pop(&mut self) -> ChildRef {
        // SAFETY: all entries up to `top` have been written, and `top` is below
        // `STREAM_STACK_SIZE`, as in `push`.
        let child = unsafe { *self.memory.children.0.as_ptr().cast::<ChildRef>().add(self.top) };
        self.top -= usize::from(self.top > BOTTOM);
        child
    }

    /// Removes children that are not closer than `limit`.
    #[inline(always)]
    pub fn cull<S: Simd>(&mut self, s: S, limit: f32) {
        // A key's low bits hold the lane, which adds at most eight units in the last place.
        let limit = s.splat(limit * (1.0 + 8.0 * f32::EPSILON));
        let end = self.top + 1;
        // Whole vectors up to the end. The first may start among the ends at the bottom, which are
        // kept.
        let mut at = BOTTOM + 1 - ((BOTTOM + 1).wrapping_sub(end) & (WIDTH - 1));
        let mut kept = at;
        while at < end {
            // SAFETY: `at` is at most `end - WIDTH`, and all entries before `end` have been
            // written.
            let (distances, children) = unsafe { self.memory.entries(at) };
            let (distances, children) = (s.load_u(distances), s.load_u(children));
            let nearer = s.lt(s.bits_as_f(distances), limit);
            let bits = s.bits(nearer);
            // SAFETY: `kept` is at most `at`.
            let (to_distances, to_children) = unsafe { self.memory.entries(kept) };
            s.store_u(s.compress(distances, nearer, bits), to_distances);
            s.store_u(s.compress(children, nearer, bits), to_children);
            kept += bits.count_ones() as usize;
            at += WIDTH;
        }
        self.top = kept - 1;
    }
}
