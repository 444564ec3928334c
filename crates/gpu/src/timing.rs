//! Time that passes take on the device, by its own clock.

use crate::film::read_mapped;
use crate::scene::upload::empty_buffer;
use crate::{Gpu, GpuError};
use backend::PassTime;
use std::time::Duration;
use wgpu::{BufferUsages, Features};

/// Passes that may be under way before their times are read.
const CAPACITY: u32 = 256;

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
}

/// Collects the times of passes. Does nothing where the device has no clock.
pub struct Timer {
    clock: Option<Clock>,
    passes: Vec<PassTime>,
}

struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
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
            return Ok(Self { clock: None, passes: Vec::new() });
        }
        let bytes = u64::from(2 * CAPACITY) * size_of::<u64>() as u64;
        let resolved =
            empty_buffer(gpu, "timestamps", bytes, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC)?;
        let readable =
            empty_buffer(gpu, "timestamps to read", bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST)?;
        let descriptor = wgpu::QuerySetDescriptor {
            label: Some("passes"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * CAPACITY,
        };
        let queries = gpu
            .guarded(|| gpu.device.create_query_set(&descriptor))
            .map_err(|reason| GpuError::Allocation { object: "timestamps", bytes, reason })?;
        let period = f64::from(gpu.queue.get_timestamp_period());
        let clock = Clock { queries, resolved, readable, names: Vec::new(), period, origin: None };
        Ok(Self { clock: Some(clock), passes: Vec::new() })
    }

    /// Where the next pass, called `name`, writes its times; `None` where there is no clock. Every slot handed out must be
    /// written before [`Timer::collect`].
    pub fn slot(&mut self, name: &'static str) -> Option<TimerSlot<'_>> {
        let clock = self.clock.as_mut().filter(|c| c.names.len() < CAPACITY as usize)?;
        clock.names.push(name);
        Some(TimerSlot { queries: &clock.queries, begin: 2 * (clock.names.len() as u32 - 1) })
    }

    /// Whether slots are used up soon, so that [`Timer::collect`] should be called.
    pub fn is_nearly_full(&self) -> bool {
        self.clock.as_ref().is_some_and(|c| c.names.len() + 16 > CAPACITY as usize)
    }

    /// Waits for all passes so far and reads their times. Returns how long they took together; `None` without a clock.
    ///
    /// # Errors
    /// When the device fails.
    pub fn collect(&mut self, gpu: &Gpu) -> Result<Option<Duration>, GpuError> {
        let Some(clock) = &mut self.clock else { return Ok(None) };
        let names = std::mem::take(&mut clock.names);
        if names.is_empty() {
            return Ok(Some(Duration::ZERO));
        }
        let doing = "reading timestamps";
        gpu.guarded(|| {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.resolve_query_set(&clock.queries, 0..2 * names.len() as u32, &clock.resolved, 0);
            encoder.copy_buffer_to_buffer(&clock.resolved, 0, &clock.readable, 0, clock.readable.size());
            gpu.queue.submit([encoder.finish()]);
        })
        .map_err(|reason| GpuError::Device { doing, reason })?;
        let ticks: Vec<[u64; 2]> =
            read_mapped(gpu, &clock.readable, clock.readable.size(), doing, |bytes| {
                bytemuck::pod_collect_to_vec(&bytes[..names.len() * size_of::<[u64; 2]>()])
            })?;
        let origin = *clock.origin.get_or_insert(ticks[0][0]);
        let nanoseconds = |ticks: u64| Duration::from_nanos((ticks as f64 * clock.period) as u64);
        let mut total = Duration::ZERO;
        for (name, [begin, end]) in names.into_iter().zip(ticks) {
            let duration = nanoseconds(end.saturating_sub(begin));
            self.passes.push(PassTime { name, start: nanoseconds(begin.saturating_sub(origin)), duration });
            total += duration;
        }
        Ok(Some(total))
    }

    /// All passes read since the last call.
    pub fn take(&mut self) -> Vec<PassTime> {
        std::mem::take(&mut self.passes)
    }
}
