//! Colours of many views: their films lie below each other in one film, whose cameras stand where portions' shares would.

use super::Run;
use super::download::{Downloads, UnderWay};
use crate::bindings::{PassBinding, whole};
use crate::film::{FilmBuffers, FilmPixel};
use crate::kernel::Kernel;
use crate::pass::{Dispatch, Pass, PassGroups, PassSpec, compile, groups_of_64};
use crate::plan::{DispatchPlan, Pace, most_samples};
use crate::portions::{Share, pixels_in_tiles};
use crate::scene::upload::empty_buffer;
use crate::shader::{Linkage, Variant};
use crate::{Gpu, GpuError};
use backend::{View, ViewBatch, ViewPictures};
use bytemuck::cast_slice;
use film::Rect;
use optics::camera::{CameraFrame, camera_pixel_spread};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::ops::Range;
use std::time::Instant;
use wgpu::BufferUsages;

/// Hands out the colours; see `shaders/views_colors.wgsl`.
const HAND_OUT: PassSpec = PassSpec {
    own: &[PassBinding::Write(0), PassBinding::Write(1)],
    ..PassSpec::new("views_colors", "hand_out_colors")
};

/// Bytes of a pixel on its way to the host.
const COLOR_BYTES: u64 = 16;
/// Dispatches under way at a time.
const IN_FLIGHT: usize = 2;
/// Pixels that a thread hands out at a time.
const PIECE: usize = 1 << 14;

/// A camera among the words of `tally.shares`, in the order of `stored_camera` in `shaders/film.wgsl`.
type StoredCamera = [u32; 32];

fn stored(camera: &CameraFrame, height: u32) -> StoredCamera {
    let (c, d) = (camera, &camera.distortion);
    let mut numbers = [0.0; 32];
    let vectors = [c.origin, c.right, c.up, c.forward];
    numbers[1..13].copy_from_slice(vectors.map(|v| v.to_array()).as_flattened());
    numbers[13..15].copy_from_slice(&c.half_size.to_array());
    (numbers[15], numbers[16]) = (c.lens_radius, c.focus_distance);
    (numbers[18], numbers[19]) = (d.skew, d.limit);
    numbers[20..24].copy_from_slice(&d.radial.to_array());
    numbers[24..28].copy_from_slice(&d.rest.to_array());
    numbers[28] = camera_pixel_spread(*camera, height as f32);
    let mut words = numbers.map(f32::to_bits);
    (words[0], words[17]) = (c.kind, d.model);
    words
}

/// A film for a chunk of views, kept from call to call.
pub(crate) struct ColorViews {
    /// Views that there is room for.
    room: usize,
    pub film: FilmBuffers,
    /// What the film was made for.
    view: View,
    pass: Pass,
    groups: PassGroups,
    colors: wgpu::Buffer,
    downloads: Downloads,
}

/// Views of a chunk, so that no buffer and no dispatch is too large, and films take about `most_bytes`.
fn chunk(gpu: &Gpu, batch: &ViewBatch, most_bytes: u64) -> Result<usize, GpuError> {
    let limits = &gpu.limits;
    let view_bytes = (batch.pixels() * size_of::<FilmPixel>()) as u64;
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if view_bytes > limit {
        return Err(GpuError::BufferTooLarge { object: "the film of a view", bytes: view_bytes, limit });
    }
    let rows = 8 * u64::from(limits.max_compute_workgroups_per_dimension);
    let most = (most_bytes.min(limit) / view_bytes).min(rows / u64::from(batch.view.height));
    let mut views = most.clamp(1, batch.cameras.len().max(1) as u64);
    // Of tiny views, cameras need more room than shares of portions.
    let room = |views: u64| {
        let shares = pixels_in_tiles([batch.view.width, views as u32 * batch.view.height]);
        shares * size_of::<Share>() as u64
    };
    while views > 1 && room(views) < views * size_of::<StoredCamera>() as u64 {
        views /= 2;
    }
    Ok(views as usize)
}

/// The view of a film that `views` of them share.
fn tall_view(batch: &ViewBatch, views: usize) -> View {
    let View { width, height, .. } = batch.view;
    let window = Rect { x: 0, y: 0, width, height: height * views as u32 };
    View { window, first_sample: 0, ..batch.single(0) }
}

impl ColorViews {
    /// The film for a batch: that of the call before, if it fits.
    ///
    /// # Errors
    /// When there is no memory, or a single view is too large for the device.
    pub fn prepare(
        gpu: &Gpu,
        kept: Option<Self>,
        batch: &ViewBatch,
        most_bytes: u64,
    ) -> Result<Self, GpuError> {
        let views = chunk(gpu, batch, most_bytes)?;
        let shape = |v: &View| (v.width, v.height, v.sampler);
        if let Some(mut kept) = kept.filter(|k| k.room >= views && shape(&k.view) == shape(&batch.view)) {
            let view = tall_view(batch, kept.room);
            kept.film.set_view(&view);
            return Ok(Self { view, ..kept });
        }
        let view = tall_view(batch, views);
        let film = FilmBuffers::new(gpu, &view, false)?;
        let color_bytes = (views * batch.pixels()) as u64 * COLOR_BYTES;
        let readable = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let colors = empty_buffer(gpu, "colours of views", color_bytes, readable)?;
        let mut pass = Pass::new(gpu, "views", HAND_OUT, &Linkage::of(Variant::default()), None, None)?;
        compile(gpu, [&mut pass])?;
        let groups = pass.bind(gpu, &[], &[whole(0, &film.pixels), whole(1, &colors)])?;
        let downloads = Downloads::new(gpu, color_bytes)?;
        Ok(Self { room: views, film, view, pass, groups, colors, downloads })
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.film.memory_bytes() + self.colors.size() + self.downloads.memory_bytes()
    }

    /// Makes the colours of a batch that it was prepared for.
    ///
    /// # Errors
    /// When the device fails.
    pub fn render(
        &mut self,
        run: &mut Run<'_>,
        kernel: &mut dyn Kernel,
        pace: &mut Pace,
        pictures: &mut ViewPictures,
    ) -> Result<(), GpuError> {
        let batch = run.batch;
        let mut under_way: Option<(Range<usize>, UnderWay)> = None;
        let mut first = 0;
        loop {
            let end =
                if run.control.is_cancelled() { first } else { batch.cameras.len().min(first + self.room) };
            let views = first..end;
            let begun = if views.is_empty() || !self.make(run, kernel, pace, views.clone())? {
                None
            } else {
                Some((views.clone(), self.begin_download(run, views.len())?))
            };
            if let Some((views, chunk)) = under_way.take() {
                self.downloads.finish(run.gpu, chunk, |bytes| hand_out(batch, views, bytes, pictures))?;
            }
            if begun.is_none() {
                break;
            }
            (under_way, first) = (begun, end);
        }
        let counted = self.film.take_counters(run.gpu)?;
        run.stats.rays += counted.rays();
        Ok(())
    }

    /// Submits all samples of some views. Returns whether all of them were.
    fn make(
        &mut self,
        run: &mut Run<'_>,
        kernel: &mut dyn Kernel,
        pace: &mut Pace,
        views: Range<usize>,
    ) -> Result<bool, GpuError> {
        let (gpu, batch) = (run.gpu, run.batch);
        let View { width, height, first_sample, .. } = batch.view;
        let cameras: Vec<StoredCamera> =
            batch.cameras[views.clone()].iter().map(|c| stored(c, height)).collect();
        self.film.set_shares(gpu, cast_slice(cast_slice::<StoredCamera, [u32; 2]>(&cameras)))?;
        let samples = first_sample..first_sample + batch.samples;
        let mut plan = DispatchPlan::together(width, height * views.len() as u32, samples);
        let mut submitted = VecDeque::new();
        let mut last_done = Instant::now();
        loop {
            let next = if run.control.is_cancelled() {
                None
            } else {
                plan.next(pace, most_samples(gpu.is_software()))
            };
            let is_last = next.is_none();
            if let Some(part) = next {
                let begun = Instant::now();
                submitted.push_back((kernel.submit(gpu, &mut self.film, part, run.timer)?, part, begun));
                if submitted.len() < IN_FLIGHT {
                    continue;
                }
            }
            let Some((submission, part, begun)) = submitted.pop_front() else { break };
            gpu.wait_for(Some(submission), "rendering")?;
            let done = u64::from(part.pixel_count(width)) * u64::from(part.sample_count);
            pace.learn(done, begun.max(last_done).elapsed());
            last_done = Instant::now();
            run.count(done, 0)?;
            if is_last && submitted.is_empty() {
                break;
            }
        }
        if run.control.is_cancelled() {
            // What is there of them is nobody's.
            self.film.clear(gpu)?;
            return Ok(false);
        }
        Ok(true)
    }

    /// Sends the colours of the first `views` of the film on their way, and empties it.
    fn begin_download(&mut self, run: &mut Run<'_>, views: usize) -> Result<UnderWay, GpuError> {
        let (gpu, pixels) = (run.gpu, (views * run.batch.pixels()) as u64);
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let size = Dispatch::Groups(groups_of_64(pixels));
            self.pass.record(&mut encoder, run.timer, &self.groups, size);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing: "handing out colours", reason })?;
        self.downloads.begin(gpu, &self.colors, pixels * COLOR_BYTES)
    }
}

/// Means of the samples of a chunk, as a film has them.
fn hand_out(batch: &ViewBatch, views: Range<usize>, bytes: &[u8], pictures: &mut ViewPictures) {
    let of_view = 3 * batch.pixels();
    let Some(colors) = pictures.colors_mut() else { return };
    let places = colors[of_view * views.start..of_view * views.end].par_chunks_mut(3 * PIECE);
    let mean = |(colors, pixels): (&mut [f32], &[u8])| {
        let mut invalid = 0;
        for (color, pixel) in colors.as_chunks_mut::<3>().0.iter_mut().zip(pixels.as_chunks::<16>().0) {
            let [r, g, b, counts]: [u32; 4] = bytemuck::pod_read_unaligned(pixel);
            let count = f64::from((counts & 0xffff).max(1));
            *color = [r, g, b].map(|sum| (f64::from(f32::from_bits(sum)) / count) as f32);
            invalid += u64::from(counts >> 16);
        }
        invalid
    };
    let invalid: u64 = places.zip(bytes.par_chunks(16 * PIECE)).map(mean).sum();
    pictures.invalid_samples += invalid;
}
