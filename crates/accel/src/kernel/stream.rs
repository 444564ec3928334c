//! Many rays under way at once.
//!
//! A ray alone mostly waits: for memory, for the result of the last comparison, and for what was begun on a wrong guess. So
//! several rays are under way, and all that are at nodes take a step, one after the other, then all that are at leaves.
//! In such a loop no step waits for the one before, the memory that a ray needs next has been asked for a round ago,
//! and no branch depends on where a ray goes: whether its next place is a node or a leaf decides in which list it is entered.
//! Each ray takes the steps that it would take alone.

use super::leaves::{Leaf, Shear, Spheres, Triangles};
use super::setup::{EightRays, Setup};
use super::stack::{END, STREAM_STACK, StackMemory, StreamStack};
use super::tree::{Boxes, node};
use super::wide::{tiny_any, tiny_closest};
use super::{Best, Slabs};
use crate::blas::{Blas, Shape};
use crate::layout::{ChildRef, EMPTY, INSTANCE, LEAF, Node, SphereBlock, TriangleBlock, WIDTH, leaf_index};
use crate::ray::{Hit, HitFilter, Ray};
use crate::simd::Simd;
use crate::streams::{RayLanes, RayStream};
use crate::tlas::Tlas;

/// Rays under way. Fewer wait for each other's results, more push each other's state out of the first cache.
const UNDER_WAY: usize = 16;

/// A ray on its way through both levels, or through the only object.
#[repr(C, align(64))]
struct Traveller<'a> {
    /// For `nodes` and the object's triangles.
    setup: Setup,
    /// The nodes that `child` counts.
    nodes: &'a [Node],
    /// What is to be looked at next.
    child: ChildRef,
    stack: StreamStack<'a>,
    best: Best,
    /// Whether the ray is in an object.
    in_object: bool,
    /// The object's leaves: either triangles or spheres.
    triangles: &'a [TriangleBlock],
    spheres: &'a [SphereBlock],
    instance: u32,
    /// Distances, infinite where nothing is met, and barycentric coordinates in the leaf that was tested last.
    met: [[f32; WIDTH]; 3],
    /// Number of the ray in its stream.
    number: usize,
    /// For the boxes of the upper level, while the ray is in an object.
    upper: Slabs,
    /// The ray in the space of its object, if that has spheres. Not otherwise: to copy what has just been written number by number
    /// would take as long as a step.
    ray: Ray,
}

impl<'a> Traveller<'a> {
    fn new(tlas: &'a Tlas, memory: &'a mut StackMemory<STREAM_STACK>) -> Self {
        let setup = Setup::nothing();
        Traveller {
            setup,
            nodes: &tlas.nodes,
            child: END,
            stack: StreamStack::new(memory),
            best: setup.best(),
            in_object: false,
            triangles: &[],
            spheres: &[],
            instance: 0,
            met: [[0.0; WIDTH]; 3],
            number: 0,
            upper: setup.slabs,
            ray: Ray::new([0.0; 3], [0.0, 0.0, 1.0]),
        }
    }

    /// Begins with ray `number` at the top, or in the only object. `setup` is for that.
    #[inline(always)]
    fn start(
        &mut self,
        number: usize,
        setup: &Setup,
        tlas: &'a Tlas,
        only: Option<&'a Blas>,
        rays: &(impl RayStream + ?Sized),
    ) {
        self.number = number;
        self.setup = *setup;
        self.best = setup.best();
        self.stack.clear();
        match only {
            Some(object) => self.enter(object, 0, || rays.ray(number)),
            None => {
                self.in_object = false;
                self.nodes = &tlas.nodes;
                self.child = tlas.root;
            }
        }
    }

    /// Goes to the root of an object, for which the ray has been set up. `ray` is asked for if there are spheres.
    #[inline(always)]
    fn enter(&mut self, object: &'a Blas, instance: u32, ray: impl FnOnce() -> Ray) {
        self.nodes = &object.nodes;
        (self.triangles, self.spheres) = match &object.shape {
            Shape::Triangles(blocks) => (&blocks[..], &[][..]),
            Shape::Spheres(blocks) => {
                self.ray = ray();
                (&[][..], &blocks[..])
            }
        };
        self.child = object.root;
        self.in_object = true;
        self.instance = instance;
    }

    /// Looks at the boxes of the node that the ray is at.
    #[inline(always)]
    fn visit_node<S: Simd, const ANY: bool>(&mut self, s: S) {
        let node = node(self.nodes, self.child);
        let (near, inside) = Boxes::new(s, &self.setup.slabs).meet(s, node, s.splat(self.best.t_max));
        if ANY {
            self.stack.push::<S, false>(s, node, near, inside);
        } else {
            self.stack.push::<S, true>(s, node, near, inside);
        }
        self.child = self.stack.take();
    }

    /// Tests the leaf that the ray is at, and keeps what counts.
    #[inline(always)]
    fn visit_leaf<S: Simd, F: HitFilter, const ANY: bool>(&mut self, s: S, filter: &F) {
        let index = leaf_index(self.child);
        let found = if self.spheres.is_empty() {
            self.test::<S, F, ANY>(s, &Triangles::new(s, self.triangles, &self.setup.shear), index, filter)
        } else {
            self.test::<S, F, ANY>(s, &Spheres::new(s, self.spheres, &self.ray), index, filter)
        };
        if found {
            self.keep_what_was_found::<S, ANY>(s);
        }
    }

    /// As [`Traveller::visit_leaf`] for nearest hits that all count, but without a branch on what is found. True if there are nearer hits:
    /// they are left to [`Traveller::keep_nearest`].
    #[inline(always)]
    fn look_into_leaf<S: Simd, F: HitFilter>(&mut self, s: S, filter: &F) -> bool {
        if !self.spheres.is_empty() {
            self.visit_leaf::<S, F, false>(s, filter);
            return false;
        }
        let triangles = Triangles::new(s, self.triangles, &self.setup.shear);
        let (met, mask) = triangles.meet_leaf(s, leaf_index(self.child), self.best.t_max);
        s.store(s.select(mask, s.splat(f32::INFINITY), met.t), &mut self.met[0]);
        s.store(met.u, &mut self.met[1]);
        s.store(met.v, &mut self.met[2]);
        s.bits(mask) != 0
    }

    /// Keeps the nearest of the hits that [`Traveller::look_into_leaf`] has found.
    #[inline(always)]
    fn keep_nearest<S: Simd>(&mut self, s: S) {
        let ts = s.load(&self.met[0]);
        let t = s.least(ts);
        let lane = s.bits(s.le(ts, s.splat(t))).trailing_zeros() as usize % WIDTH;
        let primitive = self.triangles[leaf_index(self.child)].ids[lane];
        let (u, v) = (self.met[1][lane], self.met[2][lane]);
        self.best = Best { hit: Hit { t, u, v, primitive, instance: self.instance }, t_max: t };
        self.stack.cull(s, t);
    }

    /// Goes on where the ray has not been yet.
    #[inline(always)]
    fn go_on(&mut self) {
        self.child = self.stack.take();
    }

    /// Whether a leaf has a hit that counts.
    #[inline(always)]
    fn test<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        leaves: &impl Leaf<S>,
        index: usize,
        filter: &F,
    ) -> bool {
        let (instance, best) = (self.instance, &mut self.best);
        let before = best.t_max;
        let mut any = false;
        leaves.test(s, index, before, |candidates, ids| {
            if ANY {
                any |= candidates.any(s, ids, instance, filter);
            } else {
                candidates.keep_nearest(s, ids, instance, filter, best);
            }
        });
        any || best.t_max < before
    }

    /// Forgets what need not be visited any more after a hit.
    #[inline(always)]
    fn keep_what_was_found<S: Simd, const ANY: bool>(&mut self, s: S) {
        if ANY {
            // Some hit, no matter which.
            self.best.hit.primitive = 0;
            self.stack.clear();
            self.in_object = false;
        } else {
            self.stack.cull(s, self.best.t_max);
        }
    }

    /// Where the ray is neither at a node nor at an object's leaf: at a leaf of the upper level, or at an end. True if the ray
    /// has been everywhere.
    #[inline(always)]
    fn change_level<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        tlas: &'a Tlas,
        only: Option<&'a Blas>,
        rays: &(impl RayStream + ?Sized),
        filter: &F,
    ) -> bool {
        if self.child == END {
            if only.is_some() || !self.in_object {
                return true;
            }
            self.in_object = false;
            self.nodes = &tlas.nodes;
            self.setup.slabs = self.upper;
        } else if self.child != EMPTY {
            // Coordinates near the end of the range of floats may let a ray into unused boxes.
            let index = leaf_index(self.child);
            let world = rays.ray(self.number);
            if let Some((object, instance, ray)) = tlas.enter(index, &world, filter.ray_mask()) {
                let Some(blocks) = object.tiny().filter(|_| F::OPAQUE) else {
                    self.upper = self.setup.slabs;
                    self.stack.push_end(s);
                    // Not as a whole: to copy what has just been written number by number would take as long as a step.
                    self.setup.slabs = Slabs::new(&ray, &object.extent);
                    self.setup.shear = Shear::new(&ray);
                    self.enter(object, instance, || ray);
                    return false;
                };
                if self.test_tiny::<S, ANY>(s, blocks, instance, ray) {
                    self.keep_what_was_found::<S, ANY>(s);
                }
            }
        }
        self.child = self.stack.take();
        false
    }

    /// Whether one of a handful of blocks has a hit.
    #[inline(always)]
    fn test_tiny<S: Simd, const ANY: bool>(
        &mut self,
        s: S,
        blocks: &[TriangleBlock],
        instance: u32,
        mut ray: Ray,
    ) -> bool {
        let before = self.best.t_max;
        ray.t_max = before;
        if ANY {
            return tiny_any(s, blocks, &ray);
        }
        tiny_closest(s, blocks, &ray, instance, &mut self.best);
        self.best.t_max < before
    }

    /// Asks for the memory of the next step.
    #[inline(always)]
    fn prefetch<S: Simd>(&self, s: S) {
        let node = self.nodes.as_ptr().wrapping_add(self.child as usize).cast();
        let block = self.triangles.as_ptr().wrapping_add(leaf_index(self.child)).cast();
        s.prefetch::<{ size_of::<TriangleBlock>() / 64 }>(if self.child & LEAF == 0 { node } else { block });
    }
}

/// The rays of a stream that have not begun yet, eight of which have been set up.
struct Waiting<'r, R: ?Sized> {
    rays: &'r R,
    /// Magnitude of the coordinates of the tree that they begin in.
    extent: &'r [f32; 3],
    lanes: RayLanes,
    /// The eight, and the number of the first.
    setups: [Setup; WIDTH],
    first: usize,
    /// Which of them still wait, as bits.
    which: u32,
    /// The first one after them.
    next: usize,
}

impl<'r, R: RayStream + ?Sized> Waiting<'r, R> {
    fn new(rays: &'r R, extent: &'r [f32; 3]) -> Self {
        Waiting {
            rays,
            extent,
            lanes: RayLanes::NOTHING,
            setups: [Setup::nothing(); WIDTH],
            first: 0,
            which: 0,
            next: 0,
        }
    }

    /// The next ray: its number and its setup. Leaves out those that cannot hit anything.
    #[inline(always)]
    fn take<S: Simd>(&mut self, s: S) -> Option<(usize, &Setup)> {
        while self.which == 0 {
            if self.next >= self.rays.len() {
                return None;
            }
            let eight = EightRays::load(s, self.rays, self.next, &mut self.lanes, self.extent);
            eight.write(s, &mut self.setups);
            self.rays.prefetch(self.next + 2 * WIDTH);
            (self.first, self.which) = (self.next, eight.valid);
            self.next += WIDTH;
        }
        let lane = self.which.trailing_zeros() as usize % WIDTH;
        self.which &= self.which - 1;
        Some((self.first + lane, &self.setups[lane]))
    }
}

/// Number of a traveller.
#[derive(Clone, Copy, Default)]
struct Member(u32);

impl Member {
    fn all() -> impl Iterator<Item = Member> {
        (0..UNDER_WAY as u32).map(Member)
    }

    #[inline(always)]
    fn of<'t, 'a>(self, travellers: &'t mut [Traveller<'a>; UNDER_WAY]) -> &'t mut Traveller<'a> {
        // SAFETY: numbers are below `UNDER_WAY`: they come from `all`, or are zero.
        unsafe { travellers.get_unchecked_mut(self.0 as usize) }
    }
}

/// Numbers of travellers; how many, is said by [`Counts`].
#[derive(Default)]
struct List([Member; UNDER_WAY]);

impl List {
    #[inline(always)]
    fn get(&self, at: usize) -> Member {
        debug_assert!(at < UNDER_WAY);
        // SAFETY: no list is ever longer than there are travellers: each is in one list at a time.
        unsafe { *self.0.get_unchecked(at) }
    }

    /// Puts a traveller that is in no list behind the first `at`.
    #[inline(always)]
    fn put(&mut self, at: usize, member: Member) {
        debug_assert!(at < UNDER_WAY);
        // SAFETY: no list is ever longer than there are other travellers, when this one is in none.
        unsafe { *self.0.get_unchecked_mut(at) = member };
    }
}

/// All travellers under way by what they are at.
#[derive(Default)]
struct Lists {
    nodes: List,
    /// Leaves of objects.
    leaves: List,
    /// Those of the leaves' that have nearer hits.
    found: List,
    /// Everything else, see [`Traveller::change_level`].
    others: List,
}

/// How long the lists are. Apart from them, so that the compiler can keep it in registers.
#[derive(Clone, Copy, Default)]
struct Counts {
    nodes: usize,
    leaves: usize,
    others: usize,
}

impl Lists {
    /// Enters a traveller that is in no list where it belongs. No branch depends on where that is: the place behind the end of
    /// each list is written in any case.
    #[inline(always)]
    fn enter(&mut self, counts: &mut Counts, member: Member, traveller: &Traveller) {
        let child = traveller.child;
        let (is_node, is_other) = (child < LEAF, child >= INSTANCE);
        self.nodes.put(counts.nodes, member);
        counts.nodes += usize::from(is_node);
        self.leaves.put(counts.leaves, member);
        counts.leaves += usize::from(!is_node & !is_other);
        self.others.put(counts.others, member);
        counts.others += usize::from(is_other);
    }
}

/// Answers the queries of a stream: `answer` gets the number of a ray and its nearest hit (for `ANY`: some hit, of which only
/// the existence counts), in no certain order. Rays that hit nothing need get no answer.
#[inline(always)]
pub(super) fn trace<S: Simd, F: HitFilter, const ANY: bool>(
    s: S,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    filter: &F,
    mut answer: impl FnMut(usize, &Hit),
) {
    if tlas.root == EMPTY {
        return;
    }
    let only = tlas.only(filter.ray_mask());
    let mut waiting = Waiting::new(rays, only.map_or(&tlas.extent, |object| &object.extent));
    let mut memories = [const { StackMemory::UNINIT }; UNDER_WAY];
    let mut memories = memories.each_mut().into_iter();
    let mut travellers =
        std::array::from_fn(|_| Traveller::new(tlas, memories.next().expect("one for each")));
    let mut lists = Lists::default();
    let mut counts = Counts::default();
    for member in Member::all() {
        let Some((number, setup)) = waiting.take(s) else { break };
        let traveller = member.of(&mut travellers);
        traveller.start(number, setup, tlas, only, rays);
        lists.enter(&mut counts, member, traveller);
    }
    while counts.nodes + counts.leaves + counts.others > 0 {
        // A list can be read while it is made anew: at most as many are entered as have been read.
        for i in 0..std::mem::take(&mut counts.nodes) {
            let member = lists.nodes.get(i);
            let traveller = member.of(&mut travellers);
            traveller.visit_node::<S, ANY>(s);
            traveller.prefetch(s);
            lists.enter(&mut counts, member, traveller);
        }
        let leaves = std::mem::take(&mut counts.leaves);
        if !ANY && F::OPAQUE {
            let mut found = 0;
            for i in 0..leaves {
                let member = lists.leaves.get(i);
                let nearer = member.of(&mut travellers).look_into_leaf(s, filter);
                lists.found.put(found, member);
                found += usize::from(nearer);
            }
            for i in 0..found {
                lists.found.get(i).of(&mut travellers).keep_nearest(s);
            }
        }
        for i in 0..leaves {
            let member = lists.leaves.get(i);
            let traveller = member.of(&mut travellers);
            if ANY || !F::OPAQUE {
                traveller.visit_leaf::<S, F, ANY>(s, filter);
            }
            traveller.go_on();
            traveller.prefetch(s);
            lists.enter(&mut counts, member, traveller);
        }
        for i in 0..std::mem::take(&mut counts.others) {
            let member = lists.others.get(i);
            let traveller = member.of(&mut travellers);
            if traveller.change_level::<S, F, ANY>(s, tlas, only, rays, filter) {
                answer(traveller.number, &traveller.best.hit);
                let Some((number, setup)) = waiting.take(s) else { continue };
                traveller.start(number, setup, tlas, only, rays);
            }
            traveller.prefetch(s);
            lists.enter(&mut counts, member, traveller);
        }
    }
}
