//! What depends on the picture's size: records for each pixel, by turns now and before, and the bind groups with them.

use super::passes::{Pass, Slot};
use crate::bindings::group;
use crate::film::FilmBuffers;
use crate::frame_pass::{BoundPass, FramePass};
use crate::hybrid::GBuffer;
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
    guides: wgpu::Buffer,
    pub shown: [wgpu::Buffer; 2],
    pub signals: [wgpu::Buffer; 2],
    pub lights_found: wgpu::Buffer,
    noise: wgpu::Buffer,
    blurred: wgpu::Buffer,
    spread: wgpu::Buffer,
    colors: wgpu::Buffer,
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

/// The groups of all passes, by [`Pass::index`], for even and for odd frames; and of [`Pass::Recombine`] by how often the
/// filter has gone from one buffer to the other.
pub(super) struct Bindings {
    pub passes: [Vec<BoundPass>; 2],
    pub recombine: [[BoundPass; 2]; 2],
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
        passes: &[FramePass],
    ) -> Result<Self, GpuError> {
        let doing = "binding a frame";
        let pixels = gbuffer
            .pixels()
            .ok_or_else(|| GpuError::Device { doing, reason: "there is nothing to draw to".into() })?;
        let resource = |slot: Slot, odd: usize, turned: usize| match slot {
            Slot::Frame => gbuffer.frame(),
            Slot::Pixels => pixels,
            Slot::PreviousInstances => gbuffer.previous_instances(),
            Slot::Realtime => &buffers.realtime,
            Slot::Guides => &buffers.guides,
            Slot::HistoriesBefore => &buffers.histories[1 - odd],
            Slot::Histories => &buffers.histories[odd],
            Slot::LightsFound => &buffers.lights_found,
            Slot::SignalsIn => &buffers.signals[turned],
            Slot::SignalsOut => &buffers.signals[1 - turned],
            Slot::Noise => &buffers.noise,
            Slot::Blurred => &buffers.blurred,
            Slot::Spread => &buffers.spread,
            Slot::Work => &buffers.work,
            Slot::Colors => &buffers.colors,
            Slot::ShownBefore => &buffers.shown[1 - odd],
            Slot::ShownNow => &buffers.shown[odd],
            Slot::Sums => &buffers.sums,
        };
        let of_film = [&film.view, &film.pixels, &film.counters, &film.aovs];
        let bind = |pass: Pass, odd: usize, turned: usize| {
            let made = &passes[pass.index()];
            let film = made.film_layout.as_ref().map(|layout| {
                let bindings = std::iter::once(&0).chain(pass.film_bindings().unwrap_or_default());
                group(gpu, "film", layout, bindings.map(|&b| (b, of_film[b as usize])))
            });
            let own = pass.bindings().iter().map(|&(slot, _)| (slot as u32, resource(slot, odd, turned)));
            BoundPass { film, frame: group(gpu, "frame", &made.layout, own) }
        };
        // The accumulation writes signals 0, which the filter's first pass reads.
        let turned = |pass: Pass| match pass {
            Pass::Filter(level) => level as usize % 2,
            Pass::Accumulate => 1,
            _ => 0,
        };
        let all = |odd| Pass::all().map(|pass| bind(pass, odd, turned(pass))).collect();
        let recombine = |odd| [0, 1].map(|turned| bind(Pass::Recombine, odd, turned));
        gpu.guarded(|| Self {
            passes: [all(0), all(1)],
            recombine: [recombine(0), recombine(1)],
            film: film.pixels.clone(),
        })
        .map_err(|reason| GpuError::Device { doing, reason })
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
    use crate::realtime::passes::noise_text;
    use crate::shader::parse;

    #[test]
    fn sizes_of_dispatches_are_where_the_shader_writes_them() {
        let module = parse(&noise_text());
        let (fields, size) = layout_of(&module, "Work");
        assert_eq!(size as u64, WORK);
        let dispatches = fields.iter().find(|(name, _)| name == "dispatches").expect("a field").1;
        assert_eq!(dispatches as u64, DISPATCHES);
    }
}
