//! What menus, keys, the command palette and scripts make the viewer do.

use super::Viewer;
use super::dialogs::For;
use crate::navigation;
use crate::queries::Purpose;
use crate::worker::{Layer, Message, Recording, full_text};
use alhazen::edits::{Addition, CameraRecord, EnvironmentRecord, LightRecord, Resources};
use alhazen::{Camera, Job, LoadReport, RenderDefaults, Source};
use egui::{Key, KeyboardShortcut, Modifiers, Pos2};
use std::path::{Path, PathBuf};

/// What a click into the picture means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Select what is there.
    Pick(Pos2),
    /// Turn the camera about what is there.
    FocusOn(Pos2),
    /// Bring what is there into the lens's focus.
    FocusLens(Pos2),
}

/// Something that can be done without saying more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the list below says what each does")]
pub enum Command {
    Open,
    Reload,
    Save,
    SaveAs,
    Screenshot,
    SavePicture,
    CopyCommandLine,
    CancelLoading,
    Quit,
    Undo,
    Redo,
    Duplicate,
    Delete,
    Hide,
    AddModel,
    AddLamp,
    AddPointLight,
    Deselect,
    Frame,
    Home,
    ToggleProjection,
    Play,
    PlayTime,
    StepOn,
    StepBack,
    Rest,
    KeepView,
    ResetZoom,
    FullScreen,
    SidePanel,
    Palette,
    Help,
    Pause,
    Restart,
    NextLayer,
    Picture,
    CompareSettings,
    CompareNow,
    CompareFile,
    CompareNothing,
    Brighter,
    Darker,
    RecordTurntable,
    RecordPath,
    RecordOrbit,
    StopRecording,
    ExportStatistics,
}

/// A command as users see it.
pub struct CommandInfo {
    /// The command.
    pub command: Command,
    /// What it does.
    pub name: &'static str,
    /// Its keys.
    pub keys: Option<KeyboardShortcut>,
}

const fn key(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::NONE, key))
}

const fn command(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::COMMAND, key))
}

const fn shift_command(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key))
}

const fn info(command: Command, name: &'static str, keys: Option<KeyboardShortcut>) -> CommandInfo {
    CommandInfo { command, name, keys }
}

/// All commands, in the order of the palette. Of two with the same key the one with more modifiers comes first.
pub const COMMANDS: &[CommandInfo] = &[
    info(Command::Open, "Open a scene…", command(Key::O)),
    info(Command::Reload, "Reload the file", command(Key::R)),
    info(Command::SaveAs, "Save the scene as…", shift_command(Key::S)),
    info(Command::Save, "Save the scene", command(Key::S)),
    info(Command::Screenshot, "Save a screenshot (PNG)…", key(Key::F12)),
    info(Command::SavePicture, "Save the rendered picture (EXR)…", command(Key::E)),
    info(Command::CopyCommandLine, "Copy the command line that renders this", None),
    info(Command::CancelLoading, "Stop loading", None),
    info(Command::Redo, "Redo", shift_command(Key::Z)),
    info(Command::Undo, "Undo", command(Key::Z)),
    info(Command::Duplicate, "Duplicate the object", command(Key::D)),
    info(Command::Delete, "Delete the object", key(Key::Delete)),
    info(Command::Hide, "Hide or show the object", key(Key::H)),
    info(Command::AddModel, "Add a model…", None),
    info(Command::AddLamp, "Add a sphere light", None),
    info(Command::AddPointLight, "Add a point light", None),
    info(Command::Deselect, "Deselect", key(Key::Escape)),
    info(Command::Frame, "Frame the selected object, or everything", key(Key::F)),
    info(Command::Home, "Go to the first camera", key(Key::Home)),
    info(Command::ToggleProjection, "Perspective or orthographic", key(Key::Num5)),
    info(Command::Play, "Automatic orbit", key(Key::O)),
    info(Command::PlayTime, "Play or pause the animation", key(Key::T)),
    info(Command::StepOn, "Next frame", key(Key::Period)),
    info(Command::StepBack, "Previous frame", key(Key::Comma)),
    info(Command::Rest, "Show the rest pose", None),
    info(Command::KeepView, "Save this view", command(Key::B)),
    info(Command::ResetZoom, "Fit the picture into the window", key(Key::Num0)),
    info(Command::FullScreen, "Full screen", key(Key::F11)),
    info(Command::SidePanel, "Show or hide the panels", key(Key::N)),
    info(Command::Palette, "All commands…", command(Key::P)),
    info(Command::Help, "Mouse and keys", key(Key::F1)),
    info(Command::Pause, "Pause or resume rendering", key(Key::Space)),
    info(Command::Restart, "Restart rendering", None),
    info(Command::NextLayer, "Show the next layer", key(Key::L)),
    info(Command::Picture, "Show the picture", key(Key::P)),
    info(Command::CompareSettings, "Compare two settings", None),
    info(Command::CompareNow, "Compare with the current picture", key(Key::C)),
    info(Command::CompareFile, "Compare with a file…", None),
    info(Command::CompareNothing, "End the comparison", None),
    info(Command::Brighter, "Half a stop brighter", key(Key::CloseBracket)),
    info(Command::Darker, "Half a stop darker", key(Key::OpenBracket)),
    info(Command::RecordTurntable, "Record a turntable…", None),
    info(Command::RecordPath, "Record a path through the saved views…", None),
    info(Command::RecordOrbit, "Record the camera orbit…", None),
    info(Command::StopRecording, "Stop recording", None),
    info(Command::ExportStatistics, "Export measurements (CSV, JSON)…", None),
    info(Command::Quit, "Quit", command(Key::Q)),
];

impl Viewer {
    /// Does what a click into the picture means.
    pub fn act(&mut self, action: Action) {
        match action {
            Action::Pick(at) => self.ask(at, Purpose::Select),
            Action::FocusOn(at) => self.ask(at, Purpose::Target),
            Action::FocusLens(at) => self.ask(at, Purpose::Focus),
        }
    }

    /// Does what the keys of this frame say.
    pub fn take_keys(&mut self, ctx: &egui::Context) {
        if ctx.egui_wants_keyboard_input() {
            return;
        }
        let pressed = COMMANDS
            .iter()
            .filter(|info| info.keys.is_some_and(|keys| ctx.input_mut(|i| i.consume_shortcut(&keys))));
        for info in pressed.collect::<Vec<_>>() {
            self.run(info.command, ctx);
        }
    }

    /// Does what a command says.
    pub fn run(&mut self, command: Command, ctx: &egui::Context) {
        match command {
            Command::Open => self.ask_for(For::Open),
            Command::Reload => self.reload(),
            Command::Save => self.save(),
            Command::SaveAs => self.ask_for(For::Save),
            Command::Screenshot => self.ask_for(For::Screenshot),
            Command::SavePicture => self.ask_for(For::Picture),
            Command::CopyCommandLine => ctx.copy_text(self.command_line()),
            Command::CancelLoading => self.cancel_loading(),
            Command::Quit => self.quit = true,
            Command::Undo | Command::Redo => self.undo_or_redo(command == Command::Undo),
            Command::Duplicate => self.duplicate(),
            Command::Delete => self.delete(),
            Command::Hide => self.hide(),
            Command::AddModel => self.ask_for(For::Model),
            Command::AddLamp => self.add_lamp(),
            Command::AddPointLight => self.add_point_light(),
            Command::Deselect => self.selection = None,
            Command::Frame => self.frame(),
            Command::Home => {
                self.look_through(self.home.clone());
                self.look_through_own(0);
            }
            Command::ToggleProjection => self.steer(navigation::toggle_projection),
            Command::Play => self.play(),
            Command::PlayTime | Command::StepOn | Command::StepBack | Command::Rest => {
                self.run_clock(command)
            }
            Command::KeepView => self.keep_view(),
            Command::ResetZoom => self.zoom = Default::default(),
            Command::FullScreen => self.full_screen = !self.full_screen,
            Command::SidePanel => self.open.side = !self.open.side,
            Command::Palette => self.open.palette = !self.open.palette,
            Command::Help => self.open.help = !self.open.help,
            Command::Pause => {
                self.paused = !self.paused;
                self.tell(Message::Pause(self.paused));
            }
            Command::Restart => self.render.seed = self.render.seed.wrapping_add(1),
            Command::NextLayer => {
                let mut after = Layer::all().skip_while(|l| *l != self.shown.layer).skip(1);
                self.shown.layer = after.next().unwrap_or_default();
            }
            Command::Picture => (self.shown.layer, self.shown.false_colour) = (Layer::Picture, None),
            Command::CompareSettings => self.compare_settings(),
            Command::CompareNow => self.compare_with_now(),
            Command::CompareFile => self.ask_for(For::Compare),
            Command::CompareNothing => self.compare_nothing(),
            Command::Brighter => self.shown.tone.exposure *= std::f32::consts::SQRT_2,
            Command::Darker => self.shown.tone.exposure /= std::f32::consts::SQRT_2,
            Command::RecordTurntable | Command::RecordPath | Command::RecordOrbit => {
                self.open.record.way = command;
                self.ask_for(For::Record);
            }
            Command::StopRecording => self.tell(Message::Record(None)),
            Command::ExportStatistics => self.ask_for(For::Statistics),
        }
    }

    fn undo_or_redo(&mut self, undo: bool) {
        let Some(document) = &mut self.document else { return };
        if if undo { document.undo() } else { document.redo() } {
            self.send_edits();
        }
    }

    /// Does what a command says of time. Scenes in which nothing moves have none.
    fn run_clock(&mut self, command: Command) {
        if !self.document.as_ref().is_some_and(|d| d.scene().is_animated()) {
            return;
        }
        match command {
            Command::PlayTime => self.clock.play(),
            Command::StepOn => self.clock.step(1),
            Command::StepBack => self.clock.step(-1),
            _ => self.clock.rest(),
        }
    }

    fn play(&mut self) {
        self.playing = !self.playing;
        self.follows = None;
        if self.playing && self.camera.path.is_none() {
            self.camera_time = 0.0;
            self.camera.path = Some(navigation::orbit_path(&self.camera, 0.0, 12.0));
        }
    }

    fn keep_view(&mut self) {
        let name = format!("view {}", self.views.len() + 1);
        let camera = Camera { name, path: None, ..self.camera.at(self.camera_time) };
        self.views.push(camera);
    }

    fn frame(&mut self) {
        let Some(document) = &self.document else { return };
        let bounds = match self.selection {
            Some(selection) => document.bounds_of(selection.object),
            None => document.scene().bounds(),
        };
        if let Some((low, high)) = bounds {
            self.steer(|c| navigation::frame(c, low, high));
        }
    }

    fn duplicate(&mut self) {
        let (Some(selection), Some(document)) = (self.selection, &self.document) else { return };
        let scene = document.scene();
        let Some(instance) = scene.instances.get(selection.object as usize) else { return };
        let count = scene.instances.len() as u32;
        // Beside the original, where it is seen.
        let size = document.bounds_of(selection.object).map_or(1.0, |(low, high)| (high - low).x.max(1e-3));
        let moved = glam::Affine3A::from_translation(glam::Vec3::X * size * 1.1) * instance.transform;
        let changed = document.edits().objects.get(&selection.object).cloned().unwrap_or_default();
        self.edit("duplicate", |edits| {
            edits.additions.push(Addition::Copy { of: selection.object });
            let copy = edits.object(count);
            // Copies are made before values are changed.
            (copy.material, copy.visible) = (changed.material, changed.visible);
            copy.set_transform(&moved);
        });
        self.selection = Some(super::Selection { object: count, ..selection });
    }

    fn delete(&mut self) {
        if let Some(selection) = self.selection.take() {
            self.edit("delete", |edits| edits.object(selection.object).removed = true);
        }
    }

    fn hide(&mut self) {
        let (Some(selection), Some(document)) = (self.selection, &self.document) else { return };
        let Some(instance) = document.scene().instances.get(selection.object as usize) else { return };
        let visible = !instance.visible;
        self.edit("hide", |edits| edits.object(selection.object).visible = Some(visible));
    }

    /// A lamp a tenth as large as the scene, above what the camera looks at.
    fn add_lamp(&mut self) {
        let Some(document) = &self.document else { return };
        let (count, materials) = (document.scene().instances.len(), document.scene().materials.len());
        let radius = self.scene_size() * 0.03;
        let place = self.camera.target + glam::Vec3::Y * self.scene_size() * 0.3;
        self.edit("add lamp", |edits| {
            edits.additions.push(Addition::Lamp { radius, radiance: [10.0; 3] });
            edits.object(count as u32).set_transform(&glam::Affine3A::from_translation(place));
        });
        self.selection = Some(super::Selection { object: count as u32, material: materials as u32 });
    }

    fn add_point_light(&mut self) {
        let position = (self.camera.target + glam::Vec3::Y * self.scene_size() * 0.3).to_array();
        // As bright at this distance as a cloudy sky.
        let intensity = [self.scene_size().powi(2) * 0.3; 3];
        self.edit_lights("add light", |lights| {
            let name = format!("light {}", lights.len() + 1);
            lights.push(LightRecord::Point { name, position, intensity, profile: None });
        });
    }

    /// Changes the list of lights.
    pub fn edit_lights(&mut self, what: &str, change: impl FnOnce(&mut Vec<LightRecord>)) {
        let Some(document) = &self.document else { return };
        let mut lights: Vec<_> = document.scene().lights.iter().map(LightRecord::from).collect();
        if let Some(edited) = &document.edits().lights {
            lights.clone_from(edited);
        }
        change(&mut lights);
        self.edit(what, |edits| edits.lights = Some(lights));
    }

    pub(super) fn take_model(&mut self, file: &Path, resources: Resources, report: &LoadReport) {
        let Some(document) = &mut self.document else { return };
        let first = document.scene().instances.len() as u32;
        let lights = resources.models.get(file).map(|m| m.lights.clone()).unwrap_or_default();
        document.add_resources(resources);
        let file = file.to_owned();
        self.edit("add model", |edits| {
            edits.additions.push(Addition::Model { file });
            // A list of lights that was changed replaces all others.
            if let Some(edited) = &mut edits.lights {
                edited.extend(lights.iter().map(LightRecord::from));
            }
        });
        let material = self.document.as_ref().and_then(|d| d.material_of(first));
        self.selection = material.map(|material| super::Selection { object: first, material });
        report.notes.iter().for_each(|note| self.notice(note.to_string(), false));
    }

    pub(super) fn take_environment(&mut self, file: &Path, resources: Resources, report: &LoadReport) {
        let Some(document) = &mut self.document else { return };
        document.add_resources(resources);
        let file = file.to_owned();
        self.edit("environment", |edits| {
            edits.environment = Some(EnvironmentRecord::File { file, rotation: 0.0, intensity: 1.0 });
        });
        report.notes.iter().for_each(|note| self.notice(note.to_string(), false));
    }

    fn save(&mut self) {
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
        let RenderDefaults { cull_backs, shadow_terminator, .. } = document.scene().defaults.clone();
        let render = self.render.defaults(size, &self.shown.tone);
        let render = RenderDefaults { cull_backs, shadow_terminator, ..render };
        let text = match document.text(&path, edits, render) {
            Ok(text) => text,
            Err(error) => return self.notice(full_text(&error), true),
        };
        let written = alhazen::write_atomically(&path, |writer| {
            std::io::Write::write_all(writer, text.as_bytes())
                .map_err(|source| alhazen::ImageError::Write { path: path.clone(), source })
        });
        match written {
            Ok(()) => {
                document.mark_saved();
                self.settings.remember(&path.display().to_string());
                self.notice(format!("wrote {}", path.display()), false);
            }
            Err(error) => self.notice(full_text(&error), true),
        }
    }

    /// The command line that renders the scene as it was saved.
    pub fn command_line(&self) -> String {
        let scene = self.document.as_ref().map_or(String::new(), |d| d.source.to_string());
        let spp = format!("alhazen render {scene} -o picture.exr --spp {}", self.render.spp);
        let denoise = self.shown.denoiser.map_or("", |denoiser| match denoiser {
            alhazen::Denoiser::Network => "--denoise",
            alhazen::Denoiser::Regression => "--denoise=regression",
            alhazen::Denoiser::Oidn => "--denoise=oidn",
        });
        let words = [spp, self.render.arguments(), self.clock.arguments(), denoise.to_owned()];
        words.iter().filter(|w| !w.is_empty()).map(String::as_str).collect::<Vec<_>>().join(" ")
    }

    /// Records a sequence in the way that was chosen.
    pub fn record(&mut self, path: PathBuf) {
        let choice = &self.open.record;
        let camera = self.camera.at(self.camera_time);
        let cameras = match choice.way {
            Command::RecordPath => Recording::through(&self.views, choice.frames),
            Command::RecordOrbit => {
                let seconds = choice.frames as f32 / choice.fps.max(1.0);
                Recording::along(&self.camera, choice.frames, seconds)
            }
            _ => Recording::turntable(&Camera { path: None, ..camera }, choice.frames),
        };
        if cameras.is_empty() {
            self.notice("there are no saved views: save some first", true);
            return;
        }
        let spp = choice.spp;
        self.recording = Some((0, cameras.len()));
        let job = Job { tone: self.shown.tone, ..self.job() };
        self.tell(Message::Record(Some(Box::new(Recording { job, cameras, spp, path }))));
    }

    /// Writes what was measured, as JSON or else as a table.
    pub fn export_statistics(&mut self, path: &Path) {
        let is_json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let text = if is_json {
            self.statistics.to_json().map_err(std::io::Error::from)
        } else {
            Ok(self.statistics.to_csv())
        };
        match text.and_then(|text| std::fs::write(path, text)) {
            Ok(()) => self.notice(format!("wrote {}", path.display()), false),
            Err(error) => self.notice(format!("cannot write {}: {error}", path.display()), true),
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

    /// Tone mapping that the scene asks for.
    pub fn reset_tone(&mut self) {
        let tone = self.document.as_ref().map(|d| Job::for_scene(d.scene()).tone);
        self.shown.tone = tone.unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_is_in_the_list_once_and_keys_are_unique() {
        for (i, a) in COMMANDS.iter().enumerate() {
            for b in &COMMANDS[..i] {
                assert!(a.command != b.command && a.name != b.name, "{}", a.name);
                assert!(a.keys.is_none() || a.keys != b.keys, "{} and {}", a.name, b.name);
            }
        }
        assert_eq!(COMMANDS.len(), Command::ExportStatistics as usize + 1);
    }

    #[test]
    fn longer_shortcuts_come_before_shorter_ones() {
        // egui takes a shortcut even when more modifiers are held than it asks for.
        for (i, a) in COMMANDS.iter().enumerate() {
            for b in &COMMANDS[i + 1..] {
                if let (Some(a), Some(b)) = (a.keys, b.keys)
                    && a.logical_key == b.logical_key
                {
                    assert!(a.modifiers.contains(b.modifiers), "{a:?} hides {b:?}");
                }
            }
        }
    }
}
