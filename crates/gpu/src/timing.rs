//! Time that passes take on the device, by its own clock.

use crate::readback::read_mapped;
use crate::scene::upload::empty_buffer;
use crate::{Gpu, GpuError};
use backend::PassTime;
use std::time::Duration;
use wgpu::{BufferUsages, Features};

/// Passes that a set of queries has room for: no set may have more than 4096 queries.
const SET_PASSES: u32 = 2048;
/// Passes whose times are read together.
const READ_PASSES: usize = 1024;
/// Passes that are kept for who asks: long renders have millions.
pub const KEPT_PASSES: usize = 1 << 17;

/// Where a pass writes when it begins and ends.
#[derive(Clone, Copy, Debug)]
pub struct TimerSlot<'a> {
    /// The queries.
    pub queries: &'a wgpu::QuerySet,
    /// Index of the one for the beginning; the next is for the end.
    pub begin: u32,
}

impl<'a> TimerSlot<'a> {
    /// For a compute pass.
    pub fn compute(self) -> wgpu::ComputePassTimestampWrites<'a> {
        wgpu::ComputePassTimestampWrites {
            query_set: self.queries,
            beginning_of_pass_write_index: Some(self.begin),
            end_of_pass_write_index: Some(self.begin + 1),
        }
    }

    /// For a pass that draws.
    pub fn render(self) -> wgpu::RenderPassTimestampWrites<'a> {
        wgpu::RenderPassTimestampWrites {
            query_set: self.queries,
            beginning_of_pass_write_index: Some(self.begin),
            end_of_pass_write_index: Some(self.begin + 1),
        }
    }
}

/// When a pass began and ended, in ticks of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticks {
    /// What it did.
    pub name: &'static str,
    /// When it began.
    pub begin: u64,
    /// When it ended.
    pub end: u64,
}

/// What passes write their times to.
pub trait PassClock {
    /// Where the next pass, called `name`, writes its times; `None` if nobody reads them.
    fn slot(&mut self, name: &'static str) -> Option<TimerSlot<'_>>;
}

impl PassClock for Timer {
    fn slot(&mut self, name: &'static str) -> Option<TimerSlot<'_>> {
        Timer::slot(self, name)
    }
}

/// Collects the times of passes. Does nothing where the device has no clock.
pub struct Timer {
    clock: Option<Clock>,
    passes: Vec<PassTime>,
    /// What passes took that other clocks have timed, since the last call of [`Timer::collect`].
    added: Duration,
}

struct Clock {
    /// There is at least one.
    sets: Vec<QuerySet>,
    names: Vec<&'static str>,
    /// Nanoseconds of a tick.
    period: f64,
    origin: Option<u64>,
}

impl Timer {
    /// A timer for a device.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        if !gpu.features.contains(Features::TIMESTAMP_QUERY) {
            return Ok(Self { clock: None, passes: Vec::new(), added: Duration::ZERO });
        }
        let sets = vec![QuerySet::new(gpu)?];
        let period = f64::from(gpu.queue.get_timestamp_period());
        let clock = Clock { sets, names: Vec::new(), period, origin: None };
        Ok(Self { clock: Some(clock), passes: Vec::new(), added: Duration::ZERO })
    }

    /// Makes sure that there are slots for the next `passes` passes.
    ///
    /// # Errors
    /// When there is no memory for them.
    pub fn reserve(&mut self, gpu: &Gpu, passes: usize) -> Result<(), GpuError> {
        let Some(clock) = &mut self.clock else { return Ok(()) };
        while clock.sets.len() * (SET_PASSES as usize) < clock.names.len() + passes {
            clock.sets.push(QuerySet::new(gpu)?);
        }
        Ok(())
    }

    /// Where the next pass, called `name`, writes its times; `None` where there is no clock, or no slot has been reserved.
    /// Every slot handed out must be written before [`Timer::collect`].
    pub fn slot(&mut self, name: &'static str) -> Option<TimerSlot<'_>> {
        let clock = self.clock.as_mut()?;
        let (set, pass) = (clock.names.len() / SET_PASSES as usize, clock.names.len() as u32 % SET_PASSES);
        let set = clock.sets.get(set)?;
        clock.names.push(name);
        Some(TimerSlot { queries: &set.queries, begin: 2 * pass })
    }

    /// Whether there are so many passes that [`Timer::collect`] should be called.
    pub fn is_nearly_full(&self) -> bool {
        self.clock.as_ref().is_some_and(|c| c.names.len() >= READ_PASSES)
    }

    /// Waits for all passes so far and reads their times. Returns how long they took together; `None` without a clock.
    ///
    /// # Errors
    /// When the device fails.
    pub fn collect(&mut self, gpu: &Gpu) -> Result<Option<Duration>, GpuError> {
        let Some(clock) = &mut self.clock else { return Ok(None) };
        let names = std::mem::take(&mut clock.names);
        let mut total = std::mem::take(&mut self.added);
        for (set, names) in clock.sets.iter().zip(names.chunks(SET_PASSES as usize)) {
            let ticks = set.read(gpu, names.len())?;
            let read = names.iter().zip(ticks).map(|(&name, [begin, end])| Ticks { name, begin, end });
            total += read
                .map(|ticks| note(&mut clock.origin, clock.period, &mut self.passes, ticks))
                .sum::<Duration>();
        }
        // A rare batch of many passes need not be paid for ever.
        clock.sets.truncate(1);
        Ok(Some(total))
    }

    /// Takes in what another clock of the device has read.
    pub fn add(&mut self, read: &[Ticks]) {
        let Some(clock) = &mut self.clock else { return };
        for &ticks in read {
            self.added += note(&mut clock.origin, clock.period, &mut self.passes, ticks);
        }
    }

    /// The passes read since the last call: the first [`KEPT_PASSES`].
    pub fn take(&mut self) -> Vec<PassTime> {
        std::mem::take(&mut self.passes)
    }
}

/// Keeps the time of a pass, from the `origin` on, which is the beginning of the first. Returns how long it took.
fn note(origin: &mut Option<u64>, period: f64, passes: &mut Vec<PassTime>, ticks: Ticks) -> Duration {
    let nanoseconds = |ticks: u64| Duration::from_nanos((ticks as f64 * period) as u64);
    let origin = *origin.get_or_insert(ticks.begin);
    let duration = nanoseconds(ticks.end.saturating_sub(ticks.begin));
    if passes.len() < KEPT_PASSES {
        passes.push(PassTime {
            name: ticks.name,
            start: nanoseconds(ticks.begin.saturating_sub(origin)),
            duration,
        });
    }
    duration
}

/// Queries for [`SET_PASSES`] passes, and their way to the host.
struct QuerySet {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
}

impl QuerySet {
    fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let bytes = u64::from(2 * SET_PASSES) * size_of::<u64>() as u64;
        let resolved =
            empty_buffer(gpu, "timestamps", bytes, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC)?;
        let readable =
            empty_buffer(gpu, "timestamps to read", bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST)?;
        let descriptor = wgpu::QuerySetDescriptor {
            label: Some("passes"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * SET_PASSES,
        };
        let queries = gpu
            .guarded(|| gpu.device.create_query_set(&descriptor))
            .map_err(|reason| GpuError::Allocation { object: "timestamps", bytes, reason })?;
        Ok(Self { queries, resolved, readable })
    }

    /// Ticks at which the first `passes` passes began and ended; `passes` is not zero.
    fn read(&self, gpu: &Gpu, passes: usize) -> Result<Vec<[u64; 2]>, GpuError> {
        let doing = "reading timestamps";
        let bytes = (passes * size_of::<[u64; 2]>()) as u64;
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.resolve_query_set(&self.queries, 0..2 * passes as u32, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, bytes);
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing, reason })?;
        read_mapped(gpu, &self.readable, bytes, doing, bytemuck::pod_collect_to_vec)
    }
}
