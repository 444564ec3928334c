//! Whether one kernel follows whole paths, or waves follow them segment by segment.

use super::RealtimeKernel;
use super::frame::light_candidates;
use crate::film::FilmBuffers;
use crate::kernel::PathKernel;
use crate::{Gpu, GpuError};
use backend::RealtimeSettings;

impl RealtimeKernel {
    /// Whether frames of so many pixels should follow their paths in waves.
    pub(super) fn wants_waves(&self, settings: &RealtimeSettings, pixels: u32) -> bool {
        // Tiles of lights are the one kernel's.
        let has_tiles = light_candidates(settings) > 0;
        !has_tiles
            && match self.path_kernel {
                PathKernel::Auto => self.waves.are_faster(pixels),
                PathKernel::Megakernel => false,
                PathKernel::Wavefront => true,
            }
    }

    /// Decides how the paths of a frame are followed.
    ///
    /// # Errors
    /// When there is no memory for waves that were asked for.
    pub(super) fn prepare_samples(
        &mut self,
        gpu: &Gpu,
        settings: &RealtimeSettings,
        film: &FilmBuffers,
    ) -> Result<(), GpuError> {
        let [width, height] = film.contents.picture().window_size;
        let wanted = self.wants_waves(settings, width * height);
        self.taken = PathKernel::Megakernel;
        if let Some(buffers) = self.buffers.as_ref().filter(|_| wanted) {
            match self.waves.prepare(gpu, buffers, &self.gbuffer, film) {
                Ok(true) => self.taken = PathKernel::Wavefront,
                Ok(false) => {}
                // Who did not ask for queues need not hear that there is no memory for them.
                Err(GpuError::Allocation { .. }) if self.path_kernel == PathKernel::Auto => {
                    self.path_kernel = PathKernel::Megakernel;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}
