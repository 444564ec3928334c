//! A piece of work on a thread: the kernel for the scene, and memory that is kept from piece to piece.

use crate::fetch::filter::AlphaFilter;
use crate::photons::PhotonMap;
use crate::scene::CpuScene;
use crate::schedule::row_blocks::{FirstHits, RowBlock, Work};
use crate::shade::path_batch::PathBatch;
use accel::Opaque;
use backend::View;
use film::PixelStats;
use std::cell::RefCell;

thread_local! {
    /// Scratch memory of each worker, kept from block to block.
    static BATCH: RefCell<PathBatch> = RefCell::default();
}

/// Renders a piece of work on this thread; returns the number of rays. Picks the kernel for the scene: alpha tests cost
/// nothing where no surface has holes.
pub(crate) fn render_work(
    scene: &CpuScene,
    view: &View,
    photons: Option<&PhotonMap>,
    work: Work,
    pixels: &mut [PixelStats],
    aovs: &mut FirstHits,
) -> u64 {
    BATCH.with_borrow_mut(|batch| {
        if scene.tables.has_alpha {
            RowBlock { scene, view, filter: &AlphaFilter(scene), photons, work }.render(pixels, aovs, batch)
        } else {
            RowBlock { scene, view, filter: &Opaque, photons, work }.render(pixels, aovs, batch)
        }
    })
}
