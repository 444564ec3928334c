//! All that the window shows and does, without the window: panels change it, [`Viewer::tick`] keeps it in step with the
//! threads that load, render and trace.

mod actions;
mod choosing;
mod commands;
mod compare;
mod dialogs;
mod elsewhere;
mod events;
mod files;
mod findings;
mod first;
mod ground;
mod light;
mod manipulate;
mod materials;
mod output;
mod overlay;
mod paint;
mod rectangle;
mod selection;
mod sending;
mod snapshots;
mod state;
mod tev;
mod time;
mod tools;
mod tree;

pub use actions::{Action, Top};
pub use choosing::{Choosing, CopiedMaterial, Rectangle, RectangleUse};
pub use commands::{COMMANDS, Command, CommandInfo};
pub use compare::Comparison;
pub use dialogs::{Dialog, For};
pub use elsewhere::Elsewhere;
pub use first::{FirstEnvironment, FirstView};
pub use manipulate::outlined_text;
pub use state::{BackendState, Notice, Selection, Start, Viewer};
pub use tools::{Look, Snapshot, Tools};

use crate::loading::{self, Loading};
use crate::queries::{Purpose, Question, What};
use crate::watch::Watch;
use crate::worker::{Message, Wish, full_text};
use alhazen::edits::Edits;
use alhazen::{BackendChoice, Camera, RendererOptions, Source};
use std::path::Path;

/// The picture counts as moving for so long (seconds) after the camera's last motion.
const MOVING: f64 = 0.15;
/// The longest side of pictures that fill the window.
const MAX_SIDE: f32 = 8192.0;

impl Viewer {
    /// The CPU renders at once; what was asked for is opened meanwhile and takes over.
    fn start_backend(&mut self) {
        if self.backend.options.backend != BackendChoice::Auto || self.backend.options.adapter.is_some() {
            if self.backend.options.backend != BackendChoice::Cpu {
                self.worker.send(Message::Switch(self.backend.options.clone()));
            }
            return;
        }
        // Looking for a GPU takes up to seconds, and there may be none.
        let (sender, options, wake) = (self.worker.sender(), self.backend.options.clone(), self.wake.clone());
        let probe = move || {
            if !alhazen::gpu::has_hardware() {
                return;
            }
            if let Ok(chosen) = alhazen::Renderer::choose(&options) {
                let adopt = Message::Adopt { renderer: Box::new(chosen.renderer), reason: chosen.reason };
                // The viewer may have ended meanwhile.
                let _ = sender.send(adopt);
                wake();
            }
        };
        if let Err(error) = std::thread::Builder::new().name("probe".into()).spawn(probe) {
            self.notice(format!("cannot look for GPUs: {error}"), true);
        }
    }

    /// Begins to load a scene; what is open stays until it is there.
    pub fn open_source(&mut self, source: Source) {
        self.keeps_camera = false;
        self.load(loading::Job::Open(source));
    }

    /// Loads the open file again.
    pub fn reload(&mut self) {
        let Some(document) = &self.document else {
            return self.notice("no file is open", false);
        };
        let source = document.source.clone();
        self.keeps_camera = true;
        self.load(loading::Job::Open(source));
    }

    fn load(&mut self, job: loading::Job) {
        if matches!(job, loading::Job::Open(_)) {
            // Only the last scene that was asked for is wanted.
            self.loading.retain(|l| !matches!(l.job, loading::Job::Open(_)));
        }
        let wake = self.wake.clone();
        self.loading.push(Loading::start(job, self.load_options.clone(), move || wake()));
    }

    /// Gives up what is being loaded.
    pub fn cancel_loading(&mut self) {
        self.loading.clear();
    }

    /// Tells the user something.
    pub fn notice(&mut self, text: impl Into<String>, is_error: bool) {
        let notice = Notice { text: text.into(), is_error, time: self.time };
        self.notices.retain(|n| n.text != notice.text);
        self.notices.push(notice);
    }

    /// Takes what the threads have done and tells them what is wanted. Call once a frame, before drawing.
    ///
    /// - `time`: seconds, from whatever beginning.
    pub fn tick(&mut self, ctx: &egui::Context, time: f64) {
        let dt = (time - self.time).clamp(0.0, 0.2) as f32;
        self.time = time;
        self.follow_pointer(ctx);
        self.take_loaded();
        while let Some(event) = self.worker.next_event() {
            self.take_event(event);
        }
        while let Some(answer) = self.queries.next_answer() {
            self.take_answer(ctx, answer);
        }
        for shot in self.worker.take_shots().into_iter().flatten() {
            self.take_shot(ctx, shot);
        }
        self.take_findings(ctx);
        self.take_dialog();
        self.follow_tev(ctx);
        if self.settings.watch && self.watch.as_mut().is_some_and(|w| w.has_changed(time)) {
            self.reload();
        }
        if let Some(later) = self.watch.as_ref().and_then(Watch::look_again) {
            ctx.request_repaint_after(later);
        }
        if self.playing && self.camera.path.is_some() {
            self.camera_time += dt;
            self.last_motion = time;
            ctx.request_repaint();
        }
        self.pass_time(ctx, dt);
        self.send_wishes(ctx);
    }

    /// Tells drags apart: each begins when a button is pressed, and its last change comes when it is
    /// let go.
    fn follow_pointer(&mut self, ctx: &egui::Context) {
        let (pressed, held, released) =
            ctx.input(|i| (i.pointer.any_pressed(), i.pointer.any_down(), i.pointer.any_released()));
        self.gestures += u64::from(pressed);
        self.gesture = (held || released).then_some(self.gestures);
    }

    /// Asks for the picture that is wanted now. Called after input as well, so that none waits for the next frame.
    pub fn send_wishes(&mut self, ctx: &egui::Context) {
        let moving = self.time - self.last_motion < MOVING;
        if moving {
            ctx.request_repaint_after(std::time::Duration::from_secs_f64(MOVING));
        }
        if self.sent.1 != Some(self.shown) {
            self.sent.1 = Some(self.shown);
            self.worker.send(Message::Show(self.shown));
        }
        let wish = Wish {
            job: self.job(),
            other: self.comparison.job(self),
            moving,
            spp: self.render.spp,
            sampling: self.render.sampling,
            noise: self.render.noise.map(f64::from),
        };
        if self.sent.0.as_ref() != Some(&wish) {
            self.worker.send(Message::Wish(Box::new(wish.clone())));
            self.sent.0 = Some(wish);
        }
        self.ask_for_outline(moving);
        self.ask_for_ground();
        self.ask_for_findings(ctx);
    }

    /// The room for the picture, physical pixels.
    pub fn set_room(&mut self, size: egui::Vec2) {
        let side = |v: f32| v.round().clamp(16.0, MAX_SIDE) as u32;
        let room = [side(size.x), side(size.y)];
        if room != self.room && self.render.size.is_none() {
            // A border that is dragged: pictures are quick until it rests.
            self.last_motion = self.time;
        }
        self.room = room;
    }

    /// Moves the camera.
    pub fn steer(&mut self, motion: impl FnOnce(&mut Camera)) {
        // From where it is on its path.
        let mut camera = Camera { path: None, ..self.camera.at(self.camera_time) };
        motion(&mut camera);
        self.camera = camera;
        (self.playing, self.camera_time, self.follows) = (false, 0.0, None);
        self.last_motion = self.time;
    }

    /// Looks through another camera.
    pub fn look_through(&mut self, camera: Camera) {
        self.camera = camera;
        (self.playing, self.camera_time, self.follows) = (false, 0.0, None);
    }

    /// Changes the scene; impossible changes are refused with a notice. See [`crate::history::History::change`].
    pub fn edit(&mut self, what: &str, change: impl FnOnce(&mut Edits)) {
        let Some(document) = &mut self.document else { return };
        document.set_gesture(self.gesture);
        let before = document.edits().clone();
        if let Err(error) = document.edit(what, self.time, change) {
            self.notice(full_text(&error), true);
        } else if *document.edits() != before {
            self.send_edits();
        }
    }

    fn send_edits(&mut self) {
        let Some(document) = &self.document else { return };
        self.edit_count += 1;
        self.clock.set_duration(document.scene().duration());
        self.worker.send(Message::Edit(
            document.edits().clone(),
            document.resources.clone(),
            document.moment().clone(),
        ));
        self.mend_selection();
    }

    /// Sends the render thread something.
    pub fn tell(&self, message: Message) {
        self.worker.send(message);
    }

    /// Another back end from now on.
    pub fn switch_backend(&mut self, options: RendererOptions) {
        self.backend.options = options.clone();
        self.settings.backend = options.backend.name().to_owned();
        self.worker.send(Message::Switch(options));
    }

    /// Asks what is at a point of the window.
    pub fn ask(&self, at: egui::Pos2, purpose: Purpose) {
        let job = self.job();
        let place = (at - self.place.min) / self.place.size();
        if !(0.0..1.0).contains(&place.x) || !(0.0..1.0).contains(&place.y) {
            return;
        }
        let (x, y) = (place.x * job.width as f32, place.y * job.height as f32);
        let what = What::Point { x, y, purpose };
        self.queries.ask(Question { camera: job.camera, width: job.width, height: job.height, what });
    }

    /// Remembers where settings are kept.
    pub fn save_settings(&mut self, path: &Path) {
        self.settings.side_panel = self.open.side;
        if let Err(error) = self.settings.save(path) {
            eprintln!("cannot write {}: {error}", path.display());
        }
    }
}
