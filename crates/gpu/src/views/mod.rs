//! Batches of views: many pictures of the loaded scene in few dispatches, and only what is wanted on its way to the host.
//!
//! Exact layers have a kernel of their own, which sums nothing (`exact.rs`). Colours are those of the integrators'
//! kernels, which find the camera of a pixel by its row (`colors.rs`, `shaders/film.wgsl`). Whatever takes time before the
//! first view is kept for the next call: shaders with the scene, buffers with the back end.

pub(crate) mod colors;
mod download;
pub(crate) mod exact;

pub(crate) use exact::EXACT_LAYERS;
pub use exact::{ExactBuffers, ExactKernel, ExactWants};

use crate::timing::Timer;
use crate::{Gpu, GpuError};
use backend::{Control, Stats, ViewBatch};
use colors::ColorViews;
use exact::ExactViews;
use std::time::Duration;

/// Bytes of the values of a chunk: enough to keep a large device busy while the chunk before is on its way.
const CHUNK_BYTES: u64 = 64 << 20;
/// The same on software drivers, where a chunk should not take long.
const CHUNK_BYTES_OF_SOFTWARE: u64 = 8 << 20;

/// Buffers for batches of views, kept from call to call.
pub(crate) struct Views {
    chunk_bytes: u64,
    pub exact: Option<ExactViews>,
    pub colors: Option<ColorViews>,
}

/// A call that is going on.
pub(crate) struct Run<'a> {
    pub gpu: &'a Gpu,
    pub batch: &'a ViewBatch,
    pub control: &'a Control,
    pub timer: &'a mut Timer,
    pub stats: &'a mut Stats,
}

impl Run<'_> {
    /// Counts what is done, and makes room for times of passes.
    fn count(&mut self, samples: u64, rays: u64) -> Result<(), GpuError> {
        self.control.advance(samples);
        self.stats.samples += samples;
        self.stats.rays += rays;
        if self.timer.is_nearly_full() { self.collect() } else { Ok(()) }
    }

    /// Takes in the times of all passes so far.
    pub fn collect(&mut self) -> Result<(), GpuError> {
        let time: Option<Duration> = self.timer.collect(self.gpu)?;
        if let Some(time) = time {
            *self.stats.device_time.get_or_insert_default() += time;
        }
        Ok(())
    }
}

impl Views {
    /// Without any buffers yet.
    pub fn new(gpu: &Gpu) -> Self {
        let chunk_bytes = if gpu.is_software() { CHUNK_BYTES_OF_SOFTWARE } else { CHUNK_BYTES };
        Self { chunk_bytes, exact: None, colors: None }
    }

    /// Cuts batches into chunks of about so many bytes from now on.
    pub fn set_chunk_bytes(&mut self, bytes: u64) {
        (self.chunk_bytes, self.exact, self.colors) = (bytes, None, None);
    }

    /// Bytes of a chunk, about.
    pub fn chunk_bytes(&self) -> u64 {
        self.chunk_bytes
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.exact.as_ref().map_or(0, ExactViews::memory_bytes)
            + self.colors.as_ref().map_or(0, ColorViews::memory_bytes)
    }
}
