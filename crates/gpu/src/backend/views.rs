//! Batches of views: which way each part of one takes.

use super::kernels::{CompiledKernel, KernelKey};
use super::{GpuBackend, Loaded, check_boundaries};
use crate::GpuError;
use crate::film::{FOLD_SAMPLES, device_error};
use crate::kernel::{KernelKind, PathKernel};
use crate::plan::Pace;
use crate::shader::Variant;
use crate::tracer::TracerKind;
use crate::views::{ExactWants, Run, colors::ColorViews, exact::ExactViews};
use crate::wavefront::choice;
use backend::{Backend, BackendError, Control, Stats, ViewBatch, ViewPictures, check_media};
use optics::distortion::DISTORTION_NONE;
use std::collections::hash_map::Entry;
use std::time::Instant;

impl GpuBackend {
    /// Cuts batches of views into chunks of about so many bytes, for who is short of memory, and for tests.
    pub fn set_view_chunk_bytes(&mut self, bytes: u64) {
        self.views.set_chunk_bytes(bytes);
    }

    /// As [`Backend::render_views`].
    pub(super) fn render_batch(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
    ) -> Result<(ViewPictures, Stats), BackendError> {
        batch.check()?;
        let Some(loaded) = &self.scene else {
            return Err(BackendError::NoScene { backend: self.name() });
        };
        let failed = |error| device_error(self.kind.name(), error);
        if batch.wants_colors() {
            check_media(&loaded.scene.tables, &batch.view)?;
            check_boundaries(&loaded.scene.tables, &batch.view).map_err(failed)?;
        }
        let start = Instant::now();
        control.begin(batch.all_samples());
        let mut stats = Stats::default();
        let mut pictures = ViewPictures::empty(batch);
        if !batch.cameras.is_empty() {
            let exact = self.render_exact(batch, control, &mut stats, &mut pictures);
            exact.map_err(|error| device_error(self.kind.name(), error))?;
            self.render_colors(batch, control, &mut stats, &mut pictures)?;
        }
        (stats.cancelled, stats.elapsed) = (control.is_cancelled(), start.elapsed());
        Ok((pictures, stats))
    }

    fn render_exact(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
        stats: &mut Stats,
        pictures: &mut ViewPictures,
    ) -> Result<(), GpuError> {
        let Some(Loaded { scene, tracing, exact, .. }) = &mut self.scene else { return Ok(()) };
        if batch.exact_layers().next().is_none() {
            return Ok(());
        }
        let wants = ExactWants::of(batch.exact_layers());
        let kernel = match exact.entry(wants) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(tracing.exact_kernel(&self.gpu, wants, scene)?),
        };
        let mut run = Run { gpu: &self.gpu, batch, control, timer: &mut self.timer, stats };
        let most_bytes = self.views.chunk_bytes();
        ExactViews::render(&mut run, &mut self.views.exact, &mut **kernel, most_bytes, pictures)?;
        run.collect()
    }

    fn render_colors(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
        stats: &mut Stats,
        pictures: &mut ViewPictures,
    ) -> Result<(), BackendError> {
        if !batch.wants_colors() {
            return Ok(());
        }
        if self.takes_views_apart(batch) {
            return self.render_singly(batch, control, stats, pictures);
        }
        let views = ColorViews::prepare(&self.gpu, self.views.colors.take(), batch, self.views.chunk_bytes());
        let made = views.and_then(|mut views| {
            let key = self.color_kernel(batch, &views)?;
            let missing = || GpuError::Device { doing: "looking up a kernel", reason: "it is gone".into() };
            let loaded = self.scene.as_mut();
            let compiled = loaded.and_then(|l| l.kernels.get_mut(&key)).ok_or_else(missing)?;
            let CompiledKernel { kernel, pace } = compiled;
            let mut run = Run { gpu: &self.gpu, batch, control, timer: &mut self.timer, stats };
            views.render(&mut run, &mut **kernel, pace, pictures)?;
            run.collect()?;
            self.views.colors = Some(views);
            Ok(())
        });
        made.map_err(|error| device_error(self.kind.name(), error))
    }

    /// Whether each view is as large a piece of work as a picture, or needs what only pictures have.
    fn takes_views_apart(&self, batch: &ViewBatch) -> bool {
        let samples = batch.pixels() as u64 * u64::from(batch.samples);
        let is_path = KernelKind::of(&batch.view.integrator) == KernelKind::Path;
        let wavefront = match self.path_kernel {
            PathKernel::Auto => choice::is_faster(&self.gpu, self.kind, samples),
            PathKernel::Megakernel => false,
            PathKernel::Wavefront => true,
        };
        // A pipeline empties what it has not seen before, and cameras with it.
        self.kind == TracerKind::Pipeline || batch.samples > FOLD_SAMPLES || (is_path && wavefront)
    }

    /// Compiles the kernel for the colours of a batch, if it is the first of its kind.
    fn color_kernel(&mut self, batch: &ViewBatch, views: &ColorViews) -> Result<KernelKey, GpuError> {
        let kind = KernelKind::of(&batch.view.integrator);
        let is_bent = |c: &optics::camera::CameraFrame| c.distortion.model != DISTORTION_NONE;
        let of_view = self.variant_of(&batch.view, kind);
        let lens_distortion = batch.cameras.iter().any(is_bent);
        let variant = Variant { many_views: true, lens_distortion, ..of_view };
        let key = KernelKey { kind, variant, wavefront: false };
        if let Some(Loaded { scene, tracing, kernels, .. }) = &mut self.scene
            && !kernels.contains_key(&key)
        {
            let kernel = tracing.kernel(&self.gpu, kind, variant, scene, &views.film)?;
            kernels.insert(key, CompiledKernel { kernel, pace: Pace::default() });
        }
        Ok(key)
    }

    /// Colours, picture by picture.
    fn render_singly(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
        stats: &mut Stats,
        pictures: &mut ViewPictures,
    ) -> Result<(), BackendError> {
        for number in 0..batch.cameras.len() {
            if control.is_cancelled() {
                break;
            }
            self.restart();
            let made = self.render(&batch.single(number), batch.samples, control)?;
            stats.samples += made.samples;
            stats.rays += made.rays;
            // A picture counts from zero.
            control.begin(batch.all_samples());
            control.advance(stats.samples);
            if let Some(time) = made.device_time {
                *stats.device_time.get_or_insert_default() += time;
            }
            let Some(film) = self.film()? else { continue };
            let (image, invalid) = (film.to_image(), film.invalid_samples());
            let length = image.data().len();
            if let Some(place) =
                pictures.colors_mut().and_then(|c| c.get_mut(number * length..(number + 1) * length))
            {
                place.copy_from_slice(image.data());
            }
            pictures.invalid_samples += invalid;
        }
        self.restart();
        Ok(())
    }
}
