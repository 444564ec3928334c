//! Samples of some pixels: lists that the host made, and rounds that the device decides about.

use super::{CompiledKernel, FOLD_INTERVAL, GpuBackend, IN_FLIGHT, Picture, add_time, samples_of};
use crate::film::{Batch, FOLD_SAMPLES, device_error};
use crate::kernel::KernelKind;
use crate::plan::ListPlan;
use crate::rounds::{Decision, Rounds};
use crate::timing::Timer;
use crate::{Gpu, GpuError};
use backend::{BackendError, Control, Round, Stats, View};
use std::collections::VecDeque;
use std::time::Instant;

/// Samples of listed pixels that are being made.
pub(super) struct ListRun<'a> {
    pub gpu: &'a Gpu,
    pub picture: &'a mut Picture,
    compiled: &'a mut CompiledKernel,
    timer: &'a mut Timer,
    /// Pixels in a row of the window.
    width: u32,
    under_way: VecDeque<(wgpu::SubmissionIndex, Batch, Instant)>,
    last_done: Instant,
}

impl ListRun<'_> {
    /// Moves what the device has summed to the host, if it has no room for `samples` more of a pixel, or has not done so for long.
    pub fn make_room(&mut self, samples: u32) -> Result<(), GpuError> {
        let full = self.picture.pending + samples > FOLD_SAMPLES;
        if full || self.picture.last_fold.elapsed() > FOLD_INTERVAL {
            self.picture.fold(self.gpu)?;
        }
        self.picture.pending += samples;
        Ok(())
    }

    /// Makes `samples` samples of each of the `pixels` pixels that the list has now. The last ones may still be under way when it
    /// returns: what is submitted later sees what they have left.
    pub fn level(
        &mut self,
        samples: u32,
        pixels: u32,
        control: &Control,
        stats: &mut Stats,
    ) -> Result<(), GpuError> {
        let mut plan = ListPlan::new(pixels, samples);
        while let Some(batch) = plan.next(&self.compiled.pace) {
            if control.is_cancelled() {
                break;
            }
            let kernel = &mut self.compiled.kernel;
            let submission = kernel.submit(self.gpu, &mut self.picture.buffers, batch, self.timer)?;
            self.under_way.push_back((submission, batch, Instant::now()));
            if self.under_way.len() >= IN_FLIGHT {
                self.wait_for_one(control, stats)?;
            }
            if self.timer.is_nearly_full() {
                self.drain(control, stats)?;
                add_time(stats, self.timer.collect(self.gpu)?);
            }
        }
        Ok(())
    }

    /// Waits for what is under way.
    pub fn finish(mut self, control: &Control, stats: &mut Stats) -> Result<(), GpuError> {
        self.drain(control, stats)?;
        add_time(stats, self.timer.collect(self.gpu)?);
        Ok(())
    }

    fn drain(&mut self, control: &Control, stats: &mut Stats) -> Result<(), GpuError> {
        while !self.under_way.is_empty() {
            self.wait_for_one(control, stats)?;
        }
        Ok(())
    }

    fn wait_for_one(&mut self, control: &Control, stats: &mut Stats) -> Result<(), GpuError> {
        let Some((submission, batch, submitted)) = self.under_way.pop_front() else { return Ok(()) };
        self.gpu.wait_for(Some(submission), "rendering")?;
        let done = samples_of(&batch, self.width);
        self.compiled.pace.learn(done, submitted.max(self.last_done).elapsed());
        self.last_done = Instant::now();
        stats.samples += done;
        control.advance(done);
        Ok(())
    }
}

impl GpuBackend {
    /// Makes everything ready for lists of pixels that get `mean` samples each, over the whole window.
    pub(super) fn begin_list(&mut self, view: &View, mean: u64) -> Result<ListRun<'_>, GpuError> {
        // Frames are of all pixels; of single ones other kernels make the same picture.
        let kind = match KernelKind::of(&view.integrator) {
            KernelKind::Hybrid => KernelKind::Direct,
            KernelKind::Realtime => KernelKind::Path,
            other => other,
        };
        let key = self.prepare_kernel(view, u32::try_from(mean).unwrap_or(u32::MAX), kind)?;
        let missing = || GpuError::Device { doing: "looking up a kernel", reason: "it is gone".into() };
        let (Some(scene), Some(picture)) = (&mut self.scene, &mut self.picture) else {
            return Err(missing());
        };
        picture.rays = 0;
        Ok(ListRun {
            gpu: &self.gpu,
            compiled: scene.kernels.get_mut(&key).ok_or_else(missing)?,
            picture,
            timer: &mut self.timer,
            width: view.window.width,
            under_way: VecDeque::new(),
            last_done: Instant::now(),
        })
    }

    /// See [`backend::Backend::render_round`].
    pub(super) fn render_decided(
        &mut self,
        view: &View,
        round: &Round,
        control: &Control,
    ) -> Result<Option<Stats>, BackendError> {
        let start = Instant::now();
        let same = |old: &View| View { first_sample: view.first_sample, ..old.clone() } == *view;
        if !self.picture.as_ref().is_some_and(|p| same(&p.view)) {
            return Ok(None);
        }
        let name = self.kind.name();
        let decision = self.decide(view.first_sample, round).map_err(|e| device_error(name, e))?;
        let Some(decision) = decision else { return Ok(None) };
        // Without an estimate of every pixel the device cannot decide, and where all is quiet nobody deserves more than others.
        let is_known = decision.least_valid >= 2 && decision.least_taken >= round.least;
        let samples = decision.samples();
        if !is_known || samples == 0 {
            return Ok(None);
        }
        let work = |this: &mut Self, stats: &mut Stats| this.render_levels(view, &decision, control, stats);
        let mut stats = self.render_with(view, samples, control, work)?;
        stats.elapsed = start.elapsed();
        Ok(Some(stats))
    }

    /// What the device says of its film; `None` where there is none.
    fn decide(&mut self, first_sample: u32, round: &Round) -> Result<Option<Decision>, GpuError> {
        let Some(picture) = &mut self.picture else { return Ok(None) };
        let mut rounds = match picture.rounds.take() {
            Some(rounds) => rounds,
            None => match Rounds::new(&self.gpu, &picture.buffers) {
                Ok(rounds) => rounds,
                // The host can decide as well; it needs no memory of the device for it.
                Err(GpuError::Allocation { .. } | GpuError::BufferTooLarge { .. }) => return Ok(None),
                Err(error) => return Err(error),
            },
        };
        rounds.follow(&self.gpu, &picture.film, picture.folds)?;
        let decision = rounds.decide(&self.gpu, first_sample, round.total, round.floor, &mut self.timer)?;
        picture.rounds = Some(rounds);
        Ok(Some(decision))
    }

    fn render_levels(
        &mut self,
        view: &View,
        decision: &Decision,
        control: &Control,
        stats: &mut Stats,
    ) -> Result<(), GpuError> {
        let mean = decision.samples().div_ceil(view.window.area().max(1) as u64);
        let mut run = self.begin_list(view, mean)?;
        for &level in &decision.levels {
            if control.is_cancelled() {
                break;
            }
            run.make_room(level.samples)?;
            if let Some(rounds) = &mut run.picture.rounds {
                rounds.list(run.gpu, level)?;
            }
            run.level(level.samples, level.pixels, control, stats)?;
        }
        run.finish(control, stats)
    }

    /// See [`film::Film::relative_error`]: the device finds it out without moving its film.
    pub(super) fn error_on_device(&mut self) -> Result<Option<f64>, GpuError> {
        // Of a lost device, what was moved before is what there is.
        if self.gpu.is_lost() {
            return Ok(self.picture.as_ref().and_then(|p| p.film.relative_error()));
        }
        let error = self.decide(0, &Round::default())?;
        Ok(error.filter(|d| d.least_valid >= 2).map(|d| d.error))
    }
}
