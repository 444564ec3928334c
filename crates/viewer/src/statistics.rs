//! How fast it all is, over time.

use crate::worker::PassReport;
use serde::Serialize;
use std::collections::VecDeque;
use std::fmt::Write;

/// So many frames are kept.
const FRAMES: usize = 600;

/// A frame of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Frame {
    /// Seconds since the start.
    pub time: f64,
    /// Milliseconds since the frame before.
    pub frame_ms: f32,
    /// Milliseconds that the window's thread worked on it.
    pub ui_ms: f32,
}

/// A pass of the render thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PassTime {
    /// Seconds since the start, when it was seen.
    pub time: f64,
    /// Milliseconds of rendering.
    pub render_ms: f32,
    /// Milliseconds of fetching the film and making display values.
    pub show_ms: f32,
    /// Samples a second, all pixels together.
    pub samples_per_second: f64,
    /// Rays a second.
    pub rays_per_second: f64,
    /// Resident memory of the process, bytes.
    pub memory_bytes: u64,
}

/// Recent frames and passes.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Statistics {
    /// Of the window.
    pub frames: VecDeque<Frame>,
    /// Of the render thread.
    pub passes: VecDeque<PassTime>,
    /// The device's passes by name, in milliseconds, of the last pass.
    pub device: Vec<(String, f64)>,
}

impl Statistics {
    /// Notes a frame.
    pub fn frame(&mut self, time: f64, ui_ms: f32) {
        let before = self.frames.back().map_or(time, |f| f.time);
        push(&mut self.frames, Frame { time, frame_ms: ((time - before) * 1e3) as f32, ui_ms });
    }

    /// Notes a pass.
    pub fn pass(&mut self, time: f64, report: &PassReport) {
        let seconds = report.render.as_secs_f64().max(1e-9);
        let pass = PassTime {
            time,
            render_ms: (report.render.as_secs_f64() * 1e3) as f32,
            show_ms: (report.show.as_secs_f64() * 1e3) as f32,
            samples_per_second: report.samples as f64 / seconds,
            rays_per_second: report.rays as f64 / seconds,
            memory_bytes: alhazen::memory_bytes().unwrap_or(0),
        };
        push(&mut self.passes, pass);
        self.device.clear();
        for timed in &report.device {
            let ms = timed.duration.as_secs_f64() * 1e3;
            match self.device.iter_mut().find(|(name, _)| name == timed.name) {
                Some((_, sum)) => *sum += ms,
                None => self.device.push((timed.name.to_owned(), ms)),
            }
        }
    }

    /// Frames of the window a second, over the last second that had any.
    pub fn frames_per_second(&self) -> f64 {
        rate(self.frames.iter().map(|f| f.time))
    }

    /// Pictures of the render thread a second.
    pub fn passes_per_second(&self) -> f64 {
        rate(self.passes.iter().map(|p| p.time))
    }

    /// A line a pass: time, times, speeds, memory.
    pub fn to_csv(&self) -> String {
        let mut text = "time_s,render_ms,show_ms,samples_per_s,rays_per_s,memory_bytes\n".to_owned();
        for p in &self.passes {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{:.4},{:.3},{:.3},{:.0},{:.0},{}",
                p.time, p.render_ms, p.show_ms, p.samples_per_second, p.rays_per_second, p.memory_bytes
            );
        }
        text
    }

    /// Everything as JSON.
    ///
    /// # Errors
    /// Never in practice: there are only numbers and names.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }
}

fn push<T>(all: &mut VecDeque<T>, new: T) {
    if all.len() == FRAMES {
        all.pop_front();
    }
    all.push_back(new);
}

/// Events a second in the second before the last event.
fn rate(times: impl DoubleEndedIterator<Item = f64>) -> f64 {
    let mut backwards = times.rev();
    let Some(last) = backwards.next() else { return 0.0 };
    let recent: Vec<f64> = backwards.take_while(|t| last - t <= 1.0).collect();
    match recent.last() {
        Some(first) if last > *first => recent.len() as f64 / (last - first),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn rates_are_of_the_last_second() {
        let mut s = Statistics::default();
        (0..10).for_each(|i| s.frame(f64::from(i), 1.0));
        (0..50).for_each(|i| s.frame(10.0 + f64::from(i) * 0.02, 1.0));
        assert!((s.frames_per_second() - 50.0).abs() < 1.0, "{}", s.frames_per_second());
        assert_eq!(Statistics::default().frames_per_second(), 0.0);
        (0..2000).for_each(|i| s.frame(20.0 + f64::from(i), 1.0));
        assert_eq!(s.frames.len(), FRAMES);
    }

    #[test]
    fn exports_have_all_passes() {
        let mut s = Statistics::default();
        let report = PassReport { samples: 500, render: Duration::from_millis(250), ..Default::default() };
        s.pass(1.0, &report);
        s.pass(2.0, &report);
        assert_eq!(s.to_csv().lines().count(), 3);
        assert!(s.to_csv().contains(",250.000,0.000,2000,0,"), "{}", s.to_csv());
        let json: serde_json::Value = serde_json::from_str(&s.to_json().expect("numbers")).expect("JSON");
        assert_eq!(json["passes"][1]["samples_per_second"], 2000.0);
    }
}
