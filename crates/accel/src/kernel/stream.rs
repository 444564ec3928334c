//! Many rays under way at once.
//!
//! A ray alone mostly waits: for memory, for the result of the last comparison, and for what was begun on a wrong guess. So
//! several rays are under way, and all that are at nodes take a step, one after the other, then all that are at leaves.
//! In such a loop no step waits for the one before, the memory that a ray needs next has been asked for a round ago,
//! and no branch depends on where a ray goes: whether its next place is a node or a leaf decides in which list it is entered.
//! Each ray takes the steps that it would take alone.

use super::answers::Answers;
use super::leaves::{FindAny, KeepNearest, Leaf, Shear, Spheres, Triangles};
use super::setup::Setup;
use super::stack::{END, STREAM_STACK, StackMemory, StreamStack};
use super::top::{ANYTHING, Top};
use super::tree::{Boxes, node};
use super::waiting::Waiting;
use super::wide::{tiny_any, tiny_closest};
use super::{Best, Slabs};
use crate::behind::Children;
use crate::blas::{Blas, Shape};
use crate::layout::{ChildRef, EMPTY, INSTANCE, LEAF, Node, SphereBlock, TriangleBlock, WIDTH, leaf_index};
use crate::ray::{Hit, HitFilter, MISS, Ray};
use crate::simd::Simd;
use crate::streams::RayStream;
use crate::tlas::Tlas;

/// Rays under way. Fewer wait for each other's results, more push each other's state out of the first cache.
const UNDER_WAY: usize = 24;

/// Number of a ray that is none.
const NO_RAY: usize = usize::MAX;

/// A ray on its way through both levels, or through the only object.
#[repr(C, align(64))]
struct Traveller<'a> {
    /// For `nodes` and the object's triangles.
    setup: Setup,
    /// The nodes that `child` counts.
    nodes: &'a [Node],
    /// What is to be looked at next.
    child: ChildRef,
    /// What need not be looked at, see [`crate::RayColumns::leaving`].
    behind: Children,
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
    fn new(tlas: &'a Tlas, only: Option<&'a Blas>, memory: &'a mut StackMemory<STREAM_STACK>) -> Self {
        let setup = Setup::nothing();
        let mut traveller = Traveller {
            setup,
            nodes: &tlas.nodes,
            child: END,
            behind: Children::NONE,
            stack: StreamStack::new(memory),
            best: Best { hit: MISS, t_max: -1.0 },
            in_object: false,
            triangles: &[],
            spheres: &[],
            instance: 0,
            met: [[0.0; WIDTH]; 3],
            number: NO_RAY,
            upper: setup.slabs,
            ray: Ray::new([0.0; 3], [0.0, 0.0, 1.0]),
        };
        if let Some(object) = only {
            traveller.enter(object, 0);
        }
        traveller
    }

    /// Begins with a ray that has met what is at the top.
    #[inline(always)]
    fn start<R: RayStream + ?Sized, S: Simd, const ANY: bool>(
        &mut self,
        s: S,
        lane: usize,
        waiting: &Waiting<R>,
        tlas: &'a Tlas,
        only: bool,
    ) {
        self.number = waiting.first + lane;
        self.setup = waiting.setups[lane];
        self.best = waiting.bests[lane];
        self.behind = waiting.behind[lane];
        if only {
            // The object has been entered for good.
            if !self.spheres.is_empty() {
                self.ray = waiting.rays.ray(self.number);
            }
        } else {
            self.in_object = false;
            self.nodes = &tlas.nodes;
        }
        self.stack.clear();
        let near = s.load(&waiting.near[lane]);
        self.meet::<S, ANY>(s, &waiting.top.root, near, s.lt(near, s.splat(f32::INFINITY)));
        self.go_on();
    }

    /// Goes into an object.
    #[inline(always)]
    fn enter(&mut self, object: &'a Blas, instance: u32) {
        self.nodes = &object.nodes;
        (self.triangles, self.spheres) = match &object.shape {
            Shape::Triangles(blocks) => (&blocks[..], &[][..]),
            Shape::Spheres(blocks) => (&[][..], &blocks[..]),
        };
        self.in_object = true;
        self.instance = instance;
    }

    /// Remembers a node's children in `inside`, the nearest of which, or any for `ANY`, is where it goes on.
    #[inline(always)]
    fn meet<S: Simd, const ANY: bool>(&mut self, s: S, node: &Node, near: S::F, inside: S::M) {
        if ANY {
            self.stack.push::<S, false>(s, node, near, inside);
        } else {
            self.stack.push::<S, true>(s, node, near, inside);
        }
    }

    /// Looks at the boxes of the node that the ray is at.
    #[inline(always)]
    fn visit_node<S: Simd, const ANY: bool>(&mut self, s: S) {
        let node = node(self.nodes, self.child);
        let (near, inside) = Boxes::new(s, &self.setup.slabs).meet(s, node, s.splat(self.best.t_max));
        let inside = s.and_not(inside, s.mask(self.behind.of(self.child)));
        self.meet::<S, ANY>(s, node, near, inside);
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
        let (instance, before) = (self.instance, self.best.t_max);
        if ANY {
            let mut found = FindAny { instance, filter, any: false };
            leaves.test(s, index, before, &mut found);
            found.any
        } else {
            leaves.test(s, index, before, &mut KeepNearest { instance, filter, best: &mut self.best });
            self.best.t_max < before
        }
    }

    /// Forgets what need not be visited any more after a hit.
    #[inline(always)]
    fn keep_what_was_found<S: Simd, const ANY: bool>(&mut self, s: S) {
        if ANY {
            self.best.hit = ANYTHING;
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
                    self.enter(object, instance);
                    if !self.spheres.is_empty() {
                        self.ray = ray;
                    }
                    self.child = object.root;
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

/// Travellers by what they are at.
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

/// Answers the queries of a stream, in no certain order, with nearest hits (for `ANY`: some hits, of which only the existence counts).
#[inline(always)]
pub(super) fn trace<S: Simd, F: HitFilter, const ANY: bool>(
    s: S,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    filter: &F,
    mut answers: impl Answers,
) {
    if tlas.root == EMPTY || rays.is_empty() {
        return;
    }
    let only = tlas.only(filter.ray_mask());
    let extent = only.map_or(&tlas.extent, |object| &object.extent);
    let mut waiting = Waiting::new(rays, Top::new::<F>(tlas, only), extent);
    let mut memories = [const { StackMemory::UNINIT }; UNDER_WAY];
    let mut memories = memories.each_mut().into_iter();
    let mut travellers =
        std::array::from_fn(|_| Traveller::new(tlas, only, memories.next().expect("one for each")));
    // Those of a round, and those of the next: how long a list is, is known long before its turn comes.
    let (now, next) = &mut (Lists::default(), Lists::default());
    let (mut now, mut next) = (now, next);
    let mut counts = Counts::default();
    for member in Member::all() {
        now.enter(&mut counts, member, member.of(&mut travellers));
    }
    while counts.nodes + counts.leaves + counts.others > 0 {
        let Counts { nodes, leaves, others } = std::mem::take(&mut counts);
        for i in 0..nodes {
            now.nodes.get(i).of(&mut travellers).visit_node::<S, ANY>(s);
        }
        // On their own: what a step has just put on a stack is not to be waited for.
        for i in 0..nodes {
            let member = now.nodes.get(i);
            let traveller = member.of(&mut travellers);
            traveller.go_on();
            traveller.prefetch(s);
            next.enter(&mut counts, member, traveller);
        }
        if !ANY && F::OPAQUE {
            let mut found = 0;
            for i in 0..leaves {
                let member = now.leaves.get(i);
                let nearer = member.of(&mut travellers).look_into_leaf(s, filter);
                now.found.put(found, member);
                found += usize::from(nearer);
            }
            for i in 0..found {
                now.found.get(i).of(&mut travellers).keep_nearest(s);
            }
        }
        for i in 0..leaves {
            let member = now.leaves.get(i);
            let traveller = member.of(&mut travellers);
            if ANY || !F::OPAQUE {
                traveller.visit_leaf::<S, F, ANY>(s, filter);
            }
            traveller.go_on();
            traveller.prefetch(s);
            next.enter(&mut counts, member, traveller);
        }
        for i in 0..others {
            let member = now.others.get(i);
            let traveller = member.of(&mut travellers);
            if traveller.change_level::<S, F, ANY>(s, tlas, only, rays, filter) {
                if traveller.number != NO_RAY {
                    answers.one(traveller.number, &traveller.best.hit);
                }
                let Some(lane) = waiting.take::<S, ANY>(s, &mut answers) else { continue };
                traveller.start::<_, S, ANY>(s, lane, &waiting, tlas, only.is_some());
            }
            traveller.prefetch(s);
            next.enter(&mut counts, member, traveller);
        }
        (now, next) = (next, now);
    }
}
