//! The render thread's own side.

use super::recording::Sequence;
use super::show::{Layer, display, layer_image};
use super::{Event, Message, Pace, PassReport, Shared, Shot, Shown, Wish, lock};
use alhazen::edits::{Editable, Edits, Resources};
use alhazen::{
    BackendError, Control, Denoised, Denoiser, Description, Film, Job, Moment, Renderer, RendererOptions,
    SceneTables,
};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError};
use std::time::{Duration, Instant};

/// Samples per pixel below which an error estimate is none.
const LEAST_TO_TELL: u32 = 16;

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
    sequence: Option<Sequence>,
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
    /// Whether it has all the samples that are wanted, or is good enough.
    done: bool,
    /// It without its noise, and what has done that; while nothing is added.
    denoised: Option<(Denoiser, Arc<Denoised>)>,
    /// The film, where two pictures take turns on one renderer.
    film: Option<Film>,
    last_pass: PassReport,
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
            sequence: None,
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
        !self.stuck && (waits || self.sequence.is_some() || self.may_render())
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
            Message::Record(Some(recording)) => self.sequence = Some(Sequence::new(*recording)),
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
        self.forget_pictures();
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
        if std::mem::take(&mut self.todo.show_again) {
            return (0..2).try_for_each(|side| self.show(side));
        }
        if self.sequence.is_some() {
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
        let Some(scene) = &self.scene else { return Ok(()) };
        self.pictures.iter_mut().for_each(Progress::forget);
        if anew {
            self.pace.forget();
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

    /// Renders one pass and shows it.
    fn pass(&mut self, wish: &Wish, control: &Control) -> Result<(), BackendError> {
        let start = Instant::now();
        self.side = self.next_side(wish);
        let compares = wish.other.is_some();
        let side = self.side;
        let whole = wish.other.as_ref().filter(|_| side == 1).unwrap_or(&wish.job);
        let pixels = u64::from(whole.width) * u64::from(whole.height);
        let picture = &self.pictures[side];
        let preview = wish.moving || (!picture.visible && self.pace.needs_preview(pixels));
        let job = if preview { scaled(whole, self.pace.moving_scale(pixels)) } else { whole.clone() };
        let samples =
            if preview { 1 } else { self.pace.samples(pixels, picture.spp).min(wish.left(picture.spp)) };
        let adaptive = wish.adaptive(preview, picture.spp);
        let mut view = job.view(0.0);
        view.first_sample = if preview { 0 } else { picture.spp };
        if adaptive.is_some() {
            // Each pixel goes on from what it has.
            view.first_sample = 0;
        } else if view.first_sample == 0 || compares {
            // The film may have a picture of the same view that was given up half-way, or the other one.
            self.renderer.restart();
        }
        lock(&self.shared.running).finish = preview;
        let stats = match adaptive {
            Some(adaptive) => self.renderer.render_round(&view, &adaptive, samples, control)?,
            None => Some(self.renderer.render_pass(&view, samples, control)?),
        };
        let render = start.elapsed();
        let Some(stats) = stats else {
            self.pictures[side].done = true;
            return self.show(side);
        };
        for notice in self.renderer.take_notices() {
            self.tell(Event::Notice(notice));
        }
        let picture = &mut self.pictures[side];
        if stats.cancelled {
            // Some pixels have more samples than others.
            if !compares {
                picture.spp = 0;
            }
            return Ok(());
        }
        if compares {
            keep(picture, self.renderer.film()?, preview || view.first_sample == 0)?;
        }
        if !preview {
            picture.spp += samples;
        }
        (picture.begun, picture.visible) = (true, true);
        (picture.denoised, picture.done) = (None, !preview && picture.spp >= wish.spp);
        picture.total += render;
        picture.rendered = Some(Rendered { job: Arc::new(whole.clone()), preview, changes: self.changes });
        picture.last_pass = PassReport {
            samples: stats.samples,
            rays: stats.rays,
            render,
            noise: None,
            denoised_by: None,
            show: Duration::ZERO,
            total: picture.total,
            device: self.renderer.take_passes(),
            kernel: self.renderer.kernel(),
        };
        self.look_at_noise(wish, side)?;
        self.show(side)?;
        if !self.shown.layer.is_geometric() {
            self.pace.record(preview, stats.samples, start.elapsed());
        }
        Ok(())
    }

    /// Finds out whether a picture is good enough.
    fn look_at_noise(&mut self, wish: &Wish, side: usize) -> Result<(), BackendError> {
        let Some(limit) = wish.noise else { return Ok(()) };
        let noise = match &self.pictures[side].film {
            Some(film) => film.relative_error(),
            None => self.renderer.film()?.and_then(Film::relative_error),
        };
        let picture = &mut self.pictures[side];
        picture.last_pass.noise = noise;
        // An error estimate of a few samples is not one.
        let is_estimate = picture.spp >= LEAST_TO_TELL;
        picture.done |= is_estimate && noise.is_some_and(|noise| noise <= limit);
        Ok(())
    }

    /// The picture of a side without its noise, if that is wanted and the picture is done.
    fn denoised(&mut self, side: usize) -> Result<Option<Arc<Denoised>>, BackendError> {
        let picture = &self.pictures[side];
        let Some(denoiser) = self.shown.denoiser else { return Ok(None) };
        if !picture.done || self.shown.layer != Layer::Picture {
            return Ok(None);
        }
        if let Some((by, denoised)) = &picture.denoised
            && *by == denoiser
        {
            return Ok(Some(denoised.clone()));
        }
        let film = match &picture.film {
            Some(film) => Some(film),
            None => self.renderer.film()?,
        };
        let Some(film) = film else { return Ok(None) };
        match denoiser.run(film) {
            Ok(denoised) => {
                let denoised = Arc::new(denoised);
                self.pictures[side].denoised = Some((denoiser, denoised.clone()));
                Ok(Some(denoised))
            }
            Err(error) => {
                self.tell(Event::Notice(full_text(&error)));
                Ok(None)
            }
        }
    }

    /// Whose turn it is: pictures that are compared take turns until one is done.
    fn next_side(&self, wish: &Wish) -> usize {
        if wish.other.is_none() {
            return 0;
        }
        let done = |side: usize| {
            let picture = &self.pictures[side];
            if wish.moving { picture.begun } else { picture.done }
        };
        let next = 1 - self.side;
        if done(next) { self.side } else { next }
    }

    /// Publishes a film as it is.
    fn show(&mut self, side: usize) -> Result<(), BackendError> {
        let Some(Rendered { job, preview, changes }) = self.pictures[side].rendered.clone() else {
            return Ok(());
        };
        let start = Instant::now();
        let denoised = self.denoised(side)?;
        let picture = &self.pictures[side];
        let film = match &picture.film {
            Some(film) => film,
            None => match self.renderer.film()? {
                Some(film) => film,
                None => return Ok(()),
            },
        };
        let linear = match &denoised {
            Some(denoised) => denoised.picture.clone(),
            None => layer_image(film, self.shown.layer),
        };
        let image = display(&linear, film, &self.shown);
        let counts = film.pixels().iter().map(|p| p.count() as u32).collect();
        let denoised_by = denoised.map(|d| d.by.clone());
        let pass = PassReport { show: start.elapsed(), denoised_by, ..picture.last_pass.clone() };
        self.shared.publish(Shot {
            image: Arc::new(image),
            linear: Arc::new(linear),
            counts: Arc::new(counts),
            spp: picture.spp.max(1),
            side,
            job,
            preview,
            generation: self.generation,
            changes,
            pass,
        });
        Ok(())
    }

    /// Writes the first picture as it is.
    fn save(&mut self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        let denoised = self.denoised(0)?;
        let picture = &self.pictures[0];
        let Some(Rendered { job, .. }) = picture.rendered.clone() else {
            return Err("there is no picture yet".into());
        };
        let (spp, total) = (picture.spp.max(1), picture.total);
        let settings = self.settings(&job);
        let backends = BTreeSet::from([self.renderer.backend_name().to_owned()]);
        let film = match &self.pictures[0].film {
            Some(film) => film,
            None => self.renderer.film()?.ok_or("there is no picture yet")?,
        };
        let mut metadata = alhazen::metadata(&settings, film, spp, &backends, total);
        if let Some(denoised) = &denoised {
            metadata.insert("denoiser".into(), denoised.by.clone());
        }
        let colour = denoised.as_ref().map(|d| &d.picture);
        let encoding = alhazen::output::Encoding::default();
        alhazen::output::write_as(path, film, colour, &self.shown.tone, &metadata, &encoding)?;
        Ok(())
    }

    /// What files say about how a picture was made.
    fn settings(&self, job: &Job) -> std::collections::BTreeMap<String, String> {
        let empty = alhazen::Scene::default();
        let scene = self.scene.as_ref().map_or(&empty, Editable::scene);
        Description::new(&scene.name, &[], scene).settings(job)
    }

    /// A pass of the sequence that is being recorded.
    fn record(&mut self, control: &Control) -> Result<(), BackendError> {
        let Some(sequence) = &mut self.sequence else { return Ok(()) };
        let Some(job) = sequence.job() else {
            self.end_sequence();
            return Ok(());
        };
        let mut view = job.view(0.0);
        view.first_sample = sequence.spp;
        if sequence.spp == 0 {
            self.renderer.restart();
        }
        let samples = (sequence.recording.spp - sequence.spp).clamp(1, 16);
        let stats = self.renderer.render_pass(&view, samples, control)?;
        if stats.cancelled {
            sequence.spp = 0;
            return Ok(());
        }
        sequence.spp += samples;
        if sequence.spp < sequence.recording.spp {
            return Ok(());
        }
        let (spp, path) = (sequence.spp, sequence.path());
        let settings = self.settings(&job);
        let backends = BTreeSet::from([self.renderer.backend_name().to_owned()]);
        if let Some(film) = self.renderer.film()? {
            let metadata = alhazen::metadata(&settings, film, spp, &backends, stats.elapsed);
            if let Err(error) = alhazen::output::write(&path, film, &job.tone, &metadata) {
                self.tell(Event::Failed(full_text(&error)));
                self.end_sequence();
                return Ok(());
            }
        }
        let rendered = Rendered { job: Arc::new(job), preview: false, changes: self.changes };
        self.pictures[0] = Progress { rendered: Some(rendered), spp, visible: true, ..Progress::default() };
        self.show(0)?;
        if let Some(sequence) = &mut self.sequence {
            (sequence.next, sequence.spp) = (sequence.next + 1, 0);
            let (done, of) = (sequence.next, sequence.recording.cameras.len());
            self.tell(Event::Recorded { done, of, ended: false });
        }
        Ok(())
    }

    fn end_sequence(&mut self) {
        if let Some(sequence) = self.sequence.take() {
            let of = sequence.recording.cameras.len();
            self.tell(Event::Recorded { done: sequence.next, of, ended: true });
        }
        // The film has a picture of the sequence.
        self.forget_pictures();
        self.renderer.restart();
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

/// Adds a pass to the film of a picture that takes turns with another.
fn keep(picture: &mut Progress, made: Option<&Film>, first: bool) -> Result<(), BackendError> {
    let Some(made) = made else { return Ok(()) };
    match &mut picture.film {
        Some(film) if !first => film.merge(made)?,
        film => *film = Some(made.clone()),
    }
    Ok(())
}

/// The same picture with fewer pixels.
fn scaled(job: &Job, scale: f32) -> Job {
    let side = |n: u32| ((n as f32 * scale).round() as u32).max(1);
    Job { width: side(job.width), height: side(job.height), ..job.clone() }
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
