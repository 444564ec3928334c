//! What people see: errors, progress, numbers with units.

use crate::exit::Exit;
use alhazen::output::Failed;
use alhazen::{Control, ImageError, LoadReport, Severity};
use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::borrow::Cow;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Prints a line to stderr, for people. A stderr that is closed or full is no reason to stop.
macro_rules! say {
    ($($text:tt)*) => { $crate::console::print_line(format_args!($($text)*)) };
}
pub(crate) use say;

/// See [`say`].
pub fn print_line(text: std::fmt::Arguments) {
    // There is nowhere to tell that it failed.
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Prints an error and everything that led to it.
pub fn print_error(error: &anyhow::Error) {
    say!("error: {error}");
    error.chain().skip(1).for_each(|cause| say!("  because: {cause}"));
}

/// Writes the result of a command to stdout. A reader that has seen enough (`alhazen info x | head`) is no error.
pub fn print_result(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot write to stdout").map_err(|error| Exit::Output.with(error)),
    }
}

/// JSON on one line, whose names of a file's author steer no terminal: what would is escaped as JSON does it.
pub fn json_line(json: &serde_json::Value) -> String {
    let steers = |c: char| matches!(alhazen::plain(c.encode_utf8(&mut [0; 4])), Cow::Owned(_));
    let mut line = String::new();
    for c in json.to_string().chars() {
        // All that are escaped have four digits.
        if steers(c) { line += &format!("\\u{:04x}", u32::from(c)) } else { line.push(c) }
    }
    line + "\n"
}

/// Writes a text file: complete, or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<(), ImageError> {
    let failed = |source| ImageError::Write { path: path.to_owned(), source };
    alhazen::write_atomically(path, |writer| writer.write_all(text.as_bytes()).map_err(failed))
}

/// Writes outputs by `write`, each even if others fail. An error says where those are kept that could not be written where
/// they were asked for.
pub fn keep_each(paths: &[PathBuf], write: impl Fn(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let failed = alhazen::output::write_each(paths, write);
    let mut last = None;
    for Failed { path, error, kept } in failed {
        if let Some(earlier) = last.take() {
            print_error(&earlier);
        }
        let path = path.display();
        last = Some(match kept {
            Some(kept) => error.context(format!("could not write {path}; it is kept as {}", kept.display())),
            None => error.context(format!("could not write {path}, nor keep it anywhere else")),
        });
    }
    last.map_or(Ok(()), |error| Err(Exit::Output.with(error)))
}

/// Prints what a loader noticed, the harmless only if `verbose`.
pub fn print_report(report: &LoadReport, verbose: bool) {
    for note in &report.notes {
        if verbose || note.severity > Severity::Info {
            say!("  {note}");
        }
    }
}

/// A number with a metric prefix and three digits: 12.3 M.
pub fn metric(x: f64) -> String {
    let units = [(1e12, " T"), (1e9, " G"), (1e6, " M"), (1e3, " k")];
    let (factor, unit) = units.into_iter().find(|(factor, _)| x >= *factor).unwrap_or((1.0, " "));
    let scaled = x / factor;
    let digits = if scaled < 10.0 { 2 } else { usize::from(scaled < 100.0) };
    format!("{scaled:.digits$}{unit}")
}

/// Bytes in binary units.
pub fn bytes(n: u64) -> String {
    let mebibytes = n as f64 / (1 << 20) as f64;
    match n {
        0..=1023 => format!("{n} bytes"),
        1024..0x10_0000 => format!("{:.1} KiB", n as f64 / 1024.0),
        0x10_0000..0x4000_0000 => format!("{mebibytes:.1} MiB"),
        _ => format!("{:.2} GiB", mebibytes / 1024.0),
    }
}

/// A duration for people.
pub fn seconds(d: Duration) -> String {
    let s = d.as_secs_f64();
    if s < 1.0 {
        format!("{:.0} ms", s * 1e3)
    } else if s < 120.0 {
        format!("{s:.2} s")
    } else {
        format!("{}:{:02} min", s as u64 / 60, s as u64 % 60)
    }
}

/// A progress bar on the terminal, fed by a thread that watches a [`Control`].
pub struct ProgressDisplay {
    bar: ProgressBar,
    done: Arc<AtomicBool>,
    watcher: Option<JoinHandle<()>>,
}

impl ProgressDisplay {
    /// Starts to watch. `total`: samples that the whole picture will take at most, all pixels together; `base` is the
    /// number that earlier calls have done, set through [`ProgressDisplay::set_base`].
    pub fn new(control: Arc<Control>, total: u64, quiet: bool) -> Self {
        let bar = ProgressBar::new(total);
        if quiet {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template("{spinner} {percent:>3} % {wide_bar} {msg} {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let done = Arc::new(AtomicBool::new(false));
        let watcher = (!quiet).then(|| {
            let (bar, done) = (bar.clone(), done.clone());
            std::thread::spawn(move || watch(&bar, &control, &done))
        });
        Self { bar, done, watcher }
    }

    /// Ends the display.
    pub fn finish(mut self) {
        self.stop();
    }

    fn stop(&mut self) {
        self.done.store(true, Ordering::Relaxed);
        if let Some(watcher) = self.watcher.take() {
            // A watcher that panicked has nothing left to show.
            let _ = watcher.join();
        }
        self.bar.finish_and_clear();
    }
}

impl Drop for ProgressDisplay {
    fn drop(&mut self) {
        self.stop();
    }
}

fn watch(bar: &ProgressBar, control: &Control, done: &AtomicBool) {
    let start = Instant::now();
    let (mut finished, mut last) = (0, 0);
    while !done.load(Ordering::Relaxed) {
        let now = control.progress().samples_done;
        // Each pass counts from zero again.
        if now < last {
            finished += last;
        }
        last = now;
        bar.set_position(finished + now);
        let rate = (finished + now) as f64 / start.elapsed().as_secs_f64().max(1e-3);
        bar.set_message(format!("{}samples/s", metric(rate)));
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_steers_no_terminal() {
        let name = "a\u{1b}[31m\u{7f}\u{9b}\u{202e}é";
        let line = json_line(&serde_json::json!({ "name": name }));
        assert_eq!(line, "{\"name\":\"a\\u001b[31m\\u007f\\u009b\\u202eé\"}\n");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&line).expect("JSON")["name"], name);
    }

    #[test]
    fn numbers_have_units() {
        assert_eq!(metric(0.0), "0.00 ");
        assert_eq!(metric(12_345_678.0), "12.3 M");
        assert_eq!(metric(999.0), "999 ");
        assert_eq!((bytes(0).as_str(), bytes(1536).as_str()), ("0 bytes", "1.5 KiB"));
        assert_eq!(bytes(3 << 20), "3.0 MiB");
        assert_eq!(bytes(3 << 30), "3.00 GiB");
        assert_eq!(seconds(Duration::from_millis(12)), "12 ms");
        assert_eq!(seconds(Duration::from_secs(125)), "2:05 min");
    }
}
