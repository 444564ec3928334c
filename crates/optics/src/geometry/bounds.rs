//! Boxes along the axes.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod bounds {
    use crate::constants::*;
    use wgsl_rs::std::*;

    /// A box along the axes.
    #[derive(Clone, Copy, Debug)]
    pub struct AxisBox {
        /// Its lowest corner.
        pub low: Vec3f,
        /// Its highest corner.
        pub high: Vec3f,
    }

    /// A box around nothing.
    pub fn box_of_nothing() -> AxisBox {
        AxisBox { low: vec3f(FAR, FAR, FAR), high: vec3f(-FAR, -FAR, -FAR) }
    }

    /// The box around two points.
    pub fn box_of_two(a: Vec3f, b: Vec3f) -> AxisBox {
        AxisBox { low: min(a, b), high: max(a, b) }
    }

    /// A point of a grid: so many steps of size `scale` from its corner.
    pub fn grid_point(corner: Vec3f, scale: Vec3f, steps: Vec3f) -> Vec3f {
        corner + scale * steps
    }

    /// A corner of the cube around a sphere, a little larger than it must be.
    ///
    /// - `cube`: −1 or 1 for each axis.
    pub fn sphere_box_corner(center: Vec3f, radius: f32, cube: Vec3f) -> Vec3f {
        center + cube * (radius * 1.0001)
    }
}
