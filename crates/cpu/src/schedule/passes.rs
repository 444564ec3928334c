//! Samples of every pixel, in passes over the picture that run into one another.
//!
//! A block of rows is worked on by one thread at a time, which owns its part of the film meanwhile. When it has a pass more,
//! it queues up behind the others for the next one: so the picture grows evenly, and yet nobody waits for the slowest
//! block of each pass. The last blocks of all are cut into halves as long as there are threads without work.

use crate::photons::PhotonMap;
use crate::scene::CpuScene;
use crate::schedule::photon_passes::PhotonPasses;
use crate::schedule::row_blocks::{BLOCK_ROWS, FirstHits, Work};
use crate::schedule::work::render_work;
use backend::{Control, View};
use crossbeam_deque::{Injector, Steal};
use film::{Film, PixelStats};
use optics::photons::{SAMPLES_PER_PASS, photon_pass};
use std::ops::Range;

/// Samples of a pixel in one pass. Few, so that the picture is even when the work is cancelled.
const PASS_SAMPLES: u32 = 16;
/// Blocks that each thread should find, so that the last ones do not keep all others waiting.
const BLOCKS_OF_A_THREAD: u32 = 8;

/// Rows of the window and their estimates.
struct PendingRowBlock<'a> {
    rows: Range<u32>,
    pixels: &'a mut [PixelStats],
    /// What it is to have yet.
    samples: Range<u32>,
}

impl PendingRowBlock<'_> {
    /// Takes the lower half away, unless there is but one row.
    fn split_off_half(&mut self) -> Option<Self> {
        let middle = self.rows.start + self.rows.len() as u32 / 2;
        if middle == self.rows.start {
            return None;
        }
        let (width, rows) = (self.pixels.len() / self.rows.len(), (middle - self.rows.start) as usize);
        let (upper, lower) = std::mem::take(&mut self.pixels).split_at_mut(width * rows);
        let half = Self { rows: middle..self.rows.end, pixels: lower, samples: self.samples.clone() };
        (self.rows.end, self.pixels) = (middle, upper);
        Some(half)
    }
}

/// Adds `samples` to every pixel; returns the number of rays. Runs on the threads of the current pool.
pub(crate) fn render(
    scene: &CpuScene,
    view: &View,
    samples: Range<u32>,
    film: &mut Film,
    mut photons: Option<&mut PhotonPasses>,
    control: &Control,
) -> u64 {
    // First hits wait in memory until all blocks are done with them, so there is one pass at a time.
    let at_once = if view.aovs.is_empty() { samples.len() } else { PASS_SAMPLES as usize };
    let (mut rays, mut first) = (0, samples.start);
    while first < samples.end && !control.is_cancelled() {
        let mut end = samples.end.min(first.saturating_add(at_once as u32));
        let mut map = None;
        if let Some(photons) = &mut photons {
            let (pass, next) = (photon_pass(first), photon_pass(first).saturating_add(1));
            end = end.min(next.saturating_mul(SAMPLES_PER_PASS));
            let (of_pass, new_rays) = photons.pass(scene, view, pass);
            (map, rays) = (Some(of_pass), rays + new_rays);
        }
        rays += render_together(scene, view, first..end, film, map.as_deref(), control);
        first = end;
    }
    rays
}

/// Adds `samples` to every pixel without a stop, and then the first hits.
fn render_together(
    scene: &CpuScene,
    view: &View,
    samples: Range<u32>,
    film: &mut Film,
    photons: Option<&PhotonMap>,
    control: &Control,
) -> u64 {
    let done = {
        let row_blocks = row_blocks(view, samples, film.pixels_mut());
        rayon::broadcast(|_| render_row_blocks(scene, view, photons, &row_blocks, control))
    };
    for (x, y, index, sample) in done.iter().flat_map(|(_, aovs)| aovs) {
        film.add_aovs(*x, *y, u64::from(*index), sample);
    }
    done.iter().map(|(rays, _)| rays).sum()
}

/// The whole picture, waiting for its first pass.
fn row_blocks<'a>(
    view: &View,
    samples: Range<u32>,
    pixels: &'a mut [PixelStats],
) -> Injector<PendingRowBlock<'a>> {
    let row_blocks = Injector::new();
    let window = view.window;
    let height = block_rows(window.height, rayon::current_num_threads() as u32);
    let pixels = pixels.chunks_mut(window.width as usize * height as usize);
    for (first, pixels) in (0..window.height).step_by(height as usize).zip(pixels) {
        let rows = first..(first + height).min(window.height);
        row_blocks.push(PendingRowBlock { rows, pixels, samples: samples.clone() });
    }
    row_blocks
}

/// What one thread does: pass after pass, of the blocks that have waited longest, as long as there are any. Returns the number of
/// rays, and the first hits.
fn render_row_blocks(
    scene: &CpuScene,
    view: &View,
    photons: Option<&PhotonMap>,
    row_blocks: &Injector<PendingRowBlock>,
    control: &Control,
) -> (u64, FirstHits) {
    let (mut rays, mut aovs) = (0, FirstHits::new());
    while let Some(mut row_block) = next(row_blocks) {
        if control.is_cancelled() {
            break;
        }
        if row_blocks.is_empty()
            && let Some(half) = row_block.split_off_half()
        {
            // The end is near: something to do for whoever is ready first.
            row_blocks.push(half);
        }
        rays += render_pass(scene, view, photons, &mut row_block, &mut aovs, control);
        if !row_block.samples.is_empty() {
            row_blocks.push(row_block);
        }
    }
    (rays, aovs)
}

/// One more pass over a block; returns the number of rays.
fn render_pass(
    scene: &CpuScene,
    view: &View,
    photons: Option<&PhotonMap>,
    row_block: &mut PendingRowBlock,
    aovs: &mut FirstHits,
    control: &Control,
) -> u64 {
    let end = row_block.samples.end.min(row_block.samples.start.saturating_add(PASS_SAMPLES));
    let samples = row_block.samples.start..end;
    row_block.samples.start = end;
    let work = Work::Rows { rows: row_block.rows.clone(), samples: samples.clone() };
    let rays = render_work(scene, view, photons, work, row_block.pixels, aovs);
    control.advance(row_block.pixels.len() as u64 * samples.len() as u64);
    rays
}

/// The block that has waited longest, if any waits. Who finds none is not needed any more: whoever has one goes on with it.
fn next<T>(waiting: &Injector<T>) -> Option<T> {
    loop {
        match waiting.steal() {
            Steal::Success(row_block) => return Some(row_block),
            Steal::Empty => return None,
            Steal::Retry => {}
        }
    }
}

/// Rows of each block: [`BLOCK_ROWS`], or fewer where that would leave threads without enough of them.
fn block_rows(height: u32, threads: u32) -> u32 {
    (height / threads.saturating_mul(BLOCKS_OF_A_THREAD)).clamp(1, BLOCK_ROWS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_a_band_are_all_of_it() {
        let mut pixels = vec![PixelStats::default(); 7 * 5];
        let mut row_blocks = vec![PendingRowBlock { rows: 16..23, pixels: &mut pixels, samples: 3..9 }];
        let mut rows = Vec::new();
        while let Some(mut row_block) = row_blocks.pop() {
            assert_eq!((row_block.pixels.len(), row_block.samples.clone()), (5 * row_block.rows.len(), 3..9));
            match row_block.split_off_half() {
                Some(half) => row_blocks.extend([half, row_block]),
                None => rows.push(row_block.rows),
            }
        }
        assert_eq!(rows, (16..23).map(|row| row..row + 1).collect::<Vec<_>>());
    }

    #[test]
    fn bands_are_lower_where_there_are_many_threads() {
        assert_eq!(block_rows(512, 1), BLOCK_ROWS);
        assert_eq!(block_rows(512, 2), BLOCK_ROWS);
        assert_eq!(block_rows(512, 16), 4);
        assert_eq!(block_rows(512, 128), 1);
        assert_eq!((block_rows(1, 2), block_rows(100, u32::MAX)), (1, 1));
    }
}
