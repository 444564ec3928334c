//! The state of the window, and what can be read off it.

use super::choosing::{CopiedMaterial, Rectangle};
use super::compare::Comparison;
use super::dialogs::{Dialog, For};
use super::elsewhere::Elsewhere;
use super::first::FirstView;
use super::sending::Sending;
use super::tools::{Ground, Tools};
use crate::analysis::Analyst;
use crate::browser::Browser;
use crate::clock::Clock;
use crate::document::Document;
use crate::gizmo::Gizmo;
use crate::loading::Loading;
use crate::panels::Open;
use crate::queries::{Outline, Queries, Question, Seen};
use crate::render_settings::RenderSettings;
use crate::settings::Settings;
use crate::statistics::Statistics;
use crate::viewport::Zoom;
use crate::watch::Watch;
use crate::worker::{Recorded, Shot, Shown, Wish, Worker};
use alhazen::{
    BackendError, Camera, InstanceId, Job, LoadOptions, LoadStats, RendererOptions, Scene, Source,
    TevAddress, ToneMapping,
};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

/// What the viewer begins with.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// How files are loaded.
    pub load: LoadOptions,
    /// What renders.
    pub renderer: RendererOptions,
    /// Width and height of pictures; `None` fills the window.
    pub size: Option<[u32; 2]>,
    /// How the first scene is looked at.
    pub first: FirstView,
    /// What was remembered.
    pub settings: Settings,
    /// The tev that is sent pictures from the beginning.
    pub tev: Option<TevAddress>,
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
    /// What is looked into.
    pub tools: Tools,
    /// Where in the window the picture is, points.
    pub place: egui::Rect,
    /// Where the pointer is over the picture.
    pub pointer: Option<egui::Pos2>,
    /// What is under it.
    pub under_pointer: Option<Seen>,
    /// The active one of the selected objects.
    pub selection: Option<Selection>,
    /// The other selected objects.
    pub also: BTreeSet<InstanceId>,
    /// A rectangle that is dragged over the picture.
    pub rectangle: Rectangle,
    /// The material that was copied.
    pub copied_material: Option<CopiedMaterial>,
    /// What moves, turns and scales it.
    pub gizmo: Gizmo,
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
    pub open: Open,
    /// A dialog of our own that asks for a file.
    pub browser: Option<(For, Browser)>,
    /// What is being rendered into files.
    pub recording: Option<Recorded>,
    /// Pictures that were rendered into files since the start: somebody waits for them.
    pub finished: u64,
    /// Whether rendering stands still.
    pub paused: bool,
    /// A picture of the window is wanted here.
    pub capture_to: Option<PathBuf>,
    /// The window should close.
    pub quit: bool,
    /// The window should fill the screen.
    pub full_screen: bool,
    /// The newest picture of each side.
    pub(super) shots: [Option<Shot>; 2],
    pub(super) textures: [Option<egui::TextureHandle>; 2],
    pub(super) outline: Option<(Question, Outline, Option<egui::TextureHandle>)>,
    pub(super) ground: Ground,
    /// Where the light was told to fall, until the answer comes.
    pub(super) aimed_at: Option<egui::Pos2>,
    pub(super) asked_outline: Option<(Question, u64)>,
    pub(super) edit_count: u64,
    /// How many drags there were, and the one that goes on.
    pub(super) gestures: u64,
    pub(super) gesture: Option<u64>,
    /// Whether keys went to a field in the frame before.
    pub(super) typed: bool,
    pub(super) room: [u32; 2],
    pub(super) worker: Worker,
    pub(super) queries: Queries,
    pub(super) analyst: Analyst,
    pub(super) loading: Vec<Loading>,
    pub(super) dialog: Option<Dialog>,
    pub(super) sending: Option<Sending>,
    /// Where a tev is looked for.
    pub(super) tev_address: TevAddress,
    /// What was asked for before the first scene was there.
    pub(super) first_view: Option<FirstView>,
    /// The desktop has shown no dialog when it should have.
    pub(super) desktop_lacks_dialogs: bool,
    /// Where the last file was that the user has chosen.
    pub(super) last_folder: Option<PathBuf>,
    pub(super) watch: Option<Watch>,
    pub(super) load_options: LoadOptions,
    /// Folders that the user has been asked about.
    pub(super) asked_about: BTreeSet<PathBuf>,
    pub(super) home: Camera,
    pub(super) sent: (Option<Wish>, Option<Shown>),
    pub(super) time: f64,
    pub(super) last_motion: f64,
    /// When the scene was last brought to another moment, and which change that was.
    pub(super) last_moment: (f64, u64),
    pub(super) generation: u64,
    /// A reload keeps the camera.
    pub(super) keeps_camera: bool,
    pub(super) fixed_size: Option<[u32; 2]>,
    pub(super) shots_seen: u64,
    pub(super) wake: Arc<dyn Fn() + Send + Sync>,
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
        let of_analyst = wake.clone();
        let analyst = Analyst::start(move || of_analyst());
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
            tools: Tools::default(),
            place: egui::Rect::ZERO,
            pointer: None,
            under_pointer: None,
            selection: None,
            also: BTreeSet::new(),
            rectangle: Rectangle::default(),
            copied_material: None,
            gizmo: Gizmo::default(),
            backend: BackendState { options: start.renderer, name: "cpu".into(), ..BackendState::default() },
            statistics: Statistics::default(),
            notices: Vec::new(),
            elsewhere: None,
            previews: Default::default(),
            browser: None,
            open: Open { side: start.settings.side_panel, ..Default::default() },
            settings: start.settings,
            recording: None,
            finished: 0,
            paused: false,
            capture_to: None,
            quit: false,
            full_screen: false,
            shots: [None, None],
            textures: [None, None],
            outline: None,
            ground: Ground::default(),
            aimed_at: None,
            asked_outline: None,
            edit_count: 0,
            gestures: 0,
            gesture: None,
            typed: false,
            room: [640, 360],
            worker,
            queries,
            analyst,
            loading: Vec::new(),
            dialog: None,
            sending: None,
            tev_address: start.tev.clone().unwrap_or_default(),
            first_view: Some(start.first),
            desktop_lacks_dialogs: false,
            last_folder: None,
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
        if let Some(address) = start.tev {
            viewer.send_to_tev(address);
        }
        viewer.start_backend();
        Ok(viewer)
    }

    /// What is being loaded.
    pub fn loading(&self) -> &[Loading] {
        &self.loading
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

    /// How large the scene is, metres: speeds follow it.
    pub fn scene_size(&self) -> f32 {
        let bounds = self.document.as_ref().and_then(|d| d.scene().bounds());
        bounds.map_or(1.0, |(low, high)| (high - low).length()).clamp(1e-3, 1e6)
    }

    /// The newest picture.
    pub fn shot(&self) -> Option<&Shot> {
        self.shots[0].as_ref()
    }

    /// Which of the scenes that were opened is open.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// How often the scene was changed.
    pub fn edit_count(&self) -> u64 {
        self.edit_count
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
}
