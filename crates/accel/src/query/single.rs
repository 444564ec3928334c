//! Traversal for a single ray.

use super::brute_force::{brute_force_any, brute_force_closest};
use super::closest_hit::ClosestHit;
use super::leaf_intersector::{FindAny, KeepClosest, LeafIntersector};
use super::node_intersector::{NodeIntersector, node};
use super::slabs::Slabs;
use super::sphere_intersector::SphereIntersector;
use super::traversal_stack::{Stack, StackMemory};
use super::triangle_intersector::{Shear, TriangleIntersector};
use crate::bvh::{Blas, LeafBlocks, Tlas};
use crate::layout::{ChildRef, EMPTY, LEAF, Node, leaf_index};
use crate::ray::{HitFilter, Ray};
use crate::simd::Simd;

/// What traversal does at leaves.
trait LeafVisitor<S: Simd> {
    /// Whether children are visited in order of distance.
    const ORDERED: bool;

    /// The current end of the ray.
    fn t_max(&self) -> f32;

    /// Visits leaf `index`. True ends the traversal.
    fn leaf(&mut self, s: S, index: usize) -> bool;
}

/// Visits the leaves that the ray hits, until a visit returns true. Returns whether one did.
#[inline(always)]
fn traverse<S: Simd, V: LeafVisitor<S>>(
    s: S,
    nodes: &[Node],
    root: ChildRef,
    slabs: &Slabs,
    visitor: &mut V,
) -> bool {
    let mut memory = StackMemory::UNINIT;
    let mut stack = Stack::new(&mut memory);
    let boxes = NodeIntersector::new(s, slabs);
    let mut t_max = s.splat(visitor.t_max());
    let mut child = root;
    loop {
        if child & LEAF == 0 {
            let node = node(nodes, child);
            let (near, inside) = boxes.intersect(s, node, t_max);
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
            // Coordinates near the limits of floats may let a ray hit unused boxes.
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

/// Finds the closest hit in the leaves of an object.
struct ClosestHitVisitor<'a, L, F> {
    leaves: L,
    instance: u32,
    filter: &'a F,
    best: &'a mut ClosestHit,
}

impl<S: Simd, L: LeafIntersector<S>, F: HitFilter> LeafVisitor<S> for ClosestHitVisitor<'_, L, F> {
    const ORDERED: bool = true;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.best.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, index: usize) -> bool {
        let (t_max, best) = (self.best.t_max, &mut *self.best);
        let mut handler = KeepClosest { instance: self.instance, filter: self.filter, best };
        self.leaves.intersect(s, index, t_max, &mut handler);
        false
    }
}

/// Finds any hit in the leaves of an object.
struct AnyHitVisitor<'a, L, F> {
    leaves: L,
    instance: u32,
    filter: &'a F,
    t_max: f32,
}

impl<S: Simd, L: LeafIntersector<S>, F: HitFilter> LeafVisitor<S> for AnyHitVisitor<'_, L, F> {
    const ORDERED: bool = false;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, index: usize) -> bool {
        let mut handler = FindAny { instance: self.instance, filter: self.filter, any: false };
        self.leaves.intersect(s, index, self.t_max, &mut handler);
        handler.any
    }
}

/// The closest hit with an object.
#[inline(always)]
pub(super) fn blas_closest<S: Simd, F: HitFilter>(
    s: S,
    blas: &Blas,
    ray: &Ray,
    instance: u32,
    filter: &F,
    best: &mut ClosestHit,
) {
    if F::OPAQUE
        && let Some(blocks) = blas.brute_force_blocks()
    {
        return brute_force_closest(s, blocks, ray, instance, best);
    }
    let slabs = Slabs::new(ray, &blas.extent);
    match &blas.leaves {
        LeafBlocks::Triangles(blocks) => {
            let mut visitor = ClosestHitVisitor {
                leaves: TriangleIntersector::new(s, blocks, &Shear::new(ray)),
                instance,
                filter,
                best,
            };
            traverse(s, &blas.nodes, blas.root, &slabs, &mut visitor);
        }
        LeafBlocks::Spheres(blocks) => {
            let mut visitor =
                ClosestHitVisitor { leaves: SphereIntersector::new(s, blocks, ray), instance, filter, best };
            traverse(s, &blas.nodes, blas.root, &slabs, &mut visitor);
        }
    }
}

/// Any hit with an object.
#[inline(always)]
pub(super) fn blas_any<S: Simd, F: HitFilter>(
    s: S,
    blas: &Blas,
    ray: &Ray,
    instance: u32,
    filter: &F,
) -> bool {
    if F::OPAQUE
        && let Some(blocks) = blas.brute_force_blocks()
    {
        return brute_force_any(s, blocks, ray);
    }
    let slabs = Slabs::new(ray, &blas.extent);
    let t_max = ray.t_max;
    match &blas.leaves {
        LeafBlocks::Triangles(blocks) => {
            let mut visitor = AnyHitVisitor {
                leaves: TriangleIntersector::new(s, blocks, &Shear::new(ray)),
                instance,
                filter,
                t_max,
            };
            traverse(s, &blas.nodes, blas.root, &slabs, &mut visitor)
        }
        LeafBlocks::Spheres(blocks) => {
            let mut visitor =
                AnyHitVisitor { leaves: SphereIntersector::new(s, blocks, ray), instance, filter, t_max };
            traverse(s, &blas.nodes, blas.root, &slabs, &mut visitor)
        }
    }
}

/// Finds the closest hit in instances, the leaves of the top level. `closest` is the entry point
/// for one object.
struct ClosestInstanceVisitor<'a, F, C> {
    tlas: &'a Tlas,
    ray: &'a Ray,
    time: f32,
    filter: &'a F,
    best: &'a mut ClosestHit,
    closest: C,
}

impl<S: Simd, F: HitFilter, C: Fn(&Blas, &Ray, u32, &F, &mut ClosestHit)> LeafVisitor<S>
    for ClosestInstanceVisitor<'_, F, C>
{
    const ORDERED: bool = true;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.best.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, _: S, index: usize) -> bool {
        let (ray, mask) = (self.ray, self.filter.ray_mask());
        if let Some((blas, instance, ray)) = self.tlas.enter(index, ray, || self.time, mask) {
            (self.closest)(blas, &ray, instance, self.filter, self.best);
        }
        false
    }
}

/// Finds any hit in instances.
struct AnyInstanceVisitor<'a, F, C> {
    tlas: &'a Tlas,
    ray: &'a Ray,
    time: f32,
    filter: &'a F,
    any: C,
}

impl<S: Simd, F: HitFilter, C: Fn(&Blas, &Ray, u32, &F) -> bool> LeafVisitor<S>
    for AnyInstanceVisitor<'_, F, C>
{
    const ORDERED: bool = false;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.ray.t_max
    }

    #[inline(always)]
    fn leaf(&mut self, _: S, index: usize) -> bool {
        match self.tlas.enter(index, self.ray, || self.time, self.filter.ray_mask()) {
            Some((blas, instance, ray)) => (self.any)(blas, &ray, instance, self.filter),
            None => false,
        }
    }
}

/// The closest hit with all instances. `closest` is the entry point for one object.
#[inline(always)]
pub(super) fn tlas_closest<S: Simd, F: HitFilter>(
    s: S,
    tlas: &Tlas,
    ray: &Ray,
    time: f32,
    filter: &F,
    best: &mut ClosestHit,
    closest: impl Fn(&Blas, &Ray, u32, &F, &mut ClosestHit),
) {
    let slabs = Slabs::new(ray, &tlas.extent);
    let mut visitor = ClosestInstanceVisitor { tlas, ray, time, filter, best, closest };
    traverse(s, &tlas.nodes, tlas.root, &slabs, &mut visitor);
}

/// Any hit with the instances. `any` is the entry point for one object.
#[inline(always)]
pub(super) fn tlas_any<S: Simd, F: HitFilter>(
    s: S,
    tlas: &Tlas,
    ray: &Ray,
    time: f32,
    filter: &F,
    any: impl Fn(&Blas, &Ray, u32, &F) -> bool,
) -> bool {
    let slabs = Slabs::new(ray, &tlas.extent);
    let mut visitor = AnyInstanceVisitor { tlas, ray, time, filter, any };
    traverse(s, &tlas.nodes, tlas.root, &slabs, &mut visitor)
}
