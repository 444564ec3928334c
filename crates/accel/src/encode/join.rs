//! Instances that stand still, joined to one object.
//!
//! Boxes around instances overlap where small things stand in large ones: columns under arches, lamps in a hall. A ray enters all of
//! them, each time with its origin and direction made anew. Their primitives can be put into the world instead, in one tree with no
//! level above it; that takes memory for each instance, and none can be moved any more.

use super::part::Part;
use super::primitive::OWNER_SPHERE;
use super::{Object, SphereGeometry};
use crate::blas::{Geometry, Sphere};
use crate::tlas::{Instance, inverse};
use rayon::prelude::*;

/// How far, relative to its size, a matrix may be from one that makes spheres of spheres.
const SIMILAR: f64 = 1e-5;

/// One geometry of one instance, in world space.
struct Placed<'a> {
    shape: PlacedShape<'a>,
    first_id: u32,
    /// Which instance, and which of its geometries.
    owner: (u32, u32),
}

enum PlacedShape<'a> {
    Triangles(Vec<[f32; 3]>, &'a [[u32; 3]]),
    Spheres(Vec<Sphere>),
}

/// All instances of a scene as one object.
pub(super) struct Joined<'a>(Vec<Placed<'a>>);

impl<'a> Joined<'a> {
    /// Joins all instances that can be hit, if they have no more than `most_primitives`. `None` if they have, if joining gains
    /// nothing because there is no upper level anyway, or if spheres would be none in the world.
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
            for (number, part) in (0..).zip(Part::of(&objects[instance.blas as usize])) {
                count += part.len();
                if count > most_primitives || part.is_spheres() && scale_of(instance).is_none() {
                    return None;
                }
                wanted.push((instance, part, (index, number)));
            }
        }
        Some(Joined(wanted.into_par_iter().map(|(i, part, owner)| placed(i, part, owner)).collect()))
    }

    /// The geometries of all instances, one after the other.
    pub fn parts(&self) -> Vec<Part<'_>> {
        self.0.iter().map(Placed::part).collect()
    }

    /// Of the geometry of this number among [`Joined::parts`]: [`super::EncodedPrimitive::owner`], and its number in its object.
    pub fn owner(&self, part: u32) -> (u32, u32) {
        let Placed { shape, owner: (instance, geometry), .. } = &self.0[part as usize];
        let kind = if matches!(shape, PlacedShape::Spheres(_)) { OWNER_SPHERE } else { 0 };
        (instance | kind, *geometry)
    }
}

impl Placed<'_> {
    fn part(&self) -> Part<'_> {
        let first_id = self.first_id;
        match &self.shape {
            PlacedShape::Triangles(positions, indices) => {
                Part::Triangles(Geometry { positions, indices, first_id })
            }
            PlacedShape::Spheres(spheres) => Part::Spheres(SphereGeometry { spheres, first_id }),
        }
    }
}

fn placed<'a>(instance: &Instance, part: Part<'a>, owner: (u32, u32)) -> Placed<'a> {
    let to_world = |p: &[f32; 3]| moved(&instance.object_to_world, *p);
    match part {
        Part::Triangles(g) => {
            let positions = g.positions.iter().map(to_world).collect();
            Placed { shape: PlacedShape::Triangles(positions, g.indices), first_id: g.first_id, owner }
        }
        Part::Spheres(g) => {
            let scale = scale_of(instance).unwrap_or(1.0);
            let sphere = |s: &Sphere| Sphere {
                center: to_world(&s.center),
                radius: (f64::from(s.radius) * scale) as f32,
            };
            let spheres = g.spheres.iter().map(sphere).collect();
            Placed { shape: PlacedShape::Spheres(spheres), first_id: g.first_id, owner }
        }
    }
}

/// A point in the world. In double precision, and rounded once: as near as can be to where shading finds the surface.
fn moved(m: &[[f32; 4]; 3], p: [f32; 3]) -> [f32; 3] {
    let p = p.map(f64::from);
    m.map(|row| {
        let [x, y, z, w] = row.map(f64::from);
        (x * p[0] + y * p[1] + z * p[2] + w) as f32
    })
}

/// How much larger spheres are in the world, if they are spheres there.
fn scale_of(instance: &Instance) -> Option<f64> {
    let m = instance.object_to_world.map(|row| row.map(f64::from));
    let dot = |a: usize, b: usize| (0..3).map(|row| m[row][a] * m[row][b]).sum::<f64>();
    let square = dot(0, 0);
    let alike = |a: usize| (dot(a, a) - square).abs() <= SIMILAR * square;
    let at_right_angles = |a: usize, b: usize| dot(a, b).abs() <= SIMILAR * square;
    let is_similar =
        alike(1) && alike(2) && at_right_angles(0, 1) && at_right_angles(1, 2) && at_right_angles(0, 2);
    is_similar.then(|| square.sqrt())
}
