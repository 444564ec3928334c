//! The film on the device, and the way from there to the host's film.
//!
//! Shaders sum samples in single precision. That is exact enough for some thousands of samples, not for millions, so the
//! sums are moved to the host's film, which is exact, whenever somebody looks or [`FOLD_SAMPLES`] have gathered, and the
//! device starts from zero.

pub use crate::batch::{Batch, BatchPixels};

use crate::bindings::{PassBinding, Resource, whole};
use crate::portions::{Gathering, PORTION_BYTES, Share, pixels_in_tiles};
use crate::readback::read_mapped;
use crate::scene::upload::{empty_buffer, write_buffer, write_buffer_at};
use crate::view::{View, ViewMotion};
use crate::{Gpu, GpuError};
use backend::{BackendError, Integrator, SamplerKind};
use bytemuck::{Pod, Zeroable};
use film::{AovSample, AovSums, Film, PixelStats};
use rayon::prelude::*;
use wgpu::BufferUsages;

/// Samples of a pixel that may gather on the device. Portions count as one: rounding errors grow with the number of additions.
pub const FOLD_SAMPLES: u32 = 1024;

/// A pixel's sums.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct FilmPixel {
    sum: [f32; 3],
    count: u32,
    sum_of_squares: [f32; 3],
    invalid: u32,
}

impl FilmPixel {
    /// What the host's film has of a pixel, in single precision.
    pub(crate) fn of(stats: &PixelStats) -> Self {
        let single = |sums: [film::ExactSum; 3]| sums.map(|s| s.to_f64() as f32);
        let number = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        Self {
            sum: single(stats.sum()),
            count: number(stats.count()),
            sum_of_squares: single(stats.sum_of_squares()),
            invalid: number(stats.invalid()),
        }
    }
}

/// What a pixel's camera rays saw first.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct AovPixel {
    normal: [f32; 3],
    count: u32,
    geometric_normal: [f32; 3],
    depth: f32,
    albedo: [f32; 3],
    material: u32,
    position: [f32; 3],
    object: u32,
    uv: [f32; 2],
    primitive: u32,
    has_first: u32,
    denoising_albedo: [f32; 3],
    padding0: u32,
    denoising_normal: [f32; 3],
    padding1: u32,
}

/// What is counted for the whole picture.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Counters {
    rays_low: u32,
    rays_high: u32,
    invalid_aovs: u32,
    padding: u32,
}

/// Bytes of the counters; the pixels' shares come behind them.
const COUNTER_BYTES: u64 = size_of::<Counters>() as u64;

/// Most portions that are summed at a time: enough to keep a large device busy, 32 MiB.
const MOST_PORTIONS: u64 = 1 << 20;
/// Room for portions that small windows have.
const LEAST_PORTIONS: u64 = 1 << 12;

impl Counters {
    /// Rays traced.
    pub fn rays(&self) -> u64 {
        u64::from(self.rays_high) << 32 | u64::from(self.rays_low)
    }

    /// Auxiliary values dropped because they were not finite.
    pub fn invalid_aovs(&self) -> u64 {
        u64::from(self.invalid_aovs)
    }
}

/// What passes bind of group 2.
pub(crate) const VIEW: PassBinding = PassBinding::Uniform(0);
pub(crate) const FILM: PassBinding = PassBinding::Write(1);
pub(crate) const TALLY: PassBinding = PassBinding::Write(2);
pub(crate) const AOVS: PassBinding = PassBinding::Write(3);

/// Bind group 2: view and film.
pub struct FilmBuffers {
    /// Binding 0: [`View`], uniform.
    pub view: wgpu::Buffer,
    /// Binding 1: a [`FilmPixel`] for each pixel of the window, row by row, and room for portions behind them.
    pub pixels: wgpu::Buffer,
    /// Binding 2: [`Counters`], and for each pixel of the window its share of portions.
    pub counters: wgpu::Buffer,
    /// Binding 3: an [`AovPixel`] for each pixel, or one for all if no layers are wanted.
    pub aovs: wgpu::Buffer,
    /// What is rendered.
    pub contents: View,
    /// When camera rays leave; `None` is an instant.
    motion: Option<ViewMotion>,
    /// How, for who renders in more than one way.
    pub integrator: Integrator,
    /// By which camera.
    pub camera: optics::camera::CameraFrame,
    /// With which random numbers; those of the shaders ([`Variant::sampler`](crate::shader::Variant)).
    pub sampler: SamplerKind,
    wants_aovs: bool,
    wants_features: bool,
    staging: wgpu::Buffer,
    /// Made when it is first needed.
    gathering: Option<Gathering>,
}

impl FilmBuffers {
    /// An empty film for a view.
    ///
    /// # Errors
    /// When the window has too many pixels for the device.
    pub fn new(gpu: &Gpu, view: &backend::View, wants_aovs: bool) -> Result<Self, GpuError> {
        let pixels = view.window.area() as u64;
        let readable = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let film_bytes = pixels * size_of::<FilmPixel>() as u64;
        let most_bytes = gpu.limits.max_storage_buffer_binding_size.min(gpu.limits.max_buffer_size);
        let room = pixels.clamp(LEAST_PORTIONS, MOST_PORTIONS) * PORTION_BYTES;
        let room = room.min(most_bytes.saturating_sub(film_bytes) / PORTION_BYTES * PORTION_BYTES);
        let aov_bytes = if wants_aovs { pixels } else { 1 } * size_of::<AovPixel>() as u64;
        let shares = pixels_in_tiles([view.window.width, view.window.height]);
        let tally_bytes = COUNTER_BYTES + shares * size_of::<Share>() as u64;
        let view_buffer = empty_buffer(
            gpu,
            "the view",
            (size_of::<View>() + size_of::<ViewMotion>()) as u64,
            BufferUsages::UNIFORM,
        )?;
        let film = empty_buffer(gpu, "the film", film_bytes + room, readable)?;
        let counters = empty_buffer(gpu, "counters", tally_bytes, readable)?;
        let aovs = empty_buffer(gpu, "the auxiliary layers", aov_bytes, readable)?;
        let staging_bytes = film_bytes + if wants_aovs { aov_bytes } else { 0 } + COUNTER_BYTES;
        let staging = empty_buffer(
            gpu,
            "reading the film",
            staging_bytes,
            BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        )?;
        Ok(Self {
            view: view_buffer,
            pixels: film,
            counters,
            aovs,
            contents: View::new(view),
            motion: ViewMotion::new(view),
            integrator: view.integrator,
            camera: view.camera,
            sampler: view.sampler,
            wants_aovs,
            wants_features: view.aovs.iter().any(|aov| aov.guides_denoisers()),
            staging,
            gathering: None,
        })
    }

    /// All of group 2, for passes to bind what they need of it.
    pub(crate) fn resources(&self) -> [Resource<'_>; 4] {
        let buffers = [&self.view, &self.pixels, &self.counters, &self.aovs];
        [0, 1, 2, 3].map(|number| whole(number, buffers[number as usize]))
    }

    /// Takes another view of the same size without making anything anew. Returns whether that was possible.
    pub fn set_view(&mut self, view: &backend::View) -> bool {
        let contents = View::new(view);
        if contents.picture().window_size != self.contents.picture().window_size {
            return false;
        }
        (self.contents, self.integrator, self.camera) = (contents, view.integrator, view.camera);
        self.motion = ViewMotion::new(view);
        true
    }

    /// Forgets everything that was summed and counted. What was submitted before still adds to it.
    ///
    /// # Errors
    /// When the device fails at once.
    pub fn clear(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            for part in [&self.pixels, &self.counters, &self.aovs] {
                encoder.clear_buffer(part, 0, None);
            }
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing: "emptying the film", reason })
    }

    /// Bytes of the window's pixels, at the beginning of [`FilmBuffers::pixels`].
    pub fn pixel_bytes(&self) -> u64 {
        let [width, height] = self.contents.picture().window_size;
        u64::from(width) * u64::from(height) * size_of::<FilmPixel>() as u64
    }

    /// Portions that there is room for at a time; 0 where the device has none for a window of this size.
    pub fn most_portions(&self) -> u32 {
        ((self.pixels.size() - self.pixel_bytes()) / PORTION_BYTES) as u32
    }

    /// Whether first hits are recorded.
    pub fn wants_aovs(&self) -> bool {
        self.wants_aovs
    }

    /// Whether what guides denoisers is recorded.
    pub fn wants_features(&self) -> bool {
        self.wants_features
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        let buffers = [&self.view, &self.pixels, &self.counters, &self.aovs, &self.staging];
        buffers.iter().map(|b| b.size()).sum()
    }

    /// Tells shaders which batch is next. Dispatches submitted before still see the one before.
    ///
    /// # Errors
    /// When there is no memory for the copy.
    pub fn set_batch(&mut self, gpu: &Gpu, batch: Batch) -> Result<(), GpuError> {
        self.contents.set_batch(batch);
        if let Some(motion) = &self.motion {
            let bytes = bytemuck::bytes_of(motion);
            write_buffer_at(gpu, "the view", &self.view, size_of::<View>() as u64, bytes)?;
        }
        write_buffer(gpu, "the view", &self.view, bytemuck::bytes_of(&self.contents))
    }

    /// Says how many portions each pixel gets. Dispatches submitted before still see what was said before.
    ///
    /// # Errors
    /// When there is no memory for the copy.
    pub fn set_shares(&self, gpu: &Gpu, shares: &[Share]) -> Result<(), GpuError> {
        let bytes = bytemuck::cast_slice(shares);
        write_buffer_at(gpu, "shares of pixels", &self.counters, COUNTER_BYTES, bytes)
    }

    /// Adds portions that were submitted to their pixels.
    ///
    /// - `first`, `count`: as in [`BatchPixels::Portions`]. `all`: portions of all pixels.
    ///
    /// # Errors
    /// When the device fails.
    pub fn gather(&mut self, gpu: &Gpu, first: u32, count: u32, all: u32) -> Result<(), GpuError> {
        let gathering = match self.gathering.take() {
            Some(gathering) => gathering,
            None => Gathering::new(gpu, self)?,
        };
        let done = gathering.submit(gpu, first, count, all);
        self.gathering = Some(gathering);
        done
    }

    /// Moves everything summed on the device to `film`; returns what was counted. The device starts from zero.
    ///
    /// # Errors
    /// When the device fails; `film` is unchanged then.
    pub fn fold_into(&mut self, gpu: &Gpu, film: &mut Film) -> Result<Counters, GpuError> {
        let doing = "reading the film";
        let pixel_bytes = self.pixel_bytes();
        let mut parts = vec![(&self.counters, COUNTER_BYTES), (&self.pixels, pixel_bytes)];
        if self.wants_aovs {
            parts.push((&self.aovs, self.aovs.size()));
        }
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut at = 0;
            for &(part, size) in &parts {
                encoder.copy_buffer_to_buffer(part, 0, &self.staging, at, size);
                encoder.clear_buffer(part, 0, Some(size));
                at += size;
            }
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing, reason })?;
        let counters = read_mapped(gpu, &self.staging, self.staging.size(), doing, |bytes| {
            let (counters, rest) = bytes.split_at(size_of::<Counters>());
            let (pixels, layers) = rest.split_at(pixel_bytes as usize);
            add_pixels(film, bytemuck::cast_slice(pixels));
            if self.wants_aovs {
                add_layers(film, bytemuck::cast_slice(layers));
            }
            bytemuck::pod_read_unaligned::<Counters>(counters)
        })?;
        film.add_invalid_aovs(counters.invalid_aovs());
        Ok(counters)
    }

    /// What has been counted since the last call of this or of [`FilmBuffers::fold_into`].
    ///
    /// # Errors
    /// When the device fails.
    pub fn take_counters(&mut self, gpu: &Gpu) -> Result<Counters, GpuError> {
        let doing = "reading counters";
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&self.counters, 0, &self.staging, 0, COUNTER_BYTES);
            encoder.clear_buffer(&self.counters, 0, Some(COUNTER_BYTES));
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing, reason })?;
        read_mapped(gpu, &self.staging, COUNTER_BYTES, doing, bytemuck::pod_read_unaligned::<Counters>)
    }
}

fn add_pixels(film: &mut Film, pixels: &[FilmPixel]) {
    /// Pixels that a thread adds at a time. All together they take longer than the way here.
    const PIECE: usize = 1 << 12;
    let pieces = film.pixels_mut().par_chunks_mut(PIECE).zip(pixels.par_chunks(PIECE));
    pieces.for_each(|(stats, pixels)| {
        for (stats, p) in stats.iter_mut().zip(pixels) {
            if p.count > 0 {
                let [sum, squares] = [p.sum, p.sum_of_squares].map(|s| s.map(f64::from));
                stats.add_sums(sum, squares, u64::from(p.count));
            }
            stats.add_invalid(u64::from(p.invalid));
        }
    });
}

fn add_layers(film: &mut Film, layers: &[AovPixel]) {
    let window = film.window();
    for (i, a) in (0..).zip(layers) {
        let (x, y) = (window.x + i % window.width, window.y + i / window.width);
        let first = AovSample {
            depth: a.depth,
            position: a.position,
            uv: a.uv,
            material_id: a.material,
            instance_id: a.object,
            primitive_id: a.primitive,
            ..AovSample::default()
        };
        let sums = AovSums {
            count: a.count,
            normal: a.normal.map(f64::from),
            geometric_normal: a.geometric_normal.map(f64::from),
            albedo: a.albedo.map(f64::from),
            denoising_albedo: a.denoising_albedo.map(f64::from),
            denoising_normal: a.denoising_normal.map(f64::from),
            first: (a.has_first != 0).then_some(first),
        };
        film.add_aov_sums(x, y, &sums);
    }
}

/// The back end's error for one of the device's.
pub(crate) fn device_error(backend: &'static str, error: GpuError) -> BackendError {
    BackendError::Device { backend, source: Box::new(error) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::assert_layout;

    #[test]
    fn layouts_match_the_shader() {
        let module = crate::shader::check::module("film");
        assert_layout!(module, FilmPixel { sum, count, sum_of_squares, invalid });
        assert_layout!(
            module,
            AovPixel {
                normal,
                count,
                geometric_normal,
                depth,
                albedo,
                material,
                position,
                object,
                uv,
                primitive,
                has_first,
                denoising_albedo,
                padding0,
                denoising_normal,
                padding1,
            }
        );
        assert_layout!(module, Counters { rays_low, rays_high, invalid_aovs, padding });
        let (tally, _) = crate::layout::layout_of(&module, "Tally");
        assert_eq!(tally, [("counters".to_owned(), 0), ("shares".to_owned(), COUNTER_BYTES as usize)]);
        assert_eq!(size_of::<Share>(), 8, "a vec2u");
    }
}
