//! The constants of a ray for the slab test of boxes.

use crate::layout::NodePlane;
use crate::ray::Ray;

/// A ray's constants for the slab test. Along axis `a` it crosses the plane at `x` at `t = x *
/// inverse[a] + offset`, with one offset for entry and one for exit.
///
/// The fused multiply-add is exact up to the rounding of the offset and of the reciprocal. Both
/// errors are a few units in the last place of the largest coordinate. The two offsets are moved
/// apart by that much, so that the test never misses a box that the ray touches. This follows Ize,
/// "Robust BVH Ray Traversal", JCGT 2(2), 2013, at no cost per node.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Slabs {
    pub inverse: [f32; 3],
    pub near_offset: [f32; 3],
    pub far_offset: [f32; 3],
    /// The plane of boxes through which the ray enters, by axis.
    pub near_plane: [NodePlane; 3],
    pub t_min: f32,
}

impl Slabs {
    /// `extent`: the largest magnitude of a coordinate of the tree, by axis.
    #[inline(always)]
    pub fn new(ray: &Ray, extent: &[f32; 3]) -> Slabs {
        let d = &ray.direction;
        // A zero direction would give infinity, and then NaN. This value is small enough to count
        // as parallel at any distance.
        let tiny = (d[0].abs().max(d[1].abs()).max(d[2].abs()) * 1e-24).max(1e-37);
        let mut s = Slabs {
            inverse: [0.0; 3],
            near_offset: [0.0; 3],
            far_offset: [0.0; 3],
            near_plane: [NodePlane::new(0, 0); 3],
            t_min: ray.t_min.max(0.0),
        };
        for a in 0..3 {
            let inverse = 1.0 / if d[a].abs() < tiny { tiny.copysign(d[a]) } else { d[a] };
            let error = (ray.origin[a].abs() + extent[a]) * inverse.abs() * (4.0 * f32::EPSILON);
            s.inverse[a] = inverse;
            s.near_offset[a] = -(ray.origin[a] * inverse) - error;
            s.far_offset[a] = -(ray.origin[a] * inverse) + error;
            s.near_plane[a] = NodePlane::new(a, usize::from(inverse < 0.0));
        }
        s
    }
}
