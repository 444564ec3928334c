//! The render thread's own side.

mod frames;
mod passes;
mod publish;
mod sequence;

use super::recording::Sequence;
use super::{Event, Message, Pace, PassReport, Shared, Shown, Wish, lock};
use alhazen::edits::{Editable, Edits, Resources};
use alhazen::{
    BackendError, Control, Denoised, Denoiser, Film, Job, Moment, Renderer, RendererOptions, SceneTables,
};
use frames::Frames;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError};
use std::time::{Duration, Instant};

/// What the thread knows.
pub(super) struct State {
    inbox: Receiver<Message>,
    outbox: Sender<Event>,
    shared: Arc<Shared>,
    renderer: Renderer,
    threads: Option<usize>,
    scene: Option<Editable>,
    generation: u64,
    /// How often another picture was asked for.
    changes: u64,
    wish: Option<Wish>,
    shown: Shown,
    paused: bool,
    pace: Pace,
    /// The wish's picture and the other one.
    pictures: [Progress; 2],
    /// Whose turn it is.
    side: usize,
    /// What is rendered into files: the first now, the others after it.
    sequences: VecDeque<Sequence>,
    frames: Frames,
    /// What has to be done before the next pass.
    todo: Todo,
    /// Whether the last attempt failed and nothing has changed since.
    stuck: bool,
}

/// Work that messages have asked for.
#[derive(Default)]
struct Todo {
    switch: Option<RendererOptions>,
    edit: Option<(Edits, Resources, Moment)>,
    /// The renderer has no scene or an old one.
    load: bool,
    show_again: bool,
}

/// How far the current picture is.
#[derive(Default)]
struct Progress {
    /// Samples per pixel of the full picture.
    spp: u32,
    /// Time spent on it.
    total: Duration,
    /// Whether a pass of it has been made.
    begun: bool,
    /// Whether something of this camera has been shown.
    visible: bool,
    /// What was last rendered: the film shows this.
    rendered: Option<Rendered>,
    /// How many pixels that has: fewer than the job's at reduced size.
    pixels: u32,
    /// Whether it has all the samples that are wanted, or is good enough.
    done: bool,
    /// It without its noise, or as it was some passes ago.
    clean: Option<Clean>,
    /// The film, where two pictures take turns on one renderer.
    film: Option<Film>,
    last_pass: PassReport,
}

/// A picture without its noise.
struct Clean {
    denoiser: Denoiser,
    picture: Arc<Denoised>,
    /// Whether nothing has been added to the film since.
    is_current: bool,
    /// When it was made.
    made: Instant,
    /// How long that took.
    took: Duration,
}

/// What a film shows.
#[derive(Clone)]
struct Rendered {
    job: Arc<Job>,
    /// Whether it was made in a hurry at reduced size.
    preview: bool,
    /// Up to which change.
    changes: u64,
}

impl Progress {
    /// Begins anew; what is visible stays so.
    fn forget(&mut self) {
        *self = Self { visible: self.visible, ..Self::default() };
    }
}

impl State {
    pub fn new(
        renderer: Renderer,
        threads: Option<usize>,
        inbox: Receiver<Message>,
        outbox: Sender<Event>,
        shared: Arc<Shared>,
    ) -> Self {
        Self {
            inbox,
            outbox,
            shared,
            renderer,
            threads,
            scene: None,
            generation: 0,
            changes: 0,
            wish: None,
            shown: Shown::default(),
            paused: false,
            pace: Pace::new(false),
            pictures: Default::default(),
            side: 0,
            sequences: VecDeque::new(),
            frames: Frames::default(),
            todo: Todo::default(),
            stuck: false,
        }
    }

    /// Works until told to end.
    pub fn run(mut self) {
        self.tell_backend(String::new());
        loop {
            // From here on, whoever sends a message cancels this pass and no older one.
            let control = Arc::new(Control::new());
            {
                let mut running = lock(&self.shared.running);
                running.control = control.clone();
                running.finish = false;
            }
            if !self.take_messages() {
                return;
            }
            if let Err(error) = self.step(&control) {
                self.fail(error);
            }
        }
    }

    /// Takes all messages that there are; waits for one if there is nothing to do. False at the end.
    fn take_messages(&mut self) -> bool {
        loop {
            let message = if self.has_work() {
                match self.inbox.try_recv() {
                    Ok(message) => message,
                    Err(TryRecvError::Empty) => return true,
                    Err(TryRecvError::Disconnected) => return false,
                }
            } else {
                let Ok(message) = self.inbox.recv() else { return false };
                message
            };
            if matches!(message, Message::Quit) {
                return false;
            }
            self.take(message);
        }
    }

    fn has_work(&self) -> bool {
        let todo = &self.todo;
        let waits = todo.switch.is_some() || todo.edit.is_some() || todo.load || todo.show_again;
        !self.stuck && (waits || !self.sequences.is_empty() || self.may_render())
    }

    /// Whether there is a picture to go on with. One pass is all that a moving camera gets at a place.
    fn may_render(&self) -> bool {
        let unfinished = |w: &Wish| {
            let unfinished = |p: &Progress| if w.moving { !p.begun } else { !p.done };
            unfinished(&self.pictures[0]) || (w.other.is_some() && unfinished(&self.pictures[1]))
        };
        !self.paused && self.scene.is_some() && self.wish.as_ref().is_some_and(unfinished)
    }

    fn take(&mut self, message: Message) {
        self.stuck = false;
        self.changes += u64::from(message.changes_picture());
        match message {
            Message::Load { scene, edits, resources, generation } => {
                // What is rendered into files is of the scene that was open.
                (0..self.sequences.len()).for_each(|_| self.end_sequence());
                self.scene = Some(Editable::new(*scene));
                self.generation = generation;
                self.todo.edit = Some((edits, resources, Moment::default()));
                self.todo.load = true;
            }
            Message::Edit(edits, resources, moment) => self.todo.edit = Some((edits, resources, moment)),
            Message::Wish(wish) => self.take_wish(*wish),
            Message::Show(shown) => {
                self.todo.show_again |= shown != self.shown;
                self.shown = shown;
            }
            Message::Switch(options) => self.todo.switch = Some(options),
            Message::Adopt { renderer, reason } => {
                self.todo.switch = None;
                self.use_renderer(*renderer, reason);
            }
            Message::Pause(paused) => self.paused = paused,
            Message::Save(path) => match self.save(&path) {
                Ok(()) => self.tell(Event::Saved(path)),
                Err(error) => self.tell(Event::Failed(full_text(&*error))),
            },
            Message::Record(Some(recording)) => self.sequences.push_back(Sequence::new(*recording)),
            Message::Record(None) => self.end_sequence(),
            Message::Quit => {}
        }
    }

    fn take_wish(&mut self, wish: Wish) {
        let old = self.wish.replace(wish);
        let (Some(old), Some(new)) = (old, &self.wish) else { return };
        let compared = (old.other.is_some(), new.other.is_some());
        // Pixels with as many samples as others deserve can not go on with as many as others have.
        let spread = (old.sampling, new.sampling);
        let (spp, same_limits) = (new.spp, (old.spp, old.noise) == (new.spp, new.noise));
        let jobs = [(Some(&old.job), Some(&new.job)), (old.other.as_ref(), new.other.as_ref())];
        for (picture, (old, new)) in self.pictures.iter_mut().zip(jobs) {
            if old != new || compared.0 != compared.1 || spread.0 != spread.1 {
                let camera = |j: Option<&Job>| j.map(|j| (j.camera.clone(), j.width));
                *picture = Progress {
                    visible: picture.visible && camera(old) == camera(new),
                    rendered: picture.rendered.take(),
                    pixels: picture.pixels,
                    ..Progress::default()
                };
            } else if let (true, Some(rendered)) = (picture.begun, &mut picture.rendered) {
                rendered.changes = self.changes;
            }
            picture.done = picture.spp >= spp || (picture.done && same_limits);
        }
        // What there is may be all that is wanted.
        self.todo.show_again |= !self.may_render();
    }

    fn use_renderer(&mut self, renderer: Renderer, reason: String) {
        self.pace = Pace::new(renderer.backend_name() != "cpu");
        self.renderer = renderer;
        self.frames = Frames::default();
        self.forget_pictures();
        self.restart_recorded();
        self.todo.load = self.scene.is_some();
        self.tell_backend(reason);
    }

    fn tell_backend(&self, reason: String) {
        let (name, device) = (self.renderer.backend_name(), self.renderer.describe());
        self.tell(Event::Backend { name, device, reason });
    }

    fn tell(&self, event: Event) {
        // Without a window there is nobody to tell.
        let _ = self.outbox.send(event);
        (self.shared.wake)();
    }

    /// One thing of what there is to do.
    fn step(&mut self, control: &Control) -> Result<(), BackendError> {
        if let Some(options) = self.todo.switch.take() {
            match Renderer::choose(&options) {
                Ok(chosen) => self.use_renderer(chosen.renderer, chosen.reason),
                Err(error) => self.tell(Event::Failed(full_text(&error))),
            }
            return Ok(());
        }
        if let Some((edits, resources, moment)) = self.todo.edit.take() {
            let Some(scene) = &mut self.scene else { return Ok(()) };
            if let Err(error) = scene.set_at(&edits, &resources, &moment) {
                self.tell(Event::Failed(full_text(&error)));
            }
            return self.load();
        }
        if self.todo.load {
            return self.load();
        }
        // The film has nothing for the window while it is that of a file.
        if self.sequences.is_empty() && std::mem::take(&mut self.todo.show_again) {
            return (0..2).try_for_each(|side| self.show(side));
        }
        if !self.sequences.is_empty() {
            return self.record(control);
        }
        match self.wish.clone() {
            Some(wish) if self.may_render() => self.pass(&wish, control),
            _ => Ok(()),
        }
    }

    /// Brings the renderer to the scene.
    fn load(&mut self) -> Result<(), BackendError> {
        let anew = std::mem::take(&mut self.todo.load);
        self.restart_recorded();
        let Some(scene) = &self.scene else { return Ok(()) };
        self.pictures.iter_mut().for_each(Progress::forget);
        if anew {
            self.pace.forget();
            self.frames = Frames::default();
            let stats = self.renderer.load_tables(SceneTables::build(scene.scene()))?;
            self.tell(Event::Loaded { generation: self.generation, stats });
        } else {
            self.renderer.update(scene.scene())?;
        }
        if let Some(tables) = self.renderer.tables() {
            self.tell(Event::Tables(tables));
        }
        Ok(())
    }

    /// Begins all pictures anew, but what is visible stays so.
    fn forget_pictures(&mut self) {
        self.pictures.iter_mut().for_each(Progress::forget);
    }

    /// After an error of the back end: the CPU goes on where a device failed.
    fn fail(&mut self, error: BackendError) {
        let device_failed = matches!(error, BackendError::Device { .. });
        self.tell(Event::Failed(full_text(&error)));
        self.stuck = true;
        if device_failed && self.renderer.backend_name() != "cpu" {
            match Renderer::cpu(self.threads) {
                Ok(renderer) => {
                    self.use_renderer(renderer, "the CPU goes on where the device failed".into());
                    self.stuck = false;
                }
                Err(error) => self.tell(Event::Failed(full_text(&error))),
            }
        }
    }
}

/// An error with all its causes.
pub(crate) fn full_text(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}
