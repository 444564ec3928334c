//! Samples of every pixel, in passes over the picture that run into one another.
//!
//! A band of rows is worked on by one thread at a time, which owns its part of the film meanwhile. When it has a pass more,
//! it queues up behind the others for the next one: so the picture grows evenly, and yet nobody waits for the slowest
//! band of each pass. The last bands of all are cut into halves as long as there are threads without work.

use crate::backend::render_work;
use crate::bands::{BAND_ROWS, FirstHits, Work};
use crate::scene::CpuScene;
use backend::{Control, View};
use crossbeam_deque::{Injector, Steal};
use film::{Film, PixelStats};
use std::ops::Range;

/// Samples of a pixel in one pass. Few, so that the picture is even when the work is cancelled.
const PASS_SAMPLES: u32 = 16;
/// Bands that each thread should find, so that the last ones do not keep all others waiting.
const BANDS_OF_A_THREAD: u32 = 8;

/// Rows of the window and their estimates.
struct PendingBand<'a> {
    rows: Range<u32>,
    pixels: &'a mut [PixelStats],
    /// What it is to have yet.
    samples: Range<u32>,
}

impl PendingBand<'_> {
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
    control: &Control,
) -> u64 {
    // First hits wait in memory until all bands are done with them, so there is one pass at a time.
    let at_once = if view.aovs.is_empty() { samples.len() } else { PASS_SAMPLES as usize };
    let mut rays = 0;
    for first in samples.clone().step_by(at_once.max(1)) {
        if control.is_cancelled() {
            break;
        }
        let some = first..samples.end.min(first.saturating_add(at_once as u32));
        rays += render_together(scene, view, some, film, control);
    }
    rays
}

/// Adds `samples` to every pixel without a stop, and then the first hits.
fn render_together(
    scene: &CpuScene,
    view: &View,
    samples: Range<u32>,
    film: &mut Film,
    control: &Control,
) -> u64 {
    let done = {
        let bands = bands(view, samples, film.pixels_mut());
        rayon::broadcast(|_| render_bands(scene, view, &bands, control))
    };
    for (x, y, index, sample) in done.iter().flat_map(|(_, aovs)| aovs) {
        film.add_aovs(*x, *y, u64::from(*index), sample);
    }
    done.iter().map(|(rays, _)| rays).sum()
}

/// The whole picture, waiting for its first pass.
fn bands<'a>(view: &View, samples: Range<u32>, pixels: &'a mut [PixelStats]) -> Injector<PendingBand<'a>> {
    let bands = Injector::new();
    let window = view.window;
    let height = band_rows(window.height, rayon::current_num_threads() as u32);
    let pixels = pixels.chunks_mut(window.width as usize * height as usize);
    for (first, pixels) in (0..window.height).step_by(height as usize).zip(pixels) {
        let rows = first..(first + height).min(window.height);
        bands.push(PendingBand { rows, pixels, samples: samples.clone() });
    }
    bands
}

/// What one thread does: pass after pass, of the bands that have waited longest, as long as there are any. Returns the number of
/// rays, and the first hits.
fn render_bands(
    scene: &CpuScene,
    view: &View,
    bands: &Injector<PendingBand>,
    control: &Control,
) -> (u64, FirstHits) {
    let (mut rays, mut aovs) = (0, FirstHits::new());
    while let Some(mut band) = next(bands) {
        if control.is_cancelled() {
            break;
        }
        if bands.is_empty()
            && let Some(half) = band.split_off_half()
        {
            // The end is near: something to do for whoever is ready first.
            bands.push(half);
        }
        rays += render_pass(scene, view, &mut band, &mut aovs, control);
        if !band.samples.is_empty() {
            bands.push(band);
        }
    }
    (rays, aovs)
}

/// One more pass over a band; returns the number of rays.
fn render_pass(
    scene: &CpuScene,
    view: &View,
    band: &mut PendingBand,
    aovs: &mut FirstHits,
    control: &Control,
) -> u64 {
    let end = band.samples.end.min(band.samples.start.saturating_add(PASS_SAMPLES));
    let samples = band.samples.start..end;
    band.samples.start = end;
    let work = Work::Rows { rows: band.rows.clone(), samples: samples.clone() };
    let rays = render_work(scene, view, work, band.pixels, aovs);
    control.advance(band.pixels.len() as u64 * samples.len() as u64);
    rays
}

/// The band that has waited longest, if any waits. Who finds none is not needed any more: whoever has one goes on with it.
fn next<T>(waiting: &Injector<T>) -> Option<T> {
    loop {
        match waiting.steal() {
            Steal::Success(band) => return Some(band),
            Steal::Empty => return None,
            Steal::Retry => {}
        }
    }
}

/// Rows of each band: [`BAND_ROWS`], or fewer where that would leave threads without enough of them.
fn band_rows(height: u32, threads: u32) -> u32 {
    (height / threads.saturating_mul(BANDS_OF_A_THREAD)).clamp(1, BAND_ROWS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_a_band_are_all_of_it() {
        let mut pixels = vec![PixelStats::default(); 7 * 5];
        let mut bands = vec![PendingBand { rows: 16..23, pixels: &mut pixels, samples: 3..9 }];
        let mut rows = Vec::new();
        while let Some(mut band) = bands.pop() {
            assert_eq!((band.pixels.len(), band.samples.clone()), (5 * band.rows.len(), 3..9));
            match band.split_off_half() {
                Some(half) => bands.extend([half, band]),
                None => rows.push(band.rows),
            }
        }
        assert_eq!(rows, (16..23).map(|row| row..row + 1).collect::<Vec<_>>());
    }

    #[test]
    fn bands_are_lower_where_there_are_many_threads() {
        assert_eq!(band_rows(512, 1), BAND_ROWS);
        assert_eq!(band_rows(512, 2), BAND_ROWS);
        assert_eq!(band_rows(512, 16), 4);
        assert_eq!(band_rows(512, 128), 1);
        assert_eq!((band_rows(1, 2), band_rows(100, u32::MAX)), (1, 1));
    }
}
