//! Doing the same again and again, to see whether anything is left behind.

/// What the process holds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    bytes: u64,
    files: usize,
}

impl Held {
    fn now() -> Self {
        let (bytes, files) = (alhazen::memory_bytes(), alhazen::open_files());
        Self { bytes: bytes.unwrap_or(0), files: files.unwrap_or(0) }
    }
}

/// Rounds at least: slow machines make few in the time that they have.
const LEAST: u32 = 6;

/// Rounds of a script.
#[derive(Clone, Debug)]
pub(super) struct Rounds {
    begun: f64,
    count: u32,
    /// After the first third of the time and of the rounds, when all that is allocated once is there.
    settled: Option<Held>,
}

impl Rounds {
    /// Begins at `time`, seconds.
    pub fn new(time: f64) -> Self {
        Self { begun: time, count: 0, settled: None }
    }

    /// A round ends at `time`. What all of them left, once they have taken `seconds`; before, `None`.
    pub fn end_of_one(&mut self, time: f64, seconds: f64) -> Option<String> {
        self.count += 1;
        let elapsed = time - self.begun;
        if self.settled.is_none() && elapsed >= seconds / 3.0 && self.count >= LEAST / 3 {
            self.settled = Some(Held::now());
        }
        let before = self.settled.filter(|_| elapsed >= seconds && self.count >= LEAST)?;
        let after = Held::now();
        let growth = 100.0 * (after.bytes as f64 / before.bytes.max(1) as f64 - 1.0);
        Some(format!(
            "rounds: {} in {elapsed:.0} s, files {} to {}, memory {} to {} bytes, {growth:+.2} %",
            self.count, before.files, after.files, before.bytes, after.bytes
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_end_after_their_time() {
        let mut rounds = Rounds::new(10.0);
        assert!(rounds.end_of_one(11.0, 9.0).is_none() && rounds.settled.is_none());
        assert!(rounds.end_of_one(12.0, 9.0).is_none() && rounds.settled.is_none());
        assert!(rounds.end_of_one(14.0, 9.0).is_none() && rounds.settled.is_some());
        assert!(rounds.end_of_one(20.0, 9.0).is_none() && rounds.end_of_one(21.0, 9.0).is_none(), "too few");
        let report = rounds.end_of_one(21.5, 9.0).expect("the time is over");
        assert!(report.starts_with("rounds: 6 in 12 s, files "), "{report}");
    }
}
