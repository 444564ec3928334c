//! Where measured frames go, to nobody or to a window, and the loop that measures them.

use super::frames::{FrameArgs, Measured, milliseconds};
use crate::console::{say, write_text};
use alhazen::gpu::Gpu;
use alhazen::gpu::frames::chrome_trace;
use alhazen::gpu::live::LiveScene;
use alhazen::gpu::screen::Screen;
use alhazen::gpu::tracer::upper::{Place, UpperUpdate};
use alhazen::{Scene, SceneTables, View};
use anyhow::{Context, bail, ensure};
use std::sync::Arc;
use std::time::{Duration, Instant};
#[cfg(feature = "window")]
use viewer::PlainWindow;

#[cfg(not(feature = "window"))]
use crate::windowless::PlainWindow;

/// How long nothing is said while frames are made.
const SILENCE: Duration = Duration::from_secs(5);

/// What a frame shows: the view, and where instances stand, if they move.
pub type NextFrame<'a> = &'a mut dyn FnMut(u32, &mut Vec<Place>) -> (View, Option<UpperUpdate>);

/// Where the frames of a measurement go. A window is opened once and shows one scene after the other.
pub struct Stage<'a> {
    args: &'a FrameArgs,
    window: Option<PlainWindow>,
    /// What the next scene is loaded on, if it is open already.
    next: Option<(Gpu, Option<Screen>)>,
    settings: Vec<(&'static str, String)>,
}

/// A scene on a device, and what shows its frames.
pub struct Shown {
    /// The scene.
    pub live: LiveScene,
    screen: Option<Screen>,
}

impl<'a> Stage<'a> {
    /// Opens the window, if there is to be one, and the device.
    ///
    /// # Errors
    /// When there is no display, or no device, or the window cannot present as the arguments want it.
    pub fn open(args: &'a FrameArgs, title: &str) -> anyhow::Result<Self> {
        let size = args.size();
        let window = match args.windowed {
            true => Some(PlainWindow::open(&format!("Alhazen: {title}"), size)?),
            false => None,
        };
        let mut stage = Self { args, window, next: None, settings: Vec::new() };
        let (gpu, screen) = stage.open_device()?;
        stage.settings = args.settings(&gpu);
        if let Some(screen) = &screen {
            let [width, height] = screen.size();
            stage.settings.extend([
                ("window", format!("{width}×{height}")),
                ("present mode", format!("{} (asked for: {})", screen.present_mode(), args.presenting())),
                ("surface format", screen.format()),
            ]);
        }
        stage.next = Some((gpu, screen));
        Ok(stage)
    }

    fn open_device(&self) -> anyhow::Result<(Gpu, Option<Screen>)> {
        let options = self.args.gpu_options();
        Ok(match &self.window {
            None => (Gpu::open(&options)?, None),
            Some(window) => {
                let (gpu, screen) = Gpu::open_with_screen(&options, window.target(), self.args.presenting())?;
                (gpu, Some(screen))
            }
        })
    }

    /// What reports say of the measurement.
    pub fn settings(&self) -> &[(&'static str, String)] {
        &self.settings
    }

    /// Columns of tables that only frames in a window have.
    pub fn columns(&self) -> &'static [&'static str] {
        if self.window.is_some() { &["acquire ms", "present ms"] } else { &[] }
    }

    /// Loads a scene on a device of its own. What was loaded before has to be gone: a window is one device's at a time.
    ///
    /// # Errors
    /// When the device cannot hold it.
    pub fn load(&mut self, scene: &Scene, view: &View, depth: usize) -> anyhow::Result<Shown> {
        let (gpu, screen) = match self.next.take() {
            Some(open) => open,
            None => self.open_device()?,
        };
        let tables = Arc::new(SceneTables::build(scene));
        let start = Instant::now();
        if gpu.is_software() {
            say!(
                "{}: a software driver compiles shaders for minutes and takes seconds for a frame",
                scene.name
            );
        }
        let live = LiveScene::new(gpu, tables, self.args.kind(), view, depth)
            .with_context(|| format!("cannot show {}", scene.name))?;
        say!("{}: on the device after {:.1} s", scene.name, start.elapsed().as_secs_f64());
        Ok(Shown { live, screen })
    }

    /// Shows frames, those of the warm-up first, and measures the others. The last measured frame has to show something.
    ///
    /// # Errors
    /// When the device fails, the window is closed or shows none of the frames, or the picture is black or not a number.
    pub fn measure(&mut self, shown: &mut Shown, next: NextFrame<'_>) -> anyhow::Result<Measured> {
        let args = self.args;
        let mut measured = Measured::default();
        let mut places = Vec::new();
        let mut last = None;
        let mut start = Instant::now();
        let (warm_up, all) = (args.warm_up(), args.warm_up() + args.frames());
        let (begun_at, mut said) = (Instant::now(), Instant::now());
        for number in 0..all {
            if said.elapsed() > SILENCE {
                let rate = f64::from(number) / begun_at.elapsed().as_secs_f64();
                say!("  frame {number} of {all}, {rate:.1} a second");
                said = Instant::now();
            }
            if number == warm_up {
                shown.forget_times()?;
                start = Instant::now();
            }
            let begun = Instant::now();
            self.follow_window(shown, number)?;
            let (view, update) = next(number, &mut places);
            let view = View { first_sample: number, ..view };
            shown.frame(&view, update.map(|update| (&places[..], update)))?;
            if number >= warm_up {
                measured.host.push(milliseconds(begun.elapsed()));
            }
            last = Some(view);
        }
        shown.live.finish()?;
        measured.seconds = start.elapsed().as_secs_f64();
        shown.take_times(&mut measured)?;
        if let Some(path) = &args.trace {
            let trace = chrome_trace(&shown.live.frames().take_spans());
            write_text(path, &trace.to_string())
                .with_context(|| format!("cannot write {}", path.display()))?;
        }
        if let Some(view) = last {
            let mean = shown.live.read(&view)?.mean();
            ensure!(
                mean.iter().all(|m| m.is_finite() && *m > 0.0),
                "the last frame is not a picture: {mean:?}"
            );
        }
        Ok(measured)
    }

    /// Takes the window's events.
    fn follow_window(&mut self, shown: &mut Shown, number: u32) -> anyhow::Result<()> {
        let (Some(window), Some(screen)) = (&mut self.window, &mut shown.screen) else { return Ok(()) };
        if !window.poll() {
            let all = self.args.warm_up() + self.args.frames();
            bail!("the window was closed after {number} of {all} frames; nothing is written");
        }
        screen.resize(window.size());
        Ok(())
    }
}

impl Shown {
    fn frame(&mut self, view: &View, motion: Option<(&[Place], UpperUpdate)>) -> anyhow::Result<()> {
        match &mut self.screen {
            None => self.live.frame(view, motion)?,
            Some(screen) => self.live.show(view, motion, screen)?,
        };
        Ok(())
    }

    /// What was measured so far was the warm-up.
    fn forget_times(&mut self) -> anyhow::Result<()> {
        self.live.finish()?;
        self.live.frames().take_reports();
        self.live.frames().take_spans();
        if let Some(screen) = &mut self.screen {
            screen.take_shown();
        }
        Ok(())
    }

    /// Adds what ring and window know of the frames to the host's times, which hold all waiting until then.
    fn take_times(&mut self, measured: &mut Measured) -> anyhow::Result<()> {
        self.live.frames().take_reports().iter().for_each(|report| measured.add(report));
        if let Some(screen) = &mut self.screen {
            let (times, missed) = screen.take_shown();
            let frames = times.len();
            ensure!(missed as usize != frames, "the window was hidden: it has shown none of {frames} frames");
            if missed > 0 {
                say!("{missed} of {frames} frames were not shown: the window was hidden");
            }
            measured.acquired.extend(times.iter().map(|t| milliseconds(t.acquired)));
            measured.presented.extend(times.iter().map(|t| milliseconds(t.presented)));
        }
        for waits in [&measured.waited, &measured.acquired, &measured.presented] {
            measured.host.iter_mut().zip(waits).for_each(|(host, wait)| *host -= wait);
        }
        Ok(())
    }
}
