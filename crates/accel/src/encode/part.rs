//! What trees for shaders are built over: the geometries of an object, of either kind.

use super::{EncodedPrimitive, Object, SphereGeometry};
use crate::blas::{self, Geometry};
use crate::build::PrimitiveRef;

/// One geometry of an object.
#[derive(Clone, Copy)]
pub(super) enum Part<'a> {
    Triangles(Geometry<'a>),
    Spheres(SphereGeometry<'a>),
}

impl<'a> Part<'a> {
    /// The geometries of an object, in order.
    pub fn of(object: &Object<'a>) -> Vec<Part<'a>> {
        match object {
            Object::Triangles(geometries) => geometries.iter().map(|g| Part::Triangles(*g)).collect(),
            Object::Spheres(geometries) => geometries.iter().map(|g| Part::Spheres(*g)).collect(),
        }
    }

    pub fn is_spheres(&self) -> bool {
        matches!(self, Part::Spheres(_))
    }

    /// Number of primitives, with those that cannot be hit.
    pub fn len(&self) -> usize {
        match self {
            Part::Triangles(g) => g.indices.len(),
            Part::Spheres(g) => g.spheres.len(),
        }
    }

    /// References to what can be hit, under the geometry's `number`, and how many others there are.
    fn references(&self, number: u32) -> (Vec<PrimitiveRef>, usize) {
        match self {
            Part::Triangles(g) => blas::triangle_references(g, number),
            Part::Spheres(g) => blas::sphere_references(g.spheres, number),
        }
    }
}

/// References to all primitives that can be hit, and how many others there are.
pub(super) fn references(parts: &[Part]) -> (Vec<PrimitiveRef>, usize) {
    let (mut refs, mut skipped) = (Vec::new(), 0);
    for (number, part) in (0..).zip(parts) {
        let (mut new, new_skipped) = part.references(number);
        skipped += new_skipped;
        if refs.is_empty() {
            refs = new;
        } else {
            refs.append(&mut new);
        }
    }
    (refs, skipped)
}

/// Corners of a reference's triangle; spheres have none.
pub(super) fn corners(parts: &[Part], r: &PrimitiveRef) -> Option<[[f32; 3]; 3]> {
    match &parts[r.geometry() as usize] {
        Part::Triangles(g) => Some(g.indices[r.index() as usize].map(|i| g.positions[i as usize])),
        Part::Spheres(_) => None,
    }
}

/// A reference's primitive as shaders read it.
pub(super) fn encode(parts: &[Part], r: &PrimitiveRef) -> EncodedPrimitive {
    let (geometry, index) = (r.geometry(), r.index());
    match &parts[geometry as usize] {
        Part::Triangles(g) => EncodedPrimitive::triangle(g, geometry, index),
        Part::Spheres(g) => {
            EncodedPrimitive::sphere(&g.spheres[index as usize], g.first_id + index, geometry)
        }
    }
}
