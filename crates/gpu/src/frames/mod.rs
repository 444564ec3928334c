//! Frames in flight: the host prepares one while the device works on those before it.
//!
//! [`FrameRing`] decides, without a device, which slot is whose; [`Frames`] keeps what a slot needs on a device, and notes what took
//! how long on both sides.

mod clock;
mod ring;
mod timeline;

pub use crate::timing::Ticks;
pub use clock::FrameClock;
pub use ring::{FrameRing, MOST_FRAMES, Turn};
pub use timeline::{Span, Track, chrome_trace};

use crate::{Gpu, GpuError};
use backend::PassTime;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Spans that are kept: some minutes of frames.
const KEPT_SPANS: usize = 1 << 18;

/// What a frame took.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameReport {
    /// Its number, from 0.
    pub frame: u64,
    /// Time the host spent on it, waiting not counted.
    pub host: Duration,
    /// Time the host waited for a slot before it.
    pub waited: Duration,
    /// From when the host began with it (after which no input counts any more) until the device was done; `None` without a clock.
    pub latency: Option<Duration>,
    /// Passes of the device; empty without a clock.
    pub passes: Vec<PassTime>,
}

impl FrameReport {
    /// Time that the device spent in passes.
    pub fn device(&self) -> Duration {
        self.passes.iter().map(|p| p.duration).sum()
    }
}

/// A frame that the device has.
struct Flight {
    slot: usize,
    frame: u64,
    submission: wgpu::SubmissionIndex,
    begun: Instant,
    waited: Duration,
    host: Duration,
}

/// Frames in flight on a device.
pub struct Frames {
    ring: FrameRing,
    clocks: Vec<FrameClock>,
    flights: VecDeque<Flight>,
    begun: Instant,
    waited: Duration,
    start: Instant,
    /// The first tick of the device that was seen; others are counted from it, or a 64-bit float could not tell them apart.
    first_tick: Option<u64>,
    /// The host's time at that tick, since `start`, in nanoseconds.
    device_zero: f64,
    nanoseconds_per_tick: f64,
    reports: Vec<FrameReport>,
    spans: Vec<Span>,
}

impl Frames {
    /// A ring of `depth` frames, see [`FrameRing::new`].
    ///
    /// # Errors
    /// When the device has no memory for clocks.
    pub fn new(gpu: &Gpu, depth: usize) -> Result<Self, GpuError> {
        let clocks = (0..MOST_FRAMES).map(|_| FrameClock::new(gpu)).collect::<Result<_, _>>()?;
        let now = Instant::now();
        let mut frames = Self {
            ring: FrameRing::new(depth),
            clocks,
            flights: VecDeque::new(),
            begun: now,
            waited: Duration::ZERO,
            start: now,
            first_tick: None,
            device_zero: f64::INFINITY,
            nanoseconds_per_tick: f64::from(gpu.queue.get_timestamp_period()),
            reports: Vec::new(),
            spans: Vec::new(),
        };
        frames.set_clocks(gpu)?;
        Ok(frames)
    }

    /// Finds out what time it is on the device: an empty pass, and when the host hears that it is done. That is late by what a wait
    /// takes to end, some tens of microseconds; frames make it more exact, see [`Self::heard_of`].
    fn set_clocks(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        let clock = &mut self.clocks[0];
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let slot = crate::timing::PassClock::slot(clock, "clock");
        drop(encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("clock"),
            timestamp_writes: slot.map(|s| s.compute()),
        }));
        clock.resolve(&mut encoder);
        let submission = gpu.queue.submit([encoder.finish()]);
        clock.request();
        gpu.wait_for(Some(submission), "setting clocks")?;
        let now = self.start.elapsed().as_nanos() as f64;
        let ticks = clock.take(gpu)?;
        self.heard_of(&ticks, now);
        Ok(())
    }

    /// Sets the device's clock by what it did: all of it was over when the host heard of it, `now` nanoseconds after the start. How
    /// late the host hears differs, by milliseconds if it is busy, so the least is what counts.
    fn heard_of(&mut self, ticks: &[Ticks], now: f64) {
        if let Some(last) = ticks.iter().map(|t| t.end).max() {
            self.first_tick.get_or_insert(last);
            self.device_zero = self.device_zero.min(now - self.since_first(last));
        }
    }

    /// How many frames may be in flight.
    pub fn depth(&self) -> usize {
        self.ring.depth()
    }

    /// Lets more or fewer frames be in flight, from the next one on.
    pub fn set_depth(&mut self, depth: usize) {
        self.ring.set_depth(depth);
    }

    /// Begins a frame: waits only if as many are in flight as may be. Returns its slot.
    ///
    /// # Errors
    /// When the device fails.
    pub fn begin(&mut self, gpu: &Gpu) -> Result<usize, GpuError> {
        let asked = Instant::now();
        let slot = loop {
            match self.ring.begin() {
                Turn::Prepare(slot) => break slot,
                Turn::Wait(frame) => self.wait_for(gpu, frame)?,
            }
        };
        self.begun = Instant::now();
        self.waited = self.begun - asked;
        Ok(slot)
    }

    /// The clock of the frame that was begun, for its passes.
    pub fn clock(&mut self, slot: usize) -> &mut FrameClock {
        &mut self.clocks[slot]
    }

    /// Hands the frame that was begun to the device.
    ///
    /// # Errors
    /// When the device fails at once.
    pub fn submit(
        &mut self,
        gpu: &Gpu,
        slot: usize,
        mut encoder: wgpu::CommandEncoder,
    ) -> Result<u64, GpuError> {
        let doing = "submitting a frame";
        self.clocks[slot].resolve(&mut encoder);
        let submission = gpu
            .guarded(|| gpu.queue.submit([encoder.finish()]))
            .map_err(|reason| GpuError::Device { doing, reason })?;
        self.clocks[slot].request();
        let frame = self
            .ring
            .submitted()
            .ok_or_else(|| GpuError::Device { doing, reason: "no frame was begun".into() })?;
        let (begun, waited) = (self.begun, self.waited);
        let host = begun.elapsed();
        self.span(Track::Host, "wait", frame, begun - waited, begun);
        self.span(Track::Host, "prepare", frame, begun, begun + host);
        self.flights.push_back(Flight { slot, frame, submission, begun, waited, host });
        Ok(frame)
    }

    /// Waits until the device is done with everything.
    ///
    /// # Errors
    /// When the device fails.
    pub fn finish(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        match self.flights.back().map(|f| f.frame) {
            Some(frame) => self.wait_for(gpu, frame),
            None => Ok(()),
        }
    }

    /// The report of the last frame that is done, unless it was taken.
    pub fn last_report(&self) -> Option<&FrameReport> {
        self.reports.last()
    }

    /// Reports of the frames that are done since the last call.
    pub fn take_reports(&mut self) -> Vec<FrameReport> {
        std::mem::take(&mut self.reports)
    }

    /// What was done since the last call, by host and device, for [`chrome_trace`].
    pub fn take_spans(&mut self) -> Vec<Span> {
        std::mem::take(&mut self.spans)
    }

    fn wait_for(&mut self, gpu: &Gpu, frame: u64) -> Result<(), GpuError> {
        let waiting = self.flights.iter().rfind(|f| f.frame <= frame);
        if let Some(flight) = waiting {
            gpu.wait_for(Some(flight.submission.clone()), "waiting for a frame")?;
        }
        let heard = self.start.elapsed().as_nanos() as f64;
        self.ring.finished(frame);
        while self.flights.front().is_some_and(|f| f.frame <= frame) {
            if let Some(flight) = self.flights.pop_front() {
                self.report(gpu, &flight, heard)?;
            }
        }
        Ok(())
    }

    fn report(&mut self, gpu: &Gpu, flight: &Flight, heard: f64) -> Result<(), GpuError> {
        let ticks = self.clocks[flight.slot].take(gpu)?;
        self.heard_of(&ticks, heard);
        let mut passes = Vec::with_capacity(ticks.len());
        for t in &ticks {
            let (start, end) = (self.host_time(t.begin), self.host_time(t.end));
            passes.push(PassTime { name: t.name, start, duration: end.saturating_sub(start) });
            if self.spans.len() < KEPT_SPANS {
                self.spans.push(Span { track: Track::Device, name: t.name, frame: flight.frame, start, end });
            }
        }
        let begun = flight.begun - self.start;
        let latency = ticks.last().map(|t| self.host_time(t.end).saturating_sub(begun));
        let (frame, host, waited) = (flight.frame, flight.host, flight.waited);
        self.reports.push(FrameReport { frame, host, waited, latency, passes });
        Ok(())
    }

    /// When it was a tick, since `start`.
    fn host_time(&self, tick: u64) -> Duration {
        Duration::from_nanos((self.device_zero + self.since_first(tick)).max(0.0) as u64)
    }

    /// Nanoseconds from the first tick to another, which may be before it.
    fn since_first(&self, tick: u64) -> f64 {
        tick.wrapping_sub(self.first_tick.unwrap_or_default()) as i64 as f64 * self.nanoseconds_per_tick
    }

    fn span(&mut self, track: Track, name: &'static str, frame: u64, start: Instant, end: Instant) {
        if self.spans.len() < KEPT_SPANS {
            let [start, end] = [start, end].map(|t| t.saturating_duration_since(self.start));
            self.spans.push(Span { track, name, frame, start, end });
        }
    }
}

#[cfg(test)]
mod tests;
