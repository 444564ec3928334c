//! Ray origins that do not hit the surface they start from.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod offset {
    use wgsl_rs::std::*;

    /// The largest relative error of one rounding, 2⁻²⁴.
    pub const UNIT_ROUNDOFF: f32 = 0.000000059604644775390625;

    /// By component, the largest magnitude in three points.
    pub fn largest_components(a: Vec3f, b: Vec3f, c: Vec3f) -> Vec3f {
        vec3f(
            max(abs(a.x), max(abs(b.x), abs(c.x))),
            max(abs(a.y), max(abs(b.y), abs(c.y))),
            max(abs(a.z), max(abs(b.z), abs(c.z))),
        )
    }

    /// How far off a primitive the origin of a ray must lie, so that rounding does not bring it to the other side.
    ///
    /// - `coordinates`: by component, the largest magnitude in the points that the origin is interpolated from. Only what
    ///   rounding moves along the unit normal `n` counts.
    /// - `size`: length in which the intersection test rounds.
    /// - `transformed`: of an instance with a transform, the largest coordinate in world space and of the translation
    ///   together: a transform's rounding has no preferred direction. Otherwise 0.
    ///
    /// Source: the bounds of NVIDIA's sample code "SelfIntersectionAvoidance" for DXR and Vulkan, 2023, with larger factors
    /// and, in [`triangle_clearance`], a term for slender triangles.
    pub fn rounding_clearance(coordinates: Vec3f, n: Vec3f, size: f32, transformed: f32) -> f32 {
        let along = coordinates.x * abs(n.x) + coordinates.y * abs(n.y) + coordinates.z * abs(n.z);
        UNIT_ROUNDOFF * (4.0 * along + 4.0 * size + 12.0 * transformed)
    }

    /// [`rounding_clearance`] of the triangle `p0 p1 p2` with the unit normal `n`.
    ///
    /// The test's error is that of its edge functions over the triangle's area: it grows with the longest edge over the
    /// height. Of a triangle as slender as a hair the rest is given up, or rays would start beyond its neighbours.
    pub fn triangle_clearance(p0: Vec3f, p1: Vec3f, p2: Vec3f, n: Vec3f, transformed: f32) -> f32 {
        let a = p1 - p0;
        let b = p2 - p0;
        let c = p2 - p1;
        let longest = max(dot(a, a), max(dot(b, b), dot(c, c)));
        let g = cross(a, b);
        // Squares, of which one root is taken. Of triangles so small that these vanish the slenderness is not known.
        let slenderness2 = clamp(longest * longest / max(dot(g, g), 1e-37), 1.0, 16384.0);
        rounding_clearance(largest_components(p0, p1, p2), n, sqrt(longest * slenderness2), transformed)
    }

    /// [`rounding_clearance`] at the point `p` of the sphere around `center`, where its unit normal is `n`.
    pub fn sphere_clearance(p: Vec3f, center: Vec3f, radius: f32, n: Vec3f, transformed: f32) -> f32 {
        rounding_clearance(largest_components(p, center, p), n, 2.0 * radius, transformed)
    }

    /// A ray origin at the distance `clearance` from `p`, on the side that the unit normal `n` points to.
    pub fn offset_ray_origin(p: Vec3f, n: Vec3f, clearance: f32) -> Vec3f {
        p + n * clearance
    }
}

#[cfg(test)]
mod tests {
    use super::offset::*;
    use crate::intersect::{intersect_sphere, intersect_triangle, ray_shear};
    use wgsl_rs::std::*;

    /// Random numbers that are the same in every run (PCG, O'Neill 2014, without its permutation).
    struct Numbers(u64);

    impl Numbers {
        fn new() -> Self {
            Self(1)
        }

        /// In `[-1, 1)`.
        fn signed(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 * 2f32.powi(-23) - 1.0
        }

        fn vector(&mut self, size: f32) -> Vec3f {
            vec3f(self.signed(), self.signed(), self.signed()) * size
        }

        /// Above the plane of `n`: half of the directions are within 0.6° of it.
        fn leaving(&mut self, n: Vec3f) -> Vec3f {
            let cosine = 10f32.powf(-2.0 - 2.0 * self.signed());
            let along = normalize(cross(n, self.vector(1.0)));
            n * cosine + along * f32::sqrt(1.0 - cosine * cosine)
        }
    }

    /// Share of rays that hit the triangle they leave. `place`: where triangles are, `slenderness`: height over length.
    fn hits_of_own_triangle(place: f32, slenderness: f32, length: impl Fn(f32) -> f32) -> f64 {
        let mut numbers = Numbers::new();
        let count = 100_000;
        let hits = (0..count).filter(|_| {
            let p0 = numbers.vector(place);
            let (along, across) = (numbers.vector(1.0), numbers.vector(slenderness));
            let (p1, p2) = (p0 + along, p0 + along * numbers.signed() + across);
            let g = cross(p1 - p0, p2 - p0);
            if dot(g, g) == 0.0 {
                return false;
            }
            let n = normalize(g) * f32::signum(numbers.signed());
            let (mut u, mut v) = (f32::abs(numbers.signed()), f32::abs(numbers.signed()));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let p = p0 * (1.0 - u - v) + p1 * u + p2 * v;
            let origin = offset_ray_origin(p, n, length(triangle_clearance(p0, p1, p2, n, 0.0)));
            let direction = numbers.leaving(n);
            intersect_triangle(origin, ray_shear(direction), p0, p1, p2, 0.0, 1e30).hit
        });
        hits.count() as f64 / f64::from(count)
    }

    #[test]
    fn no_ray_hits_the_triangle_that_it_leaves() {
        for place in [0.0, 10.0, 1e3, 1e5] {
            for slenderness in [1.0, 0.1, 0.03] {
                let share = hits_of_own_triangle(place, slenderness, |clearance| clearance);
                assert_eq!(share, 0.0, "at {place}, height {slenderness}");
            }
        }
        let too_near = hits_of_own_triangle(10.0, 1.0, |clearance| 0.1 * clearance);
        assert!(too_near > 1e-3, "a tenth is too little: {too_near}");
    }

    #[test]
    fn no_ray_hits_the_sphere_that_it_leaves() {
        let mut numbers = Numbers::new();
        for (place, radius) in [(0.0, 1.0), (10.0, 1.0), (1e3, 1.0), (10.0, 0.01), (10.0, 100.0)] {
            for _ in 0..100_000 {
                let center = numbers.vector(place);
                let n = normalize(numbers.vector(1.0));
                let p = center + n * radius;
                let clearance = sphere_clearance(p, center, radius, n, 0.0);
                let direction = numbers.leaving(n);
                let outside = offset_ray_origin(p, n, clearance);
                let hit = intersect_sphere(outside, direction, center, radius);
                assert!(!hit.hit || hit.far <= 0.0, "at {center:?}, radius {radius}: hit at {}", hit.far);
            }
        }
    }

    #[test]
    fn offsets_are_a_few_roundings() {
        let (x, y, z) = (vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0));
        let unit = triangle_clearance(y, y + x, y + z, y, 0.0);
        assert!(unit > 4.0 * UNIT_ROUNDOFF && unit < 1.5e-6, "{unit}");
        // Along the normal, what lies far away in the plane does not count.
        let far = x * 1e4;
        let aside = triangle_clearance(y + far, y + x + far, y + z + far, y, 0.0);
        assert!(aside < 1.1 * unit, "{aside} against {unit}");
        let above = triangle_clearance(y * 1e4, y * 1e4 + x, y * 1e4 + z, y, 0.0);
        assert!(above > 1e4 * 4.0 * UNIT_ROUNDOFF && above < 1e4 * 4.01 * UNIT_ROUNDOFF, "{above}");
        // Slender, tiny, without area: a length all the same.
        for height in [1e-6, 1e-30, 0.0] {
            let hair = triangle_clearance(y, y + x, y + z * height, y, 0.0);
            assert!(hair > unit && hair < 4e-5, "{height}: {hair}");
        }
    }

    /// Scaling a scene by a power of two scales everything, offsets included.
    #[test]
    fn offsets_do_not_depend_on_the_scale() {
        let n = normalize(vec3f(0.3, -0.8, 0.5));
        let corners = [vec3f(0.0, 0.01, -3.0), vec3f(1.0, 2.0, 1e-5), vec3f(0.2, -0.3, 4.0)];
        let [p0, p1, p2] = corners;
        let one = triangle_clearance(p0, p1, p2, n, 3.0);
        for scale in [2f32.powi(-20), 2f32.powi(26)] {
            let [p0, p1, p2] = corners.map(|p| p * scale);
            assert_eq!(triangle_clearance(p0, p1, p2, n, 3.0 * scale), one * scale, "scale {scale}");
        }
    }
}
