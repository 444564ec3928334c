//! Lights that move while the shutter is open.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod moving_light {
    use crate::light::*;
    use crate::motion::*;
    use wgsl_rs::std::*;

    /// A light where a transform takes it.
    ///
    /// - `m`: maps world space to world space. Where it changes the size of a sphere, it does so
    ///   alike in all directions; spots, projectors and what is infinitely far away it only moves
    ///   and turns.
    pub fn moved_light(light: Light, m: AffineRows) -> Light {
        let mut moved = light;
        if light.kind == LIGHT_ENVIRONMENT {
            return moved;
        }
        if light.kind == LIGHT_DIRECTIONAL {
            moved.position = affine_vector(m, light.position);
            return moved;
        }
        moved.position = affine_point(m, light.position);
        if light.kind == LIGHT_SPHERE {
            moved.size = light.size * length(affine_vector(m, vec3f(1.0, 0.0, 0.0)));
        }
        if light_is_flat(light.kind) || light.kind == LIGHT_PROJECTOR {
            moved.edge2 = affine_vector(m, light.edge2);
        }
        // Of a point that is the axis of its profile, if it has one.
        moved.edge1 = affine_vector(m, light.edge1);
        moved
    }
}
