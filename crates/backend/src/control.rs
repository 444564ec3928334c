//! Cancelling long work and watching it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// How far a call of `render` has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples done by this call, all pixels together.
    pub samples_done: u64,
    /// Samples that this call is to do.
    pub samples_total: u64,
}

/// A handle that another thread, a signal handler or a progress bar holds while a back end works.
#[derive(Debug, Default)]
pub struct Control {
    cancelled: AtomicBool,
    samples_done: AtomicU64,
    samples_total: AtomicU64,
}

impl Control {
    /// A handle of work that has not begun.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the back end to stop soon. What is finished is kept.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether [`Control::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// How far the work has come.
    pub fn progress(&self) -> Progress {
        Progress {
            samples_done: self.samples_done.load(Ordering::Relaxed),
            samples_total: self.samples_total.load(Ordering::Relaxed),
        }
    }

    /// For back ends: announces work of `total` samples.
    pub fn begin(&self, total: u64) {
        self.samples_done.store(0, Ordering::Relaxed);
        self.samples_total.store(total, Ordering::Relaxed);
    }

    /// For back ends: reports `samples` more samples as done.
    pub fn advance(&self, samples: u64) {
        self.samples_done.fetch_add(samples, Ordering::Relaxed);
    }
}
