//! Where a ray meets a triangle, a sphere or a box: the scalar formulas of the project.
//!
//! The vector kernels of the acceleration structures follow the same formulas, lane by lane, and are tested against
//! these.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod intersect {
    use wgsl_rs::std::*;

    /// The part of the watertight triangle test that depends on the ray alone.
    ///
    /// The ray's direction is sheared onto +w, where w is the axis in which the direction is longest.
    #[derive(Clone, Copy)]
    pub struct RayShear {
        /// The axis w: 0 for x, 1 for y, 2 for z. The other two follow cyclically: (u, v, w).
        pub axis: u32,
        /// `(d_u / d_w, d_v / d_w, 1 / d_w)`.
        pub shear: Vec3f,
    }

    /// A point on a triangle's plane, or nothing.
    #[derive(Clone, Copy)]
    pub struct TriangleHit {
        /// Ray parameter, in units of the direction's length.
        pub t: f32,
        /// Barycentric weight of the second vertex: the point is `(1-u-v) p0 + u p1 + v p2`.
        pub u: f32,
        /// Barycentric weight of the third vertex.
        pub v: f32,
        /// Whether there is a hit. The other fields are zero if not.
        pub hit: bool,
    }

    /// Both crossings of a line with a sphere.
    #[derive(Clone, Copy)]
    pub struct SphereHit {
        /// The smaller ray parameter, where the line enters. May be negative.
        pub near: f32,
        /// The larger ray parameter, where the line leaves. May be negative.
        pub far: f32,
        /// Whether the line crosses the sphere. The other fields are zero if not.
        pub hit: bool,
    }

    /// The part of a ray inside a box.
    #[derive(Clone, Copy)]
    pub struct BoxHit {
        /// Where the ray enters the box, at least the ray's own start.
        pub near: f32,
        /// Where the ray leaves the box, at most the ray's own end.
        pub far: f32,
        /// Whether `near <= far`.
        pub hit: bool,
    }

    /// Rotates `v` cyclically so that its component `axis` comes last.
    pub fn axis_last(v: Vec3f, axis: u32) -> Vec3f {
        let mut r = v;
        if axis == 0u32 {
            r = vec3f(v.y, v.z, v.x);
        }
        if axis == 1u32 {
            r = vec3f(v.z, v.x, v.y);
        }
        r
    }

    /// Prepares the watertight triangle test for a ray of this `direction` (any length but zero).
    pub fn ray_shear(direction: Vec3f) -> RayShear {
        let a = vec3f(abs(direction.x), abs(direction.y), abs(direction.z));
        let mut axis = 2u32;
        if a.x > a.y && a.x > a.z {
            axis = 0u32;
        }
        if a.y >= a.x && a.y > a.z {
            axis = 1u32;
        }
        let d = axis_last(direction, axis);
        RayShear { axis: axis, shear: vec3f(d.x / d.z, d.y / d.z, 1.0 / d.z) }
    }

    /// Tests a ray against the two-sided triangle `p0 p1 p2`, without gaps between triangles that share an edge.
    ///
    /// A hit has `t_min < t < t_max`. A ray through a shared edge or vertex hits at least one of the triangles
    /// there. A triangle without area as seen from the ray never hits; NaN never hits. Products of coordinates
    /// must neither overflow nor vanish: coordinates relative to the origin of 1e-18 to 1e18 are safe.
    ///
    /// Method: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013. An edge function of
    /// exactly zero counts as inside, so their second pass in double precision is not needed.
    pub fn intersect_triangle(
        origin: Vec3f,
        ray: RayShear,
        p0: Vec3f,
        p1: Vec3f,
        p2: Vec3f,
        t_min: f32,
        t_max: f32,
    ) -> TriangleHit {
        let a = axis_last(p0 - origin, ray.axis);
        let b = axis_last(p1 - origin, ray.axis);
        let c = axis_last(p2 - origin, ray.axis);
        let ax = a.x - ray.shear.x * a.z;
        let ay = a.y - ray.shear.y * a.z;
        let bx = b.x - ray.shear.x * b.z;
        let by = b.y - ray.shear.y * b.z;
        let cx = c.x - ray.shear.x * c.z;
        let cy = c.y - ray.shear.y * c.z;
        // Two rounded products and a rounded difference: swapping the edge's ends flips the sign exactly. A fused
        // multiply-add would not, and rays would slip through.
        let e0 = cx * by - cy * bx;
        let e1 = ax * cy - ay * cx;
        let e2 = bx * ay - by * ax;
        let det = e0 + e1 + e2;
        let mut result = TriangleHit { t: 0.0, u: 0.0, v: 0.0, hit: false };
        let same_side = (e0 >= 0.0 && e1 >= 0.0 && e2 >= 0.0) || (e0 <= 0.0 && e1 <= 0.0 && e2 <= 0.0);
        if same_side && det != 0.0 {
            let t = (e0 * a.z + e1 * b.z + e2 * c.z) * ray.shear.z / det;
            if t > t_min && t < t_max {
                result = TriangleHit { t: t, u: e1 / det, v: e2 / det, hit: true };
            }
        }
        result
    }

    /// The test that textbooks teach: first the triangle's plane, then its three edges in that plane.
    ///
    /// Same result as [`intersect_triangle`] up to rounding, except that rays may slip between two triangles that
    /// share an edge. It is written from the definition and serves to check the other.
    pub fn intersect_triangle_plane(
        origin: Vec3f,
        direction: Vec3f,
        p0: Vec3f,
        p1: Vec3f,
        p2: Vec3f,
        t_min: f32,
        t_max: f32,
    ) -> TriangleHit {
        let mut result = TriangleHit { t: 0.0, u: 0.0, v: 0.0, hit: false };
        let normal = cross(p1 - p0, p2 - p0);
        let facing = dot(normal, direction);
        let area = dot(normal, normal);
        if area > 0.0 && facing != 0.0 {
            let t = dot(normal, p0 - origin) / facing;
            let p = origin + direction * t;
            let e0 = dot(normal, cross(p2 - p1, p - p1));
            let e1 = dot(normal, cross(p0 - p2, p - p2));
            let e2 = dot(normal, cross(p1 - p0, p - p0));
            if e0 >= 0.0 && e1 >= 0.0 && e2 >= 0.0 && t > t_min && t < t_max {
                result = TriangleHit { t: t, u: e1 / area, v: e2 / area, hit: true };
            }
        }
        result
    }

    /// The point of a triangle that is seen along a ray that passes it by, or through it, a fraction of a pixel beside what a
    /// rasteriser samples: where the ray meets the triangle's plane, moved to the nearest weights inside.
    ///
    /// Always a hit; the centroid where the triangle is seen edge-on.
    pub fn nearest_triangle_point(
        origin: Vec3f,
        direction: Vec3f,
        p0: Vec3f,
        p1: Vec3f,
        p2: Vec3f,
    ) -> TriangleHit {
        let normal = cross(p1 - p0, p2 - p0);
        let facing = dot(normal, direction);
        let area = dot(normal, normal);
        let mut u = 1.0 / 3.0;
        let mut v = 1.0 / 3.0;
        if area > 0.0 && facing != 0.0 {
            let p = origin + direction * (dot(normal, p0 - origin) / facing);
            u = max(dot(normal, cross(p0 - p2, p - p2)) / area, 0.0);
            v = max(dot(normal, cross(p1 - p0, p - p0)) / area, 0.0);
            let sum = max(u + v, 1.0);
            u = u / sum;
            v = v / sum;
        }
        let point = p0 * (1.0 - u - v) + p1 * u + p2 * v;
        let t = dot(point - origin, direction) / dot(direction, direction);
        TriangleHit { t: t, u: u, v: v, hit: true }
    }

    /// Where a ray is nearest to a point: distance in units of `direction`, which need not be a unit vector.
    pub fn nearest_to_point(origin: Vec3f, direction: Vec3f, point: Vec3f) -> f32 {
        dot(point - origin, direction) / dot(direction, direction)
    }

    /// Both crossings of the line `origin + t direction` with a sphere.
    ///
    /// Keeps its precision for small spheres far away and for large ones. A radius of zero or less, or NaN, never
    /// hits.
    ///
    /// Method: Haines, Günther and Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing
    /// Gems, 2019.
    pub fn intersect_sphere(origin: Vec3f, direction: Vec3f, center: Vec3f, radius: f32) -> SphereHit {
        let mut result = SphereHit { near: 0.0, far: 0.0, hit: false };
        let f = origin - center;
        let a = dot(direction, direction);
        let b = -dot(f, direction);
        // From the centre to the line's closest point, instead of b² - ac: no cancellation far away.
        let l = f + direction * (b / a);
        let d = radius * radius - dot(l, l);
        if d > 0.0 && radius > 0.0 {
            let c = dot(f, f) - radius * radius;
            let root = sqrt(a * d);
            // The root with the larger magnitude first, the other from it: no cancellation close to the surface.
            let q = b + select(-root, root, b >= 0.0);
            let t0 = c / q;
            let t1 = q / a;
            result = SphereHit { near: min(t0, t1), far: max(t0, t1), hit: true };
        }
        result
    }

    /// The reciprocal of each component of a direction; where that is zero or nearly so, a number beyond all distances instead of
    /// infinity, so that no product with it is NaN.
    pub fn inverse_direction(direction: Vec3f) -> Vec3f {
        let tiny = 1e-20;
        let x = select(direction.x, select(-tiny, tiny, direction.x >= 0.0), abs(direction.x) < tiny);
        let y = select(direction.y, select(-tiny, tiny, direction.y >= 0.0), abs(direction.y) < tiny);
        let z = select(direction.z, select(-tiny, tiny, direction.z >= 0.0), abs(direction.z) < tiny);
        vec3f(1.0 / x, 1.0 / y, 1.0 / z)
    }

    /// The part of the ray between `t_min` and `t_max` that lies in the box from `low` to `high`.
    ///
    /// `inverse_direction` is the reciprocal of each component of the direction, infinite where that is zero. Rays
    /// in the plane of a face count as inside. The result is not padded against rounding: grow the box by a few
    /// units in the last place where a miss must be certain (Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013).
    pub fn intersect_box(
        origin: Vec3f,
        inverse_direction: Vec3f,
        low: Vec3f,
        high: Vec3f,
        t_min: f32,
        t_max: f32,
    ) -> BoxHit {
        let a = (low - origin) * inverse_direction;
        let b = (high - origin) * inverse_direction;
        let mut near = t_min;
        let mut far = t_max;
        // Zero times infinity is NaN: the ray lies in a face's plane, and this axis cuts nothing off.
        if a.x <= b.x || a.x >= b.x {
            near = max(near, min(a.x, b.x));
            far = min(far, max(a.x, b.x));
        }
        if a.y <= b.y || a.y >= b.y {
            near = max(near, min(a.y, b.y));
            far = min(far, max(a.y, b.y));
        }
        if a.z <= b.z || a.z >= b.z {
            near = max(near, min(a.z, b.z));
            far = min(far, max(a.z, b.z));
        }
        BoxHit { near: near, far: far, hit: near <= far }
    }
}

#[cfg(test)]
mod tests {
    use super::intersect::*;
    use proptest::prelude::*;
    use wgsl_rs::std::*;

    fn v(a: [f32; 3]) -> Vec3f {
        vec3f(a[0], a[1], a[2])
    }

    fn point() -> impl Strategy<Value = [f32; 3]> {
        [-2.0f32..2.0, -2.0f32..2.0, -2.0f32..2.0]
    }

    proptest! {
        #[test]
        fn watertight_agrees_with_plane_then_edges(o in point(), a in point(), b in point(), c in point(),
                                                   s in 0.05f32..0.9, r in 0.05f32..0.9) {
            // Aim well inside of the triangle, or well outside of it.
            let (w1, w2) = (s * (1.0 - r * 0.9), r * 0.9 * s);
            let inside = v(a) * (1.0 - w1 - w2) + v(b) * w1 + v(c) * w2;
            let n = cross(v(b) - v(a), v(c) - v(a));
            let d = inside - v(o);
            prop_assume!(dot(n, n) > 1e-2 && dot(d, n).abs() > 1e-2);
            let exact = intersect_triangle(v(o), ray_shear(d), v(a), v(b), v(c), 0.0, 1e30);
            let plane = intersect_triangle_plane(v(o), d, v(a), v(b), v(c), 0.0, 1e30);
            prop_assert!(exact.hit && plane.hit);
            for (x, y) in [(exact.t, 1.0), (plane.t, 1.0), (exact.u, w1), (plane.u, w1), (exact.v, w2), (plane.v, w2)] {
                prop_assert!((x - y).abs() < 2e-3, "{x} {y}");
            }
            let beside = v(a) * 2.0 - inside - v(o);
            prop_assert!(!intersect_triangle(v(o), ray_shear(beside), v(a), v(b), v(c), 0.0, 1e30).hit);
        }

        #[test]
        fn shared_edges_do_not_leak(o in point(), a in point(), b in point(), c in point(), e in point(), s in 0.0f32..1.0) {
            // `a b` is shared; the ray goes through the best float approximation of a point on it.
            let d = v(a) * (1.0 - s) + v(b) * s - v(o);
            prop_assume!(dot(d, d) > 1e-6);
            let ray = ray_shear(d);
            let side = |p: Vec3f| {
                let n = cross(v(a) - v(o), v(b) - v(o));
                dot(n, p - v(o))
            };
            // One triangle on each side of the plane through the ray and the edge.
            let (c, e) = if side(v(c)) > side(v(e)) { (c, e) } else { (e, c) };
            prop_assume!(side(v(c)) > 0.1 && side(v(e)) < -0.1);
            let hit = intersect_triangle(v(o), ray, v(a), v(b), v(c), 0.0, 1e30).hit
                || intersect_triangle(v(o), ray, v(b), v(a), v(e), 0.0, 1e30).hit;
            // Rounding of the ray may lead past the ends of the edge, but not through its middle.
            prop_assert!(hit || !(1e-3..=1.0 - 1e-3).contains(&s));
        }

        #[test]
        fn sphere_hits_lie_on_the_sphere(o in point(), c in point(), r in 0.1f32..2.0, d in point()) {
            prop_assume!(dot(v(d), v(d)) > 1e-2);
            let h = intersect_sphere(v(o), v(d), v(c), r);
            if h.hit {
                for t in [h.near, h.far] {
                    let p = v(o) + v(d) * t - v(c);
                    prop_assert!((dot(p, p).sqrt() - r).abs() < 2e-3 * (1.0 + t.abs()), "{}", dot(p, p).sqrt());
                }
                prop_assert!(h.near <= h.far);
            }
        }
    }

    #[test]
    fn the_nearest_point_is_the_hit_inside_and_on_the_edge_outside() {
        let (a, b, c) = (v([0.0, 0.0, 0.0]), v([2.0, 0.0, 0.0]), v([0.0, 2.0, 0.0]));
        let at = |x: f32, y: f32| nearest_triangle_point(v([x, y, 5.0]), v([0.0, 0.0, -1.0]), a, b, c);
        let inside = at(0.5, 1.0);
        assert_eq!((inside.t, inside.u, inside.v), (5.0, 0.25, 0.5));
        let below = at(1.0, -0.1);
        assert_eq!((below.t, below.u, below.v), (5.0, 0.5, 0.0));
        let beyond = at(1.5, 1.5);
        assert!(
            (beyond.u + beyond.v - 1.0).abs() < 1e-6 && beyond.u == beyond.v,
            "{} {}",
            beyond.u,
            beyond.v
        );
        let edge_on = nearest_triangle_point(v([5.0, 0.0, 0.0]), v([-1.0, 0.0, 0.0]), a, b, c);
        assert_eq!(edge_on.u, 1.0 / 3.0, "any point will do, and this one is inside");
    }

    #[test]
    fn degenerate_triangles_never_hit() {
        let o = v([0.1, 0.2, -1.0]);
        let a = v([0.1, 0.2, 0.0]);
        let b = v([1.0, 1.0, 0.0]);
        let nan = v([f32::NAN, 0.0, 0.0]);
        for (p, q, r) in [(a, a, a), (a, a, b), (a, b, b), (nan, a, b), (a, b, (a + b) * 0.5)] {
            let d = v([0.0, 0.0, 1.0]);
            let h = intersect_triangle(o, ray_shear(d), p, q, r, 0.0, 1e30);
            assert!(!h.hit && h.t == 0.0 && !intersect_triangle_plane(o, d, p, q, r, 0.0, 1e30).hit);
        }
    }

    #[test]
    fn small_far_sphere_is_round() {
        // The textbook quadratic loses all digits here.
        let h = intersect_sphere(v([0.0, 0.0, -4000.0]), v([0.0, 0.0, 1.0]), v([0.0, 0.0, 0.0]), 0.01);
        assert!(h.hit && (h.near - 3999.99).abs() < 1e-3 && h.near < h.far);
    }

    #[test]
    fn box_in_a_face_plane_counts_as_inside() {
        let inf = f32::INFINITY;
        let h = intersect_box(v([0.0, 0.5, -1.0]), v([inf, inf, 1.0]), v([0.0; 3]), v([1.0; 3]), 0.0, 1e30);
        assert!(h.hit && h.near == 1.0 && h.far == 2.0);
        assert!(
            !intersect_box(v([2.0, 0.5, -1.0]), v([inf, inf, 1.0]), v([0.0; 3]), v([1.0; 3]), 0.0, 1e30).hit
        );
    }
}
