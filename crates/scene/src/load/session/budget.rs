//! What one scene may take of memory and time, through every loader.

use crate::LoadError;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use web_time::Instant;

/// Counts what a scene will take until it is rendered: its files, its objects, and their rows in tables and
/// acceleration structures.
///
/// Whatever goes over a limit is remembered, so that code that cannot fail may go on with less; the call as a whole
/// fails.
#[derive(Debug)]
pub(crate) struct Budget {
    scene: PathBuf,
    limit: u64,
    used: AtomicU64,
    end: Option<(Instant, Duration)>,
    exceeded: OnceLock<Exceeded>,
}

/// What went over a limit first.
#[derive(Clone, Debug)]
enum Exceeded {
    Memory {
        what: String,
        size: u64,
    },
    Time,
    /// The system had no more.
    Refused {
        what: String,
        size: u64,
    },
}

impl Budget {
    /// A budget of `limit` bytes and, from now on, `time`.
    pub fn new(scene: &Path, limit: u64, time: Option<Duration>) -> Self {
        let end = time.and_then(|time| Some((Instant::now().checked_add(time)?, time)));
        Self { scene: scene.to_owned(), limit, end, ..Self::unlimited() }
    }

    /// A budget that is never used up.
    pub const fn unlimited() -> Self {
        Self {
            scene: PathBuf::new(),
            limit: u64::MAX,
            used: AtomicU64::new(0),
            end: None,
            exceeded: OnceLock::new(),
        }
    }

    /// Takes `bytes` for `what`, a word in the plural, before they are allocated; and looks at the clock.
    ///
    /// # Errors
    /// [`LoadError::OverBudget`], [`LoadError::TookTooLong`].
    pub fn take(&self, bytes: u64, what: &str) -> Result<(), LoadError> {
        self.check_time()?;
        let used = self.used.fetch_add(bytes.min(1 << 60), Ordering::Relaxed);
        let size = used.saturating_add(bytes);
        if size > self.limit {
            // What was not allocated leaves room for what is smaller.
            self.used.fetch_sub(bytes.min(1 << 60), Ordering::Relaxed);
            let _ = self.exceeded.set(Exceeded::Memory { what: what.into(), size }); // the first counts
        }
        self.outcome()
    }

    /// Whether there is room for `bytes` for a moment, which are given back. Where what is made is counted once it is known.
    ///
    /// # Errors
    /// As [`Budget::take`].
    pub fn check_room(&self, bytes: u64, what: &str) -> Result<(), LoadError> {
        self.take(bytes, what)?;
        self.used.fetch_sub(bytes.min(1 << 60), Ordering::Relaxed);
        Ok(())
    }

    /// Looks at the clock.
    ///
    /// # Errors
    /// [`LoadError::TookTooLong`], and what went over a limit before.
    pub fn check_time(&self) -> Result<(), LoadError> {
        if self.end.is_some_and(|(end, _)| Instant::now() > end) {
            let _ = self.exceeded.set(Exceeded::Time);
        }
        self.outcome()
    }

    /// The error for `size` bytes that the system did not give.
    pub fn no_memory(&self, size: u64, what: &str) -> LoadError {
        let _ = self.exceeded.set(Exceeded::Refused { what: what.into(), size });
        self.outcome().err().unwrap_or(LoadError::OutOfMemory {
            path: self.scene.clone(),
            what: what.into(),
            size,
        })
    }

    /// What went over a limit, if anything did.
    pub fn outcome(&self) -> Result<(), LoadError> {
        let path = || self.scene.clone();
        match self.exceeded.get() {
            None => Ok(()),
            Some(Exceeded::Memory { what, size }) => {
                let (what, size, limit) = (what.clone(), *size, self.limit);
                Err(LoadError::OverBudget { path: path(), what, size, limit })
            }
            Some(Exceeded::Time) => {
                let limit = self.end.map_or(Duration::ZERO, |(_, limit)| limit);
                Err(LoadError::TookTooLong { path: path(), limit })
            }
            Some(Exceeded::Refused { what, size }) => {
                Err(LoadError::OutOfMemory { path: path(), what: what.clone(), size: *size })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_exceeds_is_named_and_remembered() {
        let budget = Budget::new(Path::new("a.toml"), 1000, None);
        assert!(budget.take(600, "images").is_ok());
        let error = budget.take(600, "instances").expect_err("1200 of 1000").to_string();
        assert!(
            error.contains("instances") && error.contains("1200") && error.contains("--max-memory"),
            "{error}"
        );
        assert_eq!(budget.outcome().expect_err("remembered").to_string(), error);
    }

    #[test]
    fn room_is_given_back() {
        let budget = Budget::new(Path::new("a.toml"), 1000, None);
        assert!((0..5).all(|_| budget.check_room(900, "triangles").is_ok()));
        assert!(budget.take(1000, "triangles").is_ok() && budget.check_room(1, "triangles").is_err());
    }

    #[test]
    fn huge_numbers_do_not_wrap() {
        let budget = Budget::new(Path::new("a.toml"), u64::MAX - 1, None);
        for _ in 0..3 {
            let _ = budget.take(u64::MAX, "triangles");
        }
        assert!(budget.outcome().is_err());
    }

    #[test]
    fn time_runs_out() {
        let budget = Budget::new(Path::new("a.toml"), 1000, Some(Duration::ZERO));
        std::thread::sleep(Duration::from_millis(2));
        let error = budget.check_time().expect_err("no time").to_string();
        assert!(error.contains("--max-load-time"), "{error}");
    }
}
