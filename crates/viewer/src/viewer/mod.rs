//! All that the window shows and does, without the window: panels change it, [`Viewer::tick`] keeps it in step with the
//! threads that load, render and trace.

mod actions;
mod compare;
mod dialogs;
mod elsewhere;
mod events;
mod paint;
mod time;

pub use actions::{Action, COMMANDS, Command, CommandInfo};
pub use compare::Comparison;
pub use dialogs::{Dialog, For};
pub use elsewhere::Elsewhere;

use crate::clock::Clock;
use crate::document::Document;
use crate::loading::{self, Loading};
use crate::queries::{Outline, Purpose, Queries, Question, Seen, What};
use crate::render_settings::RenderSettings;
use crate::settings::Settings;
use crate::statistics::Statistics;
use crate::viewport::Zoom;
use crate::watch::Watch;
use crate::worker::{Message, Shot, Shown, Wish, Worker, full_text};
use alhazen::edits::Edits;
use alhazen::{
    BackendChoice, BackendError, Camera, Job, LoadOptions, LoadStats, RendererOptions, Scene, Source,
    ToneMapping,
};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The picture counts as moving for so long (seconds) after the camera's last motion.
const MOVING: f64 = 0.15;
/// The longest side of pictures that fill the window.
const MAX_SIDE: f32 = 8192.0;

/// What the viewer begins with.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// How files are loaded.
    pub load: LoadOptions,
    /// What renders.
    pub renderer: RendererOptions,
    /// Width and height of pictures; `None` fills the window.
    pub size: Option<[u32; 2]>,
    /// What was remembered.
    pub settings: Settings,
}

/// What is selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selection {
    /// The object.
    pub object: u32,
    /// The material at the place that was picked.
    pub material: u32,
}

/// A message that the user has not dismissed.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// What happened.
    pub text: String,
    /// Whether it is an error.
    pub is_error: bool,
    /// When it was told, seconds.
    pub time: f64,
}

/// What renders.
#[derive(Clone, Debug, Default)]
pub struct BackendState {
    /// What was asked for.
    pub options: RendererOptions,
    /// What does it.
    pub name: String,
    /// On what.
    pub device: String,
    /// Why, where somebody chose.
    pub reason: String,
    /// Adapters of this machine, once they are known.
    pub adapters: Vec<String>,
    /// What the scene takes.
    pub stats: LoadStats,
}

/// All of it.
pub struct Viewer {
    /// The open scene; `None` before the first is there.
    pub document: Option<Document>,
    /// The camera that is looked through.
    pub camera: Camera,
    /// Where a moving camera is on its path, seconds.
    pub camera_time: f32,
    /// Whether the camera follows its path.
    pub playing: bool,
    /// Which camera of the scene is looked through, until it is steered away.
    pub follows: Option<usize>,
    /// Time in the scene.
    pub clock: Clock,
    /// Views that the user has kept.
    pub views: Vec<Camera>,
    /// What is rendered.
    pub render: RenderSettings,
    /// How it is shown.
    pub shown: Shown,
    /// How the picture lies in the window.
    pub zoom: Zoom,
    /// Another picture beside it.
    pub comparison: Comparison,
    /// Where in the window the picture is, points.
    pub place: egui::Rect,
    /// Where the pointer is over the picture.
    pub pointer: Option<egui::Pos2>,
    /// What is under it.
    pub under_pointer: Option<Seen>,
    /// What is selected.
    pub selection: Option<Selection>,
    /// What renders.
    pub backend: BackendState,
    /// How fast it is.
    pub statistics: Statistics,
    /// What the user should read.
    pub notices: Vec<Notice>,
    /// Files that a scene asks for and that the user has not been asked about.
    pub elsewhere: Option<Elsewhere>,
    /// What is remembered.
    pub settings: Settings,
    /// What nodes of textures look like.
    pub previews: crate::node_previews::NodePreviews,
    /// Which panels and windows are open.
    pub open: crate::panels::Open,
    /// A sequence that is being rendered: pictures done, and in all.
    pub recording: Option<(usize, usize)>,
    /// Whether rendering stands still.
    pub paused: bool,
    /// A picture of the window is wanted here.
    pub capture_to: Option<PathBuf>,
    /// The window should close.
    pub quit: bool,
    /// The window should fill the screen.
    pub full_screen: bool,
    /// The newest picture of each side.
    shots: [Option<Shot>; 2],
    textures: [Option<egui::TextureHandle>; 2],
    outline: Option<(Question, Outline, Option<egui::TextureHandle>)>,
    asked_outline: Option<(Question, u64)>,
    edit_count: u64,
    room: [u32; 2],
    worker: Worker,
    queries: Queries,
    loading: Vec<Loading>,
    dialog: Option<Dialog>,
    watch: Option<Watch>,
    load_options: LoadOptions,
    /// Folders that the user has been asked about.
    asked_about: BTreeSet<PathBuf>,
    home: Camera,
    sent: (Option<Wish>, Option<Shown>),
    time: f64,
    last_motion: f64,
    /// When the scene was last brought to another moment, and which change that was.
    last_moment: (f64, u64),
    generation: u64,
    /// A reload keeps the camera.
    keeps_camera: bool,
    fixed_size: Option<[u32; 2]>,
    shots_seen: u64,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl Viewer {
    /// A viewer that opens `source`.
    ///
    /// - `wake`: makes a frame soon; is called from other threads.
    ///
    /// # Errors
    /// When the system refuses threads.
    pub fn new(
        source: Source,
        start: Start,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, BackendError> {
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
        let of_worker = wake.clone();
        let worker = Worker::start(start.renderer.threads, move || of_worker())?;
        let of_queries = wake.clone();
        let queries = Queries::start(move || of_queries());
        let empty = Job::for_scene(&Scene::default());
        let mut viewer = Self {
            document: None,
            camera: empty.camera.clone(),
            camera_time: 0.0,
            playing: false,
            follows: None,
            clock: Clock::default(),
            views: Vec::new(),
            render: RenderSettings { size: start.size, ..RenderSettings::of(&empty, None) },
            shown: Shown::default(),
            zoom: Zoom::default(),
            comparison: Comparison::default(),
            place: egui::Rect::ZERO,
            pointer: None,
            under_pointer: None,
            selection: None,
            backend: BackendState { options: start.renderer, name: "cpu".into(), ..BackendState::default() },
            statistics: Statistics::default(),
            notices: Vec::new(),
            elsewhere: None,
            previews: Default::default(),
            open: crate::panels::Open { side: start.settings.side_panel, ..Default::default() },
            settings: start.settings,
            recording: None,
            paused: false,
            capture_to: None,
            quit: false,
            full_screen: false,
            shots: [None, None],
            textures: [None, None],
            outline: None,
            asked_outline: None,
            edit_count: 0,
            room: [640, 360],
            worker,
            queries,
            loading: Vec::new(),
            dialog: None,
            watch: None,
            load_options: start.load,
            asked_about: BTreeSet::new(),
            home: empty.camera,
            sent: (None, None),
            time: 0.0,
            last_motion: f64::NEG_INFINITY,
            last_moment: (f64::NEG_INFINITY, 0),
            generation: 0,
            keeps_camera: false,
            fixed_size: start.size,
            shots_seen: 0,
            wake,
        };
        viewer.open_source(source);
        viewer.start_backend();
        Ok(viewer)
    }

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
        let Some(document) = &self.document else { return };
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

    /// What is being loaded.
    pub fn loading(&self) -> &[Loading] {
        &self.loading
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
        self.take_dialog();
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
    }

    /// The picture that is wanted, with the camera where it is now.
    pub fn job(&self) -> Job {
        let camera = Camera { path: None, ..self.camera.at(self.camera_time) };
        // How it is shown is no reason to begin anew.
        self.render.job(camera, self.size(), &self.shown, ToneMapping::default())
    }

    /// Width and height of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.render.size.unwrap_or(self.room)
    }

    /// Width over height of the picture.
    pub fn aspect(&self) -> f32 {
        let [width, height] = self.size();
        width as f32 / height as f32
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

    /// How large the scene is, metres: speeds follow it.
    pub fn scene_size(&self) -> f32 {
        let bounds = self.document.as_ref().and_then(|d| d.scene().bounds());
        bounds.map_or(1.0, |(low, high)| (high - low).length()).clamp(1e-3, 1e6)
    }

    /// Changes the scene; impossible changes are refused with a notice. See [`crate::history::History::change`].
    pub fn edit(&mut self, what: &str, change: impl FnOnce(&mut Edits)) {
        let Some(document) = &mut self.document else { return };
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
        let gone = |s: &Selection| {
            let removed = document.edits().objects.get(&s.object).is_some_and(|o| o.removed);
            removed || s.object as usize >= document.scene().instances.len()
        };
        if self.selection.as_ref().is_some_and(gone) {
            self.selection = None;
        }
        if let Some(selection) = &mut self.selection {
            let materials = document.scene().materials.len();
            if selection.material as usize >= materials {
                selection.material = document.material_of(selection.object).unwrap_or(0);
            }
        }
    }

    /// The newest picture.
    pub fn shot(&self) -> Option<&Shot> {
        self.shots[0].as_ref()
    }

    /// Which of the scenes that were opened is open.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// How many pictures the render thread has sent so far.
    pub fn shots_seen(&self) -> u64 {
        self.shots_seen
    }

    /// How often another picture was asked for; pictures say how many of these changes they show.
    pub fn changes(&self) -> u64 {
        self.worker.changes()
    }

    /// Whether the newest picture shows everything as it is now.
    pub fn is_current(&self) -> bool {
        let current =
            |s: &Shot| s.changes == self.changes() && s.generation == self.generation && *s.job == self.job();
        // A moment that the render thread was not yet told of has no picture.
        let in_time = self.document.as_ref().is_none_or(|d| *d.moment() == self.clock.moment());
        in_time && self.loading().is_empty() && self.shot().is_some_and(current)
    }

    /// Seconds, as [`Viewer::tick`] was told.
    pub fn time(&self) -> f64 {
        self.time
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
