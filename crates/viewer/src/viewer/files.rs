//! Files that the user chooses: asking for them, reading and writing them.

use super::dialogs::{Answer, Dialog, For};
use super::state::Viewer;
use crate::browser::Browser;
use crate::loading;
use crate::text_file;
use crate::worker::full_text;
use alhazen::edits::CameraRecord;
use alhazen::{Camera, LoadOptions, RenderDefaults, Source};
use std::path::{Path, PathBuf};

impl Viewer {
    /// Asks the user for a file, unless they are being asked already.
    pub fn ask_for(&mut self, what: For) {
        if self.dialog.is_some() || self.browser.is_some() {
            return self.notice("another file is being asked for", false);
        }
        if self.settings.own_dialogs || self.desktop_lacks_dialogs {
            return self.browse(what);
        }
        let wake = self.wake.clone();
        self.dialog = Some(Dialog::show(what, move || wake()));
    }

    /// How files are loaded.
    pub fn load_options(&self) -> &LoadOptions {
        &self.load_options
    }

    /// Asks by a dialog of our own.
    fn browse(&mut self, what: For) {
        let files: Vec<PathBuf> = self.settings.recent.iter().map(PathBuf::from).collect();
        let of_scene = self.document.as_ref().and_then(|d| match &d.source.place {
            alhazen::Place::File(file) => Some(file.as_path()),
            alhazen::Place::Builtin(_) => None,
        });
        let folder = self.last_folder.clone().or_else(|| of_scene?.parent().map(Path::to_owned));
        let folder = folder.unwrap_or_else(|| PathBuf::from("."));
        self.open.close_overlays();
        self.browser = Some((what, Browser::new(what.request(), &folder, &files, self.wake.clone())));
    }

    pub(super) fn take_dialog(&mut self) {
        let Some(dialog) = &self.dialog else { return };
        let (what, answer) = (dialog.what, dialog.poll());
        match answer {
            Answer::Open => return,
            Answer::Closed(None) => {}
            Answer::Closed(Some(path)) => self.use_file(what, path),
            Answer::Missing => {
                self.desktop_lacks_dialogs = true;
                self.browse(what);
            }
        }
        self.dialog = None;
    }

    /// Does with a file what it is for.
    pub fn use_file(&mut self, what: For, path: PathBuf) {
        self.last_folder = path.parent().filter(|folder| folder.is_dir()).map(Path::to_owned);
        match what {
            For::Open => self.open_source(Source::parse_file(&path)),
            For::Model => self.load(loading::Job::Model(path)),
            For::Environment => self.load(loading::Job::Environment(path)),
            For::Texture(material, slot) => self.load(loading::Job::Picture(path, material, slot)),
            For::Compare => self.compare_with_file(&path),
            For::Save => self.save_scene(&path),
            For::Screenshot => self.capture_to = Some(path),
            For::Picture => self.tell(crate::worker::Message::Save(path)),
            For::Render => self.render_to_file(path),
            For::Record => self.record(path),
            For::Statistics => self.export_statistics(&path),
        }
    }

    /// Writes the scene to its own file, if a program has written that; else asks for another.
    pub(super) fn save(&mut self) {
        let own = self.document.as_ref().and_then(|d| match &d.source.place {
            // Only what a program has written is written over by a program.
            alhazen::Place::File(file) if d.is_edited_file() => Some(file.clone()),
            _ => None,
        });
        match own {
            Some(file) => self.save_scene(&file),
            None => self.ask_for(For::Save),
        }
    }

    /// Writes the scene as it is now: `alhazen render` makes the same picture of it.
    pub fn save_scene(&mut self, path: &Path) {
        let path = if path.extension().is_none() { path.with_extension("toml") } else { path.to_owned() };
        let Some(document) = &mut self.document else { return };
        let mut edits = document.edits().clone();
        // At a moment of the scene, its clock would move a camera that has a path.
        let orbit = self.camera.path.filter(|_| !self.clock.shown);
        let current = Camera { path: orbit, ..self.camera.at(self.camera_time) };
        // The camera that is looked through is rendered first; then the kept views, then the others.
        let others =
            document.scene().cameras.iter().filter(|c| c.name != "viewer" && !self.views.contains(c));
        let cameras = [Camera { name: "viewer".into(), ..current }].into_iter();
        let cameras = cameras.chain(self.views.iter().cloned()).chain(others.cloned());
        edits.cameras = Some(cameras.map(|c| CameraRecord::from(&c)).collect());
        let size = self.render.size.unwrap_or(self.room);
        // How rays meet surfaces is the scene's own choice.
        let RenderDefaults { cull_backs, shadow_terminator, shutter, .. } = document.scene().defaults.clone();
        let render = self.render.defaults(size, &self.shown.tone);
        let render = RenderDefaults { cull_backs, shadow_terminator, shutter, ..render };
        let text = match document.text(&path, edits, render) {
            Ok(text) => text,
            Err(error) => return self.notice(full_text(&error), true),
        };
        match text_file::write(&path, &text) {
            Ok(()) => {
                document.mark_saved();
                self.settings.remember(&path.display().to_string());
                self.notice(format!("wrote {}", path.display()), false);
            }
            Err(error) => self.notice(full_text(&error), true),
        }
    }

    /// Writes what was measured, as JSON or else as a table.
    pub fn export_statistics(&mut self, path: &Path) {
        let is_json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let text = match self.statistics.to_json() {
            Ok(json) if is_json => json,
            Err(error) if is_json => {
                return self.notice(format!("cannot write {}: {error}", path.display()), true);
            }
            _ => self.statistics.to_csv(),
        };
        match text_file::write(path, &text) {
            Ok(()) => self.notice(format!("wrote {}", path.display()), false),
            Err(error) => self.notice(full_text(&error), true),
        }
    }

    /// Opens what was dropped onto the window.
    pub fn drop_file(&mut self, path: &Path) {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match ending.as_str() {
            "hdr" | "exr" => self.use_file(For::Environment, path.to_owned()),
            "png" => self.use_file(For::Compare, path.to_owned()),
            _ => self.open_source(Source::parse_file(path)),
        }
    }
}
