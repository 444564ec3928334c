//! Times of a frame's passes by the device's clock, read without waiting: each slot of the ring has its own queries, which are read
//! when the slot's turn comes again.

use crate::scene::upload::empty_buffer;
use crate::timing::{PassClock, Ticks, TimerSlot};
use crate::{Gpu, GpuError};
use std::sync::mpsc::{Receiver, channel};
use wgpu::{BufferUsages, Features};

/// Passes of a frame that are timed; what comes after them is not.
const MOST_PASSES: u32 = 24;

/// The clock of one slot. Does nothing where the device has none.
pub struct FrameClock {
    queries: Option<Queries>,
    names: Vec<&'static str>,
}

struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    mapped: Option<Receiver<bool>>,
}

impl FrameClock {
    /// A clock for a slot.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        if !gpu.features.contains(Features::TIMESTAMP_QUERY) {
            return Ok(Self { queries: None, names: Vec::new() });
        }
        let bytes = u64::from(2 * MOST_PASSES) * size_of::<u64>() as u64;
        let resolved = empty_buffer(
            gpu,
            "frame timestamps",
            bytes,
            BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC,
        )?;
        let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let readable = empty_buffer(gpu, "frame timestamps to read", bytes, usage)?;
        let descriptor = wgpu::QuerySetDescriptor {
            label: Some("frame"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * MOST_PASSES,
        };
        let set = gpu
            .guarded(|| gpu.device.create_query_set(&descriptor))
            .map_err(|reason| GpuError::Allocation { object: "frame timestamps", bytes, reason })?;
        let queries = Queries { set, resolved, readable, mapped: None };
        Ok(Self { queries: Some(queries), names: Vec::new() })
    }

    /// Records that what passes have written be brought where the host can read it.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        let Some(queries) = &self.queries else { return };
        let count = 2 * self.names.len() as u32;
        if count > 0 {
            encoder.resolve_query_set(&queries.set, 0..count, &queries.resolved, 0);
            let bytes = u64::from(count) * size_of::<u64>() as u64;
            encoder.copy_buffer_to_buffer(&queries.resolved, 0, &queries.readable, 0, bytes);
        }
    }

    /// Asks for the times; after the frame was submitted.
    pub fn request(&mut self) {
        let Some(queries) = &mut self.queries else { return };
        let (sender, receiver) = channel();
        queries.readable.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            let _ = sender.send(result.is_ok()); // nobody waits any more if the ring is gone
        });
        queries.mapped = Some(receiver);
    }

    /// The times of a frame that the device is done with, and an empty clock for the next. None where there is no clock.
    ///
    /// # Errors
    /// When the device fails.
    pub fn take(&mut self, gpu: &Gpu) -> Result<Vec<Ticks>, GpuError> {
        let names = std::mem::take(&mut self.names);
        let Some(queries) = &mut self.queries else { return Ok(Vec::new()) };
        let Some(mapped) = queries.mapped.take() else { return Ok(Vec::new()) };
        let doing = "reading a frame's times";
        let failed = |reason: String| GpuError::Device { doing, reason };
        // The frame is done; its callbacks run in a poll.
        let _ = gpu.device.poll(wgpu::PollType::Poll);
        let answer = match mapped.try_recv() {
            Ok(answer) => Ok(answer),
            Err(_) => {
                gpu.wait(doing)?;
                mapped.try_recv()
            }
        };
        if !answer.map_err(|e| failed(e.to_string()))? {
            return Err(failed("the times cannot be mapped".into()));
        }
        let view = queries.readable.slice(..).get_mapped_range().map_err(|e| failed(e.to_string()))?;
        let ticks: Vec<[u64; 2]> = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        queries.readable.unmap();
        Ok(names.into_iter().zip(ticks).map(|(name, [begin, end])| Ticks { name, begin, end }).collect())
    }
}

impl PassClock for FrameClock {
    fn slot(&mut self, name: &'static str) -> Option<TimerSlot<'_>> {
        let queries = self.queries.as_ref()?;
        let pass = self.names.len() as u32;
        if pass >= MOST_PASSES {
            return None;
        }
        self.names.push(name);
        Some(TimerSlot { queries: &queries.set, begin: 2 * pass })
    }
}
