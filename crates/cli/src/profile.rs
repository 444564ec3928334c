//! Profiles in the format of Chrome's trace viewer (`chrome://tracing`, Perfetto).

use crate::console::write_text;
use alhazen::PassTime;
use anyhow::Context;
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// What happened when, on the host and on the device.
pub struct Profile {
    start: Instant,
    events: Vec<Value>,
}

/// Process number of the host's events; the device's is the next.
const HOST: u32 = 1;
const DEVICE: u32 = 2;

impl Profile {
    /// Begins now.
    pub fn new() -> Self {
        let name = |pid: u32, name: &str| json!({ "ph": "M", "pid": pid, "name": "process_name", "args": { "name": name } });
        Self { start: Instant::now(), events: vec![name(HOST, "host"), name(DEVICE, "device")] }
    }

    /// Adds a span of the host that began at `begin` and ends now.
    pub fn span(&mut self, name: &str, begin: Instant) {
        let start = begin.saturating_duration_since(self.start);
        self.events.push(event(HOST, name, start, begin.elapsed()));
    }

    /// Adds passes of the device. The device has a clock of its own: its first pass begins where `begin` is.
    pub fn passes(&mut self, passes: &[PassTime], begin: Instant) {
        let offset = begin.saturating_duration_since(self.start);
        let first = passes.first().map_or(Duration::ZERO, |p| p.start);
        for pass in passes {
            let start = offset + pass.start.saturating_sub(first);
            self.events.push(event(DEVICE, pass.name, start, pass.duration));
        }
    }

    /// Writes the file.
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = json!({ "traceEvents": self.events }).to_string();
        write_text(path, &text).with_context(|| format!("cannot write the profile {}", path.display()))
    }
}

/// A complete event; times in microseconds.
fn event(pid: u32, name: &str, start: Duration, duration: Duration) -> Value {
    let microseconds = |d: Duration| d.as_secs_f64() * 1e6;
    json!({
        "ph": "X", "pid": pid, "tid": 1, "name": name, "ts": microseconds(start), "dur": microseconds(duration),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_device_begins_where_the_host_says() {
        let mut profile = Profile::new();
        let begin = profile.start + Duration::from_millis(3);
        let pass = |start: u64| PassTime {
            name: "path",
            start: Duration::from_millis(start),
            duration: Duration::from_millis(2),
        };
        profile.passes(&[pass(10), pass(14)], begin);
        let times: Vec<_> =
            profile.events.iter().filter(|e| e["ph"] == "X").map(|e| e["ts"].as_f64()).collect();
        assert_eq!(times, [Some(3000.0), Some(7000.0)]);
    }
}
