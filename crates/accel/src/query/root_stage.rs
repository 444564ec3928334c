//! The root stage of a stream: sixteen rays at a time are tested with the polygons and boxes at the
//! root, before any ray is traversed alone.
//!
//! Near the root, rays do not diverge yet. A test of one polygon or box with sixteen rays is a few
//! times faster than a single ray's test of eight boxes, and has no branches. In a room, most rays
//! are finished after this stage, and only those that hit a child box traverse the tree. An object
//! of a few triangles has no tree to traverse. Shadow rays between two points inside the object's
//! bounds are not tested with walls that lie in the bounds' sides.
//!
//! `bvh/planar_polygon.rs` explains the polygon test.

use super::hit_sink::Hit16;
use super::lane_vectors::abs;
use super::ray_setup::{LaneRays, LaneSlabs};
use crate::aabb::Aabb;
use crate::bvh::{ALL_CHILDREN, Blas, MAX_TOLERANCE, PlanarPolygon, PolygonTriangle, Tlas};
use crate::layout::{EMPTY, LEAF, NO_PRIMITIVE, Node, WIDTH};
use crate::ray::{Hit, HitFilter, MISS};
use crate::simd::{Arithmetic, Simd, Sixteen};

/// Rays of one batch.
pub(super) const RAYS: usize = 2 * WIDTH;

/// The polygons and boxes at the root of a tree.
pub(super) struct RootStage<'a> {
    polygons: &'a [PlanarPolygon],
    /// Number of polygons that are not in a side of the bounds; they come first.
    inner: usize,
    /// See [`RootTriangles::triangles`](crate::bvh::RootTriangles::triangles).
    triangles: &'a [PolygonTriangle],
    /// Bounds of the tree.
    bounds: Aabb,
    /// The root node. If the root is a leaf, a node with that leaf as its only child.
    pub root: Node,
    /// The boxes of the root node.
    boxes: [Aabb; WIDTH],
    /// Mask of the root's children to test: not those that are empty or replaced by polygons.
    children: u32,
}

impl<'a> RootStage<'a> {
    /// For the single object `object`, or for all instances. Polygons are only used if every hit
    /// counts.
    pub fn new<F: HitFilter>(tlas: &'a Tlas, object: Option<&'a Blas>) -> Self {
        let (nodes, root, bounds) = match object {
            Some(object) => (&object.nodes, object.root, object.bounds()),
            None => (&tlas.nodes, tlas.root, tlas.bounds()),
        };
        let root = if root & LEAF == 0 { nodes[root as usize] } else { parent_of(root, &bounds) };
        let boxes = std::array::from_fn(|slot| root.bounds(slot));
        let mut root_stage = RootStage {
            polygons: &[],
            inner: 0,
            triangles: const { &[PolygonTriangle::NONE] },
            bounds,
            root,
            boxes,
            children: ALL_CHILDREN,
        };
        if let Some(root_triangles) = object.and_then(Blas::root_triangles).filter(|_| F::OPAQUE) {
            (root_stage.polygons, root_stage.inner, root_stage.triangles) =
                (&root_triangles.polygons, root_triangles.inner, &root_triangles.triangles);
            root_stage.children &= !root_triangles.replaced_children;
        }
        for (slot, child) in root.children.iter().enumerate() {
            root_stage.children &= !(u32::from(*child == EMPTY) << slot);
        }
        root_stage
    }

    /// Whether there is nothing but polygons.
    #[inline(always)]
    pub fn is_complete(&self) -> bool {
        self.children == 0
    }

    /// Whether there are polygons.
    #[inline(always)]
    pub fn has_polygons(&self) -> bool {
        !self.polygons.is_empty()
    }

    /// The closest hit of each ray with the polygons; if `ANY`, only which rays hit any.
    #[inline(always)]
    pub fn intersect_polygons<A: Arithmetic, const ANY: bool>(
        &self,
        a: A,
        rays: &LaneRays<A>,
    ) -> RootHits<A> {
        let count = if ANY && self.are_inside_bounds(a, rays) { self.inner } else { self.polygons.len() };
        let tests = PlaneTests::new(a, rays, &self.bounds);
        let mut hits = RootHits::new(a, rays);
        for (number, polygon) in (0..).zip(&self.polygons[..count]) {
            hits.intersect::<ANY>(a, polygon, number, rays, &tests);
        }
        hits
    }

    /// Whether all rays start and end inside the bounds, and so do not cross polygons in the sides.
    /// This is exact: an end point that is rounded once is outside if the exact point is.
    #[inline(always)]
    fn are_inside_bounds<A: Arithmetic>(&self, a: A, rays: &LaneRays<A>) -> bool {
        if self.inner == self.polygons.len() {
            return false;
        }
        let mut within = a.le(rays.t_min, rays.t_max);
        for axis in 0..3 {
            let (low, high) = (a.splat(self.bounds.min[axis]), a.splat(self.bounds.max[axis]));
            let begin = rays.origin[axis];
            // NaN for an infinite ray parallel to the axis; `min` and `max` then return it, and the
            // comparison is false.
            let end = a.mul_add(rays.t_max, rays.direction[axis], begin);
            within = a.and(within, a.lt(low, a.min(begin, end)));
            within = a.and(within, a.lt(a.max(begin, end), high));
        }
        // Inactive rays do not count.
        a.bits(a.or(within, a.lt(rays.t_max, a.splat(0.0)))) == (1 << RAYS) - 1
    }

    /// The distances at which rays enter the root's boxes, infinite for misses, and the mask of
    /// rays that hit any box before `t_max`.
    #[inline(always)]
    pub fn intersect_boxes<A: Arithmetic>(
        &self,
        a: A,
        rays: &LaneRays<A>,
        slabs: &LaneSlabs<A>,
        t_max: A::F,
    ) -> ([A::F; WIDTH], u32) {
        let infinite = a.splat(f32::INFINITY);
        let (mut near, mut nearest) = ([infinite; WIDTH], infinite);
        for slot in 0..WIDTH {
            if self.children >> slot & 1 != 0 {
                let Aabb { min, max } = self.boxes[slot];
                let (enter, inside) = slabs.intersect(a, min, max, rays.t_min, t_max);
                near[slot] = a.select(inside, infinite, enter);
                nearest = a.min(nearest, near[slot]);
            }
        }
        (near, a.bits(a.lt(nearest, infinite)))
    }

    /// Stores the hits with polygons.
    #[inline(always)]
    pub fn store_hits<S: Simd>(&self, s: S, hits: &RootHits<S::Sixteen>, to: &mut Hit16) {
        let w = s.sixteen();
        let mut firsts = [[0.0; WIDTH]; 2];
        let [low, high] = w.halves_u(hits.triangle);
        let (low_numbers, high_numbers) = to.primitive.split_at_mut(WIDTH);
        s.store_u(low, low_numbers.first_chunk_mut().expect("half of sixteen"));
        s.store_u(high, high_numbers.first_chunk_mut().expect("half of sixteen"));
        for lane in 0..RAYS {
            let last = self.triangles.len() - 1;
            let PolygonTriangle { id, first_corner } =
                self.triangles[(to.primitive[lane] as usize).min(last)];
            to.primitive[lane] = id;
            to.instance[lane] = if id == NO_PRIMITIVE { MISS.instance } else { 0 };
            firsts[lane / WIDTH][lane % WIDTH] = first_corner;
        }
        let (zero, one) = (w.splat(0.0), w.splat(1.0));
        // Weights may be below zero by the tolerance.
        let (second, third) = (w.max(zero, hits.second), w.max(zero, hits.third));
        let first = w.max(zero, w.sub(w.sub(one, second), third));
        // The polygon's first corner may be any corner of the original triangle.
        let firsts = w.join([s.load(&firsts[0]), s.load(&firsts[1])]);
        let (from_second, from_third) = (w.lt(w.splat(0.5), firsts), w.lt(w.splat(1.5), firsts));
        let u = w.select(from_third, w.select(from_second, second, first), third);
        let v = w.select(from_third, w.select(from_second, third, second), first);
        store(s, w.select(hits.any, w.splat(MISS.t), hits.t), &mut to.t);
        store(s, w.select(hits.any, zero, u), &mut to.u);
        store(s, w.select(hits.any, zero, v), &mut to.v);
    }
}

/// A node with one child.
fn parent_of(child: u32, bounds: &Aabb) -> Node {
    let mut node = Node::EMPTY;
    node.set_bounds(0, bounds);
    node.children[0] = child;
    node
}

/// Stores sixteen lanes.
#[inline(always)]
pub(super) fn store<S: Simd>(s: S, x: <S::Sixteen as Arithmetic>::F, to: &mut [f32; RAYS]) {
    let [low, high] = s.sixteen().halves(x);
    let (low_lanes, high_lanes) = to.split_at_mut(WIDTH);
    s.store(low, low_lanes.first_chunk_mut().expect("half of sixteen"));
    s.store(high, high_lanes.first_chunk_mut().expect("half of sixteen"));
}

/// Per-ray constants of the plane tests.
struct PlaneTests<A: Arithmetic> {
    /// Bound of the distance between origin and geometry along an axis; negative, as tolerances
    /// are.
    distance: A::F,
    /// The largest magnitude of a direction's component.
    longest: A::F,
    /// A quarter of the direction, so that sums of components do not overflow.
    quarter: [A::F; 3],
    /// -1 / direction.
    inverse: [A::F; 3],
    /// Tolerances for axis-aligned planes, without the polygon's factor.
    tolerance: [A::F; 3],
}

impl<A: Arithmetic> PlaneTests<A> {
    #[inline(always)]
    fn new(a: A, rays: &LaneRays<A>, bounds: &Aabb) -> Self {
        let zero = a.splat(0.0);
        let (mut distance, mut longest) = (zero, zero);
        for axis in 0..3 {
            let (low, high) = (a.splat(bounds.min[axis]), a.splat(bounds.max[axis]));
            let (to_low, to_high) = (a.sub(low, rays.origin[axis]), a.sub(rays.origin[axis], high));
            distance = a.min(distance, a.min(to_low, to_high));
            longest = a.max(longest, abs(a, rays.direction[axis]));
        }
        let [quarter, inverse, tolerance] = [[zero; 3]; 3];
        let mut tests = PlaneTests { distance, longest, quarter, inverse, tolerance };
        for axis in 0..3 {
            tests.quarter[axis] = a.mul(rays.direction[axis], a.splat(0.25));
            tests.inverse[axis] = a.div(a.splat(-1.0), rays.direction[axis]);
            tests.tolerance[axis] = tests.tolerance_at(a, tests.inverse[axis]);
        }
        tests
    }

    /// The tolerance for a plane, given the reciprocal rate at which a ray approaches it.
    #[inline(always)]
    fn tolerance_at(&self, a: A, inverse: A::F) -> A::F {
        // In this order, because the first product does not depend on the length of the direction.
        a.mul(a.mul(self.longest, a.flip_sign(inverse, inverse)), self.distance)
    }
}

/// The hits of rays in SIMD lanes with polygons.
#[derive(Clone, Copy)]
pub(super) struct RootHits<A: Arithmetic> {
    /// Mask of rays with a hit.
    pub any: A::M,
    /// Distance of the hit, or the end of the ray. Not updated for any-hit queries.
    pub t: A::F,
    /// Weights of the second and third corner, in the polygon's order.
    second: A::F,
    third: A::F,
    /// Index into [`RootStage::triangles`].
    triangle: A::U,
}

impl<A: Arithmetic> RootHits<A> {
    /// No hits yet.
    #[inline(always)]
    fn new(a: A, rays: &LaneRays<A>) -> Self {
        let zero = a.splat(0.0);
        RootHits {
            any: a.lt(zero, zero),
            t: rays.t_max,
            second: zero,
            third: zero,
            triangle: a.splat_u(u32::MAX),
        }
    }

    /// Tests a polygon and keeps closer hits; if `ANY`, only the mask of hits.
    #[inline(always)]
    fn intersect<const ANY: bool>(
        &mut self,
        a: A,
        polygon: &PlanarPolygon,
        number: u32,
        rays: &LaneRays<A>,
        tests: &PlaneTests<A>,
    ) {
        let [k, i, j] = polygon.axis.order();
        let from = [
            a.sub(rays.origin[k], a.splat(polygon.corner[k])),
            a.sub(rays.origin[i], a.splat(polygon.corner[i])),
            a.sub(rays.origin[j], a.splat(polygon.corner[j])),
        ];
        let (t, tolerance) = if polygon.is_aligned() {
            // A faster way to the same result: most walls are axis-aligned.
            (a.mul(from[0], tests.inverse[k]), tests.tolerance[k])
        } else {
            let [slope_i, slope_j] = [a.splat(polygon.slope[0]), a.splat(polygon.slope[1])];
            // The height of the origin above the plane, and a quarter of the direction's, along the
            // axis.
            let height = a.mul_add(slope_j, from[2], a.mul_add(slope_i, from[1], from[0]));
            let [dk, di, dj] = [tests.quarter[k], tests.quarter[i], tests.quarter[j]];
            let ascent = a.mul_add(slope_j, dj, a.mul_add(slope_i, di, dk));
            let inverse = a.div(a.splat(-0.25), ascent);
            (a.mul(height, inverse), tests.tolerance_at(a, inverse))
        };
        let (x, y) = (a.mul_add(t, rays.direction[i], from[1]), a.mul_add(t, rays.direction[j], from[2]));
        let b = weight(a, polygon.b, x, y);
        // The side of the shared edge.
        let beyond = a.lt(b, a.splat(polygon.beyond));
        let second = a.select(beyond, b, weight(a, polygon.c_beyond, x, y));
        let third = a.select(beyond, weight(a, polygon.c, x, y), a.mul(b, a.splat(polygon.d)));
        let first = a.sub(a.sub(a.splat(1.0), second), third);
        let lowest = a.max(a.mul(tolerance, a.splat(polygon.tolerance)), a.splat(-MAX_TOLERANCE));
        // NaN in any weight makes `first` NaN, and in this order the result.
        let inside = a.le(lowest, a.min(a.min(second, third), first));
        let is_hit = a.and(inside, a.and(a.lt(rays.t_min, t), a.lt(t, self.t)));
        self.any = a.or(self.any, is_hit);
        if !ANY {
            self.t = a.select(is_hit, self.t, t);
            self.second = a.select(is_hit, self.second, second);
            self.third = a.select(is_hit, self.third, third);
            let triangle = a.select_u(beyond, a.splat_u(2 * number), a.splat_u(2 * number + 1));
            self.triangle = a.select_u(is_hit, self.triangle, triangle);
        }
    }
}

/// The weight of a corner at a point relative to the polygon's first corner.
#[inline(always)]
fn weight<A: Arithmetic>(a: A, [along_x, along_y]: [f32; 2], x: A::F, y: A::F) -> A::F {
    a.mul_add(a.splat(along_x), x, a.mul(a.splat(along_y), y))
}

/// The hit of any-hit queries, which only say that there is one.
pub(super) const ANY_HIT: Hit = Hit { primitive: 0, ..MISS };

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Coherence, Geometry, Instance, InstructionSet, Opaque, Quality, Ray};
    use std::sync::Arc;

    /// Random numbers from -1 to 1.
    fn numbers() -> impl FnMut() -> f32 {
        let mut bits = 7u32;
        move || {
            bits = bits.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (bits >> 8) as f32 / 8_388_608.0 - 1.0
        }
    }

    /// A floor and a folded sheet, with many small triangles between them.
    fn scene() -> Blas {
        let mut number = numbers();
        let mut positions = vec![
            [-9.0, -2.0, -9.0],
            [9.0, -2.0, -9.0],
            [9.0, -2.0, 9.0],
            [-9.0, -2.0, 9.0],
            [-9.0, 3.0, -9.0],
            [9.0, 3.0, -9.0],
            [9.0, 2.0, 9.0],
            [-9.0, 5.0, 9.0],
        ];
        let mut indices = vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
        for _ in 0..4000 {
            let center = [3.0 * number(), number(), 3.0 * number()];
            let first = positions.len() as u32;
            for _ in 0..3 {
                positions.push(center.map(|c| c + 0.25 * number()));
            }
            indices.push([first, first + 1, first + 2]);
        }
        let geometry = Geometry { positions: &positions, indices: &indices, first_id: 0 };
        Blas::triangles(&[geometry], Quality::Balanced)
    }

    #[test]
    fn large_triangles_are_root_triangles() {
        let blas = scene();
        let root_stage = blas.root_triangles().expect("it is made of triangles");
        assert!(!root_stage.is_whole_object());
        let mut ids: Vec<u32> =
            root_stage.triangles.iter().map(|triangle| triangle.id).filter(|id| *id < 4).collect();
        ids.sort();
        assert_eq!(ids, [0, 1, 2, 3]);
    }

    /// Streams agree with single rays of the scalar kernels, for a single object and for instances
    /// of it.
    #[test]
    fn streams_find_what_single_rays_find() {
        let mut number = numbers();
        let mut rays: Vec<Ray> = (0..3000)
            .map(|_| {
                let origin = [4.0 * number(), 2.5 * number(), 4.0 * number()];
                let t_max = if number() > 0.0 { f32::INFINITY } else { 4.0 + 4.0 * number() };
                Ray { t_min: number(), t_max, ..Ray::new(origin, [number(), number(), number()]) }
            })
            .collect();
        rays[5].origin[1] = f32::NAN;
        rays[6].direction = [0.0; 3];
        rays.truncate(2999);
        let turned = [[0.8, 0.0, 0.6, 1.0], [0.0, 1.0, 0.0, 0.5], [-0.6, 0.0, 0.8, 0.0]];
        let second = Instance { object_to_world: turned, ..Instance::identity(0) };
        for instances in [vec![Instance::identity(0)], vec![Instance::identity(0), second]] {
            let mut tlas = Tlas::build(&instances, vec![Arc::new(scene())]);
            tlas.set_instruction_set(InstructionSet::Scalar);
            let expected: Vec<Hit> = rays.iter().map(|ray| tlas.closest(ray, &Opaque)).collect();
            let large = expected.iter().filter(|hit| hit.primitive < 4).count();
            let small = expected.iter().filter(|hit| !hit.is_miss()).count() - large;
            assert!(large > 300 && small > 300, "{large} and {small} hits");
            for isa in InstructionSet::available() {
                tlas.set_instruction_set(isa);
                let (mut hits, mut any) = (vec![MISS; rays.len()], vec![false; rays.len()]);
                tlas.closest_stream(&rays[..], &mut hits[..], &Opaque, Coherence::Incoherent);
                tlas.any_stream(&rays[..], &mut any, &Opaque, Coherence::Incoherent);
                for ((hit, any), expected) in hits.iter().zip(&any).zip(&expected) {
                    assert_eq!(*any, !expected.is_miss(), "{isa:?}");
                    let (found, wanted) =
                        ((hit.primitive, hit.instance), (expected.primitive, expected.instance));
                    assert_eq!(found, wanted, "{isa:?}: {hit:?}, {expected:?}");
                    let apart = (hit.t - expected.t).abs();
                    assert!(
                        hit.is_miss() || apart <= 1e-5 * (1.0 + expected.t),
                        "{isa:?}: {hit:?}, {expected:?}"
                    );
                }
            }
        }
    }

    /// Batches of sixteen shadow rays between points inside the bounds are not tested with the
    /// floor, which is the lower side of the bounds. A batch with one other ray is.
    #[test]
    fn shadow_rays_within_the_bounds_find_what_is_there() {
        let mut number = numbers();
        let mut within = || [8.0 * number(), 0.5 + 2.4 * number(), 8.0 * number()];
        let mut rays: Vec<Ray> = (0..1600)
            .map(|_| {
                let (from, to) = (within(), within());
                Ray { t_max: 1.0, ..Ray::new(from, [0, 1, 2].map(|k: usize| to[k] - from[k])) }
            })
            .collect();
        let crossing = Ray { t_max: 1.0, ..Ray::new([8.5, 0.0, 8.5], [0.0, -3.0, 0.0]) };
        let for_ever = Ray::new([-8.5, 0.0, 8.5], [0.1, -1.0, 0.0]);
        (rays[35], rays[70]) = (crossing, for_ever);
        let mut tlas = Tlas::build(&[Instance::identity(0)], vec![Arc::new(scene())]);
        let root_stage = RootStage::new::<Opaque>(&tlas, tlas.single_object(u32::MAX));
        assert_eq!(root_stage.inner + 1, root_stage.polygons.len(), "all but the floor");
        tlas.set_instruction_set(InstructionSet::Scalar);
        let expected: Vec<bool> = rays.iter().map(|ray| tlas.any(ray, &Opaque)).collect();
        assert!(expected[35] && expected[70] && expected.iter().filter(|any| **any).count() > 300);
        for isa in InstructionSet::available() {
            tlas.set_instruction_set(isa);
            let mut any = vec![false; rays.len()];
            tlas.any_stream(&rays[..], &mut any, &Opaque, Coherence::Incoherent);
            assert_eq!(any, expected, "{isa:?}");
        }
    }
}
