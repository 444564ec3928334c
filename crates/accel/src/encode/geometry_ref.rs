//! The geometries that trees for shaders are built over, of either kind.

use super::object::{Object, SphereGeometry};
use super::primitive::EncodedPrimitive;
use crate::build::PrimitiveRef;
use crate::bvh::{self, Geometry};

/// One geometry of an object.
#[derive(Clone, Copy)]
pub(super) enum GeometryRef<'a> {
    Triangles(Geometry<'a>),
    Spheres(SphereGeometry<'a>),
}

impl<'a> GeometryRef<'a> {
    /// The geometries of an object, in order.
    pub fn of(object: &Object<'a>) -> Vec<GeometryRef<'a>> {
        match object {
            Object::Triangles(geometries) => geometries.iter().map(|g| GeometryRef::Triangles(*g)).collect(),
            Object::Spheres(geometries) => geometries.iter().map(|g| GeometryRef::Spheres(*g)).collect(),
        }
    }

    pub fn is_spheres(&self) -> bool {
        matches!(self, GeometryRef::Spheres(_))
    }

    /// Number of primitives, with those that cannot be hit.
    pub fn len(&self) -> usize {
        match self {
            GeometryRef::Triangles(g) => g.indices.len(),
            GeometryRef::Spheres(g) => g.spheres.len(),
        }
    }

    /// References to the primitives that can be hit, and the number of all others. `number`: that
    /// of the geometry.
    fn references(&self, number: u32) -> (Vec<PrimitiveRef>, usize) {
        match self {
            GeometryRef::Triangles(g) => bvh::triangle_references(g, number),
            GeometryRef::Spheres(g) => bvh::sphere_references(g.spheres, number),
        }
    }
}

/// References to all primitives that can be hit, and the number of all others.
pub(super) fn references(geometries: &[GeometryRef]) -> (Vec<PrimitiveRef>, usize) {
    let (mut refs, mut skipped) = (Vec::new(), 0);
    for (number, geometry) in (0..).zip(geometries) {
        let (mut new, new_skipped) = geometry.references(number);
        skipped += new_skipped;
        if refs.is_empty() {
            refs = new;
        } else {
            refs.append(&mut new);
        }
    }
    (refs, skipped)
}

/// Corners of a reference's triangle; `None` for spheres.
pub(super) fn corners(geometries: &[GeometryRef], r: &PrimitiveRef) -> Option<[[f32; 3]; 3]> {
    match &geometries[r.geometry() as usize] {
        GeometryRef::Triangles(g) => Some(g.indices[r.index() as usize].map(|i| g.positions[i as usize])),
        GeometryRef::Spheres(_) => None,
    }
}

/// A reference's primitive as shaders read it.
pub(super) fn encode(geometries: &[GeometryRef], r: &PrimitiveRef) -> EncodedPrimitive {
    let (geometry, index) = (r.geometry(), r.index());
    match &geometries[geometry as usize] {
        GeometryRef::Triangles(g) => EncodedPrimitive::triangle(g, geometry, index),
        GeometryRef::Spheres(g) => {
            EncodedPrimitive::sphere(&g.spheres[index as usize], g.first_id + index, geometry)
        }
    }
}
