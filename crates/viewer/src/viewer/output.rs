//! Pictures that are rendered into files from the window: asked for, followed and ended.

use super::state::Viewer;
use crate::presets::Preset;
use crate::remaining::in_words;
use crate::worker::{Message, Recorded, Recording};
use alhazen::{Camera, Job};
use std::path::PathBuf;

impl Viewer {
    /// Sets a preset of quality.
    pub fn use_preset(&mut self, preset: Preset) {
        preset.apply(&mut self.render, &mut self.shown);
        self.notice(format!("{}: {}", preset.name(), preset.about()), false);
    }

    /// Renders what is seen into a file, in the size and quality of the page Render. Several wait for
    /// each other.
    pub fn render_to_file(&mut self, path: PathBuf) {
        let (mut render, mut shown) = (self.render.clone(), self.shown);
        if let Some(preset) = self.open.output.quality {
            preset.apply(&mut render, &mut shown);
        }
        // Whatever is looked at, the file is the picture.
        shown.layer = crate::worker::Layer::Picture;
        let camera = Camera { path: None, ..self.camera.at(self.camera_time) };
        let size = self.open.output.size.unwrap_or(self.size());
        let job: Job = render.job(camera.clone(), size, &shown, shown.tone);
        self.render_into(Recording {
            job,
            cameras: vec![camera],
            spp: render.spp,
            sampling: render.sampling,
            noise: render.noise.map(f64::from),
            denoiser: shown.denoiser,
            path,
            is_single: true,
        });
    }

    pub(super) fn render_into(&mut self, recording: Recording) {
        let path = recording.is_single.then(|| recording.path.clone());
        match &mut self.recording {
            Some(recorded) => {
                recorded.waiting += 1;
                let waiting = recorded.waiting;
                self.notice(format!("{waiting} more to render after this"), false);
            }
            None => {
                let of = recording.cameras.len();
                self.recording = Some(Recorded { of, wanted: recording.spp, path, ..Recorded::default() });
            }
        }
        self.tell(Message::Record(Some(Box::new(recording))));
    }

    pub(super) fn stop_recording(&mut self) {
        if self.recording.is_none() {
            return self.notice("nothing is being rendered into a file", false);
        }
        self.tell(Message::Record(None));
    }

    pub(super) fn take_recorded(&mut self, recorded: Recorded) {
        if !recorded.ended {
            self.recording = Some(recorded);
            return;
        }
        let (Recorded { done, of, .. }, time) = (&recorded, in_words(recorded.elapsed));
        let text = match &recorded.path {
            Some(path) if done == of => format!("rendered {} in {time}", path.display()),
            Some(path) => format!("{} was not rendered to the end", path.display()),
            None => format!("recorded {done} of {of} pictures in {time}"),
        };
        self.notice(text, false);
        self.finished += 1;
        let waiting = recorded.waiting;
        self.recording =
            waiting.checked_sub(1).map(|waiting| Recorded { waiting, of: 1, ..Recorded::default() });
    }

    /// What the window is called: what is rendered into a file and how far it is, and what is open.
    pub fn title(&self) -> String {
        let name = self.document.as_ref().map(|d| d.source.to_string());
        let title = name.map_or("Alhazen".to_owned(), |name| format!("{name} – Alhazen"));
        match &self.recording {
            Some(recorded) => format!("{:.0} % – {title}", recorded.share() * 100.0),
            None => title,
        }
    }
}
