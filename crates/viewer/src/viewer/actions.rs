//! What menus, keys, the command palette and scripts make the viewer do.

use super::choosing::RectangleUse;
use super::commands::{COMMANDS, Command};
use super::dialogs::For;
use super::state::{Selection, Viewer};
use crate::gizmo::Tool;
use crate::panels::Overlay;
use crate::presets::Preset;
use crate::queries::Purpose;
use crate::worker::{Layer, Message, Recording};
use alhazen::edits::{Addition, EnvironmentRecord, Resources};
use alhazen::navigation;
use alhazen::{Camera, Job, Light, LightKind, LoadReport, MaterialId, TextureSlot};
use egui::{Key, KeyboardShortcut, Pos2};
use std::path::{Path, PathBuf};

/// What a click into the picture means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Select what is there.
    Pick(Pos2),
    /// Select what is there as well, or no more.
    Toggle(Pos2),
    /// Turn the camera about what is there.
    FocusOn(Pos2),
    /// Bring what is there into the lens's focus.
    FocusLens(Pos2),
    /// Have the light fall there.
    Aim(Pos2),
    /// Give the object that is there a material.
    TakeMaterial(Pos2, MaterialId),
}

/// What lies over everything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Top {
    /// Errors that the user has not dismissed.
    Errors,
    /// Whether a scene may read files elsewhere.
    Question,
    /// The file dialog.
    Browser,
    /// What a command has opened.
    Overlay(Overlay),
}

impl Viewer {
    /// Does what a click into the picture means.
    pub fn act(&mut self, action: Action) {
        match action {
            Action::Pick(at) => self.ask(at, Purpose::Select),
            Action::Toggle(at) => self.ask(at, Purpose::Toggle),
            Action::FocusOn(at) => self.ask(at, Purpose::Target),
            Action::FocusLens(at) => self.ask(at, Purpose::Focus),
            Action::Aim(at) => self.aim_at(at),
            Action::TakeMaterial(at, material) => self.ask(at, Purpose::TakeMaterial(material)),
        }
    }

    /// Does what the keys of this frame say.
    pub fn take_keys(&mut self, ctx: &egui::Context) {
        // Menus and the file dialog take their keys themselves, Escape among them.
        if self.take_drag_keys(ctx) {
            return;
        }
        let types = self.is_typing(ctx);
        let typed = std::mem::replace(&mut self.typed, types || self.open.outliner.has_focus);
        if types || egui::Popup::is_any_open(ctx) || self.top() == Some(Top::Browser) {
            return;
        }
        // What ends typing ends nothing else.
        if typed && self.top().is_none() && ctx.input(|i| i.key_pressed(Key::Escape)) {
            return;
        }
        // The tree of objects has another use for this key.
        let of_tree =
            |keys: &KeyboardShortcut| self.open.outliner.has_focus && keys.logical_key == Key::Space;
        let pressed = COMMANDS.iter().filter(|info| {
            let keys = info.keys.filter(|keys| !of_tree(keys));
            keys.is_some_and(|keys| ctx.input_mut(|i| i.consume_shortcut(&keys)))
        });
        for info in pressed.collect::<Vec<_>>() {
            self.run(info.command, ctx);
        }
    }

    /// Whether keys go to a field in which text is typed.
    pub fn is_typing(&self, ctx: &egui::Context) -> bool {
        ctx.egui_wants_keyboard_input() && !self.open.outliner.has_focus
    }

    /// What lies over everything else. Only this is shown.
    pub fn top(&self) -> Option<Top> {
        if self.notices.iter().any(|notice| notice.is_error) {
            Some(Top::Errors)
        } else if self.elsewhere.is_some() {
            Some(Top::Question)
        } else if self.browser.is_some() {
            Some(Top::Browser)
        } else {
            self.open.overlay.map(Top::Overlay)
        }
    }

    /// Closes what lies over everything else; ends the selection where nothing does.
    fn close_top(&mut self) {
        match self.top() {
            Some(Top::Errors) => self.notices.retain(|notice| !notice.is_error),
            Some(Top::Question) => self.answer_elsewhere(false),
            Some(Top::Browser) => self.browser = None,
            Some(Top::Overlay(_)) => drop(self.open.close_overlays()),
            None if self.gizmo.aims => self.gizmo.aims = false,
            None if self.rectangle.is_active() => self.give_up_rectangle(),
            None if !self.has_selection() => self.notice("nothing is selected", false),
            None => self.deselect(),
        }
    }

    /// Opens or closes a window over the picture. A file dialog that is open gives way.
    fn toggle(&mut self, overlay: Overlay) {
        self.browser = None;
        self.open.toggle(overlay);
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
            Command::CopyCommandLine => {
                ctx.copy_text(self.command_line());
                self.notice("copied the command line", false);
            }
            Command::CancelLoading if self.loading.is_empty() => {
                self.notice("nothing is being loaded", false)
            }
            Command::CancelLoading => self.cancel_loading(),
            Command::Quit => self.quit = true,
            Command::Undo | Command::Redo => self.undo_or_redo(command == Command::Undo),
            Command::SelectArea => self.await_rectangle(RectangleUse::Select),
            Command::CopyMaterial => self.copy_material(),
            Command::PasteMaterial => self.paste_material(),
            Command::CropArea => self.await_rectangle(RectangleUse::Crop),
            Command::CropNothing => self.crop_to(None),
            Command::Duplicate => self.duplicate(),
            Command::Delete => self.delete(),
            Command::Hide => self.hide(),
            Command::ShowAll => self.show_all(),
            Command::Isolate => self.isolate(),
            Command::Rename => self.begin_renaming(),
            Command::AddModel => self.ask_for(For::Model),
            Command::AddLamp => self.add_lamp(),
            Command::AddPointLight => self.add_point_light(),
            Command::Deselect => self.close_top(),
            Command::Frame => self.frame(),
            Command::Home => {
                let before = self.camera.clone();
                self.look_through(self.home.clone());
                self.look_through_own(0);
                if self.camera == before {
                    self.notice("this is the first camera", false);
                }
            }
            Command::ToggleProjection => self.steer(navigation::toggle_projection),
            Command::Play => self.play(),
            Command::PlayTime | Command::StepOn | Command::StepBack | Command::Rest => {
                self.run_clock(command)
            }
            Command::KeepView => self.keep_view(),
            Command::ResetZoom if self.zoom == Default::default() => {
                self.notice("the whole picture is shown already", false);
            }
            Command::ResetZoom => self.zoom = Default::default(),
            Command::FullScreen => self.full_screen = !self.full_screen,
            Command::SidePanel => self.open.side = !self.open.side,
            Command::Palette => self.toggle(Overlay::Palette),
            Command::Help => self.toggle(Overlay::Help),
            Command::Pause => {
                self.paused = !self.paused;
                self.tell(Message::Pause(self.paused));
            }
            Command::Restart => self.render.seed = self.render.seed.wrapping_add(1),
            Command::NextLayer => {
                let mut after = Layer::all().skip_while(|l| *l != self.shown.layer).skip(1);
                self.shown.layer = after.next().unwrap_or_default();
                self.notice(format!("layer: {}", self.shown.layer.name()), false);
            }
            Command::Picture => {
                (self.shown.layer, self.shown.false_colour) = (Layer::Picture, None);
                self.shown.channels = Default::default();
                self.notice("the picture is shown", false);
            }
            Command::CompareSettings => self.compare_settings(),
            Command::CompareNow => self.compare_with_now(),
            Command::CompareFile => self.ask_for(For::Compare),
            Command::CompareNothing if self.comparison.split().is_none() => {
                self.notice("nothing is compared", false);
            }
            Command::CompareNothing => self.compare_nothing(),
            Command::Snapshot => self.take_snapshot(),
            Command::NextLook => self.next_look(),
            Command::Zebra => self.toggle_zebra(),
            Command::PixelGrid => self.toggle_grid(),
            Command::CopyPicture => self.copy_picture(ctx),
            Command::Brighter => self.expose(0.5),
            Command::Darker => self.expose(-0.5),
            Command::RecordTurntable | Command::RecordPath | Command::RecordOrbit => {
                self.open.record.way = command;
                self.ask_for(For::Record);
            }
            Command::ToolSelect => self.use_tool(Tool::Select),
            Command::ToolMove => self.use_tool(Tool::Move),
            Command::ToolRotate => self.use_tool(Tool::Rotate),
            Command::ToolScale => self.use_tool(Tool::Scale),
            Command::LocalAxes => {
                self.gizmo.local = !self.gizmo.local;
                let axes = if self.gizmo.local { "the object" } else { "the world" };
                self.notice(format!("handles follow the axes of {axes}"), false);
            }
            Command::Aim => self.begin_to_aim(),
            Command::Icons => {
                self.settings.icons = !self.settings.icons;
                let are = if self.settings.icons { "shown" } else { "hidden" };
                self.notice(format!("signs of lights and cameras are {are}"), false);
            }
            Command::RenderToFile => self.ask_for(For::Render),
            Command::PresetDraft => self.use_preset(Preset::Draft),
            Command::PresetPreview => self.use_preset(Preset::Preview),
            Command::PresetFinal => self.use_preset(Preset::Final),
            Command::Compass => {
                self.settings.compass = !self.settings.compass;
                let is = if self.settings.compass { "shown" } else { "hidden" };
                self.notice(format!("the compass is {is}"), false);
            }
            Command::SendToTev => self.toggle_tev(),
            Command::Ground => self.toggle_ground(),
            Command::StopRecording => self.stop_recording(),
            Command::ExportStatistics => self.ask_for(For::Statistics),
        }
    }

    /// Changes the exposure by so many stops.
    fn expose(&mut self, stops: f32) {
        self.shown.tone.exposure *= stops.exp2();
        self.notice(format!("exposure: {:+.1} stops", self.shown.tone.exposure.log2()), false);
    }

    fn undo_or_redo(&mut self, undo: bool) {
        let Some(document) = &mut self.document else { return };
        if if undo { document.undo() } else { document.redo() } {
            self.send_edits();
        } else {
            self.notice(format!("nothing to {}", if undo { "undo" } else { "redo" }), false);
        }
    }

    /// Does what a command says of time. Scenes in which nothing moves have none.
    fn run_clock(&mut self, command: Command) {
        if !self.document.as_ref().is_some_and(|d| d.scene().is_animated()) {
            return self.notice("nothing moves in this scene", false);
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
        self.notice(format!("saved {name}; it is on the Camera page"), false);
        let camera = Camera { name, path: None, ..self.camera.at(self.camera_time) };
        self.views.push(camera);
    }

    fn frame(&mut self) {
        match self.bounds_of_chosen() {
            Some((low, high)) => self.steer(|c| navigation::frame(c, low, high)),
            None => self.notice("there is nothing to frame", false),
        }
    }

    fn delete(&mut self) {
        if let Some(light) = self.gizmo.light {
            return self.remove_light(light);
        }
        let objects = self.chosen_objects();
        if objects.is_empty() {
            return self.notice("select an object, a group or a light to delete it", false);
        }
        self.deselect();
        self.edit("delete", |edits| {
            objects.into_iter().for_each(|object| edits.object(object).removed = true);
        });
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
        self.select(Some(Selection { object: count as u32, material: materials as u32 }));
    }

    fn add_point_light(&mut self) {
        let position = self.camera.target + glam::Vec3::Y * self.scene_size() * 0.3;
        // As bright at this distance as a cloudy sky.
        let intensity = glam::Vec3::splat(self.scene_size().powi(2) * 0.3);
        self.edit_lights("add light", |lights| {
            let name = format!("light {}", lights.len() + 1);
            lights.push(Light::new(name, LightKind::Point { position, intensity }));
        });
    }

    /// Changes the list of lights.
    pub fn edit_lights(&mut self, what: &str, change: impl FnOnce(&mut Vec<Light>)) {
        let Some(document) = &self.document else { return };
        let mut lights = document.scene().lights.clone();
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
                edited.extend(lights);
            }
        });
        let material = self.document.as_ref().and_then(|d| d.material_of(first));
        self.select(material.map(|material| Selection { object: first, material }));
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

    pub(super) fn take_picture(
        &mut self,
        file: PathBuf,
        material: MaterialId,
        slot: TextureSlot,
        resources: Resources,
        report: &LoadReport,
    ) {
        let Some(document) = &mut self.document else { return };
        document.add_resources(resources);
        self.edit("replace texture", |edits| edits.slot(material, slot).file = Some(file));
        report.notes.iter().for_each(|note| self.notice(note.to_string(), false));
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
        let crop = self.render.crop_of(self.size());
        let crop = crop.map_or(String::new(), |c| format!("--crop {},{},{},{}", c.x, c.y, c.width, c.height));
        let words = [spp, crop, self.render.arguments(), self.clock.arguments(), denoise.to_owned()];
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
        let job = Job { tone: self.shown.tone, ..self.job() };
        let (sampling, noise, denoiser) = (alhazen::Sampling::Uniform, None, None);
        let is_single = false;
        self.render_into(Recording { job, cameras, spp, sampling, noise, denoiser, path, is_single });
    }

    /// Tone mapping that the scene asks for.
    pub fn reset_tone(&mut self) {
        let tone = self.document.as_ref().map(|d| Job::for_scene(d.scene()).tone);
        self.shown.tone = tone.unwrap_or_default();
    }
}
