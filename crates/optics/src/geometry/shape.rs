//! Coordinates on analytic shapes.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod shape {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Texture coordinates of a sphere, those of a mesh of longitude and latitude: u from +Z over +X around +Y, so that
    /// images are upright and not mirrored as seen from outside; v from the north pole (0) to the south pole (1).
    ///
    /// - `outward`: unit vector from the centre, in the sphere's own space.
    pub fn sphere_uv(outward: Vec3f) -> Vec2f {
        let turns = atan2(outward.x, outward.z) * (0.5 / PI);
        let v = acos(clamp(outward.y, -1.0, 1.0)) / PI;
        vec2f(select(turns, turns + 1.0, turns < 0.0), v)
    }

    /// Unit tangent of a sphere in the direction in which [`sphere_uv`]'s u grows, where it is `u`. The bitangent
    /// `outward × tangent` points to the upper side of the image.
    pub fn sphere_tangent(u: f32) -> Vec3f {
        let around = cos_sin_turns(u);
        vec3f(around.x, 0.0, -around.y)
    }

    /// As [`sphere_tangent`], of unit length, for coordinates that are transformed before they are used.
    ///
    /// - `uv`: the sphere's own coordinates there. `turn`: as `MaterialRecord::tangent_turn`.
    pub fn sphere_tangent_turned(uv: Vec2f, turn: f32) -> Vec3f {
        let east = sphere_tangent(uv.x);
        if turn == 0.0 {
            return east;
        }
        let around = cos_sin_turns(uv.x);
        let down = cos_sin_turns(0.5 * uv.y);
        let south = vec3f(around.y * down.x, -down.y, around.x * down.x);
        // A whole turn of u is once around, as long as the circle there; v is half a turn.
        let part = cos_sin_turns(turn);
        let tangent = east * (2.0 * down.y * part.x) + south * part.y;
        let length2 = dot(tangent, tangent);
        if length2 < 1e-12 {
            return east;
        }
        tangent * (1.0 / sqrt(length2))
    }

    /// A direction through the rows of a matrix, of unit length: from the centre of a sphere that is turned in the world
    /// to a point on it, in the sphere's own space. Zero where the matrix leaves nothing.
    pub fn turned_direction(row_x: Vec3f, row_y: Vec3f, row_z: Vec3f, direction: Vec3f) -> Vec3f {
        let turned = vec3f(dot(row_x, direction), dot(row_y, direction), dot(row_z, direction));
        turned * (1.0 / sqrt(max(dot(turned, turned), 1e-30)))
    }
}

#[cfg(test)]
mod tests {
    use super::shape::*;
    use wgsl_rs::std::*;

    /// The tangent is where the transformed u grows and the transformed v stays.
    #[test]
    fn turned_tangents_follow_transformed_coordinates() {
        let at = |uv: Vec2f| {
            let (around, down) = (uv.x * std::f32::consts::TAU, uv.y * std::f32::consts::PI);
            vec3f(around.sin() * down.sin(), down.cos(), around.cos() * down.sin())
        };
        for i in 0..40 {
            let uv = vec2f(0.1 + 0.02 * i as f32, 0.15 + 0.017 * i as f32);
            let turn = 0.05 * i as f32 - 1.0;
            let part = vec2f((turn * std::f32::consts::TAU).cos(), (turn * std::f32::consts::TAU).sin());
            let step = 1e-3;
            let moved = at(uv + part * step) - at(uv - part * step);
            let expected = moved * (1.0 / length(moved));
            let tangent = sphere_tangent_turned(uv, turn);
            assert!(length(tangent - expected) < 1e-3, "turn {turn}: {tangent:?} {expected:?}");
        }
        assert_eq!(sphere_tangent_turned(vec2f(0.3, 0.0), 0.5).to_array(), sphere_tangent(0.3).to_array());
    }

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
        let right = sphere_uv(normalize(vec3f(0.3, 0.0, 1.0)));
        assert!(right.x > 0.0 && right.x < 0.1, "from outside, u grows to the right: {right:?}");
        let (outward, tangent) = (vec3f(0.0, 0.0, 1.0), sphere_tangent(0.0));
        assert!(cross(outward, tangent).y > 0.999, "the bitangent points to the upper side of the image");
        assert!(sphere_uv(vec3f(0.0, 1.0, 0.0)).y < 1e-6 && sphere_uv(vec3f(0.0, -1.0, 0.0)).y > 1.0 - 1e-6);
    }
}
