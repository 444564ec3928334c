//! Cutting the picture into work for threads, and that into batches.

use crate::batch::samples::{Run, SampleId};
use crate::integrate::render_batch;
use crate::photons::PhotonMap;
use crate::scene::CpuScene;
use crate::shade::path_batch::PathBatch;
use crate::simd::{Instructions, Stage, call_with_best};
use accel::HitFilter;
use backend::{PixelSamples, View};
use film::{AovSample, PixelStats, Rect};
use std::ops::Range;

/// Rows of a block: the unit of work that threads steal. Blocks are whole rows so that each owns its part of the film.
pub(crate) const BLOCK_ROWS: u32 = 8;
/// Columns of a batch's block of pixels, if they have many samples each.
pub(crate) const BLOCK_COLUMNS: u32 = 16;
/// Samples of a batch: enough that what each stage costs once does not count, few enough that the batch stays in the caches.
const BATCH_SAMPLES: u32 = 4096;

/// First hits of a piece of work: pixel, sample index, values.
pub(crate) type FirstHits = Vec<(u32, u32, u32, AovSample)>;

/// What a thread renders at a time.
#[derive(Clone)]
pub(crate) enum Work<'a> {
    /// Some samples of every pixel of some rows of the window. The estimates are those of the rows.
    Rows { rows: Range<u32>, samples: Range<u32> },
    /// Some samples of each of these pixels. The estimates are in the order of the list.
    PixelList(&'a [PixelSamples]),
}

/// What rendering a piece of work needs to know.
pub(crate) struct RowBlock<'a, F> {
    pub scene: &'a CpuScene,
    pub view: &'a View,
    pub filter: &'a F,
    /// Photons that paths gather.
    pub photons: Option<&'a PhotonMap>,
    pub work: Work<'a>,
}

impl<'a, F: HitFilter> RowBlock<'a, F> {
    /// Renders the work into `pixels`, its estimates; returns the number of rays.
    pub fn render(&self, pixels: &mut [PixelStats], aovs: &mut FirstHits, batch: &mut PathBatch) -> u64 {
        let mut rays = 0;
        call_with_best(RenderRowBlock { row_block: self, pixels, aovs, batch, rays: &mut rays });
        rays
    }

    #[inline(always)]
    fn render_batches<I: Instructions>(
        &self,
        i: I,
        pixels: &mut [PixelStats],
        aovs: &mut FirstHits,
        batch: &mut PathBatch,
    ) -> u64 {
        let before = batch.rays_traced;
        let mut rays = 0;
        let (mut ids, mut runs) = (std::mem::take(&mut batch.ids), std::mem::take(&mut batch.runs));
        let mut walk = Walk::new(self.view.window, self.work.clone());
        while walk.next_batch(&mut ids, &mut runs) {
            rays += render_batch(i, self.scene, self.view, self.filter, self.photons, &ids, batch);
            let mut radiance = batch.radiance.iter();
            for run in &runs {
                let samples = radiance.by_ref().take(run.count as usize);
                pixels[run.place as usize].add_all(samples.map(|r| r.to_array()));
            }
            for (id, sample) in ids.iter().zip(&batch.aovs) {
                aovs.push((id.x, id.y, id.index, *sample));
            }
        }
        (batch.ids, batch.runs) = (ids, runs);
        rays + batch.rays_traced - before
    }
}

/// [`RowBlock::render`], compiled for some instructions.
struct RenderRowBlock<'a, 'b, F> {
    row_block: &'a RowBlock<'b, F>,
    pixels: &'a mut [PixelStats],
    aovs: &'a mut FirstHits,
    batch: &'a mut PathBatch,
    rays: &'a mut u64,
}

impl<F: HitFilter> Stage for RenderRowBlock<'_, '_, F> {
    #[inline(always)]
    fn run<I: Instructions>(self, i: I) {
        *self.rays = self.row_block.render_batches(i, self.pixels, self.aovs, self.batch);
    }
}

/// Where in a piece of work the next batch begins.
struct Walk<'a> {
    window: Rect,
    work: Work<'a>,
    /// Of rows: the first column of the block. Of a list: the place in it.
    at: u32,
    /// Samples that the pixels there have already.
    done: u32,
}

impl<'a> Walk<'a> {
    fn new(window: Rect, work: Work<'a>) -> Self {
        Self { window, work, at: 0, done: 0 }
    }

    /// Fills in the next batch, all samples of a pixel together: neighbours in a batch are alike. Returns whether there
    /// was anything left.
    fn next_batch(&mut self, ids: &mut Vec<SampleId>, runs: &mut Vec<Run>) -> bool {
        ids.clear();
        runs.clear();
        match self.work.clone() {
            Work::Rows { rows, samples } => self.next_block(rows, samples, ids, runs),
            Work::PixelList(list) => self.next_of_list(list, ids, runs),
        }
        !ids.is_empty()
    }

    /// A block of pixels with as many samples each as fit.
    fn next_block(
        &mut self,
        rows: Range<u32>,
        samples: Range<u32>,
        ids: &mut Vec<SampleId>,
        runs: &mut Vec<Run>,
    ) {
        let Rect { x: left, y: top, width, .. } = self.window;
        if samples.is_empty() {
            return;
        }
        // Where there are few samples of each pixel, more of them make a batch.
        let block_columns = (BATCH_SAMPLES / (samples.len() * rows.len()) as u32).max(BLOCK_COLUMNS);
        if self.done == samples.len() as u32 {
            (self.at, self.done) = (self.at + block_columns, 0);
        }
        if self.at >= width {
            return;
        }
        let columns = self.at..(self.at + block_columns).min(width);
        let step = (BATCH_SAMPLES / (columns.len() * rows.len()) as u32).max(1);
        let first = samples.start + self.done;
        let count = step.min(samples.end - first);
        for y in rows.clone() {
            for x in columns.clone() {
                let sample = |index| SampleId { x: left + x, y: top + y, index };
                ids.extend((first..first + count).map(sample));
                runs.push(Run { place: (y - rows.start) * width + x, count });
            }
        }
        self.done += count;
    }

    /// As many of the list's samples as fit.
    fn next_of_list(&mut self, list: &[PixelSamples], ids: &mut Vec<SampleId>, runs: &mut Vec<Run>) {
        let Rect { x: left, y: top, width, .. } = self.window;
        while let Some(pixel) = list.get(self.at as usize) {
            let room = BATCH_SAMPLES - ids.len() as u32;
            if room == 0 {
                break;
            }
            let (x, y) = (left + pixel.pixel % width, top + pixel.pixel / width);
            let first = pixel.first + self.done;
            let count = room.min(pixel.count - self.done);
            ids.extend((first..first + count).map(|index| SampleId { x, y, index }));
            runs.push(Run { place: self.at, count });
            self.done += count;
            if self.done == pixel.count {
                (self.at, self.done) = (self.at + 1, 0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn batches_hold_every_sample_once_and_are_large() {
        for (width, rows, samples) in
            [(700, 8..16, 0..1), (37, 0..8, 5..9), (300, 3..6, 2..18), (9, 0..8, 0..3000)]
        {
            let window = Rect { x: 4, y: 100, width, height: 50 };
            let work = Work::Rows { rows: rows.clone(), samples: samples.clone() };
            let mut walk = Walk::new(window, work);
            let (mut ids, mut runs, mut seen, mut sizes) =
                (Vec::new(), Vec::new(), HashSet::new(), Vec::new());
            while walk.next_batch(&mut ids, &mut runs) {
                let in_runs = runs.iter().flat_map(|run| (0..run.count).map(|_| run.place));
                assert!(in_runs.clone().count() == ids.len());
                for (place, id) in in_runs.zip(&ids) {
                    let (x, y) = (id.x - 4, id.y - 100);
                    assert_eq!(place, (y - rows.start) * width + x, "{id:?}");
                    assert!(seen.insert((x, y, id.index)), "{id:?} again");
                }
                sizes.push(ids.len() as u32);
            }
            let expected = width * rows.len() as u32 * samples.len() as u32;
            assert_eq!(seen.len() as u32, expected);
            assert!(seen.iter().all(|(x, y, i)| *x < width && rows.contains(y) && samples.contains(i)));
            let largest = sizes.iter().copied().max().unwrap_or(0);
            assert!(largest <= BATCH_SAMPLES && largest >= BATCH_SAMPLES.min(expected) / 2, "{sizes:?}");
        }
    }
}
