//! Coordinates on analytic shapes.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod shape {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Texture coordinates of a sphere: u around +Y, v from the north pole (0) to the south pole (1).
    ///
    /// - `outward`: unit vector from the centre, in the sphere's own space.
    pub fn sphere_uv(outward: Vec3f) -> Vec2f {
        let u = atan2(outward.z, outward.x) * (0.5 / PI) + 0.5;
        let v = acos(clamp(outward.y, -1.0, 1.0)) / PI;
        vec2f(u, v)
    }

    /// Unit tangent of a sphere in the direction in which [`sphere_uv`]'s u grows, where it is `u`.
    pub fn sphere_tangent(u: f32) -> Vec3f {
        let around = cos_sin_turns(u);
        vec3f(around.y, 0.0, -around.x)
    }
}

#[cfg(test)]
mod tests {
    use super::shape::*;
    use wgsl_rs::std::*;

    #[test]
    fn tangents_point_where_u_grows() {
        for i in 0..64 {
            let turn = std::f32::consts::TAU * (i as f32 + 0.5) / 64.0;
            let outward = |turn: f32| normalize(vec3f(turn.cos(), 0.3, turn.sin()));
            let (here, next) = (outward(turn), outward(turn + 1e-3));
            let (u, u_next) = (sphere_uv(here).x, sphere_uv(next).x);
            let along = dot(next - here, sphere_tangent(u));
            // Half the circle grows across the seam; elsewhere u and the tangent agree.
            assert!(
                (u_next - u).abs() > 0.5 || (u_next > u) == (along > 0.0),
                "turn {turn}: {u} {u_next} {along}"
            );
            assert!((length(sphere_tangent(u)) - 1.0).abs() < 1e-5);
        }
        assert!(sphere_uv(vec3f(0.0, 1.0, 0.0)).y < 1e-6 && sphere_uv(vec3f(0.0, -1.0, 0.0)).y > 1.0 - 1e-6);
    }
}
