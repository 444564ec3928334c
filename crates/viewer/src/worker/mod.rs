//! The render thread: it owns the renderer, is told what picture is wanted, and publishes what it has.
//!
//! The thread of the window never waits for it. What is wanted are values, of which the latest counts
//! ([`Wish`], [`Shown`]); what comes back are events and the latest [`Shot`].

mod channels;
mod pace;
mod recording;
mod show;
mod thread;
mod upscale;
mod whole;

pub use channels::Channels;
pub use pace::Pace;
pub use recording::Recording;
pub use show::{Layer, Shown, display, heat, layer_image};
pub(crate) use thread::full_text;

use crate::remaining::Progress;
use alhazen::edits::{Edits, Resources};
use alhazen::{
    Adaptive, BackendError, Control, Job, LoadStats, Moment, PassTime, Renderer, RendererOptions, Sampling,
    Scene, SceneTables,
};
use std::cell::Cell;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// What picture is wanted of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Wish {
    /// Camera, full size, integrator, layers.
    pub job: Job,
    /// Another picture, rendered in turns with the first to compare them.
    pub other: Option<Job>,
    /// Whether the camera moves: then speed counts more than sharpness.
    pub moving: bool,
    /// Samples per pixel after which the picture is done; on average, where sampling is adaptive.
    pub spp: u32,
    /// How samples are spread over the picture. Pictures that take turns get the same everywhere.
    pub sampling: Sampling,
    /// Relative standard error of the first picture, below which all pictures are done.
    pub noise: Option<f64>,
}

impl Wish {
    /// How the next pass chooses its pixels; `None` gives all the same.
    ///
    /// - `spp`: samples that they have.
    fn adaptive(&self, preview: bool, spp: u32) -> Option<Adaptive> {
        match self.sampling {
            Sampling::Adaptive(adaptive) if !preview && self.other.is_none() && spp >= adaptive.pilot() => {
                Some(adaptive)
            }
            _ => None,
        }
    }

    /// Samples per pixel that the next pass may add to the `spp` that there are.
    fn left(&self, spp: u32) -> u32 {
        let end = match self.sampling {
            Sampling::Adaptive(adaptive) if self.other.is_none() && spp < adaptive.pilot() => {
                adaptive.pilot()
            }
            _ => self.spp,
        };
        end.min(self.spp).saturating_sub(spp).max(1)
    }
}

/// What the render thread is told.
pub enum Message {
    /// Render another scene from now on.
    Load {
        /// It.
        scene: Box<Scene>,
        /// What is changed of it.
        edits: Edits,
        /// The files that the edits need.
        resources: Resources,
        /// Comes back with its pictures.
        generation: u64,
    },
    /// Change the scene in this way and no other, and show it at this moment.
    Edit(Edits, Resources, Moment),
    /// Make this picture.
    Wish(Box<Wish>),
    /// Show pictures in this way.
    Show(Shown),
    /// Render with another back end.
    Switch(RendererOptions),
    /// Render with this renderer, which another thread has opened.
    Adopt {
        /// It.
        renderer: Box<Renderer>,
        /// Why, for the user.
        reason: String,
    },
    /// Render nothing until told otherwise.
    Pause(bool),
    /// Write the picture as it is now to a file, by its ending.
    Save(PathBuf),
    /// Render pictures into files, after those that are asked for already; `None` ends what is being
    /// rendered.
    Record(Option<Box<Recording>>),
    /// End.
    Quit,
}

impl Message {
    /// Whether it asks for another picture; see [`Shot::changes`].
    fn changes_picture(&self) -> bool {
        matches!(self, Self::Load { .. } | Self::Edit(..) | Self::Wish(_) | Self::Switch(_))
    }
}

/// What the render thread tells.
#[derive(Debug)]
pub enum Event {
    /// A scene has been handed to the back end.
    Loaded {
        /// Of [`Message::Load`].
        generation: u64,
        /// What it took.
        stats: LoadStats,
    },
    /// Another back end renders.
    Backend {
        /// Its name.
        name: &'static str,
        /// What it runs on.
        device: String,
        /// Why it is this one; empty where nobody chose.
        reason: String,
    },
    /// The tables of the scene that is rendered from now on, for ray queries.
    Tables(Arc<SceneTables>),
    /// A picture was written.
    Saved(PathBuf),
    /// How far the pictures are that are rendered into files.
    Recorded(Recorded),
    /// Something that the user should hear of.
    Notice(String),
    /// Something failed; rendering goes on with what there was, or stands still.
    Failed(String),
}

/// How far pictures are that are rendered into files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recorded {
    /// Pictures written.
    pub done: usize,
    /// Pictures in all.
    pub of: usize,
    /// Samples per pixel of the picture after those.
    pub spp: u32,
    /// Samples per pixel that it will have at most.
    pub wanted: u32,
    /// Its relative standard error, where that can end it.
    pub noise: Option<f64>,
    /// Relative standard error at which it is done.
    pub limit: Option<f64>,
    /// Time since the first picture was begun.
    pub elapsed: Duration,
    /// How many others wait for their turn.
    pub waiting: usize,
    /// Where a single picture goes; sequences have many files.
    pub path: Option<PathBuf>,
    /// Whether this was all, or it was ended.
    pub ended: bool,
}

impl Recorded {
    /// The share that is done, in `[0, 1]`.
    pub fn share(&self) -> f32 {
        let limit = self.limit.map(|limit| limit as f32);
        let picture = Progress { spp: self.spp, wanted: self.wanted, noise: self.noise, limit };
        let picture = if self.done < self.of { picture.share() } else { 0.0 };
        (self.done as f32 + picture) / self.of.max(1) as f32
    }

    /// The time that is left; `None` before there is anything to tell it by.
    pub fn left(&self) -> Option<Duration> {
        let share = f64::from(self.share());
        (share > 0.0).then(|| self.elapsed.mul_f64((1.0 / share - 1.0).max(0.0)))
    }
}

/// A picture as it is so far.
#[derive(Clone)]
pub struct Shot {
    /// Display values. Small pictures of a moving camera are enlarged.
    pub image: Arc<egui::ColorImage>,
    /// What is shown before exposure and curve: linear radiance, or the values of a layer. Three channels.
    pub linear: Arc<alhazen::Image>,
    /// Valid samples of each pixel.
    pub counts: Arc<Vec<u32>>,
    /// Samples per pixel made.
    pub spp: u32,
    /// 0 for the wish's picture, 1 for the other one.
    pub side: usize,
    /// The camera and everything else that it was made with, as wished: the film may be smaller.
    pub job: Arc<Job>,
    /// Whether it was made in a hurry at reduced size.
    pub preview: bool,
    /// The scene it shows.
    pub generation: u64,
    /// How many of the changes that the thread was told of it shows; see [`Worker::changes`].
    pub changes: u64,
    /// What the last pass took.
    pub pass: PassReport,
}

/// What a pass of the render thread took.
#[derive(Clone, Debug, Default)]
pub struct PassReport {
    /// Samples of all pixels together.
    pub samples: u64,
    /// Rays traced.
    pub rays: u64,
    /// Wall time of rendering.
    pub render: Duration,
    /// Wall time of fetching the film and making display values.
    pub show: Duration,
    /// Relative standard error of the picture, where somebody waits for it.
    pub noise: Option<f64>,
    /// What took the noise out of the picture, if anything did.
    pub denoised_by: Option<String>,
    /// Wall time of rendering this picture since it began.
    pub total: Duration,
    /// The device's passes, where it has a clock.
    pub device: Vec<PassTime>,
    /// `megakernel` or `wavefront`, where there is a choice.
    pub kernel: Option<&'static str>,
}

/// The pass that the thread is working on, so that others can end it early.
struct Running {
    control: Arc<Control>,
    /// Whether it is worth finishing although something newer is wanted: passes of a moving camera are short.
    finish: bool,
}

/// What both sides share.
struct Shared {
    running: Mutex<Running>,
    /// The newest picture of each side.
    latest: Mutex<[Option<Shot>; 2]>,
    wake: Box<dyn Fn() + Send + Sync>,
}

impl Shared {
    fn publish(&self, shot: Shot) {
        let side = shot.side;
        lock(&self.latest)[side] = Some(shot);
        (self.wake)();
    }
}

/// A thread that panicked while it held a lock leaves nothing half-done: values are replaced whole.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The render thread, seen from the window's.
pub struct Worker {
    messages: Sender<Message>,
    events: Receiver<Event>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    changes: Cell<u64>,
}

impl Worker {
    /// Starts the thread with a CPU renderer, which needs no probing.
    ///
    /// - `threads`: of the CPU; `None` uses all cores.
    /// - `wake`: is called when there is something new to see, from the render thread.
    ///
    /// # Errors
    /// When the system refuses threads.
    pub fn start(
        threads: Option<usize>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, BackendError> {
        let renderer = Renderer::cpu(threads)?;
        let (messages, inbox) = channel();
        let (outbox, events) = channel();
        let running = Mutex::new(Running { control: Arc::default(), finish: false });
        let shared = Arc::new(Shared { running, latest: Mutex::default(), wake: Box::new(wake) });
        let state = thread::State::new(renderer, threads, inbox, outbox, shared.clone());
        let thread = std::thread::Builder::new().name("render".into()).spawn(move || state.run());
        let thread = thread
            .map_err(|e| BackendError::View { reason: format!("cannot start the render thread: {e}") })?;
        Ok(Self { messages, events, shared, thread: Some(thread), changes: Cell::new(0) })
    }

    /// Tells the thread something. What it is working on is given up if the message makes it useless.
    pub fn send(&self, message: Message) {
        let outdates = match &message {
            Message::Wish(_) | Message::Pause(_) => Some(false),
            Message::Edit(..) => Some(false),
            Message::Load { .. }
            | Message::Switch(_)
            | Message::Adopt { .. }
            | Message::Record(_)
            | Message::Quit => Some(true),
            Message::Show(_) | Message::Save(_) => None,
        };
        self.changes.set(self.changes.get() + u64::from(message.changes_picture()));
        // The thread ends only when it is told to: nobody listens after that.
        let _ = self.messages.send(message);
        if let Some(at_once) = outdates {
            let running = lock(&self.shared.running);
            if at_once || !running.finish {
                running.control.cancel();
            }
        }
    }

    /// How often another picture was asked for: scenes, edits, wishes, back ends.
    pub fn changes(&self) -> u64 {
        self.changes.get()
    }

    /// What other threads tell the render thread with. It ends nothing early.
    pub fn sender(&self) -> Sender<Message> {
        self.messages.clone()
    }

    /// The newest picture of each side, if there is one that was not taken yet.
    pub fn take_shots(&self) -> [Option<Shot>; 2] {
        std::mem::take(&mut *lock(&self.shared.latest))
    }

    /// The next event.
    pub fn next_event(&self) -> Option<Event> {
        self.events.try_recv().ok()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.send(Message::Quit);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was printed when it happened.
            let _ = thread.join();
        }
    }
}
