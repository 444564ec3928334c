//! A file dialog of our own, for systems whose desktop has none, and for who prefers it. This is
//! its state; the panel `panels/browser.rs` shows it. Folders are listed by a thread, since disks
//! may be far away.

mod entries;
mod preview;

pub use entries::{Entry, list};
pub use preview::{Preview, Previews, SIDE};

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

/// Recent folders that are offered.
const MOST_RECENT: usize = 6;

/// What the user is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// The title of the dialog.
    pub title: &'static str,
    /// What the files are called that are wanted.
    pub kind: &'static str,
    /// How their names end, in lower case, without dots.
    pub endings: &'static [&'static str],
    /// The suggested name of a file that is to be written; `None`: a file is to be read.
    pub saves_as: Option<&'static str>,
}

/// A folder that is offered beside the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// What the user calls it.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
}

/// The state of a dialog.
pub struct Browser {
    /// What is asked for.
    pub request: Request,
    /// What was typed: the name of a file to be written; else part of the names to be listed, or a
    /// path.
    pub text: String,
    /// Show files of all kinds.
    pub all_kinds: bool,
    /// Show hidden files.
    pub hidden: bool,
    /// What the user should know.
    pub message: Option<String>,
    /// What files look like.
    pub previews: Previews,
    /// The preview that is shown, on the window's device, and whose it is.
    pub texture: Option<(PathBuf, egui::TextureHandle)>,
    folder: PathBuf,
    entries: Vec<Entry>,
    listing: Option<Receiver<std::io::Result<Vec<Entry>>>>,
    marked: Option<PathBuf>,
    /// A file that exists, and that the user has been warned of.
    warned_of: Option<PathBuf>,
    places: Vec<Place>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl Browser {
    /// A dialog that begins at `folder`.
    ///
    /// - `recent`: files that were used before, the last one first.
    /// - `wake`: is called when there is something new to show.
    pub fn new(
        request: Request,
        folder: &Path,
        recent: &[PathBuf],
        wake: Arc<dyn Fn() + Send + Sync>,
    ) -> Self {
        let mut browser = Self {
            request,
            text: request.saves_as.unwrap_or_default().to_owned(),
            all_kinds: false,
            hidden: false,
            message: None,
            previews: Previews::default(),
            texture: None,
            folder: PathBuf::new(),
            entries: Vec::new(),
            listing: None,
            marked: None,
            warned_of: None,
            places: places(recent),
            wake,
        };
        browser.go(folder);
        browser
    }

    /// The folder that is shown.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Folders that are offered.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Is called when there is something new to show.
    pub fn wake(&self) -> &Arc<dyn Fn() + Send + Sync> {
        &self.wake
    }

    /// Whether the folder is still being read.
    pub fn is_listing(&self) -> bool {
        self.listing.is_some()
    }

    /// Shows another folder.
    pub fn go(&mut self, folder: &Path) {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let (sender, listing) = channel();
        let (of_thread, wake) = (folder.clone(), self.wake.clone());
        let read = move || {
            // Who has gone elsewhere does not listen.
            let _ = sender.send(list(&of_thread));
            wake();
        };
        let started = std::thread::Builder::new().name("folder".into()).spawn(read);
        self.message = started.err().map(|error| format!("cannot read {}: {error}", folder.display()));
        (self.folder, self.listing) = (folder, Some(listing));
        (self.entries, self.marked, self.warned_of) = (Vec::new(), None, None);
    }

    /// Shows the folder above.
    pub fn up(&mut self) {
        if let Some(above) = self.folder.parent().map(Path::to_owned) {
            self.go(&above);
        }
    }

    /// Takes what the thread has found. Call once a frame.
    pub fn poll(&mut self) {
        let Some(result) = self.listing.as_ref().and_then(|listing| listing.try_recv().ok()) else { return };
        self.listing = None;
        match result {
            Ok(entries) => self.entries = entries,
            Err(error) => self.message = Some(format!("cannot read {}: {error}", self.folder.display())),
        }
    }

    /// What is listed: folders, and files of the kind that is wanted. Typed text narrows it where
    /// files are to be read.
    pub fn shown(&self) -> impl Iterator<Item = &Entry> {
        let typed = match self.request.saves_as {
            None if !is_path(&self.text) => self.text.to_lowercase(),
            _ => String::new(),
        };
        self.entries.iter().filter(move |entry| {
            (self.hidden || !entry.is_hidden())
                && (entry.is_folder || self.all_kinds || entry.ends_as(self.request.endings))
                && entry.name.to_lowercase().contains(&typed)
        })
    }

    /// What is marked in the list.
    pub fn marked(&self) -> Option<&Entry> {
        let marked = self.marked.as_ref()?;
        self.shown().find(|entry| entry.path == *marked)
    }

    /// Marks an entry. The name of a file to be written becomes that of a marked file.
    pub fn mark(&mut self, path: &Path) {
        self.marked = Some(path.to_owned());
        let name = self.marked().filter(|entry| !entry.is_folder).map(|entry| entry.name.clone());
        if let (Some(name), true) = (name, self.request.saves_as.is_some()) {
            self.text = name;
        }
    }

    /// Marks the entry so many places further down; the first one if none is marked.
    pub fn step(&mut self, down: isize) {
        let paths: Vec<PathBuf> = self.shown().map(|entry| entry.path.clone()).collect();
        let at = self.marked.as_ref().and_then(|marked| paths.iter().position(|path| path == marked));
        let next = match at {
            Some(at) => at.saturating_add_signed(down).min(paths.len().saturating_sub(1)),
            None => 0,
        };
        if let Some(path) = paths.get(next).cloned() {
            self.mark(&path);
        }
    }

    /// The file that the user has chosen, if what is typed and marked says one. Else goes to the
    /// folder that it says, or says what is missing. A file that exists has to be chosen twice to
    /// be written.
    pub fn accept(&mut self) -> Option<PathBuf> {
        match self.request.saves_as {
            Some(_) => self.accept_name(),
            None => self.accept_file(),
        }
    }

    fn accept_file(&mut self) -> Option<PathBuf> {
        let typed = typed_path(&self.folder, &self.text);
        if let Some(path) = typed.filter(|path| is_path(&self.text) || path.is_file()) {
            return self.open(&path);
        }
        // Where typing has left one entry, that is meant.
        let first = self.shown().next().filter(|_| !self.text.is_empty());
        let Some(path) = self.marked().or(first).map(|entry| entry.path.clone()) else {
            let folder = self.folder.display();
            self.message = Some(match self.text.is_empty() {
                true => "mark a file in the list, or type its name".into(),
                false => format!("{folder} has no file of that kind named `{}`", self.text),
            });
            return None;
        };
        self.open(&path)
    }

    /// Goes to a folder of the list.
    pub fn go_into(&mut self, folder: &Path) -> Option<PathBuf> {
        self.go(folder);
        None
    }

    /// Goes to a folder, or chooses a file.
    fn open(&mut self, path: &Path) -> Option<PathBuf> {
        if path.is_dir() {
            self.text.clear();
            self.go(path);
            return None;
        }
        if !path.is_file() {
            self.message = Some(format!("there is no file {}", path.display()));
            return None;
        }
        Some(path.to_owned())
    }

    fn accept_name(&mut self) -> Option<PathBuf> {
        let Some(path) = typed_path(&self.folder, self.text.trim()) else {
            self.message = Some("type a name for the file".into());
            return None;
        };
        if path.is_dir() {
            self.text = self.request.saves_as.unwrap_or_default().to_owned();
            self.go(&path);
            return None;
        }
        let path = match (path.extension(), self.request.endings.first()) {
            (None, Some(ending)) => path.with_extension(ending),
            _ => path,
        };
        let folder = path.parent().unwrap_or(&self.folder);
        if !folder.is_dir() {
            self.message = Some(format!("there is no folder {}", folder.display()));
            return None;
        }
        if path.exists() && self.warned_of.as_ref() != Some(&path) {
            self.message = Some(format!("{} exists; Save again replaces it", path.display()));
            self.warned_of = Some(path);
            return None;
        }
        Some(path)
    }
}

/// Whether typed text is a path rather than a name.
fn is_path(text: &str) -> bool {
    text.starts_with('~') || text.contains('/') || (cfg!(windows) && text.contains(['\\', ':']))
}

/// The path that typed text means in a folder; `None` if nothing is typed.
fn typed_path(folder: &Path, text: &str) -> Option<PathBuf> {
    if text.is_empty() {
        return None;
    }
    let below_home = text.strip_prefix('~').filter(|rest| rest.is_empty() || rest.starts_with('/'));
    match (below_home, std::env::home_dir()) {
        (Some(rest), Some(home)) => Some(home.join(rest.trim_start_matches('/'))),
        _ => Some(folder.join(text)),
    }
}

/// Folders to offer: home, where the program was started, those of recent files, and the system's
/// roots.
fn places(recent: &[PathBuf]) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::new();
    let mut add = |name: Option<&str>, path: PathBuf| {
        if path.is_dir() && places.iter().all(|place| place.path != path) {
            let own = path.file_name().map(|name| name.to_string_lossy().into_owned());
            let name = name.map(str::to_owned).or(own).unwrap_or_else(|| path.display().to_string());
            places.push(Place { name, path });
        }
    };
    if let Some(home) = std::env::home_dir() {
        add(Some("Home"), home);
    }
    if let Ok(here) = std::env::current_dir() {
        add(Some("Current folder"), here);
    }
    let folders =
        recent.iter().filter_map(|file| std::path::absolute(file).ok()?.parent().map(Path::to_owned));
    folders.take(MOST_RECENT).for_each(|folder| add(None, folder));
    if cfg!(windows) {
        ('A'..='Z').for_each(|letter| add(None, PathBuf::from(format!("{letter}:\\"))));
    } else {
        add(Some("Computer"), PathBuf::from("/"));
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    const READS: Request =
        Request { title: "Open", kind: "Scenes", endings: &["obj", "toml"], saves_as: None };
    const SAVES: Request =
        Request { title: "Save", kind: "Scenes", endings: &["toml"], saves_as: Some("scene.toml") };

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("deeper")).expect("made");
        for name in ["box.obj", "Boat.OBJ", "notes.txt", ".secret.obj", "deeper/room.toml"] {
            std::fs::write(folder.path().join(name), "").expect("written");
        }
        folder
    }

    fn browser(request: Request, folder: &Path) -> Browser {
        let mut browser = Browser::new(request, folder, &[], Arc::new(|| {}));
        settle(&mut browser);
        browser
    }

    fn settle(browser: &mut Browser) {
        let begin = Instant::now();
        while browser.is_listing() {
            assert!(begin.elapsed() < Duration::from_secs(20), "the folder is not listed");
            browser.poll();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn names(browser: &Browser) -> Vec<&str> {
        browser.shown().map(|entry| entry.name.as_str()).collect()
    }

    #[test]
    fn files_are_found_by_kind_by_typing_and_by_steps() {
        let folder = folder();
        let mut browser = browser(READS, folder.path());
        assert_eq!(names(&browser), ["deeper", "Boat.OBJ", "box.obj"]);
        browser.all_kinds = true;
        assert_eq!(names(&browser), ["deeper", "Boat.OBJ", "box.obj", "notes.txt"]);
        (browser.all_kinds, browser.hidden) = (false, true);
        assert_eq!(names(&browser), ["deeper", ".secret.obj", "Boat.OBJ", "box.obj"]);
        browser.hidden = false;
        assert_eq!(browser.accept(), None);
        assert!(browser.message.as_ref().is_some_and(|m| m.contains("mark a file")), "{:?}", browser.message);
        browser.step(1);
        browser.step(1);
        assert_eq!(browser.accept(), Some(folder.path().join("Boat.OBJ")));
        browser.text = "box".into();
        assert_eq!(names(&browser), ["box.obj"]);
        assert_eq!(browser.accept(), Some(folder.path().join("box.obj")));
        browser.text = "no such".into();
        assert_eq!(browser.accept(), None);
        assert!(browser.message.as_ref().is_some_and(|m| m.contains("`no such`")), "{:?}", browser.message);
        browser.text = folder.path().join("deeper/room.toml").display().to_string();
        assert_eq!(browser.accept(), Some(folder.path().join("deeper/room.toml")));
    }

    #[test]
    fn folders_are_entered_and_left() {
        let folder = folder();
        let mut browser = browser(READS, folder.path());
        browser.step(1);
        assert_eq!(browser.accept(), None);
        settle(&mut browser);
        assert_eq!((names(&browser), browser.folder()), (vec!["room.toml"], &*folder.path().join("deeper")));
        browser.up();
        settle(&mut browser);
        assert_eq!(browser.folder(), folder.path());
        browser.go(&folder.path().join("gone"));
        settle(&mut browser);
        assert!(browser.message.as_ref().is_some_and(|m| m.contains("gone")), "{:?}", browser.message);
    }

    #[test]
    fn what_exists_is_replaced_only_if_that_is_said_twice() {
        let folder = folder();
        let mut browser = browser(SAVES, folder.path());
        let new = folder.path().join("scene.toml");
        assert_eq!(browser.accept(), Some(new.clone()));
        std::fs::write(&new, "").expect("written");
        assert_eq!(browser.accept(), None);
        assert!(browser.message.as_ref().is_some_and(|m| m.contains("exists")), "{:?}", browser.message);
        assert_eq!(browser.accept(), Some(new));
        browser.text = "other".into();
        assert_eq!(browser.accept(), Some(folder.path().join("other.toml")));
        browser.text = "no folder/other".into();
        assert_eq!(browser.accept(), None);
        browser.text = "  ".into();
        assert_eq!(browser.accept(), None);
        browser.text = "deeper".into();
        assert_eq!(browser.accept(), None);
        settle(&mut browser);
        browser.mark(&folder.path().join("deeper/room.toml"));
        assert_eq!(browser.text, "room.toml");
        assert_eq!(browser.accept(), None);
    }

    #[test]
    fn folders_of_recent_files_are_offered_once() {
        let folder = folder();
        let recent = ["box.obj", "Boat.OBJ", "deeper/room.toml"].map(|name| folder.path().join(name));
        let offered = places(&recent);
        let of = |path: &Path| offered.iter().filter(|place| place.path == path).count();
        assert_eq!((of(folder.path()), of(&folder.path().join("deeper"))), (1, 1));
    }
}
