//! The place on a surface that textures are looked up for.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod texture_point {
    use crate::constants::*;
    use wgsl_rs::std::*;

    /// What the value of a texture may depend on.
    #[derive(Clone, Copy, Debug)]
    pub struct TexturePoint {
        /// Both sets of texture coordinates, (u₀, v₀, u₁, v₁).
        pub coords: Vec4f,
        /// Linear vertex colour, ones where there is none.
        pub color: Vec4f,
        /// Position in object space.
        pub position: Vec3f,
        /// Width of the ray's footprint on the surface, metres in world space; 0 is a point.
        pub width: f32,
        /// Position in world space.
        pub world: Vec3f,
        /// Units of object space per metre.
        pub object_density: f32,
        /// Unit geometric normal in object space, of any side.
        pub normal: Vec3f,
        /// Texture coordinates per metre, of either set; see [`area_density`].
        pub uv_density: Vec2f,
    }

    /// A point of which only texture coordinates and vertex colour are known.
    pub fn texture_point_at(coords: Vec4f, color: Vec4f) -> TexturePoint {
        TexturePoint {
            coords: coords,
            color: color,
            position: vec3f(0.0, 0.0, 0.0),
            width: 0.0,
            world: vec3f(0.0, 0.0, 0.0),
            object_density: 1.0,
            normal: vec3f(0.0, 1.0, 0.0),
            uv_density: vec2f(1.0, 1.0),
        }
    }

    /// How many units of another space a metre is, in the mean of both directions: of a triangle whose edges are `e1` and
    /// `e2` in world space and `d1` and `d2` there. Zero for triangles without area.
    pub fn area_density(e1: Vec3f, e2: Vec3f, d1: Vec3f, d2: Vec3f) -> f32 {
        let n = cross(e1, e2);
        let m = cross(d1, d2);
        let area2 = dot(n, n);
        if area2 <= 0.0 {
            return 0.0;
        }
        sqrt(sqrt(dot(m, m) / area2))
    }

    /// Texture coordinates per metre on a sphere, which as a whole has coordinates of area 1. `radius`: metres, positive.
    pub fn sphere_uv_density(radius: f32) -> f32 {
        1.0 / (radius * sqrt(4.0 * PI))
    }

    /// By how much the barycentric weights of the second and third corner change on the way `step`, which is in the plane of
    /// a triangle with edges `e1` and `e2`. Zero for triangles without area.
    pub fn barycentric_step(e1: Vec3f, e2: Vec3f, step: Vec3f) -> Vec2f {
        let a = dot(e1, e1);
        let b = dot(e1, e2);
        let c = dot(e2, e2);
        let determinant = a * c - b * b;
        if determinant <= 0.0 {
            return vec2f(0.0, 0.0);
        }
        let x = dot(e1, step);
        let y = dot(e2, step);
        vec2f(c * x - b * y, a * y - b * x) * (1.0 / determinant)
    }

    /// The step that slopes of heights at a point are taken over, metres: large enough for what coordinates round to.
    pub fn bump_step(world: Vec3f) -> f32 {
        max(2e-4, 1e-4 * max(max(abs(world.x), abs(world.y)), abs(world.z)))
    }

    /// The unit normal of a height field in its tangent frame, from heights at a point and a step along tangent and
    /// bitangent. Heights and step in metres.
    /// Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.
    pub fn height_normal(height: f32, along_tangent: f32, along_bitangent: f32, step: f32) -> Vec3f {
        let slope_x = (along_tangent - height) / step;
        let slope_y = (along_bitangent - height) / step;
        vec3f(0.0 - slope_x, 0.0 - slope_y, 1.0) * (1.0 / sqrt(1.0 + slope_x * slope_x + slope_y * slope_y))
    }
}

#[cfg(test)]
mod tests {
    use super::texture_point::*;
    use wgsl_rs::std::*;

    #[test]
    fn weights_of_a_step_lead_to_its_end() {
        let (e1, e2) = (vec3f(1.0, 0.5, 0.0), vec3f(-0.25, 2.0, 1.0));
        let step = e1 * 0.3 - e2 * 0.1;
        let w = barycentric_step(e1, e2, step);
        assert!((w.x - 0.3).abs() < 1e-5 && (w.y + 0.1).abs() < 1e-5, "{w:?}");
        assert_eq!(barycentric_step(e1, e1, step).to_array(), [0.0; 2]);
    }

    #[test]
    fn densities_are_ratios_of_lengths() {
        let (e1, e2) = (vec3f(2.0, 0.0, 0.0), vec3f(0.0, 2.0, 0.0));
        assert_eq!(area_density(e1, e2, vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0)), 0.5);
        assert_eq!(area_density(e1, e1, e1, e2), 0.0);
    }

    #[test]
    fn slopes_tilt_the_normal_against_them() {
        let n = height_normal(0.1, 0.2, 0.1, 0.1);
        assert!((n.x + 0.5f32.sqrt()).abs() < 1e-6 && n.y == 0.0 && (n.z - 0.5f32.sqrt()).abs() < 1e-6);
    }
}
