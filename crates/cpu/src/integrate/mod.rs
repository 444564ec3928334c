//! The integrators: who follows the rays of each, and asks what is hit.

mod ambient_occlusion;
mod aov;
mod camera_rays;
mod direct;
pub(crate) mod last_segment;
pub(crate) mod path;
pub(crate) mod volume;

use crate::batch::samples::SampleId;
use crate::photons::PhotonMap;
use crate::scene::CpuScene;
use crate::shade::path_batch::PathBatch;
use crate::simd::Instructions;
use accel::HitFilter;
use backend::{Integrator, View};
use camera_rays::CameraRays;
use film::AovSample;
use optics::Vec3f;
use volume::VolumeTracer;

/// Fills the batch's results for the samples `ids`; returns rays that the batch itself did not count.
#[inline(always)]
pub(crate) fn render_batch<I: Instructions, F: HitFilter>(
    i: I,
    scene: &CpuScene,
    view: &View,
    filter: &F,
    photons: Option<&PhotonMap>,
    ids: &[SampleId],
    batch: &mut PathBatch,
) -> u64 {
    let rays = CameraRays::new(scene, view, filter);
    match &view.integrator {
        Integrator::Path(settings) if scene.volumes || photons.is_some() => {
            render_volumes(VolumeTracer::new(scene, view, settings, photons), view, ids, batch)
        }
        Integrator::Path(settings) => {
            batch.run(i, scene, view, settings, filter, ids);
            0
        }
        Integrator::Direct(settings) => {
            render_single(rays, ids, batch, |rays, id| direct::sample(rays, settings, id))
        }
        // The same expected picture; the back end has refused what is not.
        Integrator::Hybrid(settings) => {
            render_single(rays, ids, batch, |rays, id| direct::sample(rays, &settings.rays, id))
        }
        // The back end has refused it.
        Integrator::Realtime(settings) => {
            batch.run(i, scene, view, &settings.path, filter, ids);
            0
        }
        Integrator::Aov => render_single(rays, ids, batch, aov::sample),
        Integrator::AmbientOcclusion(settings) => {
            render_single(rays, ids, batch, |rays, id| ambient_occlusion::sample(rays, settings, id))
        }
    }
}

/// Paths through media, and those that gather photons.
fn render_volumes(mut tracer: VolumeTracer, view: &View, ids: &[SampleId], batch: &mut PathBatch) -> u64 {
    batch.radiance.clear();
    batch.aovs.clear();
    for id in ids {
        batch.radiance.push(tracer.sample(id));
        if !view.aovs.is_empty() {
            batch.aovs.push(tracer.first_hit(id));
        }
    }
    tracer.rays_traced
}

/// Integrators that make one sample after the other.
fn render_single<F: HitFilter>(
    mut rays: CameraRays<F>,
    ids: &[SampleId],
    batch: &mut PathBatch,
    sample: impl Fn(&mut CameraRays<F>, &SampleId) -> (Vec3f, AovSample),
) -> u64 {
    batch.radiance.clear();
    batch.aovs.clear();
    for id in ids {
        let (radiance, first_hit) = sample(&mut rays, id);
        batch.radiance.push(radiance);
        if !rays.view.aovs.is_empty() {
            batch.aovs.push(first_hit);
        }
    }
    rays.traced
}
