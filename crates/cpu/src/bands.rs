//! Cutting the picture into work for threads.

use crate::direct::DirectTracer;
use crate::path::{PathBatch, SampleId};
use crate::scene::CpuScene;
use accel::HitFilter;
use backend::{DirectSettings, Integrator, View};
use film::{AovSample, PixelStats, Rect};
use std::ops::Range;

/// Rows of a band: the unit of work that threads steal. Bands are whole rows so that each owns its part of the film.
pub(crate) const BAND_ROWS: u32 = 8;
/// Pixels along a batch's side.
const BLOCK_COLUMNS: u32 = 8;
/// Samples of a batch: enough to fill streams, few enough that a batch stays in the second-level cache.
const BATCH_SAMPLES: u32 = 1024;

/// First hits of a band: pixel, sample index, values.
pub(crate) type BandAovs = Vec<(u32, u32, u32, AovSample)>;

/// Renders samples `samples` of the rows `rows` (relative to the window) into `pixels`; returns the number of rays.
pub(crate) fn render_band<F: HitFilter>(
    scene: &CpuScene,
    view: &View,
    filter: &F,
    rows: Range<u32>,
    samples: Range<u32>,
    pixels: &mut [PixelStats],
    aovs: &mut BandAovs,
    batch: &mut PathBatch,
) -> u64 {
    let before = batch.rays_traced;
    let mut rays = 0;
    let mut ids = Vec::with_capacity((BLOCK_COLUMNS * BAND_ROWS) as usize * samples.len().min(64));
    for first_column in (0..view.window.width).step_by(BLOCK_COLUMNS as usize) {
        let columns = first_column..(first_column + BLOCK_COLUMNS).min(view.window.width);
        let area = (columns.len() * rows.len()) as u32;
        let step = (BATCH_SAMPLES / area).max(1);
        for first in samples.clone().step_by(step as usize) {
            let range = first..(first + step).min(samples.end);
            ids.clear();
            sample_ids(view.window, columns.clone(), rows.clone(), range, &mut ids);
            rays += render_batch(scene, view, filter, &ids, batch);
            for (slot, id) in ids.iter().enumerate() {
                let row = id.y - view.window.y - rows.start;
                let at = (row * view.window.width + id.x - view.window.x) as usize;
                pixels[at].add(batch.radiance[slot].to_array());
                if let Some(sample) = batch.aovs.get(slot) {
                    aovs.push((id.x, id.y, id.index, *sample));
                }
            }
        }
    }
    rays + batch.rays_traced - before
}

/// Samples of a block of pixels, all samples of a pixel together: neighbours in the list are alike.
fn sample_ids(window: Rect, columns: Range<u32>, rows: Range<u32>, samples: Range<u32>, ids: &mut Vec<SampleId>) {
    for y in rows {
        for x in columns.clone() {
            ids.extend(samples.clone().map(|index| SampleId { x: window.x + x, y: window.y + y, index }));
        }
    }
}

/// Fills the batch's results; returns rays that the batch itself did not count.
fn render_batch<F: HitFilter>(scene: &CpuScene, view: &View, filter: &F, ids: &[SampleId], batch: &mut PathBatch) -> u64 {
    let settings = match &view.integrator {
        Integrator::Path(settings) => {
            batch.run(scene, view, settings, filter, ids);
            return 0;
        }
        Integrator::Direct(settings) => *settings,
        Integrator::Aov => DirectSettings::default(),
    };
    let mut tracer = DirectTracer::new(scene, view, filter, settings);
    batch.radiance.clear();
    batch.aovs.clear();
    for id in ids {
        let (radiance, aovs) = match view.integrator {
            Integrator::Aov => tracer.sample_aov(id),
            _ => tracer.sample(id),
        };
        batch.radiance.push(radiance);
        if !view.aovs.is_empty() {
            batch.aovs.push(aovs);
        }
    }
    tracer.rays_traced
}
