//! [`RayQueries`]: the renderer's acceleration structures for rays that the caller makes.

mod beam;
mod hits;
mod point;

pub use beam::BeamEcho;
pub use hits::{Hits, RayError, Rays};
pub use point::SurfacePoint;

use crate::fetch::filter::AlphaFilter;
use crate::scene::CpuScene;
use crate::threads::Threads;
use accel::{Coherence, Hit, MISS, Opaque, Quality, Ray};
use backend::{BackendError, Control};
use rayon::prelude::*;
use scene::tables::SceneTables;
use std::collections::HashMap;
use std::sync::Arc;

/// Rays that a thread traces at a time: enough for streams, few enough that rays and hits stay in the second-level cache.
const PIECE: usize = 4096;

/// A scene that answers what rays hit, on all cores. Surfaces with holes (alpha masks and coverage) let rays through
/// there, as in pictures.
pub struct RayQueries {
    threads: Threads,
    scene: CpuScene,
    /// For each binding, the number that its first primitive has in the user's mesh.
    first_in_mesh: Vec<u32>,
}

/// Buffers of a thread, kept from piece to piece.
#[derive(Default)]
struct Scratch {
    rays: Vec<Ray>,
    hits: Vec<Hit>,
}

impl RayQueries {
    /// Builds the structures over a scene, with `threads` threads; `None` uses all cores.
    ///
    /// # Errors
    /// When the system refuses to make threads.
    pub fn new(tables: impl Into<Arc<SceneTables>>, threads: Option<usize>) -> Result<Self, BackendError> {
        let tables = tables.into();
        let threads = Threads::new(threads)?;
        let first_in_mesh = first_in_mesh(&tables);
        let scene = threads.install(|| CpuScene::new(tables, Quality::Balanced));
        Ok(Self { threads, scene, first_in_mesh })
    }

    /// The number of threads.
    pub fn threads(&self) -> usize {
        self.threads.count()
    }

    /// The scene's tables.
    pub fn tables(&self) -> &SceneTables {
        &self.scene.tables
    }

    /// The nearest hit of each of `count` rays, as `record` makes something of it. Points that no ray reached are `None`.
    ///
    /// - `ray`: makes the ray of a number; directions must have unit length.
    /// - `control`: is told how many rays are done, and may cancel: what was not traced then is `T::default()`.
    pub fn map<T: Send + Clone + Default>(
        &self,
        count: usize,
        control: &Control,
        ray: impl Fn(usize) -> Ray + Sync,
        record: impl Fn(usize, Option<&SurfacePoint>) -> T + Sync,
    ) -> Vec<T> {
        let mut results = vec![T::default(); count];
        let pieces = results.par_chunks_mut(PIECE);
        self.closest_in_pieces(
            count,
            Coherence::Incoherent,
            control,
            pieces,
            ray,
            |results, first, rays, hits| {
                for (i, (result, (ray, hit))) in results.iter_mut().zip(rays.iter().zip(hits)).enumerate() {
                    let point = (!hit.is_miss()).then(|| SurfacePoint::new(self, ray, hit));
                    *result = record(first + i, point.as_ref());
                }
            },
        );
        results
    }

    /// Traces `count` rays piece by piece on all threads. `record` gets its piece of the results, the number of the piece's
    /// first ray, and rays and hits of the piece.
    fn closest_in_pieces<P: IndexedParallelIterator>(
        &self,
        count: usize,
        coherence: Coherence,
        control: &Control,
        pieces: P,
        ray: impl Fn(usize) -> Ray + Sync,
        record: impl Fn(P::Item, usize, &[Ray], &[Hit]) + Sync,
    ) {
        control.begin(count as u64);
        let trace = |scratch: &mut Scratch, (piece, results): (usize, P::Item)| {
            if control.is_cancelled() {
                return;
            }
            let first = piece * PIECE;
            scratch.rays.clear();
            scratch.rays.extend((first..(first + PIECE).min(count)).map(&ray));
            scratch.hits.resize(scratch.rays.len(), MISS);
            self.closest_stream(&scratch.rays, &mut scratch.hits, coherence);
            record(results, first, &scratch.rays, &scratch.hits);
            control.advance(scratch.rays.len() as u64);
        };
        self.threads.install(|| pieces.enumerate().for_each_init(Scratch::default, trace));
    }

    /// As [`RayQueries::closest_in_pieces`], for whether anything is hit at all.
    fn any_in_pieces(
        &self,
        results: &mut [bool],
        coherence: Coherence,
        control: &Control,
        ray: impl Fn(usize) -> Ray + Sync,
    ) {
        control.begin(results.len() as u64);
        let trace = |scratch: &mut Scratch, (piece, results): (usize, &mut [bool])| {
            if control.is_cancelled() {
                return;
            }
            let first = piece * PIECE;
            scratch.rays.clear();
            scratch.rays.extend((first..first + results.len()).map(&ray));
            self.any_stream(&scratch.rays, results, coherence);
            control.advance(results.len() as u64);
        };
        let pieces = results.par_chunks_mut(PIECE).enumerate();
        self.threads.install(|| pieces.for_each_init(Scratch::default, trace));
    }

    /// The scene that is asked.
    pub(crate) fn scene(&self) -> &CpuScene {
        &self.scene
    }

    fn closest_stream(&self, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) {
        let tlas = &self.scene.tlas;
        if self.scene.tables.has_alpha {
            tlas.closest_stream(rays, hits, &AlphaFilter(&self.scene), coherence);
        } else {
            tlas.closest_stream(rays, hits, &Opaque, coherence);
        }
    }

    pub(crate) fn any_stream(&self, rays: &[Ray], hit: &mut [bool], coherence: Coherence) {
        let tlas = &self.scene.tlas;
        if self.scene.tables.has_alpha {
            tlas.any_stream(rays, hit, &AlphaFilter(&self.scene), coherence);
        } else {
            tlas.any_stream(rays, hit, &Opaque, coherence);
        }
    }

    /// The user's instance of a hit, and the number of the primitive in that instance's mesh.
    #[inline]
    pub(crate) fn instance_and_primitive(&self, hit: &Hit) -> (u32, u32) {
        let binding = self.scene.hit_records.binding(hit.instance, hit.primitive);
        let in_geometry = hit.primitive - self.scene.hit_records.hit_record(binding).first_in_blas;
        let binding = binding as usize;
        (self.scene.tables.bindings[binding].object, self.first_in_mesh[binding] + in_geometry)
    }
}

/// What [`RayQueries::first_in_mesh`] holds: parts of a mesh follow each other in the bindings of its instance, triangles
/// and spheres apart.
fn first_in_mesh(tables: &SceneTables) -> Vec<u32> {
    let mut first = vec![0; tables.bindings.len()];
    let mut counts: HashMap<_, u32> = HashMap::new();
    for instance in &tables.instances {
        let blas = &tables.blas[instance.blas as usize];
        for g in 0..blas.geometry_count {
            let binding = (instance.first_binding + g) as usize;
            let count = counts.entry((tables.bindings[binding].object, blas.kind)).or_default();
            first[binding] = *count;
            *count += tables.geometries[(blas.first_geometry + g) as usize].primitive_count;
        }
    }
    first
}

#[cfg(test)]
mod tests;
