//! Triangles and spheres as shaders read them.

use crate::bvh::{Geometry, Sphere};
use bytemuck::{Pod, Zeroable};

/// Bit of [`EncodedPrimitive::owner`]: a sphere.
pub const OWNER_SPHERE: u32 = 1 << 31;

/// The corners of a triangle, or a sphere, with its numbers, in three loads of sixteen bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct EncodedPrimitive {
    /// First corner of a triangle; centre of a sphere. In object space, or in world space if
    /// instances are flattened.
    pub a: [f32; 3],
    /// Number of the primitive in its object.
    pub primitive: u32,
    /// Second corner; the sphere's radius, then zeros.
    pub b: [f32; 3],
    /// Number of the geometry in its object.
    pub geometry: u32,
    /// Third corner; zeros.
    pub c: [f32; 3],
    /// If instances are flattened: the index of the instance, with [`OWNER_SPHERE`] for spheres.
    /// Otherwise zero.
    pub owner: u32,
}

impl EncodedPrimitive {
    pub(super) fn triangle(g: &Geometry, geometry: u32, index: u32) -> EncodedPrimitive {
        let [a, b, c] = g.indices[index as usize].map(|i| g.positions[i as usize]);
        EncodedPrimitive { a, primitive: g.first_id + index, b, geometry, c, owner: 0 }
    }

    pub(super) fn sphere(s: &Sphere, primitive: u32, geometry: u32) -> EncodedPrimitive {
        let b = [s.radius, 0.0, 0.0];
        EncodedPrimitive { a: s.center, primitive, b, geometry, c: [0.0; 3], owner: 0 }
    }
}
