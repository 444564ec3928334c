//! The primitives that trees are built over.

use crate::aabb::Aabb;
use crate::build::PrimitiveRef;
use crate::layout::sphere_bounds;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

/// A triangle list. A [`Blas`](crate::Blas) is built from one or several.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a> {
    /// Vertex positions, in object space.
    pub positions: &'a [[f32; 3]],
    /// Indices of the three positions of each triangle.
    pub indices: &'a [[u32; 3]],
    /// Id of the first triangle; ids of the others follow. Ids must be below `u32::MAX`. They
    /// should be unique within the `Blas`, because hits name primitives by id.
    pub first_id: u32,
}

/// A procedural sphere.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// Its centre, in object space.
    pub center: [f32; 3],
    /// Its radius, above zero.
    pub radius: f32,
}

/// The corners of a triangle, if they exist, are finite and span an area.
pub(super) fn corners(g: &Geometry, index: usize) -> Option<[[f32; 3]; 3]> {
    let triangle = g.indices[index];
    let n = g.positions.len();
    if triangle.iter().any(|&i| i as usize >= n) {
        return None;
    }
    let p = triangle.map(|i| g.positions[i as usize]);
    let sum = p[0][0] + p[0][1] + p[0][2] + p[1][0] + p[1][1] + p[1][2] + p[2][0] + p[2][1] + p[2][2];
    // The sum detects NaN and infinities. It may overflow itself; then every number is checked.
    if !sum.is_finite() && !p.as_flattened().iter().all(|c| c.is_finite()) {
        return None;
    }
    let edge = |q: [f32; 3]| [0, 1, 2].map(|a: usize| f64::from(q[a]) - f64::from(p[0][a]));
    let (a, b) = (edge(p[1]), edge(p[2]));
    let flat = a[1] * b[2] == a[2] * b[1] && a[2] * b[0] == a[0] * b[2] && a[0] * b[1] == a[1] * b[0];
    if flat { None } else { Some(p) }
}

fn points_bounds(p: &[[f32; 3]; 3]) -> Aabb {
    let fold = |f: fn(f32, f32) -> f32| [0, 1, 2].map(|a: usize| f(f(p[0][a], p[1][a]), p[2][a]));
    Aabb { min: fold(f32::min), max: fold(f32::max) }
}

/// Makes references of `count` boxes and leaves out those that are `None`. Also returns the number
/// of those left out.
fn references(
    count: usize,
    geometry: u32,
    bounds: impl Fn(usize) -> Option<Aabb> + Sync,
) -> (Vec<PrimitiveRef>, usize) {
    let none = PrimitiveRef::new(&Aabb::EMPTY, u32::MAX, 0);
    let mut refs = Vec::new();
    (0..count)
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| bounds(i).map_or(none, |b| PrimitiveRef::new(&b, i as u32, geometry)))
        .collect_into_vec(&mut refs);
    refs.retain(|r| r.index() != u32::MAX);
    let skipped = count - refs.len();
    (refs, skipped)
}

/// References to the triangles that can be hit, and the number of all others.
pub(crate) fn triangle_references(g: &Geometry, number: u32) -> (Vec<PrimitiveRef>, usize) {
    references(g.indices.len(), number, |i| corners(g, i).map(|p| points_bounds(&p)))
}

/// References to the spheres that can be hit, and the number of all others.
pub(crate) fn sphere_references(spheres: &[Sphere], number: u32) -> (Vec<PrimitiveRef>, usize) {
    references(spheres.len(), number, |i| {
        let s = &spheres[i];
        let finite = s.center.iter().chain([&s.radius]).all(|c| c.is_finite());
        (finite && s.radius > 0.0).then(|| sphere_bounds(s.center, s.radius))
    })
}
