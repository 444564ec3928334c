//! How long it takes until a picture shows what was done.

use std::collections::VecDeque;

/// Frames and seconds from each change to the first picture that shows it.
#[derive(Clone, Debug, Default)]
pub struct Latency {
    /// Changes that no picture shows yet: which, the frame in which it was made, and when.
    waiting: VecDeque<(u64, u64, f64)>,
    /// The last frame, and when it was.
    last: Option<(u64, f64)>,
    /// How many changes there were then.
    changes: u64,
    /// Frames and seconds that passed.
    passed: Vec<(u64, f64)>,
}

impl Latency {
    /// At the beginning of each frame.
    ///
    /// - `frame`: its number. `time`: seconds. `changes`: made up to the end of the last frame.
    /// - `shown`: how many of them the newest picture shows, which this frame draws.
    pub fn frame(&mut self, frame: u64, time: f64, changes: u64, shown: u64) {
        if let Some((last_frame, last_time)) = self.last
            && changes > self.changes
        {
            self.waiting.push_back((changes, last_frame, last_time));
        }
        (self.last, self.changes) = (Some((frame, time)), changes);
        while let Some(&(change, made_in, made_at)) = self.waiting.front()
            && change <= shown
        {
            self.passed.push((frame - made_in, time - made_at));
            self.waiting.pop_front();
        }
    }

    /// Median and 95th percentile, in words; nothing if no change was ever shown.
    pub fn report(&self) -> Option<String> {
        let mut passed = self.passed.clone();
        passed.sort_by(|a, b| a.1.total_cmp(&b.1));
        let last = passed.len().checked_sub(1)?;
        let at = |share: f64| passed[((passed.len() as f64 * share) as usize).min(last)];
        let ((frames, seconds), (late_frames, late_seconds)) = (at(0.5), at(0.95));
        Some(format!(
            "latency: {frames} frames or {:.0} ms from input to picture, 95 % within {late_frames} frames or {:.0} ms",
            seconds * 1e3,
            late_seconds * 1e3
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Changes that a picture passes over count until the picture that contains them.
    #[test]
    fn changes_wait_for_the_first_picture_with_them() {
        let mut latency = Latency::default();
        let rows = [(1, 0, 0), (2, 1, 0), (3, 2, 1), (4, 2, 1), (5, 3, 3)];
        for (frame, changes, shown) in rows {
            latency.frame(frame, frame as f64 * 0.01, changes, shown);
        }
        let frames: Vec<_> = latency.passed.iter().map(|p| p.0).collect();
        // Made in frames 1, 2 and 4; shown in 3, 5 and 5.
        assert_eq!(frames, [2, 3, 1]);
        assert!(latency.waiting.is_empty());
        let report = latency.report().expect("changes were shown");
        assert!(report.starts_with("latency: 2 frames or 20 ms") && report.contains("3 frames"), "{report}");
        assert_eq!(Latency::default().report(), None);
    }
}
