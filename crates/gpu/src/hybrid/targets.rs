//! What depends on the picture's size: masks of lights, lists of pixels, and the bind groups with them.

use crate::bindings::whole;
use crate::film::FilmBuffers;
use crate::gbuffer::{GBuffer, slots};
use crate::pass::{Pass, PassGroups};
use crate::scene::upload::empty_buffer;
use crate::{Gpu, GpuError};
use wgpu::BufferUsages;

/// Bytes of `Reflecting` in `shaders/hybrid_reflecting.wgsl` before its list: workgroups in three directions, and the count.
pub(super) const REFLECTING_HEAD: u64 = 16;

/// Words in [`slots::LIGHT_MASKS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LightWords {
    /// Of all clusters, with a bit for each light.
    pub masks: u64,
    /// Of a pixel, with a bit for each light's sample; 0 if lights are traced and shaded in one pass.
    pub hidden: u32,
    /// Of all shafts, 0 if there are none.
    pub shafts: u64,
}

impl LightWords {
    /// Bytes of the buffer, for a picture.
    pub fn bytes(&self, [width, height]: [u32; 2]) -> u64 {
        let hidden = u64::from(width) * u64::from(height) * u64::from(self.hidden);
        // Shafts are read by four words.
        (self.masks + hidden + self.shafts).next_multiple_of(4).max(4) * size_of::<u32>() as u64
    }
}

/// For one film.
pub(super) struct Targets {
    /// The window, in pixels.
    pub size: [u32; 2],
    /// What its lights have there: see [`LightWords`].
    #[cfg(test)]
    pub light_masks: wgpu::Buffer,
    /// The pixels that send out reflection rays, after the size of the dispatch for them.
    pub reflecting: wgpu::Buffer,
    /// What its lights need.
    pub lights: LightWords,
    /// By pass.
    pub passes: Vec<PassGroups>,
    film: wgpu::Buffer,
}

impl Targets {
    /// Makes them for a film.
    ///
    /// # Errors
    /// When the picture is too large for the device, or there is no memory.
    pub fn new(
        gpu: &Gpu,
        film: &FilmBuffers,
        gbuffer: &GBuffer,
        lights: LightWords,
        passes: &[Pass],
    ) -> Result<Self, GpuError> {
        let size = film.contents.picture().window_size;
        let doing = "binding a frame";
        let pixels = gbuffer
            .pixels()
            .ok_or_else(|| GpuError::Device { doing, reason: "there is nothing to draw to".into() })?;
        let reflecting_bytes = 4 * u64::from(size[0]) * u64::from(size[1]) + REFLECTING_HEAD;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let reflecting = empty_buffer(gpu, "pixels that reflect", reflecting_bytes, usage)?;
        let masks = empty_buffer(
            gpu,
            "masks of lights",
            lights.bytes(size),
            BufferUsages::STORAGE | BufferUsages::COPY_SRC,
        )?;
        let count_bytes = 4 * u64::from(size[0]) * u64::from(size[1]);
        let ray_counts = empty_buffer(gpu, "rays of pixels", count_bytes, BufferUsages::STORAGE)?;
        let own = [
            whole(slots::FRAME, gbuffer.frame()),
            whole(slots::LIGHT_MASKS, &masks),
            whole(slots::PIXELS, pixels),
            whole(slots::RAY_COUNTS, &ray_counts),
            whole(slots::REFLECTING, &reflecting),
        ];
        let of_film = film.resources();
        let passes = passes.iter().map(|pass| pass.bind(gpu, &of_film, &own)).collect::<Result<_, _>>()?;
        let film = film.pixels.clone();
        Ok(Self {
            size,
            #[cfg(test)]
            light_masks: masks,
            reflecting,
            lights,
            passes,
            film,
        })
    }

    /// Whether they are for this film, and for so many lights.
    pub fn is_for(&self, film: &FilmBuffers, lights: LightWords) -> bool {
        self.film == film.pixels && self.lights == lights
    }
}
