//! Ray origins that do not hit the surface they start from.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod offset {
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Moves one coordinate by a number of representable steps, or, near zero, by a share of the extent.
    pub fn offset_coordinate(p: f32, n: f32, extent: f32) -> f32 {
        // 256 units in the last place: more than the error of a hit point that is not small against the surface.
        let steps = nearest_integer(256.0 * n);
        let moved = bitcast_f32(u32(bitcast_i32(p) + select(steps, -steps, p < 0.0)));
        // 2⁻¹⁹ of the extent: eight times the error of interpolating vertices that far out.
        select(moved, p + n * extent * 0.0000019073486328125, abs(p) < extent * 0.03125)
    }

    /// A ray origin just off the surface at `p`, on the side that the unit geometric normal `n` points to.
    ///
    /// - `extent`: the largest magnitude of a coordinate of the surface's vertices, in the units and space of `p`. A
    ///   point near zero is as inexact as the vertices that it was interpolated from, so this, and not a fixed length,
    ///   is what counts there; the result does not depend on the scene's scale.
    ///
    /// Source: Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems, 2019,
    /// whose constant for coordinates near zero is replaced by the extent.
    pub fn offset_ray_origin(p: Vec3f, n: Vec3f, extent: f32) -> Vec3f {
        vec3f(
            offset_coordinate(p.x, n.x, extent),
            offset_coordinate(p.y, n.y, extent),
            offset_coordinate(p.z, n.z, extent),
        )
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
            let extent = f32::abs(y).max(5.0);
            let moved = offset_ray_origin(vec3f(3.0, y, -5.0), n, extent);
            let distance = moved.y - y;
            assert!(distance > 0.0, "origin at {y} moved by {distance}");
            assert!(distance <= 4e-5 * extent, "origin at {y} moved by {distance}");
            assert_eq!((moved.x, moved.z), (3.0, -5.0));
            let other = offset_ray_origin(vec3f(3.0, y, -5.0), -n, extent);
            assert!(other.y < y, "origin at {y} moved to {}", other.y);
        }
    }

    /// Scaling a scene by a power of two scales everything, offsets included.
    #[test]
    fn offsets_do_not_depend_on_the_scale() {
        let n = normalize(vec3f(0.3, -0.8, 0.5));
        for p in [vec3f(0.0, 0.01, -3.0), vec3f(1.0, 2.0, 1e-5), vec3f(0.2, -0.3, 4.0)] {
            let one = offset_ray_origin(p, n, 4.0) - p;
            for scale in [2f32.powi(-20), 2f32.powi(26)] {
                let scaled = offset_ray_origin(p * scale, n, 4.0 * scale) - p * scale;
                let difference = length(scaled * (1.0 / scale) - one);
                assert!(
                    difference <= 1e-6 * length(one),
                    "{p:?} at scale {scale}: {scaled:?} against {one:?}"
                );
            }
        }
    }
}
