//! Flattening: static instances become one object in world space.
//!
//! Boxes of instances overlap where small objects stand inside large ones, such as lamps in a hall.
//! A ray enters all of them and is transformed each time. A single tree over all primitives in
//! world space avoids that. It takes memory for each instance, and instances cannot be
//! moved.

use super::geometry_ref::GeometryRef;
use super::object::{Object, SphereGeometry};
use super::primitive::OWNER_SPHERE;
use crate::bvh::{Geometry, Instance, Sphere, inverse};
use rayon::prelude::*;

/// Relative tolerance for transforms that map spheres to spheres.
const SIMILARITY_TOLERANCE: f64 = 1e-5;

/// One geometry of one instance, in world space.
struct FlattenedGeometry<'a> {
    primitives: FlattenedPrimitives<'a>,
    first_id: u32,
    /// Index of the instance, and number of the geometry in its object.
    owner: (u32, u32),
}

enum FlattenedPrimitives<'a> {
    Triangles(Vec<[f32; 3]>, &'a [[u32; 3]]),
    Spheres(Vec<Sphere>),
}

/// The geometries of all instances, in world space.
pub(super) struct FlattenedInstances<'a>(Vec<FlattenedGeometry<'a>>);

impl<'a> FlattenedInstances<'a> {
    /// Flattens all instances that can be hit. `None` if they have more than `most_primitives`
    /// primitives, if there is no top level anyway, or if a transform does not map spheres to
    /// spheres.
    pub fn new(objects: &[Object<'a>], instances: &[Instance], most_primitives: usize) -> Option<Self> {
        let can_be_hit = |i: &Instance| i.mask != 0 && inverse(&i.object_to_world).is_some();
        let there: Vec<(u32, &Instance)> = (0..).zip(instances).filter(|(_, i)| can_be_hit(i)).collect();
        let is_single = matches!(there[..], [(0, one)] if one.object_to_world == Instance::IDENTITY);
        if there.is_empty() || is_single {
            return None;
        }
        let mut wanted = Vec::new();
        let mut count = 0;
        for (index, instance) in there {
            for (number, geometry) in (0..).zip(GeometryRef::of(&objects[instance.blas as usize])) {
                count += geometry.len();
                if count > most_primitives || geometry.is_spheres() && scale_of(instance).is_none() {
                    return None;
                }
                wanted.push((instance, geometry, (index, number)));
            }
        }
        Some(FlattenedInstances(
            wanted.into_par_iter().map(|(i, geometry, owner)| flatten(i, geometry, owner)).collect(),
        ))
    }

    /// The geometries of all instances, in order.
    pub fn geometries(&self) -> Vec<GeometryRef<'_>> {
        self.0.iter().map(FlattenedGeometry::geometry).collect()
    }

    /// [`super::EncodedPrimitive::owner`] for a geometry of [`FlattenedInstances::geometries`], and
    /// its number in its object.
    pub fn owner(&self, geometry: u32) -> (u32, u32) {
        let FlattenedGeometry { primitives, owner: (instance, geometry), .. } = &self.0[geometry as usize];
        let kind = if matches!(primitives, FlattenedPrimitives::Spheres(_)) { OWNER_SPHERE } else { 0 };
        (instance | kind, *geometry)
    }
}

impl FlattenedGeometry<'_> {
    fn geometry(&self) -> GeometryRef<'_> {
        let first_id = self.first_id;
        match &self.primitives {
            FlattenedPrimitives::Triangles(positions, indices) => {
                GeometryRef::Triangles(Geometry { positions, indices, first_id })
            }
            FlattenedPrimitives::Spheres(spheres) => {
                GeometryRef::Spheres(SphereGeometry { spheres, first_id })
            }
        }
    }
}

fn flatten<'a>(instance: &Instance, geometry: GeometryRef<'a>, owner: (u32, u32)) -> FlattenedGeometry<'a> {
    let to_world = |p: &[f32; 3]| to_world_space(&instance.object_to_world, *p);
    match geometry {
        GeometryRef::Triangles(g) => {
            let positions = g.positions.iter().map(to_world).collect();
            FlattenedGeometry {
                primitives: FlattenedPrimitives::Triangles(positions, g.indices),
                first_id: g.first_id,
                owner,
            }
        }
        GeometryRef::Spheres(g) => {
            let scale = scale_of(instance).unwrap_or(1.0);
            let sphere = |s: &Sphere| Sphere {
                center: to_world(&s.center),
                radius: (f64::from(s.radius) * scale) as f32,
            };
            let spheres = g.spheres.iter().map(sphere).collect();
            FlattenedGeometry {
                primitives: FlattenedPrimitives::Spheres(spheres),
                first_id: g.first_id,
                owner,
            }
        }
    }
}

/// A point in world space, computed in double precision and rounded once, so that it is as close as
/// possible to the surface that shading computes.
fn to_world_space(m: &[[f32; 4]; 3], p: [f32; 3]) -> [f32; 3] {
    let p = p.map(f64::from);
    m.map(|row| {
        let [x, y, z, w] = row.map(f64::from);
        (x * p[0] + y * p[1] + z * p[2] + w) as f32
    })
}

/// The scale of spheres in world space, if they remain spheres.
fn scale_of(instance: &Instance) -> Option<f64> {
    let m = instance.object_to_world.map(|row| row.map(f64::from));
    let dot = |a: usize, b: usize| (0..3).map(|row| m[row][a] * m[row][b]).sum::<f64>();
    let square = dot(0, 0);
    let alike = |a: usize| (dot(a, a) - square).abs() <= SIMILARITY_TOLERANCE * square;
    let at_right_angles = |a: usize, b: usize| dot(a, b).abs() <= SIMILARITY_TOLERANCE * square;
    let is_similar =
        alike(1) && alike(2) && at_right_angles(0, 1) && at_right_angles(1, 2) && at_right_angles(0, 2);
    is_similar.then(|| square.sqrt())
}
