//! The learned denoiser's network on a GPU: what `post` computes on the CPU, by compute passes.
//!
//! `post` prepares the picture and restores its light afterwards ([`post::denoise_with`]); here is
//! what lies between: features, the network, and the filter that it steers. `steps.rs` says which
//! pass reads and writes what, `weights.rs` in which order weights lie. Convolutions are implicit
//! products of matrices: a workgroup computes all channels of 16×8 pixels, sixteen input channels
//! at a time of which are in shared memory. The products are those of the device's matrix units
//! where it has any (`matrices.rs`), else of its lanes (`shaders/denoise_lanes.wgsl`).
//!
//! A picture of 1920×1080 takes 109·10⁹ multiply-adds, of which 79·10⁹ are at half the resolution.
//! In 4 ms that is 55·10¹² operations a second: a twentieth of what the matrix units of an H100 do,
//! but four fifths of what its lanes do with 32 bits.

mod buffers;
mod matrices;
mod passes;
mod products;
mod resident;
mod steps;
mod weights;

pub use products::{Numbers, Products};
pub use resident::ResidentPicture;

use crate::pass::{Dispatch, PassGroups};
use crate::readback::read_mapped;
use crate::timing::Timer;
use crate::{Gpu, GpuError};
use buffers::TileBuffers;
use film::Image;
use passes::{PassId, Passes};
use post::{NetworkInput, NetworkWeights, Prepared, Tile};
use rayon::prelude::*;
use steps::Step;
use weights::DeviceWeights;

/// The network on a device.
pub struct GpuNetwork {
    products: Products,
    weights: DeviceWeights,
    passes: Passes,
}

impl GpuNetwork {
    /// The network that was trained for this renderer, as fast as the device can.
    ///
    /// # Errors
    /// When the device has no memory for the weights, or the driver refuses a shader.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let weights = NetworkWeights::trained().map_err(|error| GpuError::Device {
            doing: "reading the denoiser's weights",
            reason: error.to_string(),
        })?;
        let best = Products::best(gpu);
        match Self::with(gpu, &weights, best) {
            // Matrix units are young; what a driver refuses of them need not stop anybody.
            Err(GpuError::Shader { .. }) if matches!(best, Products::Matrices(_)) => {
                Self::with(gpu, &weights, Products::best_lanes(gpu))
            }
            made => made,
        }
    }

    /// A network with other weights, or in a way that is not the fastest. The device must be able
    /// to do it.
    ///
    /// # Errors
    /// As [`GpuNetwork::new`].
    pub fn with(gpu: &Gpu, weights: &NetworkWeights, products: Products) -> Result<Self, GpuError> {
        let weights = DeviceWeights::upload(gpu, weights, products)?;
        let linkage = |id: PassId| id.linkage(products);
        Ok(Self { products, weights, passes: Passes::new(gpu, products, linkage)? })
    }

    /// What multiplies.
    pub fn products(&self) -> Products {
        self.products
    }

    /// The picture without its noise, linear radiance, three channels; what
    /// [`post::Network::denoise`] says, up to rounding. Passes are timed by `timer`.
    ///
    /// Large pictures are filtered in tiles, one after the other, so that memory stays bounded; it
    /// is free again at the end.
    ///
    /// # Errors
    /// When the device has no memory, or fails.
    pub fn denoise(&self, gpu: &Gpu, input: &NetworkInput<'_>, timer: &mut Timer) -> Result<Image, GpuError> {
        let most_pixels = buffers::most_pixels(gpu, self.products.numbers());
        self.denoise_in_tiles(gpu, input, most_pixels, timer)
    }

    fn denoise_in_tiles(
        &self,
        gpu: &Gpu,
        input: &NetworkInput<'_>,
        most_pixels: usize,
        timer: &mut Timer,
    ) -> Result<Image, GpuError> {
        let prepared = input.prepared();
        let tiles = prepared.tiles(most_pixels);
        let [width, height] = prepared.size().map(|side| side as u32);
        let mut result = Image::black(width, height, 3);
        if tiles.is_empty() {
            return Ok(result);
        }
        let buffers = TileBuffers::new(gpu, &tiles, self.products.numbers())?;
        for tile in &tiles {
            self.denoise_tile(gpu, prepared, &buffers, tile, &mut result, timer)?;
        }
        Ok(result)
    }

    /// Filters a tile; what is kept of it goes to `result`.
    fn denoise_tile(
        &self,
        gpu: &Gpu,
        prepared: Prepared<'_>,
        buffers: &TileBuffers,
        tile: &Tile,
        result: &mut Image,
        timer: &mut Timer,
    ) -> Result<(), GpuError> {
        let [width, height] = prepared.size();
        // Tiles are larger than the picture where its sides are no multiples of 32.
        let kept_width = tile.core.width.min(width - tile.core.x);
        let kept_height = tile.core.height.min(height - tile.core.y);
        let steps = steps::steps(tile, [kept_width as u32, kept_height as u32]);
        buffers.write(gpu, &prepared.pixels(tile.region), &steps)?;
        let bytes = (kept_width * kept_height * 3 * size_of::<f32>()) as u64;
        self.submit(gpu, buffers, &steps, bytes, timer)?;
        let rows = result.data_mut()[3 * width * tile.core.y..].par_chunks_exact_mut(3 * width);
        read_mapped(gpu, &buffers.readable, bytes, "denoising", |filtered| {
            let filtered = filtered.par_chunks_exact(kept_width * 3 * size_of::<f32>());
            rows.zip(filtered).for_each(|(row, filtered)| {
                let row = &mut row[3 * tile.core.x..][..3 * kept_width];
                for (to, value) in row.iter_mut().zip(filtered.as_chunks().0) {
                    *to = prepared.radiance(f32::from_ne_bytes(*value));
                }
            });
        })
    }

    /// Submits the steps of a tile, and the way of `bytes` of its result.
    fn submit(
        &self,
        gpu: &Gpu,
        buffers: &TileBuffers,
        steps: &[Step],
        bytes: u64,
        timer: &mut Timer,
    ) -> Result<(), GpuError> {
        timer.reserve(gpu, steps.len())?;
        let bound = self.bind(gpu, buffers, steps)?;
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            for (pass, bound) in bound.iter().filter_map(|b| Some((self.passes.get(b.pass)?, b))) {
                pass.record(&mut encoder, timer, &bound.groups, Dispatch::Groups(bound.size));
            }
            buffers.copy_result(&mut encoder, bytes);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing: "denoising", reason })
    }

    /// Binds what steps read and write.
    fn bind(&self, gpu: &Gpu, buffers: &TileBuffers, steps: &[Step]) -> Result<Vec<BoundStep>, GpuError> {
        let bind = |(number, step): (usize, &Step)| {
            let missing = || GpuError::Device { doing: "denoising", reason: "a pass is not there".into() };
            let pass = self.passes.get(step.pass).ok_or_else(missing)?;
            let groups = pass.bind(gpu, &[], &buffers.resources(&self.weights, number, step))?;
            Ok(BoundStep { pass: step.pass, groups, size: step.groups })
        };
        steps.iter().enumerate().map(bind).collect()
    }
}

/// A step that is ready to be recorded.
struct BoundStep {
    pass: PassId,
    groups: PassGroups,
    /// Workgroups across and down.
    size: [u32; 2],
}

/// For tests: the module `denoise_shape`.
#[cfg(test)]
pub(crate) fn shape(outputs: u32) -> String {
    passes::shape(outputs, None)
}

#[cfg(test)]
mod tests;
