//! A handful of triangles: eight rays at a time are tested with all of them.
//!
//! Where there are only a few triangles, which of them a ray meets is soon known by looking at all, and no time is lost with
//! questions in between. Each corner is moved into the space of eight rays at once, in which they run along an axis; what is
//! left of a test are the areas between the origin and the edges, of which neighbours share one.
//!
//! The arithmetic is that of [`super::leaves::Triangles`], for one triangle and eight rays instead of the other way round.

use super::leaves::splats;
use super::setup::{Shears, vectors};
use crate::handful::{Face, Handful, MAX_CORNERS};
use crate::layout::{NO_PRIMITIVE, WIDTH};
use crate::ray::{Hit, MISS};
use crate::simd::Simd;
use crate::streams::{RayLanes, RayStream};
use std::mem::MaybeUninit;

/// Twice the area between the axis and an edge. Not fused, so that the edge in the other direction has the same area with
/// the other sign: see the scalar function.
#[inline(always)]
fn area<S: Simd>(s: S, from: [S::F; 3], to: [S::F; 3]) -> S::F {
    s.sub(s.mul(to[0], from[1]), s.mul(to[1], from[0]))
}

/// Where eight rays cross a triangle, or what they have met so far.
#[derive(Clone, Copy)]
struct Crossing<S: Simd> {
    /// Infinite where it is not crossed.
    t: S::F,
    /// Areas opposite to the triangle's second and third corner, in the order of its face, and of the whole triangle.
    areas: [S::F; 3],
    /// Twice the face's number, and one more for its second triangle.
    triangle: S::U,
}

impl<S: Simd> Crossing<S> {
    /// Of a triangle. `e`: areas opposite to its corners; `z`: the corners' third coordinates.
    #[inline(always)]
    fn new(s: S, e: [S::F; 3], z: [S::F; 3], shear_z: S::F, t_min: S::F, triangle: u32) -> Self {
        let det = s.add(s.add(e[0], e[1]), e[2]);
        let side = s.min(s.min(s.flip_sign(e[0], det), s.flip_sign(e[1], det)), s.flip_sign(e[2], det));
        let scaled = s.mul(shear_z, s.mul_add(e[0], z[0], s.mul_add(e[1], z[1], s.mul(e[2], z[2]))));
        let t = s.div(scaled, det);
        let crossed = s.and(s.le(s.splat(0.0), side), s.lt(t_min, t));
        let t = s.select(crossed, s.splat(f32::INFINITY), t);
        Crossing { t, areas: [e[1], e[2], det], triangle: s.splat_u(triangle) }
    }

    /// The nearer one in each lane. Each of its numbers waits for those of the same kind only.
    #[inline(always)]
    fn nearer(s: S, a: Self, b: Self) -> Self {
        let take_b = s.lt(b.t, a.t);
        Crossing {
            t: s.min(b.t, a.t),
            areas: [
                s.select(take_b, a.areas[0], b.areas[0]),
                s.select(take_b, a.areas[1], b.areas[1]),
                s.select(take_b, a.areas[2], b.areas[2]),
            ],
            triangle: s.select_u(take_b, a.triangle, b.triangle),
        }
    }
}

/// Answers the queries of a stream: `answer` gets the number of a ray and its nearest hit (for `ANY`: some hit, of which only
/// the existence counts). Rays that hit nothing get no answer.
#[inline(always)]
pub(super) fn trace<S: Simd, const ANY: bool>(
    s: S,
    handful: &Handful,
    rays: &(impl RayStream + ?Sized),
    mut answer: impl FnMut(usize, &Hit),
) {
    // Not initialised: most handfuls have few corners.
    let mut corners = [const { MaybeUninit::<[[S::F; 3]; GROUPS]>::uninit() }; MAX_CORNERS];
    let mut lanes = [RayLanes::NOTHING; GROUPS];
    for first in (0..rays.len()).step_by(GROUPS * WIDTH) {
        rays.load(first, &mut lanes[0]);
        rays.load(first + WIDTH, &mut lanes[1]);
        let groups: [Group<S>; GROUPS] = [Group::new(s, &lanes[0]), Group::new(s, &lanes[1])];
        for (corner, point) in corners.iter_mut().zip(&handful.corners) {
            let point = splats(s, *point);
            corner.write([groups[0].shears.apply(s, point), groups[1].shears.apply(s, point)]);
        }
        let mut met = [groups[0].nothing(s), groups[1].nothing(s)];
        for (number, face) in (0..).zip(&handful.faces) {
            let [a, b, c, d] = face.corners;
            // SAFETY: the corners of a face are some of its handful's, all of which have just been written.
            let (a, b, c, d) = unsafe {
                (
                    a.at(&corners).assume_init_ref(),
                    b.at(&corners).assume_init_ref(),
                    c.at(&corners).assume_init_ref(),
                    d.at(&corners).assume_init_ref(),
                )
            };
            for g in 0..GROUPS {
                let [one, other] = cross(s, [a[g], b[g], c[g], d[g]], &groups[g], number);
                if ANY {
                    met[g].t = s.min(s.min(one.t, other.t), met[g].t);
                } else {
                    met[g] = Crossing::nearer(s, met[g], Crossing::nearer(s, one, other));
                }
            }
        }
        for g in 0..GROUPS {
            let first = first + g * WIDTH;
            let mut hits = s.bits(s.lt(met[g].t, groups[g].t_max));
            if ANY {
                while hits != 0 {
                    answer(first + hits.trailing_zeros() as usize, &Hit { primitive: 0, ..MISS });
                    hits &= hits - 1;
                }
            } else {
                tell(s, &handful.faces, &met[g], |lane, hit| answer(first + lane, hit));
            }
        }
    }
}

/// Groups of rays that are tested side by side: one does not wait for the results of the other, and what is read of a face serves both.
const GROUPS: usize = 2;

/// Eight rays.
struct Group<S: Simd> {
    shears: Shears<S>,
    t_min: S::F,
    t_max: S::F,
}

impl<S: Simd> Group<S> {
    #[inline(always)]
    fn new(s: S, lanes: &RayLanes) -> Self {
        // A beginning that is not a number is none: the comparison with itself is false then.
        let t_min = s.load(&lanes.t_min);
        let t_max = s.select(s.le(t_min, t_min), s.splat(-1.0), s.load(&lanes.t_max));
        Group {
            shears: Shears::new(s, vectors(s, &lanes.origin), vectors(s, &lanes.direction)),
            t_min: s.max(t_min, s.splat(0.0)),
            t_max,
        }
    }

    #[inline(always)]
    fn nothing(&self, s: S) -> Crossing<S> {
        Crossing { t: self.t_max, areas: [s.splat(0.0); 3], triangle: s.splat_u(u32::MAX) }
    }
}

/// Where rays cross the two triangles of a face.
#[inline(always)]
fn cross<S: Simd>(s: S, [a, b, c, d]: [[S::F; 3]; 4], group: &Group<S>, number: u32) -> [Crossing<S>; 2] {
    let (bc, ca, ab) = (area(s, b, c), area(s, c, a), area(s, a, b));
    let (cd, da, ac) = (area(s, c, d), area(s, d, a), s.sub(s.splat(0.0), ca));
    let (shear_z, t_min) = (group.shears.shear[2], group.t_min);
    [
        Crossing::new(s, [bc, ca, ab], [a[2], b[2], c[2]], shear_z, t_min, 2 * number),
        Crossing::new(s, [cd, da, ac], [a[2], c[2], d[2]], shear_z, t_min, 2 * number + 1),
    ]
}

/// Calls `hit` with each lane that has one.
#[inline(always)]
fn tell<S: Simd>(s: S, faces: &[Face], met: &Crossing<S>, mut hit: impl FnMut(usize, &Hit)) {
    let (one, inverse) = (s.splat(1.0), s.div(s.splat(1.0), met.areas[2]));
    let (second, third) = (s.mul(met.areas[0], inverse), s.mul(met.areas[1], inverse));
    let (mut t, mut weights, mut triangles) = ([0.0; WIDTH], [[0.0; WIDTH]; 3], [0; WIDTH]);
    s.store(met.t, &mut t);
    s.store(s.sub(s.sub(one, second), third), &mut weights[0]);
    s.store(second, &mut weights[1]);
    s.store(third, &mut weights[2]);
    s.store_u(met.triangle, &mut triangles);
    for lane in 0..WIDTH {
        let Some(face) = faces.get(triangles[lane] as usize / 2) else { continue };
        let which = triangles[lane] as usize & 1;
        debug_assert_ne!(face.ids[which], NO_PRIMITIVE);
        // The corners of a face's triangle begin with one that need not have been given first.
        let turn = usize::from(face.first[which]) % 3;
        let (u, v) = (weights[[1, 0, 2][turn]][lane], weights[[2, 1, 0][turn]][lane]);
        hit(lane, &Hit { t: t[lane], u, v, primitive: face.ids[which], instance: 0 });
    }
}
