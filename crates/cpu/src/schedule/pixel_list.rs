//! Samples for some pixels only.
//!
//! Where samples are wanted has nothing to do with rows: a caustic in a corner may want most of them. So the list is cut
//! into pieces of equal work, each of which has estimates of its own; they are added to the film when they are done, in
//! any order, since the film's sums are exact.

use crate::photons::PhotonMap;
use crate::scene::CpuScene;
use crate::schedule::photon_passes::PhotonPasses;
use crate::schedule::row_blocks::{BLOCK_COLUMNS, BLOCK_ROWS, FirstHits, Work};
use crate::schedule::work::render_work;
use backend::{Control, PixelSamples, View};
use film::{Film, PixelStats};
use optics::photons::{SAMPLES_PER_PASS, photon_pass};
use rayon::prelude::*;

/// Samples of a piece of work.
const PIECE_SAMPLES: u32 = 4096;
/// Samples of a pixel, on average, whose first hits may wait in memory.
const WAITING_SAMPLES: usize = 16;

/// What became of a piece.
#[derive(Default)]
struct Done {
    rays: u64,
    estimates: Vec<PixelStats>,
    aovs: FirstHits,
}

/// Adds the samples to the film; returns the number of rays.
pub(crate) fn render(
    scene: &CpuScene,
    view: &View,
    pixels: &[PixelSamples],
    film: &mut Film,
    photons: Option<&mut PhotonPasses>,
    control: &Control,
) -> u64 {
    let Some(photons) = photons else { return render_together(scene, view, pixels, film, None, control) };
    let end = |p: &PixelSamples| p.first.saturating_add(p.count);
    let first = pixels.iter().map(|p| photon_pass(p.first)).min().unwrap_or(0);
    let last = pixels.iter().map(|p| photon_pass(end(p))).max().unwrap_or(0);
    let mut rays = 0;
    for pass in first..=last {
        // What of each pixel's samples is of this pass.
        let of_pass = pixels.iter().filter_map(|p| {
            let from = p.first.max(pass.saturating_mul(SAMPLES_PER_PASS));
            let to = end(p).min(pass.saturating_add(1).saturating_mul(SAMPLES_PER_PASS));
            (from < to).then_some(PixelSamples { first: from, count: to - from, ..*p })
        });
        let of_pass: Vec<_> = of_pass.collect();
        if of_pass.is_empty() || control.is_cancelled() {
            continue;
        }
        let (map, new_rays) = photons.pass(scene, view, pass);
        rays += new_rays + render_together(scene, view, &of_pass, film, Some(&map), control);
    }
    rays
}

/// The same of samples that gather the same photons, or none.
fn render_together(
    scene: &CpuScene,
    view: &View,
    pixels: &[PixelSamples],
    film: &mut Film,
    photons: Option<&PhotonMap>,
    control: &Control,
) -> u64 {
    let list = in_blocks(view.window.width, pixels);
    let pieces: Vec<&[PixelSamples]> = pieces(&list).collect();
    let at_once = (view.window.area() * WAITING_SAMPLES / PIECE_SAMPLES as usize).max(64);
    let mut rays = 0;
    for some in pieces.chunks(at_once) {
        let done: Vec<Done> = some
            .par_iter()
            .with_max_len(1)
            .map(|piece| render_piece(scene, view, photons, piece, control))
            .collect();
        for (piece, done) in some.iter().zip(done) {
            rays += done.rays;
            for (pixel, estimate) in piece.iter().zip(&done.estimates) {
                film.pixels_mut()[pixel.pixel as usize].merge(estimate);
            }
            for (x, y, index, sample) in &done.aovs {
                film.add_aovs(*x, *y, u64::from(*index), sample);
            }
        }
    }
    rays
}

fn render_piece(
    scene: &CpuScene,
    view: &View,
    photons: Option<&PhotonMap>,
    piece: &[PixelSamples],
    control: &Control,
) -> Done {
    if control.is_cancelled() {
        return Done::default();
    }
    let mut done = Done { estimates: vec![PixelStats::default(); piece.len()], ..Done::default() };
    done.rays =
        render_work(scene, view, photons, Work::PixelList(piece), &mut done.estimates, &mut done.aovs);
    control.advance(piece.iter().map(|p| u64::from(p.count)).sum());
    done
}

/// The list block by block of pixels, so that rays that are traced together are alike; nobody has more samples than fit
/// into a piece.
fn in_blocks(width: u32, pixels: &[PixelSamples]) -> Vec<PixelSamples> {
    let mut list = Vec::with_capacity(pixels.len());
    for pixel in pixels {
        let mut left = *pixel;
        while left.count > 0 {
            let count = left.count.min(PIECE_SAMPLES);
            list.push(PixelSamples { count, ..left });
            (left.first, left.count) = (left.first + count, left.count - count);
        }
    }
    list.sort_by_key(|p| {
        let (x, y) = (p.pixel % width, p.pixel / width);
        (y / BLOCK_ROWS, x / BLOCK_COLUMNS, y, x)
    });
    list
}

/// The list in pieces of nearly equal work.
fn pieces(list: &[PixelSamples]) -> impl Iterator<Item = &[PixelSamples]> {
    let mut rest = list;
    std::iter::from_fn(move || {
        let mut samples = 0;
        let fits = |p: &&PixelSamples| {
            samples += p.count;
            samples <= PIECE_SAMPLES
        };
        let length = rest.iter().take_while(fits).count();
        let (piece, after) = rest.split_at(length);
        rest = after;
        (!piece.is_empty()).then_some(piece)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_hold_every_sample_once() {
        let width = 20;
        let wanted = |i: u32| [0, 3, 700, 9001, 1][i as usize % 5];
        let pixels: Vec<_> =
            (0..width * 13).map(|i| PixelSamples { pixel: i, first: i % 7, count: wanted(i) }).collect();
        let list = in_blocks(width, &pixels);
        let mut next: Vec<u32> = pixels.iter().map(|p| p.first).collect();
        let mut pieces_seen = 0;
        for piece in pieces(&list) {
            pieces_seen += 1;
            assert!(piece.iter().map(|p| p.count).sum::<u32>() <= PIECE_SAMPLES);
            for p in piece {
                assert_eq!(p.first, next[p.pixel as usize], "pixel {}", p.pixel);
                next[p.pixel as usize] += p.count;
            }
        }
        assert!(pieces_seen > 100, "{pieces_seen}");
        assert!(pixels.iter().all(|p| next[p.pixel as usize] == p.first + p.count));
    }
}
