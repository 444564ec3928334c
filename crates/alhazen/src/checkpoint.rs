//! Saving an unfinished picture again and again, so that little is lost when the machine is.

use film::{Part, PartError};
use std::path::{Path, PathBuf};
use std::time::Duration;
use web_time::Instant;

/// A file that holds what there is of a picture, and when to write it.
///
/// The file is a [`Part`]. It is replaced whole or not at all, so it can be read whenever the process dies. To go on, read
/// it with [`Checkpoint::load`] and hand it to [`crate::Renderer::render_part`].
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    every: Duration,
    last: Instant,
    /// Samples per pixel and second of the last pass.
    rate: Option<f64>,
    /// Who hears of checkpoints that could not be written.
    on_failure: fn(&Path, &PartError, Option<&Path>),
}

impl Checkpoint {
    /// A checkpoint at `path`, to be written about every `every`. Nothing is written yet.
    ///
    /// Shorter intervals than a pass of one sample per pixel takes are not possible.
    pub fn new(path: impl Into<PathBuf>, every: Duration) -> Self {
        Self { path: path.into(), every, last: Instant::now(), rate: None, on_failure: |_, _, _| {} }
    }

    /// With `tell` to hear of checkpoints that cannot be written: the file, the reason, and where it was kept instead, if
    /// anywhere. Rendering goes on.
    #[must_use]
    pub fn on_failure(self, tell: fn(&Path, &PartError, Option<&Path>)) -> Self {
        Self { on_failure: tell, ..self }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the file holds; `None` if there is no such file. Removes what a process has left behind that died while it
    /// was writing.
    ///
    /// # Errors
    /// When the file is there but is no part, or damaged.
    pub fn load(&self) -> Result<Option<Part>, PartError> {
        film::remove_temporaries(&self.path);
        if self.path.exists() { Part::read(&self.path).map(Some) } else { Ok(None) }
    }

    /// Replaces the file.
    ///
    /// # Errors
    /// When it cannot be written; the old contents are then still there.
    pub fn save(&mut self, part: &Part) -> Result<(), PartError> {
        part.write(&self.path)?;
        self.last = Instant::now();
        Ok(())
    }

    /// Replaces the file if that is possible. A failure must not end hours of work: it is told, and the next interval tries
    /// again.
    pub(crate) fn save_or_tell(&mut self, part: &Part) {
        if let Err(error) = self.save(part) {
            (self.on_failure)(&self.path, &error, None);
            self.last = Instant::now();
        }
    }

    /// Writes the last state. If the file cannot be replaced, it is kept elsewhere ([`crate::output::write_each`]).
    pub(crate) fn save_last(&mut self, part: &Part) {
        let path = self.path.clone();
        for failed in crate::output::write_each(&[path], |path| part.write(path)) {
            (self.on_failure)(&failed.path, &failed.error, failed.kept.as_deref());
        }
        self.last = Instant::now();
    }

    /// Whether it is time to write.
    pub(crate) fn is_due(&self) -> bool {
        self.last.elapsed() >= self.every
    }

    /// How many of `left` samples per pixel to render before it may be time to write.
    pub(crate) fn next_pass(&self, left: u32) -> u32 {
        // The first pass finds out how fast the machine is. A few samples are as efficient as many.
        let Some(rate) = self.rate else { return left.min(4) };
        // Half of the time that is left, so that the last of these passes ends soon after the interval.
        let time = self.every.saturating_sub(self.last.elapsed()).as_secs_f64();
        ((rate * time * 0.5) as u32).clamp(1, left.max(1))
    }

    /// Remembers how long a pass took.
    pub(crate) fn learn(&mut self, samples: u32, elapsed: Duration) {
        self.rate = Some(f64::from(samples) / elapsed.as_secs_f64().max(1e-6));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_written_is_kept_elsewhere_at_the_end() {
        use film::{Block, Coverage, Film, Rect};
        use std::sync::Mutex;
        static TOLD: Mutex<Vec<Option<PathBuf>>> = Mutex::new(Vec::new());
        let window = Rect::full(2, 2);
        let film = Film::with_window(2, 2, window, &[]).expect("small");
        let part = Part::new(film, Coverage::default(), Block { window, samples: 0..1 }).expect("empty");
        let folder = tempfile::tempdir().expect("a folder");
        let tell = |_: &Path, _: &PartError, kept: Option<&Path>| {
            TOLD.lock().expect("no panic").push(kept.map(Path::to_owned));
        };
        // There is no such folder any more.
        let mut checkpoint =
            Checkpoint::new(folder.path().join("gone/c.exr"), Duration::ZERO).on_failure(tell);
        checkpoint.save_or_tell(&part);
        checkpoint.save_last(&part);
        let told = TOLD.lock().expect("no panic");
        let [None, Some(kept)] = &told[..] else { panic!("{told:?}") };
        assert_eq!(Part::read(kept).expect("whole"), part);
        std::fs::remove_file(kept).expect("removed");
    }

    #[test]
    fn passes_end_near_the_interval() {
        let mut checkpoint = Checkpoint::new("unused", Duration::from_secs(1000));
        assert_eq!((checkpoint.next_pass(100), checkpoint.next_pass(2)), (4, 2));
        checkpoint.learn(4, Duration::from_secs(2));
        let samples = checkpoint.next_pass(100_000);
        assert!((900..=1000).contains(&samples), "{samples}");
        assert_eq!(checkpoint.next_pass(50), 50);
        assert!(!checkpoint.is_due());
        let slow = Checkpoint { every: Duration::ZERO, ..checkpoint };
        assert!(slow.is_due() && slow.next_pass(100) == 1);
    }
}
