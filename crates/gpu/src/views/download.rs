//! The way to the host of what a chunk of views has made, while the device works on the next chunk.

use crate::scene::upload::empty_buffer;
use crate::{Gpu, GpuError};
use rayon::prelude::*;
use std::sync::mpsc::{Receiver, channel};
use wgpu::BufferUsages;

/// Chunks that may be on their way.
const AT_ONCE: usize = 2;
/// Bytes that a thread copies at a time.
const PIECE: usize = 1 << 20;

/// Memory that both sides see, for chunks in turn.
pub(super) struct Downloads {
    staging: [wgpu::Buffer; AT_ONCE],
    next: usize,
}

/// A chunk that is on its way.
pub(super) struct UnderWay {
    staging: usize,
    bytes: u64,
    submission: wgpu::SubmissionIndex,
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl Downloads {
    /// For chunks of at most `bytes`.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn new(gpu: &Gpu, bytes: u64) -> Result<Self, GpuError> {
        let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let one = || empty_buffer(gpu, "reading views", bytes, usage);
        Ok(Self { staging: [one()?, one()?], next: 0 })
    }

    /// Bytes of a chunk that there is room for.
    pub fn room(&self) -> u64 {
        self.staging[0].size()
    }

    /// Sends the first `bytes` of a buffer on their way, behind all that was submitted. No more than two may be there.
    ///
    /// # Errors
    /// When the device fails at once.
    pub fn begin(&mut self, gpu: &Gpu, from: &wgpu::Buffer, bytes: u64) -> Result<UnderWay, GpuError> {
        let staging = self.next;
        self.next = (self.next + 1) % AT_ONCE;
        let to = &self.staging[staging];
        let submission = gpu
            .guarded(|| {
                let mut encoder =
                    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                encoder.copy_buffer_to_buffer(from, 0, to, 0, bytes);
                gpu.queue.submit([encoder.finish()])
            })
            .map_err(|reason| GpuError::Device { doing: "reading views", reason })?;
        let (sender, mapped) = channel();
        to.slice(..bytes).map_async(wgpu::MapMode::Read, move |result| {
            let _ = sender.send(result); // nobody waits any more if the device is gone
        });
        Ok(UnderWay { staging, bytes, submission, mapped })
    }

    /// Waits for a chunk, shows it to `read`, and frees its memory.
    ///
    /// # Errors
    /// When the device fails.
    pub fn finish<T>(
        &self,
        gpu: &Gpu,
        chunk: UnderWay,
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, GpuError> {
        let doing = "reading views";
        gpu.wait_for(Some(chunk.submission), doing)?;
        let failed = |reason: String| GpuError::Device { doing, reason };
        let mapped = match chunk.mapped.try_recv() {
            Ok(mapped) => mapped,
            // The driver tells of it with the next thing that it is asked.
            Err(_) => {
                gpu.wait(doing)?;
                chunk.mapped.try_recv().map_err(|e| failed(e.to_string()))?
            }
        };
        mapped.map_err(|e| failed(e.to_string()))?;
        let staging = &self.staging[chunk.staging];
        let bytes = staging.slice(..chunk.bytes).get_mapped_range().map_err(|e| failed(e.to_string()))?;
        let value = read(&bytes);
        drop(bytes);
        staging.unmap();
        Ok(value)
    }

    /// Bytes that both take.
    pub fn memory_bytes(&self) -> u64 {
        self.staging.iter().map(wgpu::Buffer::size).sum()
    }
}

/// Copies on all threads: one of them is slower than the way from the device.
pub(super) fn copy(from: &[u8], to: &mut [u8]) {
    to.par_chunks_mut(PIECE).zip(from.par_chunks(PIECE)).for_each(|(to, from)| to.copy_from_slice(from));
}
