//! Batches of rays and what they hit, as arrays of plain numbers.

use super::{PIECE, RayQueries};
use crate::fetch::surface::front_normals;
use accel::{Coherence, Hit, Ray};
use backend::Control;
use rayon::prelude::*;

/// Many rays, as others keep them: origins and directions in arrays of their own.
///
/// Directions may have any length but zero; distances are in units of that length. A ray with a number that is not finite
/// (but `t_max`) misses everything.
#[derive(Clone, Copy, Debug)]
pub struct Rays<'a> {
    /// Where each ray starts, world space, metres.
    pub origins: &'a [[f32; 3]],
    /// Where each goes; as many as there are origins.
    pub directions: &'a [[f32; 3]],
    /// Hits must be farther than this, in units of the direction's length.
    pub t_min: f32,
    /// Hits must be nearer than this, in the same units; may be infinite.
    pub t_max: f32,
    /// Whether neighbours are alike. Affects speed only.
    pub coherence: Coherence,
}

/// Why rays cannot be traced.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there are {origins} origins but {directions} directions")]
pub struct RayError {
    origins: usize,
    directions: usize,
}

/// Nearest hits, an array for each property, in the order of the rays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hits {
    /// Distance in units of the ray's direction; infinite for a miss.
    pub t: Vec<f32>,
    /// Number of the triangle in its mesh, or of the sphere among its spheres; -1 for a miss.
    pub primitive: Vec<i32>,
    /// Index into the scene's instances; -1 for a miss.
    pub instance: Vec<i32>,
    /// Barycentric weights of the triangle's second and third vertex; zero for spheres and misses.
    pub barycentrics: Vec<[f32; 2]>,
    /// Unit normals of the geometry, world space, on the side that the winding faces, whatever side the ray came from. Zero
    /// for a miss; empty if not asked for.
    pub normals: Vec<[f32; 3]>,
}

impl<'a> Rays<'a> {
    /// Whole half-lines that go anywhere.
    ///
    /// # Errors
    /// If there are not as many directions as origins.
    pub fn new(origins: &'a [[f32; 3]], directions: &'a [[f32; 3]]) -> Result<Self, RayError> {
        if origins.len() != directions.len() {
            return Err(RayError { origins: origins.len(), directions: directions.len() });
        }
        Ok(Self { origins, directions, t_min: 0.0, t_max: f32::INFINITY, coherence: Coherence::Incoherent })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        // The fields are public: what has no partner is no ray.
        self.origins.len().min(self.directions.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline]
    fn get(&self, i: usize) -> Ray {
        Ray { origin: self.origins[i], t_min: self.t_min, direction: self.directions[i], t_max: self.t_max }
    }
}

impl RayQueries {
    /// The nearest hit of each ray; `normals`: whether normals are wanted, which cost some time.
    ///
    /// A cancelled call leaves hits of rays that were not traced at zero.
    pub fn intersect(&self, rays: &Rays, normals: bool, control: &Control) -> Hits {
        let n = rays.len();
        // Zeros, because the system hands out zeroed pages for nothing, and the threads that fill them touch them first.
        let mut hits = Hits {
            t: vec![0.0; n],
            primitive: vec![0; n],
            instance: vec![0; n],
            barycentrics: vec![[0.0; 2]; n],
            normals: vec![[0.0; 3]; if normals { n } else { 0 }],
        };
        let ids = hits.primitive.par_chunks_mut(PIECE).zip(hits.instance.par_chunks_mut(PIECE));
        let places = hits.t.par_chunks_mut(PIECE).zip(hits.barycentrics.par_chunks_mut(PIECE));
        let ray = |i| rays.get(i);
        if normals {
            let pieces = places.zip(ids).zip(hits.normals.par_chunks_mut(PIECE));
            let record =
                |(((t, uv), (primitive, instance)), normals): (((_, _), (_, _)), &mut [[f32; 3]]),
                 _,
                 rays: &[Ray],
                 hits: &[Hit]| {
                    self.record(hits, t, uv, primitive, instance);
                    front_normals(&self.scene, rays, hits, normals);
                };
            self.closest_in_pieces(n, rays.coherence, control, pieces, ray, record);
        } else {
            let pieces = places.zip(ids);
            let record = |((t, uv), (primitive, instance)): ((_, _), (_, _)), _, _: &[Ray], hits: &[Hit]| {
                self.record(hits, t, uv, primitive, instance);
            };
            self.closest_in_pieces(n, rays.coherence, control, pieces, ray, record);
        }
        hits
    }

    /// Whether each ray hits anything.
    ///
    /// A cancelled call leaves rays that were not traced at `false`.
    pub fn occluded(&self, rays: &Rays, control: &Control) -> Vec<bool> {
        let mut results = vec![false; rays.len()];
        self.any_in_pieces(&mut results, rays.coherence, control, |i| rays.get(i));
        results
    }

    fn record(
        &self,
        hits: &[Hit],
        t: &mut [f32],
        uv: &mut [[f32; 2]],
        primitive: &mut [i32],
        instance: &mut [i32],
    ) {
        for (i, hit) in hits.iter().enumerate() {
            t[i] = hit.t;
            uv[i] = [hit.u, hit.v];
            let ids = if hit.is_miss() { (u32::MAX, u32::MAX) } else { self.instance_and_primitive(hit) };
            // Arrays of numbers know no "none": the largest number becomes -1, as is custom there.
            (instance[i], primitive[i]) = (ids.0 as i32, ids.1 as i32);
        }
    }
}
