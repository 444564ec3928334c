//! What a loader noticed: nothing that changes the picture happens in silence.

use std::fmt;
use std::time::Duration;

/// How much a note matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing; the picture is what the file asked for.
    Info,
    /// Wrong or missing data was mended; the picture should be what the author meant.
    Repaired,
    /// Something is rendered by a simpler means than the file asked for.
    Approximated,
    /// Something in the file has no effect on the picture.
    Ignored,
}

/// One thing a loader noticed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// How much it matters.
    pub severity: Severity,
    /// The object and the reason, as a sentence without a full stop.
    pub message: String,
    /// How often the same thing was noticed.
    pub count: usize,
}

/// Everything a loader noticed, and how long it took.
#[derive(Clone, Debug, Default)]
pub struct LoadReport {
    /// Notes in order of first appearance; equal messages are counted, not repeated.
    pub notes: Vec<Note>,
    /// Wall time of loading.
    pub elapsed: Duration,
    /// Bytes read from files.
    pub bytes_read: u64,
}

/// Beyond this many distinct notes only the count of the last kind grows, so that a broken file cannot fill memory.
const MAX_NOTES: usize = 200;

impl LoadReport {
    /// Adds a note, or counts it if the same one is there already.
    pub fn note(&mut self, severity: Severity, message: impl Into<String>) {
        let message = message.into();
        if let Some(known) = self.notes.iter_mut().find(|n| n.severity == severity && n.message == message) {
            known.count += 1;
        } else if self.notes.len() < MAX_NOTES {
            self.notes.push(Note { severity, message, count: 1 });
        } else if let Some(last) = self.notes.last_mut() {
            last.severity = last.severity.max(severity);
            last.message = "further notes were left out".into();
            last.count += 1;
        }
    }

    /// Adds a note of [`Severity::Info`].
    pub fn info(&mut self, message: impl Into<String>) {
        self.note(Severity::Info, message);
    }

    /// Adds a note of [`Severity::Repaired`].
    pub fn repaired(&mut self, message: impl Into<String>) {
        self.note(Severity::Repaired, message);
    }

    /// Adds a note of [`Severity::Approximated`].
    pub fn approximated(&mut self, message: impl Into<String>) {
        self.note(Severity::Approximated, message);
    }

    /// Adds a note of [`Severity::Ignored`].
    pub fn ignored(&mut self, message: impl Into<String>) {
        self.note(Severity::Ignored, message);
    }

    /// Takes over the notes of a file that was loaded on behalf of this one, prefixed with its name.
    pub fn absorb(&mut self, name: &str, other: LoadReport) {
        self.bytes_read += other.bytes_read;
        for note in other.notes {
            self.note(note.severity, format!("{name}: {}", note.message));
        }
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Severity::Info => "info",
            Severity::Repaired => "repaired",
            Severity::Approximated => "approximated",
            Severity::Ignored => "ignored",
        })
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.severity, self.message)?;
        if self.count > 1 {
            write!(f, " ({} times)", self.count)?;
        }
        Ok(())
    }
}
