//! Running the window unattended, for tests, measurements and the pictures of the documentation: a
//! script of one step a line.

mod latency;
mod parse;
mod rounds;

pub use parse::{STEPS, ScriptError, Step, parse, steps_help};

use crate::viewer::{RectangleUse, Viewer};
use alhazen::edits::MaterialRecord;
use alhazen::navigation;
use alhazen::{Denoiser, RendererOptions, Source};
use latency::Latency;
use rounds::Rounds;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// A step that takes longer (seconds) has failed. Software drivers compile a shader for minutes
/// where other programs run beside them.
const STEP_LIMIT: f64 = 600.0;

/// What to do unattended.
#[derive(Clone, Debug, Default)]
pub struct Smoke {
    /// The window closes after so many frames, once the script is done.
    pub frames: u64,
    /// A picture of the window at the end.
    pub screenshot: Option<PathBuf>,
    /// What to do.
    pub script: Vec<Step>,
}

/// Why an unattended run has failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("step {number}, {step}: {reason}")]
pub struct SmokeError {
    /// Which step, from 1.
    pub number: usize,
    /// What it was to do.
    pub step: String,
    /// What went wrong.
    pub reason: String,
}

/// How far a run is.
pub struct Run {
    smoke: Smoke,
    steps: VecDeque<Step>,
    number: usize,
    /// How often the script has begun anew.
    rounds: Rounds,
    /// When the current step began, and what it remembers.
    begun: Option<(f64, Memory)>,
    frames: u64,
    started: f64,
    first_picture: Option<f64>,
    asked: bool,
    /// Lines for the one who started it.
    pub report: Vec<String>,
}

/// What a step remembers from its beginning.
#[derive(Clone, Debug, Default)]
struct Memory {
    frames: u64,
    pictures: u64,
    generation: u64,
    rounds: u32,
    bytes: u64,
    latency: Latency,
}

/// What the window has to do for a script.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Have this size, in physical pixels.
    Resize(u32, u32),
    /// A file was dropped.
    Drop(PathBuf),
    /// Close.
    Close,
}

impl Run {
    /// Begins a run at `time`, seconds since the program's start.
    pub fn new(smoke: Smoke, time: f64) -> Self {
        let steps = smoke.script.iter().cloned().collect();
        Self {
            smoke,
            steps,
            number: 1,
            rounds: Rounds::new(time),
            begun: None,
            frames: 0,
            started: time,
            first_picture: None,
            asked: false,
            report: Vec::new(),
        }
    }

    /// Goes on, once a frame.
    ///
    /// # Errors
    /// When a step fails or takes too long.
    pub fn frame(&mut self, viewer: &mut Viewer, ctx: &egui::Context) -> Result<Option<Request>, SmokeError> {
        self.frames += 1;
        let (time, pictures) = (viewer.time(), viewer.shots_seen());
        ctx.request_repaint();
        if self.first_picture.is_none() && pictures > 0 {
            self.first_picture = Some(time);
            self.report.push(format!("first picture after {:.3} s", time));
        }
        // The first scene says how it wants to be rendered; what scripts say comes after that.
        let opens = viewer.document.is_none() && !viewer.loading().is_empty();
        if viewer.capture_to.is_some() || opens {
            return Ok(None);
        }
        let Some(step) = self.steps.front().cloned() else { return Ok(self.end(viewer)) };
        let (begun, mut memory) = match self.begun.take() {
            Some(known) => known,
            None => {
                let memory = Memory {
                    frames: self.frames,
                    pictures,
                    generation: viewer.generation(),
                    ..Memory::default()
                };
                let request = self.start(&step, viewer, ctx)?;
                self.begun = Some((time, memory));
                if request.is_some() {
                    return Ok(request);
                }
                return Ok(None);
            }
        };
        if self.is_done(&step, viewer, time - begun, pictures, &mut memory) {
            self.steps.pop_front();
            self.number += 1;
            if let Step::Rounds(seconds) = step {
                self.end_round(time, seconds);
            }
            return Ok(None);
        }
        if matches!(step, Step::Open(_) | Step::Reload) && errors_since(viewer, begun) {
            return Err(self.error(&step, messages(viewer)));
        }
        if time - begun > STEP_LIMIT {
            let spp = viewer.shot().map_or(0, |s| s.spp);
            return Err(self.error(&step, format!("takes too long; {spp} spp, {}", messages(viewer))));
        }
        self.begun = Some((begun, memory));
        Ok(None)
    }

    /// Whether a file cannot be opened and the script expects that by its next step, `error`.
    fn is_refused(&self, viewer: &Viewer, elapsed: f64) -> bool {
        errors_since(viewer, viewer.time() - elapsed) && self.steps.get(1) == Some(&Step::Error)
    }

    /// Begins the script anew, or says what all rounds left.
    fn end_round(&mut self, time: f64, seconds: f64) {
        match self.rounds.end_of_one(time, seconds) {
            Some(report) => self.report.push(report),
            None => {
                // The steps that are done; this one is among them.
                let done = self.number - 1;
                self.smoke.script[..done].iter().rev().for_each(|step| self.steps.push_front(step.clone()));
                self.number = 1;
            }
        }
    }

    /// The end: enough frames, then a picture of the window, then it closes.
    fn end(&mut self, viewer: &mut Viewer) -> Option<Request> {
        if self.frames < self.smoke.frames {
            return None;
        }
        if let (Some(path), false) = (&self.smoke.screenshot, self.asked) {
            viewer.capture_to = Some(path.clone());
            self.asked = true;
            return None;
        }
        let seconds = viewer.time() - self.started;
        self.report.push(format!("{} frames in {seconds:.2} s", self.frames));
        Some(Request::Close)
    }

    fn error(&self, step: &Step, reason: impl Into<String>) -> SmokeError {
        SmokeError { number: self.number, step: format!("{step:?}"), reason: reason.into() }
    }

    /// Does what a step does at once.
    fn start(
        &mut self,
        step: &Step,
        viewer: &mut Viewer,
        ctx: &egui::Context,
    ) -> Result<Option<Request>, SmokeError> {
        match step {
            Step::Resize(width, height) => return Ok(Some(Request::Resize(*width, *height))),
            Step::Drop(path) => return Ok(Some(Request::Drop(path.clone()))),
            Step::Backend(backend) => {
                let threads = viewer.backend.options.threads;
                viewer.switch_backend(RendererOptions { backend: *backend, threads, ..Default::default() });
            }
            Step::Integrator(name) => {
                viewer.render.integrators.choose(name);
            }
            Step::Show(view) => {
                if let Some(realtime) = viewer.render.integrators.realtime_mut() {
                    realtime.show = *view;
                }
            }
            Step::Denoise(denoise) => viewer.shown.denoiser = denoise.then(Denoiser::default),
            Step::Filter(filter) => {
                if let Some(realtime) = viewer.render.integrators.realtime_mut() {
                    realtime.filter = *filter;
                }
            }
            Step::Moment(frame) => viewer.clock.seek(*frame),
            Step::Fps(fps) => viewer.clock.fps = *fps,
            Step::Clip(name) => viewer.play_clip(Some(name.clone())),
            Step::Play(_) if !viewer.clock.playing => viewer.clock.play(),
            Step::Spp(spp) => viewer.render.spp = *spp,
            Step::Material { id, key, value } => self.edit_material(step, viewer, *id, key, *value)?,
            Step::Open(name) => viewer.open_source(Source::parse(name)),
            Step::Reload => viewer.reload(),
            Step::Layer(layer) => viewer.shown.layer = *layer,
            Step::Tab(tab) => (viewer.open.side, viewer.open.tab) = (true, *tab),
            Step::Select(x, y) => {
                let at = viewer.place.min + egui::vec2(*x, *y) * viewer.place.size();
                viewer.act(crate::viewer::Action::Pick(at));
            }
            Step::Area(sides) => use_rectangle(viewer, RectangleUse::Select, *sides),
            Step::Crop(sides) => use_rectangle(viewer, RectangleUse::Crop, *sides),
            Step::Command(command) => viewer.run(*command, ctx),
            Step::Find(text) => viewer.open.outliner.filter.clone_from(text),
            Step::Save(path) => viewer.save_scene(path),
            Step::Picture(path) => viewer.use_file(crate::viewer::For::Picture, path.clone()),
            Step::Compare(path) => viewer.compare_with_file(path),
            Step::Record { path, frames, spp } => record(viewer, path, *frames, *spp),
            Step::Screenshot(path) => self.take_screenshot(path, viewer, ctx),
            Step::Wait(_)
            | Step::Choose(_)
            | Step::Error
            | Step::Frames(_)
            | Step::Play(_)
            | Step::Orbit(_)
            | Step::Restarts(_)
            | Step::Rounds(_) => {}
        }
        Ok(None)
    }

    /// Has the window captured, and says where in it the picture is.
    fn take_screenshot(&mut self, path: &Path, viewer: &mut Viewer, ctx: &egui::Context) {
        let (at, scale) = (viewer.place, ctx.pixels_per_point());
        let [x, y, width, height] =
            [at.min.x, at.min.y, at.width(), at.height()].map(|v| (v * scale).round() as u32);
        self.report.push(format!("picture at {x} {y} {width} {height}"));
        viewer.capture_to = Some(path.to_owned());
    }

    /// Changes a number of a material, as the panel does.
    fn edit_material(
        &self,
        step: &Step,
        viewer: &mut Viewer,
        id: u32,
        key: &str,
        value: f32,
    ) -> Result<(), SmokeError> {
        let document = viewer.document.as_ref().ok_or_else(|| self.error(step, "no scene is open"))?;
        let material = document.scene().materials.get(id as usize);
        let mut record = MaterialRecord::from(material.ok_or_else(|| self.error(step, "no such material"))?);
        match key {
            "roughness" => record.roughness = value,
            "metallic" => record.metallic = value,
            "transmission" => record.transmission = value,
            "ior" => record.ior = value,
            "red" => record.base_color[0] = value,
            "green" => record.base_color[1] = value,
            "blue" => record.base_color[2] = value,
            "emission" => record.emission = [value; 3],
            _ => return Err(self.error(step, format!("`{key}` is no number of a material"))),
        }
        viewer.edit("material", |edits| drop(edits.materials.insert(id, record)));
        Ok(())
    }

    /// Whether a step has done what it was to do.
    fn is_done(
        &mut self,
        step: &Step,
        viewer: &mut Viewer,
        elapsed: f64,
        pictures: u64,
        memory: &mut Memory,
    ) -> bool {
        match step {
            Step::Wait(spp) => {
                viewer.is_current() && viewer.shot().is_some_and(|s| !s.preview && s.spp >= *spp)
            }
            Step::Open(_) | Step::Reload => {
                viewer.generation() > memory.generation || self.is_refused(viewer, elapsed)
            }
            Step::Drop(_) => {
                // A file that is no good is an answer, too.
                viewer.generation() > memory.generation
                    || viewer.comparison.split().is_some()
                    || errors(viewer)
            }
            Step::Choose(path) => choose(viewer, path),
            Step::Error => errors(viewer) && dismiss(viewer),
            Step::Frames(count) => self.frames >= memory.frames + count,
            Step::Backend(backend) => backend_is(viewer, *backend) || errors(viewer),
            Step::Select(..) | Step::Area(_) => viewer.selection.is_some(),
            Step::Record { .. } => viewer.recording.is_none(),
            Step::Picture(path) => path.is_file(),
            Step::Play(seconds) => self.play(viewer, elapsed, *seconds, pictures, memory),
            Step::Orbit(seconds) => self.orbit(viewer, elapsed, *seconds, pictures, memory),
            Step::Restarts(count) => self.restarts(viewer, *count, memory),
            // Two frames, so that panels and window have followed.
            _ => self.frames >= memory.frames + 2,
        }
    }

    /// Turns the camera for a while and says how many pictures that gave.
    fn orbit(
        &mut self,
        viewer: &mut Viewer,
        elapsed: f64,
        seconds: f64,
        pictures: u64,
        memory: &mut Memory,
    ) -> bool {
        let shown = viewer.shot().map_or(0, |s| s.changes);
        memory.latency.frame(self.frames, viewer.time(), viewer.changes(), shown);
        viewer.steer(|c| navigation::orbit(c, glam::Vec2::new(0.004, 0.0)));
        if elapsed < seconds {
            return false;
        }
        let shot = viewer.shot();
        let made = shot.map_or((0, 0), |s| (s.linear.width(), s.linear.height()));
        let [width, height] = shot.map_or([0, 0], |s| s.image.size);
        self.report.push(format!(
            "orbit: {:.1} pictures/s of {}×{} pixels, shown as {width}×{height}, {:.1} frames/s of the window",
            (pictures - memory.pictures) as f64 / elapsed,
            made.0,
            made.1,
            (self.frames - memory.frames) as f64 / elapsed
        ));
        if let Some(pass) = shot.map(|s| &s.pass) {
            let [render, show] = [pass.render, pass.show].map(|time| time.as_secs_f64() * 1e3);
            let by = pass.denoised_by.as_deref().unwrap_or("nothing");
            self.report.push(format!("last pass: {render:.1} ms, shown in {show:.1} ms, denoised by {by}"));
        }
        self.report.extend(memory.latency.report());
        true
    }

    /// Lets the scene's time pass for a while and says how many pictures that gave.
    fn play(
        &mut self,
        viewer: &mut Viewer,
        elapsed: f64,
        seconds: f64,
        pictures: u64,
        memory: &Memory,
    ) -> bool {
        if elapsed < seconds {
            return false;
        }
        viewer.clock.playing = false;
        self.report.push(format!(
            "play: {:.1} pictures/s, frame {} of {}",
            (pictures - memory.pictures) as f64 / elapsed,
            viewer.clock.frame(),
            viewer.clock.last_frame()
        ));
        true
    }

    /// Begins the picture anew many times; says what memory that took.
    fn restarts(&mut self, viewer: &mut Viewer, count: u32, memory: &mut Memory) -> bool {
        if !viewer.is_current() {
            return false;
        }
        // What is allocated once is there after a few rounds.
        if memory.rounds == count / 10 {
            memory.bytes = alhazen::memory_bytes().unwrap_or(0);
        }
        if memory.rounds == count {
            let after = alhazen::memory_bytes().unwrap_or(0);
            let growth = after as f64 / memory.bytes.max(1) as f64 - 1.0;
            self.report.push(format!(
                "restarts: {count}, memory {} to {after} bytes, {:+.2} %",
                memory.bytes,
                growth * 100.0
            ));
            return true;
        }
        memory.rounds += 1;
        viewer.render.seed = viewer.render.seed.wrapping_add(1);
        false
    }
}

/// What the viewer says, for people.
fn messages(viewer: &Viewer) -> String {
    let notices: Vec<_> = viewer.notices.iter().map(|n| n.text.as_str()).collect();
    format!("messages: {notices:?}")
}

/// Whether there was an error since `time`, seconds.
fn errors_since(viewer: &Viewer, time: f64) -> bool {
    viewer.notices.iter().any(|n| n.is_error && n.time >= time)
}

/// Records a turntable.
fn record(viewer: &mut Viewer, path: &Path, frames: usize, spp: u32) {
    (viewer.open.record.frames, viewer.open.record.spp) = (frames, spp);
    viewer.record(path.to_owned());
}

/// Types a file into our own dialog and takes it, as Enter does. Returns whether that was possible:
/// not before it is open.
fn choose(viewer: &mut Viewer, path: &Path) -> bool {
    let Some((what, browser)) = &mut viewer.browser else { return false };
    browser.text = path.display().to_string();
    let (what, chosen) = (*what, browser.accept());
    let Some(file) = chosen else { return false };
    viewer.browser = None;
    viewer.use_file(what, file);
    true
}

fn errors(viewer: &Viewer) -> bool {
    viewer.notices.iter().any(|n| n.is_error)
}

fn dismiss(viewer: &mut Viewer) -> bool {
    viewer.notices.retain(|n| !n.is_error);
    true
}

fn backend_is(viewer: &Viewer, wanted: alhazen::BackendChoice) -> bool {
    use alhazen::BackendChoice::{All, Auto, Cpu, Gpu, Tracer};
    let name = viewer.backend.name.as_str();
    match wanted {
        Cpu => name == "cpu",
        Gpu => name.starts_with("gpu"),
        Tracer(kind) => name == kind.name(),
        All => name == "all",
        Auto => true,
    }
}

/// Drags a rectangle, whose sides are shares of the picture's size.
fn use_rectangle(viewer: &mut Viewer, wanted: RectangleUse, [left, top, right, bottom]: [f32; 4]) {
    let at = |x: f32, y: f32| viewer.place.min + egui::vec2(x, y) * viewer.place.size();
    viewer.use_rectangle(wanted, egui::Rect::from_min_max(at(left, top), at(right, bottom)));
}
