//! Many rays in turns, for trees that the caches cannot hold.
//!
//! A ray that goes anywhere waits for memory at almost every node. So several rays are under way at once: one takes a
//! step (a node or a leaf), what its next step needs is asked for from memory, and by the time that it is its turn again
//! the memory is there. Each ray takes exactly the steps that it would take alone.

use super::leaves::{Leaf, Shear, Spheres, Triangles};
use super::tree::{Boxes, Stack, StackMemory, node};
use super::wide::{tiny_any, tiny_closest};
use super::{Best, STACK, Slabs};
use crate::blas::{Blas, Shape};
use crate::layout::{ChildRef, EMPTY, LEAF, Node};
use crate::ray::{HitFilter, Ray};
use crate::simd::Simd;
use crate::tlas::Tlas;

/// Rays under way. Fewer wait for memory, more push each other's state out of the first cache.
const UNDER_WAY: usize = 12;

/// A ray on its way through both levels, or through the only object.
struct Traveller<'a> {
    /// Number of the ray in its stream.
    number: usize,
    /// The ray in world space.
    world: Ray,
    /// The ray in the space of the object that it is in.
    ray: Ray,
    /// What triangle tests need of `ray`.
    shear: Shear,
    /// The nodes that `child` counts.
    nodes: &'a [Node],
    /// For the boxes of `nodes`.
    slabs: Slabs,
    /// For the boxes of the upper level, while the ray is in an object.
    upper: Slabs,
    /// The object that the ray is in, if it is in one.
    object: Option<&'a Blas>,
    instance: u32,
    /// What is to be looked at next.
    child: ChildRef,
    /// Entries of the stack below this belong to the upper level.
    base: usize,
    /// Both levels'.
    stack: Stack<'a, { 2 * STACK }>,
    best: Best,
}

impl<'a> Traveller<'a> {
    fn new(tlas: &'a Tlas, memory: &'a mut StackMemory<{ 2 * STACK }>) -> Self {
        let world = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
        let slabs = Slabs::new(&world, &tlas.extent);
        Traveller {
            number: 0,
            world,
            ray: world,
            shear: Shear::new(&world),
            nodes: &tlas.nodes,
            slabs,
            upper: slabs,
            object: None,
            instance: 0,
            child: EMPTY,
            base: 0,
            stack: Stack::new(memory),
            best: Best::new(&world),
        }
    }

    /// Begins with ray `number` at the top, or in the only object.
    #[inline(always)]
    fn start(&mut self, number: usize, ray: &Ray, tlas: &'a Tlas, only: Option<&'a Blas>) {
        self.number = number;
        self.world = *ray;
        self.best = Best::new(ray);
        self.stack.clear();
        self.base = 0;
        match only {
            Some(object) => self.enter(object, 0, ray),
            None => {
                self.object = None;
                self.nodes = &tlas.nodes;
                self.slabs = Slabs::new(ray, &tlas.extent);
                self.child = tlas.root;
            }
        }
    }

    /// Goes to the root of an object.
    #[inline(always)]
    fn enter(&mut self, object: &'a Blas, instance: u32, ray: &Ray) {
        self.ray = *ray;
        self.shear = Shear::new(ray);
        self.slabs = Slabs::new(ray, &object.extent);
        self.nodes = &object.nodes;
        self.child = object.root;
        self.object = Some(object);
        self.instance = instance;
    }

    /// Looks at `child` and decides what is next. True when the query has its answer.
    #[inline(always)]
    fn step<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        tlas: &'a Tlas,
        only: Option<&'a Blas>,
        filter: &F,
    ) -> bool {
        if self.child & LEAF == 0 {
            let node = node(self.nodes, self.child);
            let (near, inside) = Boxes::new(s, &self.slabs).meet(s, node, s.splat(self.best.t_max));
            let bits = s.bits(inside);
            if bits != 0 {
                self.child = if ANY {
                    self.stack.descend::<S, false>(s, node, near, inside, bits)
                } else {
                    self.stack.descend::<S, true>(s, node, near, inside, bits)
                };
                return false;
            }
        } else if self.child != EMPTY {
            let index = (self.child & !LEAF) as usize;
            if let Some(object) = self.object {
                if self.leaf::<S, F, ANY>(s, object, index, filter) {
                    return true;
                }
            } else if let Some((object, instance, ray)) = tlas.enter(index, &self.world, filter.ray_mask()) {
                if let (true, Some(blocks)) = (F::OPAQUE, object.tiny()) {
                    let mut ray = ray;
                    ray.t_max = self.best.t_max;
                    if ANY && tiny_any(s, blocks, &ray) {
                        return self.found_any();
                    }
                    if !ANY {
                        tiny_closest(s, blocks, &ray, instance, &mut self.best);
                    }
                } else {
                    self.upper = self.slabs;
                    self.base = self.stack.size();
                    self.enter(object, instance, &ray);
                    return false;
                }
            }
        }
        self.go_back::<ANY>(tlas, only.is_none())
    }

    /// Tests a leaf of the object. True if that answers the query.
    #[inline(always)]
    fn leaf<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        object: &Blas,
        index: usize,
        filter: &F,
    ) -> bool {
        match &object.shape {
            Shape::Triangles(blocks) => {
                self.test::<S, F, ANY>(s, &Triangles::new(s, blocks, &self.shear), index, filter)
            }
            Shape::Spheres(blocks) => {
                self.test::<S, F, ANY>(s, &Spheres::new(s, blocks, &self.ray), index, filter)
            }
        }
    }

    #[inline(always)]
    fn test<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        leaves: &impl Leaf<S>,
        index: usize,
        filter: &F,
    ) -> bool {
        let (instance, best) = (self.instance, &mut self.best);
        let mut any = false;
        leaves.test(s, index, best.t_max, |candidates, ids| {
            if ANY {
                any |= candidates.any(ids, instance, filter);
            } else {
                candidates.keep_nearest(ids, instance, filter, best);
            }
        });
        any && self.found_any()
    }

    /// Marks the query as answered by some hit, no matter which.
    #[inline(always)]
    fn found_any(&mut self) -> bool {
        self.best.hit.primitive = 0;
        true
    }

    /// Takes the next child from the stack, leaving the object if it has no more. True if there is none at all.
    #[inline(always)]
    fn go_back<const ANY: bool>(&mut self, tlas: &'a Tlas, has_upper: bool) -> bool {
        loop {
            let limit = self.best.t_max;
            let next = if ANY {
                self.stack.pop::<false>(self.base, limit)
            } else {
                self.stack.pop::<true>(self.base, limit)
            };
            if let Some(child) = next {
                self.child = child;
                return false;
            }
            if !has_upper || self.object.is_none() {
                return true;
            }
            self.object = None;
            self.base = 0;
            self.nodes = &tlas.nodes;
            self.slabs = self.upper;
        }
    }

    /// Asks for the memory of the next step.
    #[inline(always)]
    fn prefetch<S: Simd>(&self, s: S) {
        if self.child & LEAF == 0 {
            s.prefetch(node(self.nodes, self.child));
        } else if let Some(object) = self.object
            && let Shape::Triangles(blocks) = &object.shape
            && let Some(block) = blocks.get((self.child & !LEAF) as usize)
        {
            s.prefetch(block);
        }
    }
}

/// Answers the queries of a stream: `answer` gets the number of a ray and its best hit (for `ANY`: some hit, of which only
/// the existence counts), in no certain order. Rays that cannot hit anything get no answer.
#[inline(always)]
pub(super) fn trace<S: Simd, F: HitFilter, const ANY: bool>(
    s: S,
    tlas: &Tlas,
    rays: &[Ray],
    filter: &F,
    mut answer: impl FnMut(usize, &Best),
) {
    if tlas.root == EMPTY {
        return;
    }
    let only = tlas.only(filter.ray_mask());
    let mut waiting = rays.iter().enumerate().filter(|(_, ray)| ray.is_valid());
    let mut memories = [const { StackMemory::UNINIT }; UNDER_WAY];
    let mut travellers = memories.each_mut().map(|memory| Traveller::new(tlas, memory));
    // The first `count` of these are under way.
    let mut order: [usize; UNDER_WAY] = std::array::from_fn(|i| i);
    let mut count = 0;
    for (traveller, (number, ray)) in travellers.iter_mut().zip(waiting.by_ref()) {
        traveller.start(number, ray, tlas, only);
        count += 1;
    }
    while count > 0 {
        let mut turn = 0;
        while turn < count {
            let traveller = &mut travellers[order[turn]];
            if traveller.step::<S, F, ANY>(s, tlas, only, filter) {
                answer(traveller.number, &traveller.best);
                let Some((number, ray)) = waiting.next() else {
                    count -= 1;
                    order.swap(turn, count);
                    continue;
                };
                traveller.start(number, ray, tlas, only);
            }
            traveller.prefetch(s);
            turn += 1;
        }
    }
}
