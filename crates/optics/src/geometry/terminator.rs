//! Where light is gathered on meshes with vertex normals, so that their triangles do not show in their own shadow.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod terminator {
    use wgsl_rs::std::*;

    /// By how much a point of a triangle is lifted towards the smooth surface that vertex normals stand for.
    #[derive(Clone, Copy, Debug)]
    pub struct TerminatorLift {
        /// What is added to the point.
        pub offset: Vec3f,
        /// Share of the whole lift in `[0, 1]`; 0: the point stays, and the triangle decides what is above it.
        pub share: f32,
    }

    /// Share of the lift where the vertex normal that is farthest from the triangle's has this cosine with it: all up to
    /// 30°, none from 44° on. Normals that are farther apart round the corners of a body that is not smooth, such as a
    /// table's, and what stands on it would lose its shadow.
    pub fn terminator_share(cos_deviation: f32) -> f32 {
        saturate((cos_deviation - 0.72) * 6.6666665)
    }

    /// From a point to its place on a vertex's tangent plane, if it lies below it; zero above.
    ///
    /// - `from_vertex`: the point minus the vertex. `normal`: of the vertex on the viewer's side, of any length.
    pub fn tangent_plane_lift(from_vertex: Vec3f, normal: Vec3f) -> Vec3f {
        normal * (max(-dot(from_vertex, normal), 0.0) / max(dot(normal, normal), 1e-30))
    }

    /// The lift of the point `p` of the triangle `p0 p1 p2`: the mean of its places on the vertices' tangent planes.
    ///
    /// - `n0`, `n1`, `n2`: normals of the vertices on the front, of any length. `side`: 1 if the front is seen, else −1.
    /// - `normal`: unit geometric normal on the viewer's side. `weights`: barycentric weights of `p`.
    ///
    /// Source: Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021, with a limit for corners.
    pub fn terminator_lift(
        p: Vec3f,
        p0: Vec3f,
        p1: Vec3f,
        p2: Vec3f,
        n0: Vec3f,
        n1: Vec3f,
        n2: Vec3f,
        side: f32,
        normal: Vec3f,
        weights: Vec3f,
    ) -> TerminatorLift {
        let a = n0 * side;
        let b = n1 * side;
        let c = n2 * side;
        let cos_a = dot(a, normal) * (1.0 / sqrt(max(dot(a, a), 1e-30)));
        let cos_b = dot(b, normal) * (1.0 / sqrt(max(dot(b, b), 1e-30)));
        let cos_c = dot(c, normal) * (1.0 / sqrt(max(dot(c, c), 1e-30)));
        let share = terminator_share(min(min(cos_a, cos_b), cos_c));
        let lift = tangent_plane_lift(p - p0, a) * weights.x
            + tangent_plane_lift(p - p1, b) * weights.y
            + tangent_plane_lift(p - p2, c) * weights.z;
        TerminatorLift { offset: lift * share, share: share }
    }
}

#[cfg(test)]
mod tests {
    use super::terminator::*;
    use wgsl_rs::std::*;

    /// A triangle of the unit sphere; corners are the normals.
    fn lift_on_sphere(spread: f32, weights: Vec3f, side: f32) -> (Vec3f, TerminatorLift) {
        let corner = |x: f32, y: f32| normalize(vec3f(x * spread, y * spread, 1.0));
        let [a, b, c] = [corner(1.0, 0.0), corner(-0.5, 0.8), corner(-0.5, -0.8)];
        let p = a * weights.x + b * weights.y + c * weights.z;
        let normal = normalize(cross(b - a, c - a)) * side;
        (p, terminator_lift(p, a, b, c, a, b, c, side, normal, weights))
    }

    #[test]
    fn points_of_a_convex_mesh_are_lifted_to_its_smooth_surface() {
        for weights in [vec3f(0.4, 0.3, 0.3), vec3f(0.5, 0.5, 0.0), vec3f(0.1, 0.1, 0.8)] {
            let (p, lift) = lift_on_sphere(0.3, weights, 1.0);
            let (below, above) = (1.0 - length(p), length(p + lift.offset) - 1.0);
            assert_eq!(lift.share, 1.0);
            // To the other side of the sphere, about as far as the chord is below it.
            assert!(above > 0.0 && above < 1.5 * below, "{below} below, {above} above");
        }
        let (_, at_vertex) = lift_on_sphere(0.3, vec3f(1.0, 0.0, 0.0), 1.0);
        assert!(length(at_vertex.offset) < 1e-6, "vertices stay");
    }

    #[test]
    fn hollows_and_corners_stay_exact() {
        let (_, inside) = lift_on_sphere(0.3, vec3f(0.4, 0.3, 0.3), -1.0);
        assert!(length(inside.offset) < 1e-6, "from inside all tangent planes are below: {inside:?}");
        let (_, corner) = lift_on_sphere(1.5, vec3f(0.4, 0.3, 0.3), 1.0);
        assert_eq!((corner.share, length(corner.offset)), (0.0, 0.0));
        let n = vec3f(0.0, 0.0, 0.0);
        let none = terminator_lift(n, n, n, n, n, n, n, 1.0, vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0));
        assert_eq!(none.share, 0.0, "without normals there is nothing smooth");
    }
}
