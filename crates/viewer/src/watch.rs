//! Noticing that the open file has changed.

use notify::{RecursiveMode, Watcher};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

/// A file is loaded again when nothing has happened to it for this long: editors write in pieces.
const QUIET: f64 = 0.3;

/// A file that is being watched.
pub struct Watch {
    // Watching ends with it.
    _watcher: notify::RecommendedWatcher,
    file: PathBuf,
    touched: Arc<AtomicBool>,
    /// What the file was when it was loaded.
    known: Option<(SystemTime, u64)>,
    /// When the last change was seen, seconds.
    changed_at: Option<f64>,
}

impl Watch {
    /// Watches a file; `wake` is called when something happens to it. `None` where the system cannot watch.
    pub fn start(file: &Path, wake: impl Fn() + Send + 'static) -> Option<Self> {
        let file = file.canonicalize().ok()?;
        let touched = Arc::new(AtomicBool::new(false));
        let (flag, name) = (touched.clone(), file.file_name()?.to_owned());
        let handler = move |event: notify::Result<notify::Event>| {
            let concerns = |e: notify::Event| {
                !e.kind.is_access() && e.paths.iter().any(|p| p.file_name() == Some(&name))
            };
            if event.is_ok_and(concerns) {
                flag.store(true, Ordering::Relaxed);
                wake();
            }
        };
        let mut watcher = notify::recommended_watcher(handler).ok()?;
        // Many programs replace files instead of writing to them: the folder is what stays.
        watcher.watch(file.parent()?, RecursiveMode::NonRecursive).ok()?;
        let known = fingerprint(&file);
        Some(Self { _watcher: watcher, file, touched, known, changed_at: None })
    }

    /// Whether the file has changed and is quiet again. `time` in seconds, from whatever beginning.
    pub fn has_changed(&mut self, time: f64) -> bool {
        if self.touched.swap(false, Ordering::Relaxed) {
            self.changed_at = Some(time);
        }
        if self.changed_at.is_none_or(|at| time - at < QUIET) {
            return false;
        }
        self.changed_at = None;
        let now = fingerprint(&self.file);
        let changed = now.is_some() && now != self.known;
        self.known = now;
        changed
    }

    /// When to look again, if a change is waiting for the file to be quiet.
    pub fn look_again(&self) -> Option<Duration> {
        let waits = self.changed_at.is_some() || self.touched.load(Ordering::Relaxed);
        waits.then_some(Duration::from_secs_f64(QUIET))
    }
}

fn fingerprint(file: &Path) -> Option<(SystemTime, u64)> {
    let metadata = std::fs::metadata(file).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_noticed_once_and_after_a_pause() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, "a").expect("written");
        let (wake, woken) = std::sync::mpsc::channel();
        let mut watch = Watch::start(&path, move || {
            let _ = wake.send(());
        })
        .expect("inotify");
        assert!(!watch.has_changed(0.0));
        std::fs::write(&path, "longer").expect("written");
        woken.recv_timeout(Duration::from_secs(10)).expect("the system tells");
        // Events of one write come in several pieces.
        while woken.recv_timeout(Duration::from_millis(100)).is_ok() {}
        assert!(!watch.has_changed(1.0), "not quiet yet");
        assert!(watch.look_again().is_some());
        assert!(watch.has_changed(1.0 + 2.0 * QUIET));
        assert!(!watch.has_changed(3.0));
    }
}
