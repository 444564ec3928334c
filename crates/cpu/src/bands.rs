//! Cutting the picture into work for threads.

use crate::direct::DirectTracer;
use crate::path::{PathBatch, SampleId};
use crate::scene::CpuScene;
use accel::HitFilter;
use backend::{DirectSettings, Integrator, View};
use film::{AovSample, PixelStats, Rect};
use optics::Vec3f;
use std::ops::Range;

/// Rows of a band: the unit of work that threads steal. Bands are whole rows so that each owns its part of the film.
pub(crate) const BAND_ROWS: u32 = 8;
/// Pixels along a batch's side.
const BLOCK_COLUMNS: u32 = 8;
/// Samples of a batch: enough to fill streams, few enough that a batch stays in the second-level cache.
const BATCH_SAMPLES: u32 = 512;

/// First hits of a band: pixel, sample index, values.
pub(crate) type BandAovs = Vec<(u32, u32, u32, AovSample)>;

/// What a band needs to know.
pub(crate) struct Band<'a, F> {
    pub scene: &'a CpuScene,
    pub view: &'a View,
    pub filter: &'a F,
    /// Rows relative to the window.
    pub rows: Range<u32>,
    /// Sample indices.
    pub samples: Range<u32>,
}

impl<'a, F: HitFilter> Band<'a, F> {
    /// Renders the band into `pixels`, its rows of the film; returns the number of rays.
    ///
    /// The whole kernel is compiled for several instruction sets, of which the best that the machine has is taken.
    /// They differ in speed only: no operation is fused or reordered.
    pub fn render(&self, pixels: &mut [PixelStats], aovs: &mut BandAovs, batch: &mut PathBatch) -> u64 {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            if has!("avx512f") && has!("avx512vl") && has!("avx512bw") && has!("avx512dq") && has!("bmi2") {
                // SAFETY: the features that the function is compiled for have just been detected.
                return unsafe { self.render_avx512(pixels, aovs, batch) };
            }
            if has!("avx2") && has!("bmi2") && has!("fma") {
                // SAFETY: the features that the function is compiled for have just been detected.
                return unsafe { self.render_avx2(pixels, aovs, batch) };
            }
        }
        self.render_blocks(pixels, aovs, batch)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,bmi1,bmi2,fma")]
    fn render_avx512(&self, pixels: &mut [PixelStats], aovs: &mut BandAovs, batch: &mut PathBatch) -> u64 {
        self.render_blocks(pixels, aovs, batch)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,fma")]
    fn render_avx2(&self, pixels: &mut [PixelStats], aovs: &mut BandAovs, batch: &mut PathBatch) -> u64 {
        self.render_blocks(pixels, aovs, batch)
    }

    #[inline(always)]
    fn render_blocks(&self, pixels: &mut [PixelStats], aovs: &mut BandAovs, batch: &mut PathBatch) -> u64 {
        let window = self.view.window;
        let before = batch.rays_traced;
        let mut rays = 0;
        let mut ids = std::mem::take(&mut batch.ids);
        for first_column in (0..window.width).step_by(BLOCK_COLUMNS as usize) {
            let columns = first_column..(first_column + BLOCK_COLUMNS).min(window.width);
            let step = (BATCH_SAMPLES / (columns.len() * self.rows.len()) as u32).max(1);
            for first in self.samples.clone().step_by(step as usize) {
                let range = first..(first + step).min(self.samples.end);
                sample_ids(window, columns.clone(), self.rows.clone(), range, &mut ids);
                rays += self.render_batch(&ids, batch);
                let of_pixel = step.min(self.samples.end - first) as usize;
                for (ids, radiance) in ids.chunks(of_pixel).zip(batch.radiance.chunks(of_pixel)) {
                    let (x, y) = (ids[0].x - window.x, ids[0].y - window.y - self.rows.start);
                    pixels[(y * window.width + x) as usize].add_all(radiance.iter().map(|r| r.to_array()));
                }
                for (id, sample) in ids.iter().zip(&batch.aovs) {
                    aovs.push((id.x, id.y, id.index, *sample));
                }
            }
        }
        batch.ids = ids;
        rays + batch.rays_traced - before
    }

    /// Fills the batch's results; returns rays that the batch itself did not count.
    #[inline(always)]
    fn render_batch(&self, ids: &[SampleId], batch: &mut PathBatch) -> u64 {
        match &self.view.integrator {
            Integrator::Path(settings) => {
                batch.run(self.scene, self.view, settings, self.filter, ids);
                0
            }
            Integrator::Direct(settings) => self.render_single(ids, batch, *settings, DirectTracer::sample),
            Integrator::Aov => {
                self.render_single(ids, batch, DirectSettings::default(), DirectTracer::sample_aov)
            }
        }
    }

    /// Integrators that make one sample after the other.
    fn render_single(
        &self,
        ids: &[SampleId],
        batch: &mut PathBatch,
        settings: DirectSettings,
        sample: impl Fn(&mut DirectTracer<'a, F>, &SampleId) -> (Vec3f, AovSample),
    ) -> u64 {
        let mut tracer = DirectTracer::new(self.scene, self.view, self.filter, settings);
        batch.radiance.clear();
        batch.aovs.clear();
        for id in ids {
            let (radiance, first_hit) = sample(&mut tracer, id);
            batch.radiance.push(radiance);
            if !self.view.aovs.is_empty() {
                batch.aovs.push(first_hit);
            }
        }
        tracer.rays_traced
    }
}

/// Samples of a block of pixels, all samples of a pixel together: neighbours in the list are alike.
fn sample_ids(
    window: Rect,
    columns: Range<u32>,
    rows: Range<u32>,
    samples: Range<u32>,
    ids: &mut Vec<SampleId>,
) {
    ids.clear();
    for y in rows {
        for x in columns.clone() {
            ids.extend(samples.clone().map(|index| SampleId { x: window.x + x, y: window.y + y, index }));
        }
    }
}
