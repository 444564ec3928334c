//! What depends on the picture's size: records for each pixel, by turns now and before, and the bind groups with them.

use super::passes::{RealtimePass, slots};
use crate::bindings::whole;
use crate::film::FilmBuffers;
use crate::gbuffer::{GBuffer, slots as gbuffer_slots};
use crate::pass::{self, PassGroups};
use crate::scene::upload::empty_buffer;
use crate::{Gpu, GpuError};
use wgpu::BufferUsages;

/// Bytes of a pixel's records, which are planes of four words each; see `shaders/realtime_frame.wgsl`.
const GUIDE: u64 = 4 * VEC4;
const FOUND_LIGHT: u64 = 4 * VEC4;
const HISTORY: u64 = 4 * VEC4;
const SIGNAL: u64 = VEC4;
const VEC4: u64 = 16;
const NUMBER: u64 = 4;

/// Bytes of `Work`: counts, then the sizes of the dispatches.
const WORK: u64 = DISPATCHES + 64 * VEC4;
/// Where in `Work` the sizes of the dispatches begin.
pub(super) const DISPATCHES: u64 = 4 * (4 + 65 + 65 + 2);

/// The pixels' records. Those that the next frame still needs are there twice.
pub(super) struct Buffers {
    pub size: [u32; 2],
    pub realtime: wgpu::Buffer,
    pub work: wgpu::Buffer,
    pub histories: [wgpu::Buffer; 2],
    pub guides: wgpu::Buffer,
    pub shown: [wgpu::Buffer; 2],
    pub signals: [wgpu::Buffer; 2],
    pub lights_found: wgpu::Buffer,
    noise: wgpu::Buffer,
    blurred: wgpu::Buffer,
    spread: wgpu::Buffer,
    pub colors: wgpu::Buffer,
    sums: wgpu::Buffer,
}

impl Buffers {
    /// Makes them for a window.
    ///
    /// # Errors
    /// When the window has too many pixels for the device, or there is no memory.
    pub fn new(gpu: &Gpu, size: [u32; 2], uniform: u64) -> Result<Self, GpuError> {
        let area = u64::from(size[0]) * u64::from(size[1]);
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let of = |object, bytes| empty_buffer(gpu, object, area * bytes, usage);
        let two = |object, bytes| -> Result<_, GpuError> { Ok([of(object, bytes)?, of(object, bytes)?]) };
        Ok(Self {
            size,
            realtime: empty_buffer(gpu, "the frame", uniform, BufferUsages::UNIFORM)?,
            work: empty_buffer(gpu, "sizes of dispatches", WORK, usage | BufferUsages::INDIRECT)?,
            histories: two("what is kept of frames", HISTORY)?,
            guides: of("what pixels see", GUIDE)?,
            shown: two("pictures", VEC4)?,
            signals: two("what is filtered", SIGNAL)?,
            lights_found: of("a frame's samples", FOUND_LIGHT)?,
            noise: of("the map of the noise", NUMBER)?,
            blurred: of("the map of the noise, spread along rows", NUMBER)?,
            spread: of("the map of the noise, spread", NUMBER)?,
            colors: of("colours", VEC4)?,
            sums: of("what goes to the film", VEC4)?,
        })
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        let twice = [&self.histories, &self.shown, &self.signals];
        let once = [
            &self.realtime,
            &self.work,
            &self.guides,
            &self.lights_found,
            &self.noise,
            &self.blurred,
            &self.spread,
            &self.colors,
            &self.sums,
        ];
        twice.into_iter().flatten().chain(once).map(|b| b.size()).sum()
    }
}

/// The groups of all passes, by [`RealtimePass::index`], for even and for odd frames; and of [`RealtimePass::Recombine`] by how often the
/// filter has gone from one buffer to the other.
pub(super) struct Bindings {
    pub passes: [Vec<PassGroups>; 2],
    pub recombine: [[PassGroups; 2]; 2],
    film: wgpu::Buffer,
}

impl Bindings {
    /// Binds buffers, the G-buffer's and the film's.
    ///
    /// # Errors
    /// When the device fails.
    pub fn new(
        gpu: &Gpu,
        buffers: &Buffers,
        gbuffer: &GBuffer,
        film: &FilmBuffers,
        passes: &[pass::Pass],
    ) -> Result<Self, GpuError> {
        let doing = "binding a frame";
        let pixels = gbuffer
            .pixels()
            .ok_or_else(|| GpuError::Device { doing, reason: "there is nothing to draw to".into() })?;
        let of_film = film.resources();
        let bind = |pass: RealtimePass, odd: usize, turned: usize| {
            let own = [
                whole(gbuffer_slots::FRAME, gbuffer.frame()),
                whole(gbuffer_slots::PIXELS, pixels),
                whole(gbuffer_slots::PREVIOUS_INSTANCES, gbuffer.previous_instances()),
                whole(slots::REALTIME, &buffers.realtime),
                whole(slots::GUIDES, &buffers.guides),
                whole(slots::HISTORIES_BEFORE, &buffers.histories[1 - odd]),
                whole(slots::HISTORIES, &buffers.histories[odd]),
                whole(slots::LIGHTS_FOUND, &buffers.lights_found),
                whole(slots::SIGNALS_IN, &buffers.signals[turned]),
                whole(slots::SIGNALS_OUT, &buffers.signals[1 - turned]),
                whole(slots::NOISE, &buffers.noise),
                whole(slots::BLURRED, &buffers.blurred),
                whole(slots::SPREAD, &buffers.spread),
                whole(slots::WORK, &buffers.work),
                whole(slots::COLORS, &buffers.colors),
                whole(slots::SHOWN_BEFORE, &buffers.shown[1 - odd]),
                whole(slots::SHOWN_NOW, &buffers.shown[odd]),
                whole(slots::SUMS, &buffers.sums),
            ];
            passes[pass.index()].bind(gpu, &of_film, &own)
        };
        // The accumulation writes signals 0, which the filter's first pass reads.
        let turned = |pass: RealtimePass| match pass {
            RealtimePass::Filter(level) => level as usize % 2,
            RealtimePass::Accumulate => 1,
            _ => 0,
        };
        let all = |odd| {
            RealtimePass::all().map(|pass| bind(pass, odd, turned(pass))).collect::<Result<_, GpuError>>()
        };
        let recombine = |odd| {
            Ok::<_, GpuError>([
                bind(RealtimePass::Recombine, odd, 0)?,
                bind(RealtimePass::Recombine, odd, 1)?,
            ])
        };
        Ok(Self {
            passes: [all(0)?, all(1)?],
            recombine: [recombine(0)?, recombine(1)?],
            film: film.pixels.clone(),
        })
    }

    /// Whether they are for this film.
    pub fn is_for(&self, film: &FilmBuffers) -> bool {
        self.film == film.pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::layout_of;
    use crate::shader::check;

    #[test]
    fn sizes_of_dispatches_are_where_the_shader_writes_them() {
        let module = check::module("realtime_noise");
        let (fields, size) = layout_of(&module, "Work");
        assert_eq!(size as u64, WORK);
        let dispatches = fields.iter().find(|(name, _)| name == "dispatches").expect("a field").1;
        assert_eq!(dispatches as u64, DISPATCHES);
    }
}
