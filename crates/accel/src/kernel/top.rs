//! What all rays of a stream meet first: sixteen at a time, they are tested with triangles and boxes at the root.
//!
//! Near the root, rays do not go different ways yet. So each large triangle and each box there is tested with sixteen rays at
//! once, which is a few times as fast as when a ray alone looks at eight of them, and no time is lost with questions in between. Most
//! rays in a room have their answer then, and only those that meet a box walk the tree below it. Where there are only a few triangles,
//! there is no tree to walk. Shadow rays from one point within the object's bounds to another are not tested with walls that lie in
//! their sides.
//!
//! Each corner of a triangle is moved into the space of sixteen rays at once, in which they run along an axis; what is left of a test
//! are the areas between the origin and the edges, of which neighbours share one. The arithmetic is that of
//! [`super::leaves::Triangles`], for one triangle and sixteen rays instead of one ray and eight triangles.

use super::leaves::splats;
use super::setup::{LaneRays, LaneSlabs, Shears};
use crate::aabb::Aabb;
use crate::behind::Behind;
use crate::blas::Blas;
use crate::handful::{ALL_CHILDREN, Face, MAX_CORNERS, Share};
use crate::layout::{ChildRef, EMPTY, LEAF, NO_PRIMITIVE, Node, WIDTH};
use crate::ray::{Hit, HitFilter, MISS};
use crate::simd::{Arithmetic, Simd, Sixteen};
use crate::tlas::Tlas;
use std::mem::MaybeUninit;

/// Rays that are tested together.
pub(super) const RAYS: usize = 2 * WIDTH;

/// What rays are tested with before they go different ways.
pub(super) struct Top<'a> {
    faces: &'a [Face],
    /// Of the faces.
    corners: &'a [[f32; 3]],
    /// What is not in the sides of the bounds.
    inner: Share,
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

/// The corners of faces in the spaces of rays in lanes. Not initialised: most handfuls have few.
pub(super) struct LaneCorners<A: Arithmetic>([MaybeUninit<[A::F; 3]>; MAX_CORNERS]);

impl<A: Arithmetic> LaneCorners<A> {
    pub fn new() -> Self {
        LaneCorners([const { MaybeUninit::uninit() }; MAX_CORNERS])
    }
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
        let inner = Share::default();
        let boxes = std::array::from_fn(|slot| root.bounds(slot));
        let mut top = Top {
            faces: &[],
            corners: &[],
            inner,
            bounds,
            root,
            entry,
            behind,
            boxes,
            children: ALL_CHILDREN,
        };
        if let Some(handful) = only.and_then(Blas::handful).filter(|_| F::OPAQUE) {
            (top.faces, top.corners) = (&handful.faces, &handful.corners);
            top.inner = handful.inner;
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

    /// The nearest triangle of the faces that each ray crosses; if `ANY`, only how far away it is.
    #[inline(always)]
    pub fn meet_faces<A: Arithmetic, const ANY: bool>(
        &self,
        a: A,
        rays: &LaneRays<A>,
        shears: &Shears<A>,
        corners: &mut LaneCorners<A>,
    ) -> Crossing<A> {
        let share = if ANY && self.are_within(a, rays) { self.inner } else { self.all() };
        for (corner, point) in corners.0.iter_mut().zip(&self.corners[..share.corners]) {
            corner.write(shears.apply(a, splats(a, *point)));
        }
        let mut met = Crossing { t: rays.t_max, areas: [a.splat(0.0); 3], triangle: a.splat_u(u32::MAX) };
        for (number, face) in (0..).zip(&self.faces[..share.faces]) {
            let [p, q, r, s] = face.corners;
            // SAFETY: the corners of so many of a handful's first faces as a `Share` says are among so many first corners, all of which
            // have just been written.
            let corners = unsafe {
                [
                    p.at(&corners.0).assume_init(),
                    q.at(&corners.0).assume_init(),
                    r.at(&corners.0).assume_init(),
                    s.at(&corners.0).assume_init(),
                ]
            };
            let [one, other] = cross(a, corners, number);
            if a.bits(a.and(one.inside, other.inside)) != 0 {
                // A fold, or the very edge between the two.
                met.keep_nearer::<ANY>(a, &one, rays.t_min, shears.shear[2]);
                met.keep_nearer::<ANY>(a, &other, rays.t_min, shears.shear[2]);
            } else {
                met.keep_nearer::<ANY>(a, &one.or(a, &other), rays.t_min, shears.shear[2]);
            }
        }
        met
    }

    /// All faces and corners.
    #[inline(always)]
    fn all(&self) -> Share {
        Share { faces: self.faces.len(), corners: self.corners.len() }
    }

    /// Whether all rays go from one point within the bounds to another, and so do not cross what lies in the sides. That is no
    /// approximation: an end that is rounded once, to the nearest number, is beyond a side if the ray is.
    #[inline(always)]
    fn are_within<A: Arithmetic>(&self, a: A, rays: &LaneRays<A>) -> bool {
        if self.inner.faces == self.faces.len() {
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
    pub fn found<S: Simd>(&self, s: S, met: &Crossing<S::Sixteen>) -> Found<'a> {
        let w = s.sixteen();
        let inverse = w.div(w.splat(1.0), met.areas[2]);
        let (second, third) = (w.mul(met.areas[0], inverse), w.mul(met.areas[1], inverse));
        let first = w.sub(w.sub(w.splat(1.0), second), third);
        let mut found = Found {
            faces: self.faces,
            t: lanes(s, met.t),
            weights: [lanes(s, first), lanes(s, second), lanes(s, third)],
            triangles: [[0; WIDTH]; 2],
        };
        let [low, high] = w.halves_u(met.triangle);
        s.store_u(low, &mut found.triangles[0]);
        s.store_u(high, &mut found.triangles[1]);
        found
    }
}

/// A node with one child.
fn above(child: u32, bounds: &Aabb) -> Node {
    let mut node = Node::EMPTY;
    node.set_bounds(0, bounds);
    node.children[0] = child;
    node
}

/// The lanes in memory.
#[inline(always)]
pub(super) fn lanes<S: Simd>(s: S, x: <S::Sixteen as Arithmetic>::F) -> [[f32; WIDTH]; 2] {
    let mut lanes = [[0.0; WIDTH]; 2];
    let [low, high] = s.sixteen().halves(x);
    s.store(low, &mut lanes[0]);
    s.store(high, &mut lanes[1]);
    lanes
}

/// What rays in lanes have crossed so far.
#[derive(Clone, Copy)]
pub(super) struct Crossing<A: Arithmetic> {
    /// How far away, or the rays' ends.
    pub t: A::F,
    /// Areas opposite to the triangle's second and third corner, in the order of its face, and of the whole triangle.
    areas: [A::F; 3],
    /// Twice the face's number, and one more for its second triangle.
    triangle: A::U,
}

impl<A: Arithmetic> Crossing<A> {
    /// Keeps a triangle where it is nearer; if `ANY`, only how far away it is. Each number waits for those of the same kind only.
    #[inline(always)]
    fn keep_nearer<const ANY: bool>(&mut self, a: A, with: &Lines<A>, t_min: A::F, shear_z: A::F) {
        let t = a.div(a.mul(shear_z, with.scaled), with.areas[2]);
        let nearer = a.and(with.inside, a.and(a.lt(t_min, t), a.lt(t, self.t)));
        self.t = a.select(nearer, self.t, t);
        if !ANY {
            self.areas = [
                a.select(nearer, self.areas[0], with.areas[0]),
                a.select(nearer, self.areas[1], with.areas[1]),
                a.select(nearer, self.areas[2], with.areas[2]),
            ];
            self.triangle = a.select_u(nearer, self.triangle, with.triangle);
        }
    }
}

/// Where lines of rays meet a triangle.
#[derive(Clone, Copy)]
struct Lines<A: Arithmetic> {
    /// Whether that is inside of it.
    inside: A::M,
    /// How far away along the axis, times the triangle's area.
    scaled: A::F,
    /// As of [`Crossing`].
    areas: [A::F; 3],
    triangle: A::U,
}

impl<A: Arithmetic> Lines<A> {
    /// `e`: areas opposite to the triangle's corners; `z`: the corners' third coordinates.
    #[inline(always)]
    fn new(a: A, e: [A::F; 3], z: [A::F; 3], triangle: u32) -> Self {
        let det = a.add(a.add(e[0], e[1]), e[2]);
        let side = a.min(a.min(a.flip_sign(e[0], det), a.flip_sign(e[1], det)), a.flip_sign(e[2], det));
        Lines {
            inside: a.le(a.splat(0.0), side),
            scaled: a.mul_add(e[0], z[0], a.mul_add(e[1], z[1], a.mul(e[2], z[2]))),
            areas: [e[1], e[2], det],
            triangle: a.splat_u(triangle),
        }
    }

    /// Of the other triangle where lines meet that one inside, of this one elsewhere.
    #[inline(always)]
    fn or(&self, a: A, other: &Self) -> Self {
        let it = other.inside;
        Lines {
            inside: a.or(self.inside, it),
            scaled: a.select(it, self.scaled, other.scaled),
            areas: [
                a.select(it, self.areas[0], other.areas[0]),
                a.select(it, self.areas[1], other.areas[1]),
                a.select(it, self.areas[2], other.areas[2]),
            ],
            triangle: a.select_u(it, self.triangle, other.triangle),
        }
    }
}

/// Twice the area between the axis and an edge. Not fused, so that the edge in the other direction has the same area with
/// the other sign: see the scalar function.
#[inline(always)]
fn area<A: Arithmetic>(a: A, from: [A::F; 3], to: [A::F; 3]) -> A::F {
    a.sub(a.mul(to[0], from[1]), a.mul(to[1], from[0]))
}

/// Where lines meet the two triangles of a face.
#[inline(always)]
fn cross<A: Arithmetic>(a: A, [p, q, r, s]: [[A::F; 3]; 4], number: u32) -> [Lines<A>; 2] {
    let (qr, rp, pq) = (area(a, q, r), area(a, r, p), area(a, p, q));
    let (rs, sp, pr) = (area(a, r, s), area(a, s, p), a.sub(a.splat(0.0), rp));
    [
        Lines::new(a, [qr, rp, pq], [p[2], q[2], r[2]], 2 * number),
        Lines::new(a, [rs, sp, pr], [p[2], r[2], s[2]], 2 * number + 1),
    ]
}

/// What sixteen rays have crossed.
pub(super) struct Found<'a> {
    faces: &'a [Face],
    t: [[f32; WIDTH]; 2],
    weights: [[[f32; WIDTH]; 2]; 3],
    triangles: [[u32; WIDTH]; 2],
}

impl Found<'_> {
    /// Of the ray in a lane: its nearest triangle, if it has crossed any.
    #[inline(always)]
    pub fn hit(&self, lane: usize) -> Option<Hit> {
        let (half, lane) = (lane / WIDTH % 2, lane % WIDTH);
        let triangle = self.triangles[half][lane] as usize;
        let face = self.faces.get(triangle / 2)?;
        let which = triangle & 1;
        debug_assert_ne!(face.ids[which], NO_PRIMITIVE);
        // The corners of a face's triangle begin with one that need not have been given first.
        let turn = usize::from(face.first[which]) % 3;
        let (u, v) = (self.weights[[1, 0, 2][turn]][half][lane], self.weights[[2, 1, 0][turn]][half][lane]);
        Some(Hit { t: self.t[half][lane], u, v, primitive: face.ids[which], instance: 0 })
    }
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
        let mut ids: Vec<u32> = top.faces.iter().flat_map(|face| face.ids).filter(|id| *id < 4).collect();
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
        assert_eq!(top.inner.faces + 1, top.faces.len(), "all but the floor");
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
