//! What waits to be visited while a tree is walked.

use super::STACK;
use crate::layout::{ChildRef, Node, WIDTH};
use crate::simd::Simd;
use std::mem::MaybeUninit;

/// Memory of a stack with room for `N` entries. It is never initialised as a whole: that would cost more than a ray.
pub(super) struct StackMemory<const N: usize> {
    distances: Lines<[u32; N]>,
    children: Lines<[ChildRef; N]>,
}

/// Something that begins with a cache line.
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
    /// `first + WIDTH` must not be beyond `N`. What has not been written must not be read.
    #[inline(always)]
    unsafe fn entries(&mut self, first: usize) -> Entries<'_> {
        debug_assert!(first + WIDTH <= N);
        // SAFETY: the entries are inside of the arrays, as the caller promises.
        unsafe {
            (
                &mut *self.distances.0.as_mut_ptr().cast::<u32>().add(first).cast::<[u32; WIDTH]>(),
                &mut *self.children.0.as_mut_ptr().cast::<ChildRef>().add(first).cast::<[ChildRef; WIDTH]>(),
            )
        }
    }
}

/// Children to be visited later, nearest on top, with the distances at which they were seen.
pub(super) struct Stack<'m> {
    memory: &'m mut StackMemory<STACK>,
    size: usize,
}

impl<'m> Stack<'m> {
    #[inline(always)]
    pub fn new(memory: &'m mut StackMemory<STACK>) -> Self {
        Stack { memory, size: 0 }
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
        // SAFETY: a path of at most MAX_DEPTH nodes leaves at most seven siblings each on the stack, and there is room for
        // one vector beyond (`validate` checks the depth in debug builds).
        let (distances, children) = unsafe { self.memory.entries(self.size) };
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

    /// The next child; if `ORDERED`, the next that was seen before `limit`.
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
            // The lane in the key's low bits makes the distance at most eight units in the last place larger.
            if !ORDERED || f32::from_bits(distance & !7) < limit {
                return Some(child);
            }
        }
        None
    }
}

/// What lies at the end of a structure's entries. No leaf has this number.
pub(super) const END: ChildRef = u32::MAX - 1;

/// Entries of a stack for both levels: the siblings along the deepest path of each, an end between them, the ends at the
/// bottom, and one vector more.
pub(super) const STREAM_STACK: usize = 2 * STACK;

/// The stack of a ray that is one of many under way: no operation has a branch. It never runs empty, but gives
/// [`END`] again and again.
pub(super) struct StreamStack<'m> {
    memory: &'m mut StackMemory<STREAM_STACK>,
    /// The uppermost entry, at least [`BOTTOM`].
    top: usize,
}

/// The last of the ends at the bottom. There is a cache line of them: vectors of entries may reach below the first, and the first
/// begins a line. What is written across two lines is slow to be read again, and few rays have so much waiting that it is.
const BOTTOM: usize = 2 * WIDTH - 1;

impl<'m> StreamStack<'m> {
    #[inline(always)]
    pub fn new(memory: &'m mut StackMemory<STREAM_STACK>) -> Self {
        for first in (0..=BOTTOM).step_by(WIDTH) {
            // SAFETY: it is the beginning, and only written.
            let (distances, children) = unsafe { memory.entries(first) };
            *distances = [0; WIDTH];
            *children = [END; WIDTH];
        }
        StreamStack { memory, top: BOTTOM }
    }

    /// Forgets everything.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.top = BOTTOM;
    }

    /// Remembers the children in `inside`, if `ORDERED` with the nearest on top. `near` are their distances.
    #[inline(always)]
    pub fn push<S: Simd, const ORDERED: bool>(&mut self, s: S, node: &Node, near: S::F, inside: S::M) {
        // SAFETY: as in `Stack::descend`, for both levels; see `STREAM_STACK`. The entries are only written.
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

    /// Remembers an end: what is above it belongs to another structure.
    #[inline(always)]
    pub fn push_end<S: Simd>(&mut self, s: S) {
        // SAFETY: as in `push`.
        let (distances, children) = unsafe { self.memory.entries(self.top + 1) };
        s.store_u(s.splat_u(0), distances);
        s.store_u(s.splat_u(END), children);
        self.top += 1;
    }

    /// Takes the uppermost entry.
    #[inline(always)]
    pub fn take(&mut self) -> ChildRef {
        // SAFETY: all entries up to `top` have been written, and `top` is below `STREAM_STACK`, as in `push`.
        let child = unsafe { *self.memory.children.0.as_ptr().cast::<ChildRef>().add(self.top) };
        self.top -= usize::from(self.top > BOTTOM);
        child
    }

    /// Forgets the children that are not nearer than `limit`.
    #[inline(always)]
    pub fn cull<S: Simd>(&mut self, s: S, limit: f32) {
        // The lane in a key's low bits makes the distance at most eight units in the last place larger.
        let limit = s.splat(limit * (1.0 + 8.0 * f32::EPSILON));
        let end = self.top + 1;
        // Whole vectors up to the end; the first may begin among the ends at the bottom, which stay where they are.
        let mut at = BOTTOM + 1 - ((BOTTOM + 1).wrapping_sub(end) & (WIDTH - 1));
        let mut kept = at;
        while at < end {
            // SAFETY: `at` is at most `end - WIDTH`, and all entries before `end` have been written.
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
