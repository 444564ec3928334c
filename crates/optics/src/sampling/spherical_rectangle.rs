//! Rectangles as they are seen from a point: their solid angle, and points uniform over it.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod spherical_rectangle {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Rectangles seen edge-on have less than this share of their largest coordinate between their plane and the point.
    pub const MIN_RECTANGLE_HEIGHT: f32 = 1e-3;
    /// A solid angle that is a smaller share than this of the two that it is the difference of has lost too many digits.
    pub const MIN_RECTANGLE_DIFFERENCE: f32 = 1e-3;
    /// Solid angles below would underflow, in steradians.
    pub const MIN_RECTANGLE_SOLID_ANGLE: f32 = 1e-12;

    /// What is seen of a rectangle from a point.
    ///
    /// Coordinates: x along the first edge, y along the second, from the foot of the perpendicular, in units of the largest of
    /// them. An angle β is that of the edge at the first or last y, seen along x: its sine is y over the distance.
    #[derive(Clone, Copy, Debug)]
    pub struct SphericalRectangle {
        /// Coordinates of the first corner.
        pub first: Vec2f,
        /// Lengths of the edges.
        pub size: Vec2f,
        /// Distance from the plane, positive.
        pub height: f32,
        /// sin β₁ − sin β₀.
        pub difference: f32,
        /// |sin β₁ + sin β₀|.
        pub sum: f32,
        /// The larger one of cos β₀ and cos β₁.
        pub cos_inner: f32,
        /// Cosine and sine of half the solid angle between x = 0 and the first corner, see [`strip_half_angle`].
        pub start: Vec2f,
        /// Half the solid angle, in turns: in `[0, ½]`.
        pub half_turns: f32,
        /// Steradians; 0 where rounding would show in what [`sample_spherical_rectangle`] makes of it.
        pub solid_angle: f32,
    }

    /// Cosine and sine of half the solid angle of a rectangle that reaches from 0 to `x` along the first edge, negative for
    /// negative `x`.
    ///
    /// - `y`: where it begins and ends along the second edge, `depth` apart. `height`: distance from its plane, positive.
    ///
    /// The solid angle is that of its corner at y₁ less that at y₀, each counted from the foot, whose tangent is x y / (height ·
    /// distance). Differences of nearly equal numbers are written as quotients of sums.
    pub fn strip_half_angle(x: f32, y: Vec2f, depth: f32, height: f32) -> Vec2f {
        let across2 = x * x + height * height;
        let distance0 = sqrt(across2 + y.x * y.x);
        let distance1 = sqrt(across2 + y.y * y.y);
        let outer = abs(y.y) * distance0 + abs(y.x) * distance1;
        let inner = depth * abs(y.y + y.x) * across2 / max(outer, 1e-30);
        // y₁ distance₀ − y₀ distance₁.
        let spread = select(inner, outer, y.x * y.y < 0.0);
        let re = height * height * distance0 * distance1 + x * x * y.x * y.y;
        let im = abs(x) * height * spread;
        let size = sqrt(re * re + im * im);
        // The bisector between the angle's direction and that of zero, or, of angles that are nearer to half a turn, what is
        // perpendicular to that between it and half a turn.
        let along = size + abs(re);
        let scale = 1.0 / max(sqrt(along * along + im * im), 1e-30);
        let half = vec2f(select(along, im, re < 0.0), select(im, along, re < 0.0)) * scale;
        vec2f(half.x, select(half.y, -half.y, x < 0.0))
    }

    /// Projects a rectangle onto the unit sphere around a point.
    ///
    /// - `to_first`: from the point to the first corner. `edge1`, `edge2`: from there to its neighbours, at right angles. Where
    ///   they differ a lot, `edge1` should be the longer one, which is more exact.
    ///
    /// Source: Ureña, Fajardo and King, "An Area-Preserving Parametrization for Spherical Rectangles", 2013, with half angles
    /// instead of inverse cosines, which would cancel for small solid angles.
    pub fn spherical_rectangle_new(to_first: Vec3f, edge1: Vec3f, edge2: Vec3f) -> SphericalRectangle {
        let length1 = sqrt(dot(edge1, edge1));
        let length2 = sqrt(dot(edge2, edge2));
        let x = dot(to_first, edge1) / length1;
        let y = dot(to_first, edge2) / length2;
        let distance = abs(dot(to_first, cross(edge1, edge2))) / (length1 * length2);
        let farthest = max(max(abs(x), abs(x + length1)), max(abs(y), abs(y + length2)));
        let unit = 1.0 / max(farthest, distance);
        let first = vec2f(x, y) * unit;
        let size = vec2f(length1, length2) * unit;
        let height = distance * unit;
        let ys = vec2f(first.y, first.y + size.y);
        // Of the two edges along x: their distances, and sums and differences of the sines of their angles.
        let away0 = sqrt(ys.x * ys.x + height * height);
        let away1 = sqrt(ys.y * ys.y + height * height);
        let both = away0 * away1;
        let outer = abs(ys.y) * away0 + abs(ys.x) * away1;
        let inner = height * height * size.y * abs(ys.y + ys.x) / max(outer * both, 1e-30);
        let opposite = ys.x * ys.y < 0.0;
        let start = strip_half_angle(first.x, ys, size.y, height);
        let end = strip_half_angle(first.x + size.x, ys, size.y, height);
        // The angle between the two halves.
        let forward = end.y * start.x;
        let back = end.x * start.y;
        let sine = max(forward - back, 0.0);
        let half_turns = upper_angle_turns(end.x * start.x + end.y * start.y, sine);
        let solid_angle = half_turns * (2.0 * TAU);
        let exact = sine > MIN_RECTANGLE_DIFFERENCE * max(abs(forward), abs(back));
        // Without extent nothing of the above is a number.
        let extended = length1 > 0.0 && length2 > 0.0 && is_finite(unit) && is_finite(1.0 / unit);
        let seen = height > MIN_RECTANGLE_HEIGHT && solid_angle > MIN_RECTANGLE_SOLID_ANGLE;
        SphericalRectangle {
            first: first,
            size: size,
            height: height,
            difference: select(inner, outer / both, opposite),
            sum: select(outer / both, inner, opposite),
            cos_inner: height / min(away0, away1),
            start: start,
            half_turns: half_turns,
            solid_angle: select(0.0, solid_angle, extended && seen && exact),
        }
    }

    /// Where on the edges, each counted from 0 to 1, a point of the rectangle is whose direction is uniform over its solid angle;
    /// `u`: two uniform numbers in `[0, 1)`. Only where `r.solid_angle` is positive.
    ///
    /// The first number cuts off a rectangle of its share of the solid angle; the second chooses on the cut, along which the
    /// density goes with the sine of the angle from the foot.
    ///
    /// With T the solid angle from x = 0 to the cut, the equation asin(c sin β₁) − asin(c sin β₀) = T of the source has the solution
    /// c = sin T / |sin β₁ − e^(iT) sin β₀|, the sine of the angle under which x is seen; what is below is its tangent.
    pub fn sample_spherical_rectangle(r: SphericalRectangle, u: Vec2f) -> Vec2f {
        let cs = cos_sin_turns(u.x * r.half_turns);
        // Cosine and sine of T/2.
        let k = r.start.x * cs.x - r.start.y * cs.y;
        let s = r.start.y * cs.x + r.start.x * cs.y;
        let p = r.difference * k * k + r.sum * s * s;
        let q = 2.0 * r.cos_inner * abs(s * k);
        let tangent = 2.0 * s * k / sqrt(max((p - q) * (p + q), 1e-30));
        let x = min(max(r.height * tangent, r.first.x), r.first.x + r.size.x);
        // 1 + sine and 1 − sine at both ends of the cut; the smaller one of each pair without cancellation.
        let away2 = x * x + r.height * r.height;
        let y = vec2f(r.first.y, r.first.y + r.size.y);
        let far0 = sqrt(away2 + y.x * y.x);
        let far1 = sqrt(away2 + y.y * y.y);
        let large0 = (far0 + abs(y.x)) / far0;
        let large1 = (far1 + abs(y.y)) / far1;
        let small0 = away2 / (far0 * (far0 + abs(y.x)));
        let small1 = away2 / (far1 * (far1 + abs(y.y)));
        let plus0 = select(small0, large0, y.x >= 0.0);
        let plus1 = select(small1, large1, y.y >= 0.0);
        let minus0 = select(large0, small0, y.x >= 0.0);
        let minus1 = select(large1, small1, y.y >= 0.0);
        let plus = plus0 * (1.0 - u.y) + plus1 * u.y;
        let minus = minus0 * (1.0 - u.y) + minus1 * u.y;
        let at = sqrt(away2) * 0.5 * (plus - minus) / sqrt(plus * minus);
        let share = vec2f((x - r.first.x) / r.size.x, (at - y.x) / r.size.y);
        vec2f(min(max(share.x, 0.0), 1.0), min(max(share.y, 0.0), 1.0))
    }
}
