//! Planar polygons: a triangle, or two triangles that share an edge and form a planar convex
//! quadrilateral, prepared for the root stage.
//!
//! A test computes the intersection with the plane. It projects the point along one axis, where the
//! barycentric weights are linear functions of the coordinates. All coefficients are computed
//! beforehand, so a test of two triangles takes a few dozen operations. The watertight test of the
//! tree's leaves takes twice as many (Baldwin and Weber, "Fast Ray-Triangle Intersections by
//! Coordinate Transformation", JCGT 5(3), 2016; the projection is that of Wald, "Realtime Ray
//! Tracing and Interactive Global Illumination", 2004).
//!
//! Rays that miss an edge by less than the rounding error count as hits, so that no ray passes
//! between neighbours.

use crate::layout::NO_PRIMITIVE;

/// Error of a weight that changes by one over a unit of length, for each unit of distance between
/// the origin and the plane: a few roundings of coordinates, of the plane and of the distance.
const ERROR: f64 = 4.0 * f32::EPSILON as f64;

/// Largest tolerance of weights. Triangles so slender that perpendicular rays from a distance of
/// the object's size need more are not made polygons. Rays from much farther away, or at grazing
/// angles, get this tolerance.
pub(crate) const MAX_TOLERANCE: f32 = 1.0 / 128.0;

/// Largest distance of the fourth corner from the plane of the others, relative to the largest
/// coordinate: the rounding error of a corner.
const FLATNESS: f64 = 2.0 * f32::EPSILON as f64;

/// A triangle abc, or a planar convex quadrilateral of two triangles abc and acd.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct PlanarPolygon {
    /// The corner a.
    pub corner: [f32; 3],
    /// The axis of projection: that of the normal's longest component.
    pub axis: Axis,
    /// The normal's components on the next two axes, divided by that on `axis`.
    pub slope: [f32; 2],
    /// Gradient of the weight of b along those two axes. All weights are zero at a.
    pub b: [f32; 2],
    /// Gradient of the weight of c in abc.
    pub c: [f32; 2],
    /// Gradient of the weight of c in acd.
    pub c_beyond: [f32; 2],
    /// The weight of d in acd divided by the weight of b.
    pub d: f32,
    /// The point is in acd if the weight of b is below this: zero, or -∞ for a triangle.
    pub beyond: f32,
    /// Weights may be this far below zero, for each unit of distance between origin and point.
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

impl PlanarPolygon {
    /// The triangle abc, or the quadrilateral abcd, in an object of this size. `None` if it is not
    /// planar or not convex, or if a triangle is too slender for the size.
    pub fn new([a, b, c]: [[f32; 3]; 3], d: Option<[f32; 3]>, size: f32) -> Option<PlanarPolygon> {
        let (ab, ac) = (between(a, b), between(a, c));
        let normal = cross(ab, ac);
        let longest = |x: usize, y: usize| if normal[y].abs() > normal[x].abs() { y } else { x };
        let axis = [Axis::X, Axis::Y, Axis::Z][longest(longest(0, 1), 2)];
        let [k, i, j] = axis.order();
        // The weight of a corner is one at the corner and zero on the line through a and `other`.
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
        let polygon = PlanarPolygon {
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
        polygon.is_finite().then_some(polygon)
    }

    /// Whether the plane is perpendicular to the axis.
    #[inline(always)]
    pub fn is_aligned(&self) -> bool {
        self.slope == [0.0; 2]
    }

    fn is_finite(&self) -> bool {
        let pairs = [self.slope, self.b, self.c, self.c_beyond];
        pairs.iter().flatten().chain([&self.d, &self.tolerance]).all(|x| x.is_finite())
    }
}

/// The steepest gradient of the three weights of a triangle, given the gradients of two.
fn steepest([first, second]: [[f64; 2]; 2]) -> f64 {
    let third = [first[0] + second[0], first[1] + second[1]];
    [first, second, third].map(|[x, y]| x.abs() + y.abs()).into_iter().fold(0.0, f64::max)
}

/// Whether d is in the plane of abc, up to rounding.
fn are_flat([a, b, c, d]: [[f32; 3]; 4], normal: Vector) -> bool {
    let largest = [a, b, c, d].as_flattened().iter().fold(0.0_f64, |most, x| most.max(f64::from(x.abs())));
    let height = dot(normal, between(a, d)).abs() / dot(normal, normal).sqrt();
    height <= FLATNESS * largest
}

/// Whether the quadrilateral abcd is convex. Corners are relative to a.
fn are_convex([ab, ac, ad]: [Vector; 3], normal: Vector) -> bool {
    let minus = |x: Vector, y: Vector| [0, 1, 2].map(|k: usize| x[k] - y[k]);
    let sides = [ab, minus(ac, ab), minus(ad, ac), ad.map(|x| -x)];
    (0..4).all(|n| dot(normal, cross(sides[n], sides[(n + 1) % 4])) > 0.0)
}

/// A triangle of a polygon, for hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PolygonTriangle {
    pub id: u32,
    /// Which of its original corners is the polygon's a: 0, 1 or 2.
    pub first_corner: f32,
}

impl PolygonTriangle {
    pub const NONE: PolygonTriangle = PolygonTriangle { id: NO_PRIMITIVE, first_corner: 0.0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_corners() {
        let [a, b, c, d] = [[1.0, 2.0, 0.5], [3.0, 2.0, 1.5], [3.5, 4.0, 1.75], [1.0, 5.0, 0.5]];
        let polygon = PlanarPolygon::new([a, b, c], Some(d), 5.0).expect("it is flat and convex");
        assert_eq!(polygon.axis, Axis::Z);
        // z = x / 2.
        assert_eq!(polygon.slope, [-0.5, 0.0]);
        let at = |[x, y]: [f32; 2], p: [f32; 3]| x * (p[0] - a[0]) + y * (p[1] - a[1]);
        let near = |x: f32, y: f32| assert!((x - y).abs() < 1e-6, "{x} {y}");
        for (p, expected) in [(a, [0.0, 0.0]), (b, [1.0, 0.0]), (c, [0.0, 1.0])] {
            near(at(polygon.b, p), expected[0]);
            near(at(polygon.c, p), expected[1]);
        }
        for (p, expected) in [(a, [0.0, 0.0]), (c, [1.0, 0.0]), (d, [0.0, 1.0])] {
            near(at(polygon.c_beyond, p), expected[0]);
            near(polygon.d * at(polygon.b, p), expected[1]);
        }
        assert!(at(polygon.b, d) < polygon.beyond && polygon.tolerance > 0.0 && !polygon.is_aligned());
    }

    #[test]
    fn what_is_bent_hollow_or_slender_is_not_taken() {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert!(PlanarPolygon::new([a, b, c], Some(d), 1.0).is_some());
        assert!(
            PlanarPolygon::new([a, b, c], None, 1.0)
                .is_some_and(|polygon| polygon.beyond == f32::NEG_INFINITY)
        );
        assert_eq!(PlanarPolygon::new([a, b, c], Some([0.0, 1.0, 1e-5]), 1.0), None, "bent");
        assert_eq!(PlanarPolygon::new([a, b, c], Some([1.5, 2.0, 0.0]), 1.0), None, "hollow at c");
        assert_eq!(PlanarPolygon::new([a, b, c], Some([-1.0, -0.5, 0.0]), 1.0), None, "hollow at a");
        assert_eq!(PlanarPolygon::new([a, c, b], Some(d), 1.0), None, "on top of each other");
        assert_eq!(PlanarPolygon::new([a, b, [0.5, 1e-5, 0.0]], None, 1.0), None, "slender");
        assert_eq!(PlanarPolygon::new([a, b, b], None, 1.0), None, "nothing");
    }
}
