//! Ray origins that do not hit the surface they start from.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod offset {
    use wgsl_rs::std::*;

    /// Moves one coordinate by a number of representable steps, or by a fixed distance near zero.
    pub fn offset_coordinate(p: f32, n: f32) -> f32 {
        // 256 units in the last place: larger than the error of a hit point computed from barycentrics.
        let steps = i32(256.0 * n);
        let moved = bitcast_f32(u32(bitcast_i32(p) + select(steps, -steps, p < 0.0)));
        select(moved, p + n * (1.0 / 65536.0), abs(p) < 1.0 / 32.0)
    }

    /// A ray origin just off the surface at `p`, on the side that the unit geometric normal `n` points to.
    ///
    /// The distance grows with the coordinates' own precision, so it needs no scale of the scene.
    /// Source: Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems, 2019.
    pub fn offset_ray_origin(p: Vec3f, n: Vec3f) -> Vec3f {
        vec3f(offset_coordinate(p.x, n.x), offset_coordinate(p.y, n.y), offset_coordinate(p.z, n.z))
    }
}

#[cfg(test)]
mod tests {
    use super::offset::*;
    use wgsl_rs::std::*;

    #[test]
    fn offsets_grow_with_the_coordinates() {
        let n = vec3f(0.0, 1.0, 0.0);
        for y in [0.0, 1e-6, 0.5, 1.0, 1000.0, 1e6, -0.5, -1e6] {
            let moved = offset_ray_origin(vec3f(3.0, y, -5.0), n);
            let distance = moved.y - y;
            assert!(distance > 0.0, "origin at {y} moved by {distance}");
            assert!(distance <= 4e-5 * y.abs().max(1.0), "origin at {y} moved by {distance}");
            assert_eq!((moved.x, moved.z), (3.0, -5.0));
            let other = offset_ray_origin(vec3f(3.0, y, -5.0), -n);
            assert!(other.y < y, "origin at {y} moved to {}", other.y);
        }
    }
}
