//! Traversal of a stream of rays, several in flight at a time.
//!
//! A single ray mostly waits: for memory, for the last comparison, and for mispredicted branches.
//! Therefore several rays are in flight. In each round, all rays that are at nodes take a step,
//! then all that are at leaves. No step waits for the previous one, memory is prefetched one round
//! ahead, and no branch depends on the path of a ray: a ray is put into the list of nodes, of
//! leaves, or of the rest. Each ray takes the same steps as in a single-ray query.

use super::brute_force::{brute_force_any, brute_force_closest};
use super::closest_hit::ClosestHit;
use super::leaf_intersector::{FindAny, KeepClosest, LeafIntersector};
use super::node_intersector::{NodeIntersector, node};
use super::ray_queue::RayQueue;
use super::ray_setup::TraversalRay;
use super::ray_stream::RayStream;
use super::root_stage::{ANY_HIT, RootStage};
use super::slabs::Slabs;
use super::sphere_intersector::SphereIntersector;
use super::stream_lists::{IN_FLIGHT, ListLengths, RayId, RayLists};
use super::stream_output::StreamOutput;
use super::traversal_stack::{END, STREAM_STACK_SIZE, StackMemory, StreamStack};
use super::triangle_intersector::{Shear, TriangleIntersector};
use crate::bvh::{Blas, LeafBlocks, Tlas};
use crate::layout::{ChildRef, EMPTY, LEAF, Node, SphereBlock, TriangleBlock, WIDTH, leaf_index};
use crate::ray::{Hit, HitFilter, MISS, Ray};
use crate::simd::Simd;

/// The index of no ray.
const NO_RAY: usize = usize::MAX;

/// The state of a ray in flight, on both levels or in the single object.
#[repr(C, align(64))]
struct StreamRay<'a> {
    /// Constants for `nodes` and the object's triangles.
    constants: TraversalRay,
    /// The nodes that `child` refers to.
    nodes: &'a [Node],
    /// What to visit next.
    child: ChildRef,
    stack: StreamStack<'a>,
    best: ClosestHit,
    /// Whether the ray is in an object.
    in_object: bool,
    /// The object's leaves, either triangles or spheres.
    triangles: &'a [TriangleBlock],
    spheres: &'a [SphereBlock],
    instance: u32,
    /// Distances, infinite for misses, and barycentric coordinates for the last leaf.
    leaf_hits: [[f32; WIDTH]; 3],
    /// Index of the ray in its stream.
    stream_index: usize,
    /// Constants for the boxes of the top level, while the ray is in an object.
    top_level_slabs: Slabs,
    /// The ray in object space, if the object has spheres. Not for triangles: the copy would take
    /// as long as a step, because the ray has just been written by component.
    ray: Ray,
}

impl<'a> StreamRay<'a> {
    fn new(tlas: &'a Tlas, single: Option<&'a Blas>, memory: &'a mut StackMemory<STREAM_STACK_SIZE>) -> Self {
        let constants = TraversalRay::inactive();
        let mut ray_state = StreamRay {
            constants,
            nodes: &tlas.nodes,
            child: END,
            stack: StreamStack::new(memory),
            best: ClosestHit { hit: MISS, t_max: -1.0 },
            in_object: false,
            triangles: &[],
            spheres: &[],
            instance: 0,
            leaf_hits: [[0.0; WIDTH]; 3],
            stream_index: NO_RAY,
            top_level_slabs: constants.slabs,
            ray: Ray::new([0.0; 3], [0.0, 0.0, 1.0]),
        };
        if let Some(object) = single {
            ray_state.enter(object, 0);
        }
        ray_state
    }

    /// Starts the ray at `lane` of the queue's batch.
    #[inline(always)]
    fn start<R: RayStream + ?Sized, S: Simd, const ANY: bool>(
        &mut self,
        s: S,
        lane: usize,
        queue: &RayQueue<R>,
        tlas: &'a Tlas,
        single: bool,
    ) {
        self.stream_index = queue.first + lane;
        self.constants = queue.traversal_rays[lane];
        self.best = queue.closest[lane];
        if single {
            // The ray never leaves the single object.
            if !self.spheres.is_empty() {
                self.ray = queue.rays.ray(self.stream_index);
            }
        } else {
            self.in_object = false;
            self.nodes = &tlas.nodes;
        }
        self.stack.clear();
        let near = s.load(&queue.near[lane]);
        self.push_children::<S, ANY>(s, &queue.root_stage.root, near, s.lt(near, s.splat(f32::INFINITY)));
        self.advance();
    }

    /// Enters an object.
    #[inline(always)]
    fn enter(&mut self, object: &'a Blas, instance: u32) {
        self.nodes = &object.nodes;
        (self.triangles, self.spheres) = match &object.leaves {
            LeafBlocks::Triangles(blocks) => (&blocks[..], &[][..]),
            LeafBlocks::Spheres(blocks) => (&[][..], &blocks[..]),
        };
        self.in_object = true;
        self.instance = instance;
    }

    /// Pushes the children in `inside`; the closest will be popped first, or any for `ANY`.
    #[inline(always)]
    fn push_children<S: Simd, const ANY: bool>(&mut self, s: S, node: &Node, near: S::F, inside: S::M) {
        if ANY {
            self.stack.push::<S, false>(s, node, near, inside);
        } else {
            self.stack.push::<S, true>(s, node, near, inside);
        }
    }

    /// Intersects the boxes of the current node.
    #[inline(always)]
    fn visit_node<S: Simd, const ANY: bool>(&mut self, s: S) {
        let node = node(self.nodes, self.child);
        let (near, inside) =
            NodeIntersector::new(s, &self.constants.slabs).intersect(s, node, s.splat(self.best.t_max));
        self.push_children::<S, ANY>(s, node, near, inside);
    }

    /// Intersects the current leaf and keeps its hits.
    #[inline(always)]
    fn visit_leaf<S: Simd, F: HitFilter, const ANY: bool>(&mut self, s: S, filter: &F) {
        let index = leaf_index(self.child);
        let found = if self.spheres.is_empty() {
            self.intersect_leaf::<S, F, ANY>(
                s,
                &TriangleIntersector::new(s, self.triangles, &self.constants.shear),
                index,
                filter,
            )
        } else {
            self.intersect_leaf::<S, F, ANY>(
                s,
                &SphereIntersector::new(s, self.spheres, &self.ray),
                index,
                filter,
            )
        };
        if found {
            self.discard_after_hit::<S, ANY>(s);
        }
    }

    /// As [`StreamRay::visit_leaf`] for closest hits without a filter, but with no branch on the
    /// result. True if there are closer hits, which [`StreamRay::keep_closest`] has to handle.
    #[inline(always)]
    fn find_leaf_hits<S: Simd, F: HitFilter>(&mut self, s: S, filter: &F) -> bool {
        if !self.spheres.is_empty() {
            self.visit_leaf::<S, F, false>(s, filter);
            return false;
        }
        let triangles = TriangleIntersector::new(s, self.triangles, &self.constants.shear);
        let (hits, mask) = triangles.leaf_hits(s, leaf_index(self.child), self.best.t_max);
        s.store(s.select(mask, s.splat(f32::INFINITY), hits.t), &mut self.leaf_hits[0]);
        s.store(hits.u, &mut self.leaf_hits[1]);
        s.store(hits.v, &mut self.leaf_hits[2]);
        s.bits(mask) != 0
    }

    /// Keeps the closest of the hits of [`StreamRay::find_leaf_hits`].
    #[inline(always)]
    fn keep_closest<S: Simd>(&mut self, s: S) {
        let ts = s.load(&self.leaf_hits[0]);
        let t = s.least(ts);
        let lane = s.bits(s.le(ts, s.splat(t))).trailing_zeros() as usize % WIDTH;
        let primitive = self.triangles[leaf_index(self.child)].ids[lane];
        let (u, v) = (self.leaf_hits[1][lane], self.leaf_hits[2][lane]);
        self.best = ClosestHit { hit: Hit { t, u, v, primitive, instance: self.instance }, t_max: t };
        self.stack.cull(s, t);
    }

    /// Pops the next child to visit.
    #[inline(always)]
    fn advance(&mut self) {
        self.child = self.stack.pop();
    }

    /// Intersects a leaf. Returns whether there is a closer hit, or any hit for `ANY`.
    #[inline(always)]
    fn intersect_leaf<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        leaves: &impl LeafIntersector<S>,
        index: usize,
        filter: &F,
    ) -> bool {
        let (instance, before) = (self.instance, self.best.t_max);
        if ANY {
            let mut handler = FindAny { instance, filter, any: false };
            leaves.intersect(s, index, before, &mut handler);
            handler.any
        } else {
            leaves.intersect(s, index, before, &mut KeepClosest { instance, filter, best: &mut self.best });
            self.best.t_max < before
        }
    }

    /// Drops stack entries that need no visit after a hit.
    #[inline(always)]
    fn discard_after_hit<S: Simd, const ANY: bool>(&mut self, s: S) {
        if ANY {
            self.best.hit = ANY_HIT;
            self.stack.clear();
            self.in_object = false;
        } else {
            self.stack.cull(s, self.best.t_max);
        }
    }

    /// Handles a ray that is at a leaf of the top level, or at an end. True if the ray is finished.
    #[inline(always)]
    fn change_level<S: Simd, F: HitFilter, const ANY: bool>(
        &mut self,
        s: S,
        tlas: &'a Tlas,
        single: Option<&'a Blas>,
        rays: &(impl RayStream + ?Sized),
        filter: &F,
    ) -> bool {
        if self.child == END {
            if single.is_some() || !self.in_object {
                return true;
            }
            self.in_object = false;
            self.nodes = &tlas.nodes;
            self.constants.slabs = self.top_level_slabs;
        } else if self.child != EMPTY {
            // Coordinates near the limits of floats may let a ray hit unused boxes.
            let index = leaf_index(self.child);
            let world = rays.ray(self.stream_index);
            let time = || rays.time(self.stream_index);
            if let Some((object, instance, ray)) = tlas.enter(index, &world, time, filter.ray_mask()) {
                let Some(blocks) = object.brute_force_blocks().filter(|_| F::OPAQUE) else {
                    self.top_level_slabs = self.constants.slabs;
                    self.stack.push_end(s);
                    // Field by field: a copy of the whole struct would stall on the stores just
                    // made.
                    self.constants.slabs = Slabs::new(&ray, &object.extent);
                    self.constants.shear = Shear::new(&ray);
                    self.enter(object, instance);
                    if !self.spheres.is_empty() {
                        self.ray = ray;
                    }
                    self.child = object.root;
                    return false;
                };
                if self.intersect_brute_force::<S, ANY>(s, blocks, instance, ray) {
                    self.discard_after_hit::<S, ANY>(s);
                }
            }
        }
        self.child = self.stack.pop();
        false
    }

    /// Intersects an object of a few blocks. Returns whether there is a hit.
    #[inline(always)]
    fn intersect_brute_force<S: Simd, const ANY: bool>(
        &mut self,
        s: S,
        blocks: &[TriangleBlock],
        instance: u32,
        mut ray: Ray,
    ) -> bool {
        let before = self.best.t_max;
        ray.t_max = before;
        if ANY {
            return brute_force_any(s, blocks, &ray);
        }
        brute_force_closest(s, blocks, &ray, instance, &mut self.best);
        self.best.t_max < before
    }

    /// Prefetches the memory of the next step.
    #[inline(always)]
    fn prefetch<S: Simd>(&self, s: S) {
        let node = self.nodes.as_ptr().wrapping_add(self.child as usize).cast();
        let block = self.triangles.as_ptr().wrapping_add(leaf_index(self.child)).cast();
        s.prefetch::<{ size_of::<TriangleBlock>() / 64 }>(if self.child & LEAF == 0 { node } else { block });
    }
}

/// Traces a stream. Rays finish in any order. For `ANY`, hits only say that there is one.
#[inline(always)]
pub(super) fn trace<S: Simd, F: HitFilter, const ANY: bool>(
    s: S,
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    filter: &F,
    mut output: impl StreamOutput,
) {
    if tlas.root == EMPTY || rays.is_empty() {
        return;
    }
    let single = tlas.single_object(filter.ray_mask());
    let extent = single.map_or(&tlas.extent, |object| &object.extent);
    let mut queue = RayQueue::new(rays, RootStage::new::<F>(tlas, single), extent);
    let mut memories = [const { StackMemory::UNINIT }; IN_FLIGHT];
    let mut memories = memories.each_mut().into_iter();
    let mut in_flight: [StreamRay; IN_FLIGHT] =
        std::array::from_fn(|_| StreamRay::new(tlas, single, memories.next().expect("one for each")));
    // The lists of this round and of the next. Their lengths are known long before they are used.
    let (now, next) = &mut (RayLists::default(), RayLists::default());
    let (mut now, mut next) = (now, next);
    let mut lengths = ListLengths::default();
    for id in RayId::all() {
        now.insert(&mut lengths, id, id.select(&mut in_flight).child);
    }
    while lengths.nodes + lengths.leaves + lengths.others > 0 {
        let ListLengths { nodes, leaves, others } = std::mem::take(&mut lengths);
        for i in 0..nodes {
            now.nodes.get(i).select(&mut in_flight).visit_node::<S, ANY>(s);
        }
        // In a loop of its own, so that no pop waits for the stores of its push.
        for i in 0..nodes {
            let id = now.nodes.get(i);
            let ray_state = id.select(&mut in_flight);
            ray_state.advance();
            ray_state.prefetch(s);
            next.insert(&mut lengths, id, ray_state.child);
        }
        if !ANY && F::OPAQUE {
            let mut found = 0;
            for i in 0..leaves {
                let id = now.leaves.get(i);
                let nearer = id.select(&mut in_flight).find_leaf_hits(s, filter);
                now.found.put(found, id);
                found += usize::from(nearer);
            }
            for i in 0..found {
                now.found.get(i).select(&mut in_flight).keep_closest(s);
            }
        }
        for i in 0..leaves {
            let id = now.leaves.get(i);
            let ray_state = id.select(&mut in_flight);
            if ANY || !F::OPAQUE {
                ray_state.visit_leaf::<S, F, ANY>(s, filter);
            }
            ray_state.advance();
            ray_state.prefetch(s);
            next.insert(&mut lengths, id, ray_state.child);
        }
        for i in 0..others {
            let id = now.others.get(i);
            let ray_state = id.select(&mut in_flight);
            if ray_state.change_level::<S, F, ANY>(s, tlas, single, rays, filter) {
                if ray_state.stream_index != NO_RAY {
                    output.write(ray_state.stream_index, &ray_state.best.hit);
                }
                let Some(lane) = queue.next_ray::<S, ANY>(s, &mut output) else { continue };
                ray_state.start::<_, S, ANY>(s, lane, &queue, tlas, single.is_some());
            }
            ray_state.prefetch(s);
            next.insert(&mut lengths, id, ray_state.child);
        }
        (now, next) = (next, now);
    }
}
