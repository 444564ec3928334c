//! What only one test of a process may have at a time.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};

static TURN: Mutex<()> = Mutex::new(());

/// Something that no other test of the process has meanwhile, if it is made so.
///
/// Drivers of real GPUs are not all safe to open, compile for and close several devices at once: in NVIDIA's (580.159), a
/// thread that compiles a ray tracing pipeline and one that closes another device wait for each other for ever.
pub struct Exclusive<T> {
    // Fields go in this order: the thing before the turn.
    value: T,
    _turn: Option<MutexGuard<'static, ()>>,
}

impl<T> Exclusive<T> {
    /// Waits until no other test has one, if it is to be `alone`, and makes it. One thread cannot have two.
    pub fn new(alone: bool, make: impl FnOnce() -> T) -> Self {
        // A test that failed while it was its turn says nothing about the next one.
        let turn = alone.then(|| TURN.lock().unwrap_or_else(PoisonError::into_inner));
        Self { value: make(), _turn: turn }
    }

    /// Makes something else of it; it is still the same turn.
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Exclusive<U> {
        Exclusive { value: change(self.value), _turn: self._turn }
    }
}

impl<T> Deref for Exclusive<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for Exclusive<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// The most threads that had one at once.
    fn crowd(alone: bool) -> u32 {
        let (present, most) = (AtomicU32::new(0), AtomicU32::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    let one =
                        Exclusive::new(alone, || present.fetch_add(1, Ordering::SeqCst) + 1).map(|n| 2 * n);
                    most.fetch_max(*one / 2, Ordering::SeqCst);
                    std::thread::sleep(std::time::Duration::from_millis(50));
                    present.fetch_sub(1, Ordering::SeqCst);
                });
            }
        });
        most.into_inner()
    }

    #[test]
    fn one_at_a_time_only_if_alone() {
        assert_eq!(crowd(true), 1);
        assert!(crowd(false) > 1, "the test itself does not run at once");
    }
}
