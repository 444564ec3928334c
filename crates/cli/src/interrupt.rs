//! Signals that stop a command: Ctrl-C, SIGTERM, SIGHUP, and on Windows CTRL_BREAK and the closing of the console.

use crate::exit::Exit;
use alhazen::Control;
use std::sync::Arc;

/// A control that a signal cancels: what there is will be written. A second signal ends the process at once.
///
/// SIGHUP is left alone where it is ignored (`nohup`).
pub fn cancel_on_signal() -> Arc<Control> {
    let control = Arc::new(Control::new());
    let handle = control.clone();
    listen(move || {
        if handle.is_cancelled() {
            std::process::exit(Exit::Stopped as i32);
        }
        handle.cancel();
    });
    control
}

/// Ends the process with a code of its own where the allocator has no more memory. Rust has said by then how many bytes it
/// asked for; what is left is an exit instead of a crash.
pub fn exit_when_memory_ends() {
    #[cfg(unix)]
    {
        let always = Arc::new(std::sync::atomic::AtomicBool::new(true));
        let (signal, code) = (signal_hook::consts::SIGABRT, Exit::Memory as i32);
        // Without the handler the process still ends; only its code says less.
        let _ = signal_hook::flag::register_conditional_shutdown(signal, code, always);
    }
}

#[cfg(unix)]
fn listen(stop: impl Fn() + Send + 'static) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let signals = [Some(SIGINT), Some(SIGTERM), (!hangup_is_ignored()).then_some(SIGHUP)];
    // Without a handler a signal still ends the program; it only keeps nothing.
    if let Ok(mut signals) = signal_hook::iterator::Signals::new(signals.into_iter().flatten()) {
        std::thread::spawn(move || signals.forever().for_each(|_| stop()));
    }
}

/// Whether whoever started this process does not want it to hear that the terminal is gone.
#[cfg(unix)]
fn hangup_is_ignored() -> bool {
    const SIGHUP_BIT: u64 = 1;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    ignored.is_some_and(|mask| mask & SIGHUP_BIT != 0)
}

#[cfg(not(unix))]
fn listen(stop: impl Fn() + Send + 'static) {
    // As above.
    let _ = ctrlc::set_handler(stop);
}
