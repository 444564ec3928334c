//! What all rays of a stream meet first: sixteen at a time, they are tested with triangles and boxes at the root.
//!
//! Near the root, rays do not go different ways yet. So each large triangle and each box there is tested with sixteen rays at
//! once, which is a few times as fast as when a ray alone looks at eight of them, and no time is lost with questions in between. Most
//! rays in a room have their answer then, and only those that meet a box walk the tree below it. Where there are only a few triangles,
//! there is no tree to walk. Shadow rays from one point within the object's bounds to another are not tested with walls that lie in
//! their sides.
//!
//! How a triangle is tested, see [`crate::face`].

use super::setup::{LaneRays, LaneSlabs, abs};
use crate::aabb::Aabb;
use crate::behind::Behind;
use crate::blas::Blas;
use crate::face::{Face, MAX_TOLERANCE, Named};
use crate::handful::ALL_CHILDREN;
use crate::layout::{ChildRef, EMPTY, LEAF, NO_PRIMITIVE, Node, WIDTH};
use crate::ray::{Hit, HitFilter, MISS};
use crate::simd::{Arithmetic, Simd, Sixteen};
use crate::streams::HitRow;
use crate::tlas::Tlas;

/// Rays that are tested together.
pub(super) const RAYS: usize = 2 * WIDTH;

/// What rays are tested with before they go different ways.
pub(super) struct Top<'a> {
    faces: &'a [Face],
    /// How many of them, the first ones, are not in the sides of the bounds.
    inner: usize,
    /// The triangles of each face, and one that is none.
    triangles: &'a [Named],
    /// Of everything that rays may meet.
    bounds: Aabb,
    /// The node whose boxes rays are tested with. Where the root is no node, one with the root as its only child.
    pub root: Node,
    /// The reference to the root.
    pub entry: ChildRef,
    /// What is behind rays in its tree, if that is the tree of one object, and not the upper level.
    pub behind: &'a Behind,
    /// The boxes of the root.
    boxes: [Aabb; WIDTH],
    /// Places of those of its children that are to be tested, as bits: not those that are empty, or whose triangles are all among
    /// the faces.
    children: u32,
}

impl<'a> Top<'a> {
    /// Of the only object, or of all instances. Triangles are tested only if all hits count.
    pub fn new<F: HitFilter>(tlas: &'a Tlas, only: Option<&'a Blas>) -> Self {
        let (nodes, root, bounds) = match only {
            Some(object) => (&object.nodes, object.root, object.bounds()),
            None => (&tlas.nodes, tlas.root, tlas.bounds()),
        };
        let (entry, behind) = (root, only.map_or(const { &Behind::NOTHING }, Blas::behind));
        let root = if root & LEAF == 0 { nodes[root as usize] } else { above(root, &bounds) };
        let boxes = std::array::from_fn(|slot| root.bounds(slot));
        let mut top = Top {
            faces: &[],
            inner: 0,
            triangles: const { &[Named::NONE] },
            bounds,
            root,
            entry,
            behind,
            boxes,
            children: ALL_CHILDREN,
        };
        if let Some(handful) = only.and_then(Blas::handful).filter(|_| F::OPAQUE) {
            (top.faces, top.inner, top.triangles) = (&handful.faces, handful.inner, &handful.triangles);
            top.children &= !handful.children;
        }
        for (slot, child) in root.children.iter().enumerate() {
            top.children &= !(u32::from(*child == EMPTY) << slot);
        }
        top
    }

    /// Whether the faces are all there is.
    #[inline(always)]
    pub fn is_all(&self) -> bool {
        self.children == 0
    }

    /// Whether there are triangles to be tested with.
    #[inline(always)]
    pub fn has_faces(&self) -> bool {
        !self.faces.is_empty()
    }

    /// The nearest triangle of the faces that each ray crosses; if `ANY`, only which rays cross any.
    #[inline(always)]
    pub fn meet_faces<A: Arithmetic, const ANY: bool>(&self, a: A, rays: &LaneRays<A>) -> Crossing<A> {
        let count = if ANY && self.are_within(a, rays) { self.inner } else { self.faces.len() };
        let across = Across::new(a, rays, &self.bounds);
        let mut met = Crossing::new(a, rays);
        for (number, face) in (0..).zip(&self.faces[..count]) {
            met.meet::<ANY>(a, face, number, rays, &across);
        }
        met
    }

    /// Whether all rays go from one point within the bounds to another, and so do not cross what lies in the sides. That is no
    /// approximation: an end that is rounded once, to the nearest number, is beyond a side if the ray is.
    #[inline(always)]
    fn are_within<A: Arithmetic>(&self, a: A, rays: &LaneRays<A>) -> bool {
        if self.inner == self.faces.len() {
            return false;
        }
        let mut within = a.le(rays.t_min, rays.t_max);
        for axis in 0..3 {
            let (low, high) = (a.splat(self.bounds.min[axis]), a.splat(self.bounds.max[axis]));
            let begin = rays.origin[axis];
            // Not a number where a ray that has no end runs beside the axis; then it is what is compared, as the second one.
            let end = a.mul_add(rays.t_max, rays.direction[axis], begin);
            within = a.and(within, a.lt(low, a.min(begin, end)));
            within = a.and(within, a.lt(a.max(begin, end), high));
        }
        // Rays that can hit nothing do not count.
        a.bits(a.or(within, a.lt(rays.t_max, a.splat(0.0)))) == (1 << RAYS) - 1
    }

    /// Where the rays enter the root's boxes before `t_max`, infinite where they do not, and which rays enter any, as bits.
    #[inline(always)]
    pub fn meet_boxes<A: Arithmetic>(
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
                let (enter, inside) = slabs.meet(a, min, max, rays.t_min, t_max);
                near[slot] = a.select(inside, infinite, enter);
                nearest = a.min(nearest, near[slot]);
            }
        }
        (near, a.bits(a.lt(nearest, infinite)))
    }

    /// What the rays have crossed, ray by ray.
    #[inline(always)]
    pub fn write_hits<S: Simd>(&self, s: S, met: &Crossing<S::Sixteen>, row: &mut HitRow) {
        let w = s.sixteen();
        let mut firsts = [[0.0; WIDTH]; 2];
        let [low, high] = w.halves_u(met.triangle);
        let (low_numbers, high_numbers) = row.primitive.split_at_mut(WIDTH);
        s.store_u(low, low_numbers.first_chunk_mut().expect("half of sixteen"));
        s.store_u(high, high_numbers.first_chunk_mut().expect("half of sixteen"));
        for lane in 0..RAYS {
            let last = self.triangles.len() - 1;
            let Named { id, first } = self.triangles[(row.primitive[lane] as usize).min(last)];
            row.primitive[lane] = id;
            row.instance[lane] = if id == NO_PRIMITIVE { MISS.instance } else { 0 };
            firsts[lane / WIDTH][lane % WIDTH] = first;
        }
        let (zero, one) = (w.splat(0.0), w.splat(1.0));
        // Within the tolerance, they may be a little below.
        let (second, third) = (w.max(zero, met.second), w.max(zero, met.third));
        let first = w.max(zero, w.sub(w.sub(one, second), third));
        // The corners of a face's triangle begin with one that need not have been given first.
        let firsts = w.join([s.load(&firsts[0]), s.load(&firsts[1])]);
        let (from_second, from_third) = (w.lt(w.splat(0.5), firsts), w.lt(w.splat(1.5), firsts));
        let u = w.select(from_third, w.select(from_second, second, first), third);
        let v = w.select(from_third, w.select(from_second, third, second), first);
        store(s, w.select(met.any, w.splat(MISS.t), met.t), &mut row.t);
        store(s, w.select(met.any, zero, u), &mut row.u);
        store(s, w.select(met.any, zero, v), &mut row.v);
    }
}

/// A node with one child.
fn above(child: u32, bounds: &Aabb) -> Node {
    let mut node = Node::EMPTY;
    node.set_bounds(0, bounds);
    node.children[0] = child;
    node
}

/// Writes lanes to memory.
#[inline(always)]
pub(super) fn store<S: Simd>(s: S, x: <S::Sixteen as Arithmetic>::F, to: &mut [f32; RAYS]) {
    let [low, high] = s.sixteen().halves(x);
    let (low_lanes, high_lanes) = to.split_at_mut(WIDTH);
    s.store(low, low_lanes.first_chunk_mut().expect("half of sixteen"));
    s.store(high, high_lanes.first_chunk_mut().expect("half of sixteen"));
}

/// How rays in lanes come to planes.
struct Across<A: Arithmetic> {
    /// How far away they begin at most, along an axis, from anything within the bounds; negative, as tolerances are.
    distance: A::F,
    /// The largest coordinates of their directions.
    longest: A::F,
    /// A quarter of their directions, so that sums of coordinates stay in the range of floats.
    quarter: [A::F; 3],
    /// Minus one over the directions' coordinates.
    inverse: [A::F; 3],
    /// Tolerances of planes across the axes, but for the faces' own part.
    tolerance: [A::F; 3],
}

impl<A: Arithmetic> Across<A> {
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
        let mut across = Across { distance, longest, quarter, inverse, tolerance };
        for axis in 0..3 {
            across.quarter[axis] = a.mul(rays.direction[axis], a.splat(0.25));
            across.inverse[axis] = a.div(a.splat(-1.0), rays.direction[axis]);
            across.tolerance[axis] = across.tolerance_at(a, across.inverse[axis]);
        }
        across
    }

    /// The tolerance of a plane to which a direction rises by this.
    #[inline(always)]
    fn tolerance_at(&self, a: A, inverse: A::F) -> A::F {
        // In this order, because the first product does not depend on the directions' length.
        a.mul(a.mul(self.longest, a.flip_sign(inverse, inverse)), self.distance)
    }
}

/// What rays in lanes have crossed so far.
#[derive(Clone, Copy)]
pub(super) struct Crossing<A: Arithmetic> {
    /// Which rays have crossed anything.
    pub any: A::M,
    /// How far away, or the rays' ends; for any hits, those.
    pub t: A::F,
    /// Weights of the triangle's second and third corner, in the order of its face.
    second: A::F,
    third: A::F,
    /// Twice the face's number, and one more for its second triangle.
    triangle: A::U,
}

impl<A: Arithmetic> Crossing<A> {
    /// Nothing yet.
    #[inline(always)]
    fn new(a: A, rays: &LaneRays<A>) -> Self {
        let zero = a.splat(0.0);
        Crossing {
            any: a.lt(zero, zero),
            t: rays.t_max,
            second: zero,
            third: zero,
            triangle: a.splat_u(u32::MAX),
        }
    }

    /// Tests a face, and keeps where rays cross it if that is nearer; if `ANY`, only that they do.
    #[inline(always)]
    fn meet<const ANY: bool>(
        &mut self,
        a: A,
        face: &Face,
        number: u32,
        rays: &LaneRays<A>,
        across: &Across<A>,
    ) {
        let [k, i, j] = face.axis.order();
        let from = [
            a.sub(rays.origin[k], a.splat(face.corner[k])),
            a.sub(rays.origin[i], a.splat(face.corner[i])),
            a.sub(rays.origin[j], a.splat(face.corner[j])),
        ];
        let (t, tolerance) = if face.is_aligned() {
            // The same numbers in less time: most walls are.
            (a.mul(from[0], across.inverse[k]), across.tolerance[k])
        } else {
            let [slope_i, slope_j] = [a.splat(face.slope[0]), a.splat(face.slope[1])];
            // Above the plane, and a quarter of how fast that changes, both along the axis.
            let height = a.mul_add(slope_j, from[2], a.mul_add(slope_i, from[1], from[0]));
            let [dk, di, dj] = [across.quarter[k], across.quarter[i], across.quarter[j]];
            let ascent = a.mul_add(slope_j, dj, a.mul_add(slope_i, di, dk));
            let inverse = a.div(a.splat(-0.25), ascent);
            (a.mul(height, inverse), across.tolerance_at(a, inverse))
        };
        let (x, y) = (a.mul_add(t, rays.direction[i], from[1]), a.mul_add(t, rays.direction[j], from[2]));
        let b = weight(a, face.b, x, y);
        // On which side of the edge that both triangles have.
        let beyond = a.lt(b, a.splat(face.beyond));
        let second = a.select(beyond, b, weight(a, face.c_beyond, x, y));
        let third = a.select(beyond, weight(a, face.c, x, y), a.mul(b, a.splat(face.d)));
        let first = a.sub(a.sub(a.splat(1.0), second), third);
        let lowest = a.max(a.mul(tolerance, a.splat(face.tolerance)), a.splat(-MAX_TOLERANCE));
        // In this order it is no number where one of them is none, because then the first one is.
        let inside = a.le(lowest, a.min(a.min(second, third), first));
        let crossed = a.and(inside, a.and(a.lt(rays.t_min, t), a.lt(t, self.t)));
        self.any = a.or(self.any, crossed);
        if !ANY {
            self.t = a.select(crossed, self.t, t);
            self.second = a.select(crossed, self.second, second);
            self.third = a.select(crossed, self.third, third);
            let triangle = a.select_u(beyond, a.splat_u(2 * number), a.splat_u(2 * number + 1));
            self.triangle = a.select_u(crossed, self.triangle, triangle);
        }
    }
}

/// The weight of a corner at a point, from the face's first corner.
#[inline(always)]
fn weight<A: Arithmetic>(a: A, [along_x, along_y]: [f32; 2], x: A::F, y: A::F) -> A::F {
    a.mul_add(a.splat(along_x), x, a.mul(a.splat(along_y), y))
}

/// Some hit, no matter which.
pub(super) const ANYTHING: Hit = Hit { primitive: 0, ..MISS };

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Coherence, Geometry, Instance, Kernel, Opaque, Quality, Ray};
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
    fn large_triangles_are_met_first() {
        let blas = scene();
        let top = blas.handful().expect("it is made of triangles");
        assert!(!top.is_all());
        let mut ids: Vec<u32> = top.triangles.iter().map(|named| named.id).filter(|id| *id < 4).collect();
        ids.sort();
        assert_eq!(ids, [0, 1, 2, 3]);
    }

    /// Streams find what single rays find with the scalar twin: of the one object as it is, and of instances of it.
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
            tlas.set_kernel(Kernel::Scalar);
            let expected: Vec<Hit> = rays.iter().map(|ray| tlas.closest(ray, &Opaque)).collect();
            let large = expected.iter().filter(|hit| hit.primitive < 4).count();
            let small = expected.iter().filter(|hit| !hit.is_miss()).count() - large;
            assert!(large > 300 && small > 300, "{large} and {small} hits");
            for kernel in Kernel::available() {
                tlas.set_kernel(kernel);
                let (mut hits, mut any) = (vec![MISS; rays.len()], vec![false; rays.len()]);
                tlas.closest_stream(&rays[..], &mut hits[..], &Opaque, Coherence::Incoherent);
                tlas.any_stream(&rays[..], &mut any, &Opaque, Coherence::Incoherent);
                for ((hit, any), expected) in hits.iter().zip(&any).zip(&expected) {
                    assert_eq!(*any, !expected.is_miss(), "{kernel:?}");
                    let (found, wanted) =
                        ((hit.primitive, hit.instance), (expected.primitive, expected.instance));
                    assert_eq!(found, wanted, "{kernel:?}: {hit:?}, {expected:?}");
                    let apart = (hit.t - expected.t).abs();
                    assert!(
                        hit.is_miss() || apart <= 1e-5 * (1.0 + expected.t),
                        "{kernel:?}: {hit:?}, {expected:?}"
                    );
                }
            }
        }
    }

    /// Groups of sixteen shadow rays that go from one point within the bounds to another are not tested with the floor, which is their
    /// lower side; those of which only fifteen do are.
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
        let top = Top::new::<Opaque>(&tlas, tlas.only(u32::MAX));
        assert_eq!(top.inner + 1, top.faces.len(), "all but the floor");
        tlas.set_kernel(Kernel::Scalar);
        let expected: Vec<bool> = rays.iter().map(|ray| tlas.any(ray, &Opaque)).collect();
        assert!(expected[35] && expected[70] && expected.iter().filter(|any| **any).count() > 300);
        for kernel in Kernel::available() {
            tlas.set_kernel(kernel);
            let mut any = vec![false; rays.len()];
            tlas.any_stream(&rays[..], &mut any, &Opaque, Coherence::Incoherent);
            assert_eq!(any, expected, "{kernel:?}");
        }
    }
}
