//! Showing the picture in a running tev while it is rendered.

use super::args::RenderArgs;
use crate::console::say;
use crate::exit::Exit;
use alhazen::{Film, Image, Renderer, Tev, TevError};
use std::time::{Duration, Instant};

/// A growing picture is sent at most so often: fetching and sending it takes time from rendering.
const PAUSE: Duration = Duration::from_secs(1);

/// A tev that is shown the picture.
pub struct Onlooker {
    /// `None` once it has gone.
    tev: Option<Tev>,
    scene: String,
    name: String,
    sent: Instant,
}

impl Onlooker {
    /// Connects to the tev that arguments name, if they name one.
    pub fn start(args: &RenderArgs) -> anyhow::Result<Option<Self>> {
        let Some(address) = &args.tev else { return Ok(None) };
        let tev = Tev::connect(address).map_err(|error| Exit::Output.with(error.into()))?;
        let scene = format!("alhazen: {}", args.scene);
        Ok(Some(Self { tev: Some(tev), name: scene.clone(), scene, sent: Instant::now() }))
    }

    /// The picture of a sequence that comes next.
    pub fn begin(&mut self, frame: Option<u32>) {
        self.name = frame.map_or(self.scene.clone(), |frame| format!("{} {frame:04}", self.scene));
    }

    /// Shows what there is of the picture, now and then.
    pub fn look(&mut self, renderer: &mut Renderer) {
        if self.tev.is_some()
            && self.sent.elapsed() >= PAUSE
            && let Ok(Some(film)) = renderer.film()
        {
            self.show(film, None);
        }
    }

    /// Shows a picture. A tev that has gone is no reason to give the picture up: that is said once.
    pub fn show(&mut self, film: &Film, colour: Option<&Image>) {
        let Some(tev) = &mut self.tev else { return };
        if let Err(error) = tev.show_film(&self.name, film, colour) {
            self.give_up(&error);
        }
        self.sent = Instant::now();
    }

    fn give_up(&mut self, error: &TevError) {
        say!("warning: {error}; rendering goes on");
        self.tev = None;
    }
}
