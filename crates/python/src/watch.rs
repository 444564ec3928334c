//! Long work beside the interpreter: other Python threads run, Ctrl-C and the progress callback are heard.

use crate::errors::Error;
use alhazen::Control;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::Thread;
use std::time::Duration;

/// How often the interpreter is asked for signals and told how far the work is.
const INTERVAL: Duration = Duration::from_millis(50);

/// Says that the work is over, even if it ends in a panic.
struct Finish<'a> {
    done: &'a AtomicBool,
    waiting: Thread,
}

impl Drop for Finish<'_> {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Release);
        self.waiting.unpark();
    }
}

/// Runs `work` on a thread of its own. Meanwhile, without holding the interpreter, waits; a signal (Ctrl-C) or an exception
/// in `progress` cancels the work and becomes the result.
///
/// - `progress`: called with the share of the work that is done, from 0 to 1, as it grows.
/// - `fraction`: that share.
pub fn watch<T: Send>(
    py: Python,
    control: &Control,
    progress: Option<&Bound<PyAny>>,
    fraction: impl Fn() -> f64,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let done = AtomicBool::new(false);
    let waiting = std::thread::current();
    std::thread::scope(|scope| {
        let done = &done;
        let worker = scope.spawn(move || {
            let _finish = Finish { done, waiting };
            work()
        });
        let mut told = -1.0;
        let mut report = |share: f64| {
            if let Some(progress) = progress
                && share > told
            {
                told = share;
                progress.call1((share.min(1.0),))?;
            }
            Ok(())
        };
        let mut interruption = None;
        while !done.load(Ordering::Acquire) {
            py.detach(|| std::thread::park_timeout(INTERVAL));
            if interruption.is_none()
                && let Err(error) = py.check_signals().and_then(|()| report(fraction()))
            {
                control.cancel();
                interruption = Some(error);
            }
        }
        let result = py.detach(|| worker.join());
        if let Some(interruption) = interruption {
            return Err(interruption);
        }
        // The panic's own text has gone to stderr.
        let result =
            result.map_err(|_| Error::new_err("internal error, please report it: a thread panicked"))?;
        report(1.0)?;
        Ok(result)
    })
}
