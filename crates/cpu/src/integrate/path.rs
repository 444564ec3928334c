//! Path tracing of a batch of samples, one segment of all paths at a time.
//!
//! The batch is a small wavefront: trace all rays as a stream, shade all hits, trace all shadow rays as a stream, go on
//! with the paths that live. Streams let the acceleration structure use its packets where rays are alike, and keep each
//! stage's code and data in the caches. What happens at a vertex is the optics' `path` module; this is only the loop.

use crate::batch::lanes::{CameraLanes, LANES};
use crate::batch::samples::{SampleId, new_sampler, ray_time, sampler_kind};
use crate::batch::streams::Connection;
use crate::scene::CpuScene;
use crate::shade::hits::ShadeHits;
use crate::shade::material::Shading;
use crate::shade::path_batch::{Context, PathBatch};
use crate::simd::{Instructions, Stage};
use accel::{Coherence, HitFilter};
use backend::{PathSettings, View};
use film::AovSample;
use optics::camera::{CAMERA_PERSPECTIVE, CameraFrame, camera_pixel_spread};
use optics::distortion::no_distortion;
use optics::path::limit_indirect;
use optics::{Vec3f, vec3f};

/// Makes the camera rays of samples.
struct Generate<'a> {
    batch: &'a mut PathBatch,
    scene: &'a CpuScene,
    view: &'a View,
    samples: &'a [SampleId],
    branches: u32,
}

impl Stage for Generate<'_> {
    #[inline(always)]
    fn run<I: Instructions>(self, i: I) {
        self.batch.times.clear();
        // Times are drawn only where something depends on them.
        if self.view.shutter.is_some() && (self.scene.tables.motion.is_some() || self.view.camera_moves()) {
            return self.batch.generate_moving(i, self.view, self.samples, self.branches);
        }
        self.batch.generate(i, self.view, self.samples, self.branches);
    }
}

impl PathBatch {
    /// Makes the samples; the results are in `radiance` and `aovs`, in the order of `samples`.
    #[inline(always)]
    pub fn run<I: Instructions, F: HitFilter>(
        &mut self,
        i: I,
        scene: &CpuScene,
        view: &View,
        settings: &PathSettings,
        filter: &F,
        samples: &[SampleId],
    ) {
        let pixel_spread = camera_pixel_spread(view.camera, view.height as f32);
        let shading = Shading { single_scatter: view.single_scatter, pixel_spread };
        let wants_aovs = !view.aovs.is_empty();
        let wants_features = view.aovs.iter().any(|aov| aov.guides_denoisers());
        let sampler_kind = sampler_kind(view);
        let branches = settings.splitting.max(1);
        let mut context = Context {
            scene,
            sampler_kind,
            depth: 1,
            branches,
            settings,
            shading,
            wants_aovs,
            wants_features,
        };
        if wants_features {
            self.begin_features(samples.len(), branches);
        }
        self.shadows.clear();
        self.next.clear();
        i.call(Generate { batch: self, scene, view, samples, branches });
        let mut coherence = Coherence::Coherent;
        while self.paths.len() > 0 {
            self.gathered.clear();
            if settings.clamp_indirect.is_some() {
                self.gathered.extend_from_slice(&self.radiance);
            }
            if context.are_last_segments() {
                self.follow_into_the_sky(&context, filter);
            }
            let count = self.paths.len();
            scene.tlas.closest_stream(
                &self.paths.rays(&self.times),
                &mut self.hits.columns(count),
                filter,
                coherence,
            );
            self.rays_traced += count as u64;
            i.call(ShadeHits(self, &context));
            self.limit_found(settings, context.depth);
            self.connect(scene, filter);
            self.limit_found(settings, context.depth + 1);
            if scene.learner.is_some() {
                self.note_finds();
            }
            std::mem::swap(&mut self.paths, &mut self.next);
            self.next.clear();
            context.depth += 1;
            coherence = Coherence::Incoherent;
        }
        if let Some(learner) = &scene.learner {
            self.learn(learner);
        }
        if branches > 1 {
            self.join_branches(samples.len(), branches as usize);
        }
    }

    /// Limits what paths have found since `gathered` was noted, by so many segments, where the settings say so.
    fn limit_found(&mut self, settings: &PathSettings, segments: u32) {
        // Empty where nothing is limited.
        for (radiance, gathered) in self.radiance.iter_mut().zip(&mut self.gathered) {
            let found = *radiance - *gathered;
            let limited = limit_indirect(found, segments, settings.most_indirect());
            if limited != found {
                *radiance = *gathered + limited;
            }
            *gathered = *radiance;
        }
    }

    /// Sums what the branches of each sample have found.
    fn join_branches(&mut self, samples: usize, branches: usize) {
        for sample in 0..samples {
            let found = &self.radiance[sample * branches..][..branches];
            self.radiance[sample] = found.iter().fold(vec3f(0.0, 0.0, 0.0), |sum, radiance| sum + *radiance);
        }
        self.radiance.truncate(samples);
    }

    /// Camera rays.
    #[inline(always)]
    fn generate<I: Instructions>(&mut self, i: I, view: &View, samples: &[SampleId], branches: u32) {
        self.begin(view, samples, branches);
        let camera = view.camera;
        if camera.kind == CAMERA_PERSPECTIVE && camera.lens_radius <= 0.0 && camera.distortion.is_none() {
            // With these known the lanes have no branches.
            let pinhole = CameraFrame {
                kind: CAMERA_PERSPECTIVE,
                lens_radius: 0.0,
                distortion: no_distortion(),
                ..camera
            };
            self.generate_from(i, view, pinhole, samples, branches);
        } else {
            self.generate_from(i, view, camera, samples, branches);
        }
    }

    /// Forgets the paths of the last batch, and makes room for the results of this one.
    fn begin(&mut self, view: &View, samples: &[SampleId], branches: u32) {
        self.paths.clear();
        self.radiance.clear();
        self.radiance.resize(samples.len() * branches as usize, vec3f(0.0, 0.0, 0.0));
        self.aovs.clear();
        if !view.aovs.is_empty() {
            self.aovs.resize(samples.len(), AovSample::default());
        }
    }

    /// Camera rays that leave at times of their own.
    #[inline(always)]
    fn generate_moving<I: Instructions>(&mut self, i: I, view: &View, samples: &[SampleId], branches: u32) {
        self.begin(view, samples, branches);
        let mut lanes = CameraLanes::default();
        for samples in samples.chunks(LANES) {
            lanes.compute(view, view.camera, samples);
            for (lane, sample) in samples.iter().enumerate() {
                let time = ray_time(view, new_sampler(view, sample), sample);
                self.times.extend(std::iter::repeat_n(time, branches as usize));
                if view.camera_moves() {
                    lanes.leave_at(view, lane, time);
                }
            }
            self.paths.begin(i, &lanes, samples.len(), branches);
        }
    }

    #[inline(always)]
    fn generate_from<I: Instructions>(
        &mut self,
        i: I,
        view: &View,
        camera: CameraFrame,
        samples: &[SampleId],
        branches: u32,
    ) {
        let mut lanes = CameraLanes::default();
        for samples in samples.chunks(LANES) {
            lanes.compute(view, camera, samples);
            self.paths.begin(i, &lanes, samples.len(), branches);
        }
    }

    /// Traces the queued shadow rays and adds what is not occluded.
    #[inline(always)]
    pub(crate) fn connect<F: HitFilter>(&mut self, scene: &CpuScene, filter: &F) {
        let count = self.shadows.len();
        // The queries write all of it.
        self.occluded.resize(count, false);
        scene.tlas.any_stream(
            &self.shadows.rays(&self.times),
            &mut self.occluded,
            filter,
            Coherence::Incoherent,
        );
        self.rays_traced += count as u64;
        for (at, occluded) in self.occluded.iter().enumerate() {
            let Connection { slot, contribution: Vec3f { x, y, z } } = self.shadows.connection(at);
            // Every second guess of a branch would be wrong. Not by factors: what is occluded may be infinite.
            let visible = |c: f32| f32::from_bits(if *occluded { 0 } else { c.to_bits() });
            self.radiance[slot as usize] += vec3f(visible(x), visible(y), visible(z));
        }
        self.shadows.clear();
    }
}
