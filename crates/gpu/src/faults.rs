//! What goes wrong with a device: what its callbacks have reported, and faults that tests make.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What the device's callbacks have reported and nobody has taken yet.
#[derive(Default)]
pub(crate) struct Reported {
    pub lost: Option<String>,
    pub error: Option<String>,
}

/// The reports of a device. A callback that panicked while it held the lock leaves nothing half-done.
#[derive(Clone, Default)]
pub(crate) struct Reports(Arc<Mutex<Reported>>);

impl Reports {
    pub fn lock(&self) -> MutexGuard<'_, Reported> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// What is made finds no memory. Steps are all that is made on the device: buffers, textures, pipelines.
    OutOfMemory,
    /// The device is gone. Steps are all that is made on it or waited for.
    Lost,
    /// Work does not end. Steps are all that is waited for.
    Timeout,
}

/// A fault that a device makes once, at a step that a test chooses. Clones are the same fault.
#[derive(Clone, Debug)]
pub struct InjectedFault(Arc<Injected>);

#[derive(Debug)]
struct Injected {
    kind: FaultKind,
    /// Steps left before it happens.
    left: AtomicU32,
    happened: AtomicBool,
}

impl InjectedFault {
    /// A fault after so many steps that go well.
    pub fn after(steps: u32, kind: FaultKind) -> Self {
        Self(Arc::new(Injected { kind, left: AtomicU32::new(steps), happened: AtomicBool::new(false) }))
    }

    /// Whether it has happened.
    pub fn has_happened(&self) -> bool {
        self.0.happened.load(Ordering::Relaxed)
    }

    /// Takes a step at which these kinds could happen, and says which does.
    pub(crate) fn step(&self, kinds: &[FaultKind]) -> Option<FaultKind> {
        let Injected { kind, left, happened } = &*self.0;
        if !kinds.contains(kind) {
            return None;
        }
        let step = left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
        (step.is_err() && !happened.swap(true, Ordering::Relaxed)).then_some(*kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_happens_once_and_only_at_its_own_steps() {
        let fault = InjectedFault::after(2, FaultKind::Lost);
        let all = [FaultKind::OutOfMemory, FaultKind::Lost];
        let happened: Vec<_> = (0..5).map(|_| fault.clone().step(&all)).collect();
        assert_eq!(happened, [None, None, Some(FaultKind::Lost), None, None]);
        assert!(fault.has_happened());
        let other = InjectedFault::after(0, FaultKind::Timeout);
        assert!(other.step(&all).is_none() && !other.has_happened());
    }
}
