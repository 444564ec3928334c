//! A triangle, or two in one plane that share an edge, as rays in lanes are tested with it.
//!
//! A line meets the plane first; the point there, seen along one of the axes, has weights of the corners that are linear functions of
//! its place. All that is found out beforehand, so a test is a few dozen operations for two triangles, where moving corners into the
//! space of each ray and measuring areas between them takes twice as many (Baldwin and Weber, "Fast Ray-Triangle Intersections by
//! Coordinate Transformation", JCGT 5(3), 2016, with the projection of Wald, "Realtime Ray Tracing and Interactive Global Illumination", 2004).
//!
//! Rays that pass an edge by as little as rounding may err are let in, so that nothing gets through between neighbours.

use crate::layout::NO_PRIMITIVE;

/// How much a weight may err, for each unit of length that the origin is away, along the normal and for a weight that changes by one
/// over a unit: a few roundings of coordinates, of the plane and of the distance.
const ERROR: f64 = 4.0 * f32::EPSILON as f64;

/// Largest tolerance of weights. Triangles so slender that rays which come straight from as far away as the object is large need more are
/// not tested in this way; rays that come from much farther or graze a triangle get no more.
pub(crate) const MAX_TOLERANCE: f32 = 1.0 / 128.0;

/// How far the fourth corner may be from the plane of the others, as a part of the largest coordinate: as much as it is rounded.
const FLATNESS: f64 = 2.0 * f32::EPSILON as f64;

/// One triangle abc, or two in one plane, abc and acd, which together are convex.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Face {
    /// The corner a.
    pub corner: [f32; 3],
    /// The axis along which the plane is looked at: that of the normal's longest coordinate.
    pub axis: Axis,
    /// The normal's coordinates on the next axis and the one after it, over that on `axis`.
    pub slope: [f32; 2],
    /// How the weight of b changes along those two axes. It is zero at a, as the others are.
    pub b: [f32; 2],
    /// How that of c does, in abc.
    pub c: [f32; 2],
    /// How that of c does, in acd.
    pub c_beyond: [f32; 2],
    /// The weight of d in acd over that of b.
    pub d: f32,
    /// Where the weight of b is below this, the point is in acd: zero, or -∞ if there is only abc.
    pub beyond: f32,
    /// Weights may be so far below zero, for each unit of the origin's distance over the cosine.
    pub tolerance: f32,
}

/// An axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// This axis and the two after it.
    #[inline(always)]
    pub fn order(self) -> [usize; 3] {
        match self {
            Axis::X => [0, 1, 2],
            Axis::Y => [1, 2, 0],
            Axis::Z => [2, 0, 1],
        }
    }
}

/// A vector in double precision.
type Vector = [f64; 3];

fn between(from: [f32; 3], to: [f32; 3]) -> Vector {
    [0, 1, 2].map(|k: usize| f64::from(to[k]) - f64::from(from[k]))
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Face {
    /// The triangle abc, or also acd, of an object of this size. `None` if d is not in the plane of the others or the two are not
    /// convex, and if they are too slender for that object.
    pub fn new([a, b, c]: [[f32; 3]; 3], d: Option<[f32; 3]>, size: f32) -> Option<Face> {
        let (ab, ac) = (between(a, b), between(a, c));
        let normal = cross(ab, ac);
        let longest = |x: usize, y: usize| if normal[y].abs() > normal[x].abs() { y } else { x };
        let axis = [Axis::X, Axis::Y, Axis::Z][longest(longest(0, 1), 2)];
        let [k, i, j] = axis.order();
        // The weight of one corner of a triangle at a is one there and zero on the line through a and `other`.
        let weight = |corner: Vector, other: Vector| {
            let area = corner[i] * other[j] - corner[j] * other[i];
            [other[j] / area, -other[i] / area]
        };
        let (of_b, of_c) = (weight(ab, ac), weight(ac, ab));
        let mut steepest = steepest([of_b, of_c]);
        let (mut c_beyond, mut of_d, mut beyond) = ([0.0; 2], 0.0, f32::NEG_INFINITY);
        if let Some(d) = d {
            let ad = between(a, d);
            if !are_flat([a, b, c, d], normal) || !are_convex([ab, ac, ad], normal) {
                return None;
            }
            c_beyond = weight(ac, ad);
            let d_beyond = weight(ad, ac);
            // Both are zero on the line through a and c.
            of_d = if ac[i].abs() > ac[j].abs() { d_beyond[1] / of_b[1] } else { d_beyond[0] / of_b[0] };
            beyond = 0.0;
            steepest = steepest.max(self::steepest([c_beyond, d_beyond]));
        }
        let tolerance = ERROR * steepest;
        let most = tolerance * f64::from(size);
        if most.is_nan() || most > f64::from(MAX_TOLERANCE) {
            return None;
        }
        let pair = |[x, y]: [f64; 2]| [x as f32, y as f32];
        let face = Face {
            corner: a,
            axis,
            slope: pair([normal[i] / normal[k], normal[j] / normal[k]]),
            b: pair(of_b),
            c: pair(of_c),
            c_beyond: pair(c_beyond),
            d: of_d as f32,
            beyond,
            tolerance: tolerance as f32,
        };
        face.is_finite().then_some(face)
    }

    /// Whether the plane is across the axis.
    #[inline(always)]
    pub fn is_aligned(&self) -> bool {
        self.slope == [0.0; 2]
    }

    fn is_finite(&self) -> bool {
        let pairs = [self.slope, self.b, self.c, self.c_beyond];
        pairs.iter().flatten().chain([&self.d, &self.tolerance]).all(|x| x.is_finite())
    }
}

/// How fast the weights of a triangle's corners change, of which these are those of two.
fn steepest([first, second]: [[f64; 2]; 2]) -> f64 {
    let third = [first[0] + second[0], first[1] + second[1]];
    [first, second, third].map(|[x, y]| x.abs() + y.abs()).into_iter().fold(0.0, f64::max)
}

/// Whether d is where the plane of abc is, as far as coordinates tell.
fn are_flat([a, b, c, d]: [[f32; 3]; 4], normal: Vector) -> bool {
    let largest = [a, b, c, d].as_flattened().iter().fold(0.0_f64, |most, x| most.max(f64::from(x.abs())));
    let height = dot(normal, between(a, d)).abs() / dot(normal, normal).sqrt();
    height <= FLATNESS * largest
}

/// Whether all corners of abcd, given from a, turn the same way.
fn are_convex([ab, ac, ad]: [Vector; 3], normal: Vector) -> bool {
    let minus = |x: Vector, y: Vector| [0, 1, 2].map(|k: usize| x[k] - y[k]);
    let sides = [ab, minus(ac, ab), minus(ad, ac), ad.map(|x| -x)];
    (0..4).all(|n| dot(normal, cross(sides[n], sides[(n + 1) % 4])) > 0.0)
}

/// A triangle of a face, as a hit names it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Named {
    pub id: u32,
    /// Which of its corners, as it was given, is the face's a: 0, 1 or 2.
    pub first: f32,
}

impl Named {
    pub const NONE: Named = Named { id: NO_PRIMITIVE, first: 0.0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_corners() {
        let [a, b, c, d] = [[1.0, 2.0, 0.5], [3.0, 2.0, 1.5], [3.5, 4.0, 1.75], [1.0, 5.0, 0.5]];
        let face = Face::new([a, b, c], Some(d), 5.0).expect("it is flat and convex");
        assert_eq!(face.axis, Axis::Z);
        // z = x / 2.
        assert_eq!(face.slope, [-0.5, 0.0]);
        let at = |[x, y]: [f32; 2], p: [f32; 3]| x * (p[0] - a[0]) + y * (p[1] - a[1]);
        let near = |x: f32, y: f32| assert!((x - y).abs() < 1e-6, "{x} {y}");
        for (p, expected) in [(a, [0.0, 0.0]), (b, [1.0, 0.0]), (c, [0.0, 1.0])] {
            near(at(face.b, p), expected[0]);
            near(at(face.c, p), expected[1]);
        }
        for (p, expected) in [(a, [0.0, 0.0]), (c, [1.0, 0.0]), (d, [0.0, 1.0])] {
            near(at(face.c_beyond, p), expected[0]);
            near(face.d * at(face.b, p), expected[1]);
        }
        assert!(at(face.b, d) < face.beyond && face.tolerance > 0.0 && !face.is_aligned());
    }

    #[test]
    fn what_is_bent_hollow_or_slender_is_not_taken() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert!(Face::new([a, b, c], Some(d), 1.0).is_some());
        assert!(Face::new([a, b, c], None, 1.0).is_some_and(|face| face.beyond == f32::NEG_INFINITY));
        assert_eq!(Face::new([a, b, c], Some([0.0, 1.0, 1e-5]), 1.0), None, "bent");
        assert_eq!(Face::new([a, b, c], Some([1.5, 2.0, 0.0]), 1.0), None, "hollow at c");
        assert_eq!(Face::new([a, b, c], Some([-1.0, -0.5, 0.0]), 1.0), None, "hollow at a");
        assert_eq!(Face::new([a, c, b], Some(d), 1.0), None, "on top of each other");
        assert_eq!(Face::new([a, b, [0.5, 1e-5, 0.0]], None, 1.0), None, "slender");
        assert_eq!(Face::new([a, b, b], None, 1.0), None, "nothing");
    }
}
