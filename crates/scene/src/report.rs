//! What a loader noticed: nothing that changes the picture happens in silence.

use std::borrow::Cow;
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

/// Text of a file as messages show it: characters that steer terminals or turn the direction of writing are escaped.
pub fn plain(text: &str) -> Cow<'_, str> {
    let steers = |c: char| {
        c.is_control()
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if steers(c) { out.extend(c.escape_default()) } else { out.push(c) }
    }
    Cow::Owned(out)
}

/// A message without what it quotes: everything from the first quotation mark to the last.
pub(crate) fn without_quotes(message: &str) -> String {
    let is_quote = |c: char| matches!(c, '`' | '"' | '\'');
    match (message.find(is_quote), message.rfind(is_quote)) {
        (Some(first), Some(last)) if first < last => {
            format!("{}`…`{}", &message[..first], &message[last + 1..])
        }
        _ => message.to_owned(),
    }
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
    /// Images that are missing or broken: a neutral colour stands in for each.
    pub missing_images: usize,
    /// Primitives of points and lines, which are left out.
    pub undrawn_primitives: usize,
}

/// Beyond this many distinct notes only the count of the last kind grows, so that a broken file cannot fill memory.
const MAX_NOTES: usize = 200;

impl LoadReport {
    /// Adds a note, or counts it if the same one is there already.
    pub fn note(&mut self, severity: Severity, message: impl Into<String>) {
        let message = message.into();
        let message = match plain(&message) {
            Cow::Borrowed(_) => message,
            Cow::Owned(escaped) => escaped,
        };
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
        self.missing_images += other.missing_images;
        self.undrawn_primitives += other.undrawn_primitives;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_are_not_steered() {
        assert_eq!(plain("a\u{1b}[31mb\n"), "a\\u{1b}[31mb\\n");
        assert_eq!(plain("Köln `x`"), "Köln `x`");
        let mut report = LoadReport::default();
        report.ignored("material \u{202e}gnp");
        assert_eq!(report.notes[0].message, "material \\u{202e}gnp");
    }

    #[test]
    fn quotes_are_cut_from_the_first_to_the_last() {
        assert_eq!(without_quotes("found `a`b`, expected \"c\" here"), "found `…` here");
        assert_eq!(without_quotes("the file ends"), "the file ends");
    }
}
