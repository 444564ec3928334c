//! Triangles as they are seen from a point: their solid angle, and points uniform over it.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod spherical_triangle {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Solid angles below would underflow, in steradians.
    pub const MIN_TRIANGLE_SOLID_ANGLE: f32 = 1e-12;
    /// Solid angles above are of triangles so near that rounding says where they end, in steradians.
    pub const MAX_TRIANGLE_SOLID_ANGLE: f32 = 6.22;

    /// What is seen of a triangle from a point.
    #[derive(Clone, Copy, Debug)]
    pub struct SphericalTriangle {
        /// Unit direction to the first vertex.
        pub a: Vec3f,
        /// Unit direction to the second.
        pub b: Vec3f,
        /// Unit direction to the third.
        pub c: Vec3f,
        /// One over the distances of the three vertices.
        pub nearness: Vec3f,
        /// |a · (b × c)|.
        pub volume: f32,
        /// 1 + a · b.
        pub one_plus_ab: f32,
        /// a · c + b · c.
        pub ac_plus_bc: f32,
        /// Half the solid angle, in turns: in `[0, ½]`.
        pub half_turns: f32,
        /// Steradians; 0 where rounding would show in what [`sample_spherical_triangle`] makes of it.
        pub solid_angle: f32,
    }

    /// Projects a triangle onto the unit sphere around a point.
    ///
    /// - `to_first`: from the point to the first vertex. `edge1`, `edge2`: from there to the others.
    ///
    /// Source: Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983.
    pub fn spherical_triangle_new(to_first: Vec3f, edge1: Vec3f, edge2: Vec3f) -> SphericalTriangle {
        let to_second = to_first + edge1;
        let to_third = to_first + edge2;
        let nearness = vec3f(
            1.0 / sqrt(dot(to_first, to_first)),
            1.0 / sqrt(dot(to_second, to_second)),
            1.0 / sqrt(dot(to_third, to_third)),
        );
        let a = to_first * nearness.x;
        let b = to_second * nearness.y;
        let c = to_third * nearness.z;
        // Of the edges, not of the directions, which would cancel for small triangles.
        let normal = cross(edge1, edge2);
        let height = abs(dot(normal, a));
        let volume = height * nearness.y * nearness.z;
        let ab = dot(a, b);
        let bc = dot(b, c);
        let ca = dot(c, a);
        let half_turns = upper_angle_turns(1.0 + ab + bc + ca, volume);
        let solid_angle = half_turns * (2.0 * TAU);
        // Seen edge-on, the height is what rounding leaves of it; from an edge, its ends are opposite, and many arcs join them.
        let edge_on = height * height <= 1e-6 * dot(normal, normal);
        let from_an_edge = min(min(ab, bc), ca) <= -0.999;
        let exact = solid_angle > MIN_TRIANGLE_SOLID_ANGLE && solid_angle < MAX_TRIANGLE_SOLID_ANGLE;
        SphericalTriangle {
            a: a,
            b: b,
            c: c,
            nearness: nearness,
            volume: volume,
            one_plus_ab: 1.0 + ab,
            ac_plus_bc: ca + bc,
            half_turns: half_turns,
            solid_angle: select(0.0, solid_angle, exact && !edge_on && !from_an_edge),
        }
    }

    /// Barycentric weights of the second and third vertex of a point of the triangle whose direction is uniform over its solid
    /// angle; `u`: two uniform numbers in `[0, 1)`. Only where `t.solid_angle` is positive.
    ///
    /// The first number cuts off a triangle of its share of the solid angle by an arc from `b` to a point of the arc from `a`
    /// to `c`; the second chooses on that arc. Directions are sums of `a`, `b` and `c` without negative terms, and the terms over the
    /// distances are the weights: no ray needs to meet the plane, and no rounding leaves the triangle.
    ///
    /// Source: Arvo, "Stratified Sampling of Spherical Triangles", 1995, in the form without inverse trigonometric functions of
    /// Peters, "BRDF Importance Sampling for Polygonal Lights", 2021, section 3.
    pub fn sample_spherical_triangle(t: SphericalTriangle, u: Vec2f) -> Vec2f {
        let cs = cos_sin_turns(u.x * t.half_turns);
        // Between `a` and the end of the cut: the bisector, as a sum of `a` and `c`.
        let of_a = t.volume * cs.x - t.ac_plus_bc * cs.y;
        let of_c = t.one_plus_ab * cs.y;
        let bisector = t.a * of_a + t.c * of_c;
        let twice = 2.0 * dot(t.a, bisector) / dot(bisector, bisector);
        // `a` mirrored by it.
        let end = bisector * twice - t.a;
        // 1 − cos of the arc from `b` to there, and of the chosen part of it, without cancellation.
        let chord = t.b - end;
        let whole = 0.5 * dot(chord, chord);
        let part = u.y * whole;
        let to_end = sqrt(max(u.y * (2.0 - part) / max(2.0 - whole, 1e-6), 0.0));
        let weights = vec3f(
            to_end * max(of_a * twice - 1.0, 0.0),
            max(1.0 - to_end - part + to_end * whole, 0.0),
            to_end * max(of_c * twice, 0.0),
        ) * t.nearness;
        let sum = weights.x + weights.y + weights.z;
        vec2f(weights.y / sum, weights.z / sum)
    }
}
