//! Clusters of a view: tiles of the window, divided by distance, each of which knows the lights that can reach it.
//!
//! Source: Olsson, Billeter and Assarsson, "Clustered Deferred and Forward Shading", HPG 2012.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod clusters {
    use crate::bounds::*;
    use crate::light::*;
    use wgsl_rs::std::*;

    /// Number of the slice at a depth, below `count`. The second slice begins at the depth `near`, and each of the next 2^`growth`
    /// times farther away.
    pub fn slice_at(depth: f32, near: f32, growth: f32, count: u32) -> u32 {
        let slice = 1.0 + log2(max(depth, 1e-30) / near) / growth;
        u32(clamp(slice, 0.0, f32(count) - 1.0))
    }

    /// The depth at which a slice begins; see [`slice_at`].
    pub fn slice_begin(slice: u32, near: f32, growth: f32) -> f32 {
        if slice == 0u32 {
            return 0.0;
        }
        near * exp2(growth * f32(slice - 1u32))
    }

    /// Adds an edge of a cluster to the box around it.
    ///
    /// - `origin`, `direction`: the camera's ray along it. `axis`: of the view. `start`, `end`: depths between which it lies.
    pub fn cluster_add_edge(
        b: AxisBox,
        origin: Vec3f,
        direction: Vec3f,
        axis: Vec3f,
        start: f32,
        end: f32,
    ) -> AxisBox {
        let step = direction / dot(direction, axis);
        let first = origin + step * start;
        let last = origin + step * end;
        AxisBox { low: min(b.low, min(first, last)), high: max(b.high, max(first, last)) }
    }

    /// A box with room for what positions in it lose by rounding. `end`: the depth at which it ends.
    pub fn cluster_with_room(b: AxisBox, end: f32) -> AxisBox {
        let room = 1e-4 * (max(abs(b.low), abs(b.high)) + vec3f(end, end, end));
        AxisBox { low: b.low - room, high: b.high + room }
    }

    /// Whether what a light reaches touches a box.
    pub fn is_within_reach(b: AxisBox, reach: LightReach) -> bool {
        let nearest = clamp(reach.center, b.low, b.high);
        length(nearest - reach.center) <= reach.radius
    }
}

#[cfg(test)]
mod tests {
    use super::clusters::*;
    use crate::bounds::AxisBox;
    use crate::light::LightReach;
    use crate::vec3f;

    #[test]
    fn slices_are_where_they_begin() {
        let (near, growth) = (0.25, 0.8);
        for slice in 0..16 {
            let (begin, end) = (slice_begin(slice, near, growth), slice_begin(slice + 1, near, growth));
            assert!(begin < end);
            assert_eq!(slice_at(0.5 * (begin + end), near, growth, 16), slice);
        }
        assert_eq!(slice_at(1e9, near, growth, 16), 15);
        assert_eq!(slice_at(-1.0, near, growth, 16), 0);
    }

    #[test]
    fn lights_reach_what_is_near() {
        let b = AxisBox { low: vec3f(0.0, 0.0, 0.0), high: vec3f(1.0, 1.0, 1.0) };
        let touches =
            |x: f32, radius: f32| is_within_reach(b, LightReach { center: vec3f(x, 0.5, 0.5), radius });
        assert!(touches(0.5, 0.0) && touches(3.0, 2.0) && !touches(3.0, 1.9));
    }
}
