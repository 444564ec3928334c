//! Samples of some pixels: those that the host lists, and rounds that the device decides about.

use super::kernels::CompiledKernel;
use super::picture::Picture;
use super::{FOLD_INTERVAL, GpuBackend, IN_FLIGHT, add_time, samples_of};
use crate::batch::{Batch, BatchPixels};
use crate::film::{FOLD_SAMPLES, device_error};
use crate::kernel::KernelKind;
use crate::plan::PortionPlan;
use crate::portions::{PORTION_BYTES, PORTIONS, portion_count};
use crate::rounds::{Decision, Rounds};
use crate::timing::Timer;
use crate::{Gpu, GpuError};
use backend::{AdaptiveRounds, BackendError, Control, Stats, View};
use std::collections::VecDeque;
use std::time::Instant;

/// Portions of pixels' samples that are being made.
pub(super) struct PortionRun<'a> {
    pub gpu: &'a Gpu,
    pub picture: &'a mut Picture,
    compiled: &'a mut CompiledKernel,
    timer: &'a mut Timer,
    /// Pixels in a row of the window.
    width: u32,
    under_way: VecDeque<(wgpu::SubmissionIndex, Batch, Instant)>,
    last_done: Instant,
}

impl PortionRun<'_> {
    /// Moves what the device has summed to the host, if it has no room for the portions of `samples` more samples of a pixel, or has
    /// not done so for long.
    pub fn make_room(&mut self, samples: u32) -> Result<(), GpuError> {
        let added = portion_count(samples);
        let full = self.picture.pending + added > FOLD_SAMPLES;
        if full || self.picture.last_fold.elapsed() > FOLD_INTERVAL {
            self.picture.fold(self.gpu)?;
        }
        self.picture.pending += added;
        Ok(())
    }

    /// Makes all of the `count` portions of `samples` samples that the film's shares say now. The last ones may still be under way
    /// when it returns: what is submitted later sees what they have left.
    pub fn make(
        &mut self,
        samples: u32,
        count: u32,
        control: &Control,
        stats: &mut Stats,
    ) -> Result<(), GpuError> {
        let most = self.picture.buffers.most_portions();
        if most == 0 {
            let (adapter, limit) = (self.gpu.info.name.clone(), "bytes of a bound buffer");
            let offered = self.picture.buffers.pixels.size();
            return Err(GpuError::Limit { adapter, limit, needed: offered + PORTION_BYTES, offered });
        }
        let mut plan = PortionPlan::new(count, samples, most);
        while let Some(batch) = plan.next(&self.compiled.pace) {
            if control.is_cancelled() {
                break;
            }
            let kernel = &mut self.compiled.kernel;
            let submission = kernel.submit(self.gpu, &mut self.picture.buffers, batch, self.timer)?;
            if let BatchPixels::Portions { first, count: made, .. } = batch.pixels {
                self.picture.buffers.gather(self.gpu, first, made, count)?;
            }
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

    /// Makes all portions that the device has decided about.
    fn make_round(
        &mut self,
        decision: &Decision,
        control: &Control,
        stats: &mut Stats,
    ) -> Result<(), GpuError> {
        self.make_room(decision.most_extra)?;
        for (size, count) in decision.portions().filter(|p| p.1 > 0) {
            if control.is_cancelled() {
                break;
            }
            if let Some(rounds) = &mut self.picture.rounds {
                rounds.share_out(self.gpu, size)?;
            }
            self.make(PORTIONS[size], count, control, stats)?;
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
    /// Makes everything ready for portions of pixels that get `mean` samples each, over the whole window.
    pub(super) fn begin_portions(&mut self, view: &View, mean: u64) -> Result<PortionRun<'_>, GpuError> {
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
        Ok(PortionRun {
            gpu: &self.gpu,
            compiled: scene.kernels.get_mut(&key).ok_or_else(missing)?,
            picture,
            timer: &mut self.timer,
            width: view.window.width,
            under_way: VecDeque::new(),
            last_done: Instant::now(),
        })
    }

    /// See [`backend::Backend::render_rounds`].
    pub(super) fn render_decided(
        &mut self,
        view: &View,
        rounds: &AdaptiveRounds,
        control: &Control,
    ) -> Result<Option<Stats>, BackendError> {
        let start = Instant::now();
        let (Some(&first), Some(&last)) = (rounds.totals.first(), rounds.totals.last()) else {
            return Ok(None);
        };
        if !self.picture.as_ref().is_some_and(|p| p.is_of(view)) {
            return Ok(None);
        }
        let name = self.kind.name();
        let decision =
            self.decide(view.first_sample, first, rounds.floor).map_err(|e| device_error(name, e))?;
        let Some(decision) = decision.filter(|d| is_of_use(d, rounds)) else { return Ok(None) };
        let samples = decision.samples() + last.saturating_sub(first);
        let work =
            |this: &mut Self, stats: &mut Stats| this.make_decided(view, rounds, decision, control, stats);
        let mut stats = self.render_with(view, samples, control, work)?;
        stats.elapsed = start.elapsed();
        Ok(Some(stats))
    }

    /// What the device says of its film; `None` where there is none.
    fn decide(
        &mut self,
        first_sample: u32,
        total: u64,
        floor: Option<f64>,
    ) -> Result<Option<Decision>, GpuError> {
        let Some(picture) = &mut self.picture else { return Ok(None) };
        if picture.rounds.is_none() {
            picture.rounds = match Rounds::new(&self.gpu, &picture.buffers) {
                Ok(rounds) => Some(rounds),
                // The host can decide as well; it needs no memory of the device for it.
                Err(GpuError::Allocation { .. } | GpuError::BufferTooLarge { .. }) => return Ok(None),
                Err(error) => return Err(error),
            };
        }
        picture.decide(&self.gpu, first_sample, total, floor, &mut self.timer)?;
        picture.rounds.as_ref().map(|rounds| rounds.read(&self.gpu)).transpose()
    }

    /// All rounds, the first of which has been decided about.
    fn make_decided(
        &mut self,
        view: &View,
        rounds: &AdaptiveRounds,
        mut decision: Decision,
        control: &Control,
        stats: &mut Stats,
    ) -> Result<(), GpuError> {
        let mean = decision.samples().div_ceil(view.window.area().max(1) as u64);
        let mut run = self.begin_portions(view, mean)?;
        run.make_round(&decision, control, stats)?;
        for &total in &rounds.totals[1..] {
            if control.is_cancelled() {
                break;
            }
            // The device goes on with this as soon as it has the portions, while the host still waits for them.
            run.picture.decide(run.gpu, view.first_sample, total, rounds.floor, run.timer)?;
            run.drain(control, stats)?;
            let Some(decider) = &run.picture.rounds else { break };
            decision = decider.read(run.gpu)?;
            if !is_of_use(&decision, rounds) {
                break;
            }
            run.make_round(&decision, control, stats)?;
        }
        run.finish(control, stats)
    }

    /// See [`film::Film::relative_error`]: the device finds it out without moving its film.
    pub(super) fn error_on_device(&mut self) -> Result<Option<f64>, GpuError> {
        // Of a lost device, what was moved before is what there is.
        if self.gpu.is_lost() {
            return Ok(self.picture.as_mut().and_then(|p| p.film.get().relative_error()));
        }
        let decision = self.decide(0, 0, None)?;
        Ok(decision.filter(|d| d.least_valid >= 2).map(|d| d.error))
    }
}

/// Without an estimate of every pixel the device cannot decide, and where all is quiet nobody deserves more than others.
fn is_of_use(decision: &Decision, rounds: &AdaptiveRounds) -> bool {
    decision.least_valid >= 2 && decision.least_taken >= rounds.least && decision.samples() > 0
}
