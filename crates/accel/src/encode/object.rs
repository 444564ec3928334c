//! What objects are made of, and what is known of encoded ones.

use crate::aabb::Aabb;
use crate::bvh::{Geometry, Sphere, TightBounds};

/// A list of spheres.
#[derive(Clone, Copy, Debug)]
pub struct SphereGeometry<'a> {
    /// The spheres, in object space.
    pub spheres: &'a [Sphere],
    /// Id of the first sphere in its object; ids of the others follow.
    pub first_id: u32,
}

/// The geometries of an object, numbered in this order.
#[derive(Clone, Debug)]
pub enum Object<'a> {
    /// Triangles.
    Triangles(Vec<Geometry<'a>>),
    /// Procedural spheres.
    Spheres(Vec<SphereGeometry<'a>>),
}

/// The root and bounds of an encoded object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectInfo {
    /// Index of its root node, or `u32::MAX` if it is empty.
    pub root: u32,
    /// Lowest corner of its bounds, in object space.
    pub low: [f32; 3],
    /// Highest corner; below the lowest if the object is empty.
    pub high: [f32; 3],
    /// Whether its primitives are spheres.
    pub has_spheres: bool,
}

/// An encoded object, for its instances.
#[derive(Clone, Debug)]
pub(super) struct EncodedObject {
    pub root: u32,
    pub bounds: Aabb,
    /// For the bounds of transformed instances.
    pub tight_bounds: TightBounds,
    pub has_triangles: bool,
    pub has_spheres: bool,
}
