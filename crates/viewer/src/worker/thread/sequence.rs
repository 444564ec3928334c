//! Rendering pictures into files: sequences and single ones, one after the other.

use super::passes::LEAST_TO_TELL;
use super::{Progress, Rendered, State, full_text};
use crate::worker::recording::Sequence;
use crate::worker::{Event, Recorded, lock};
use alhazen::output::{self, Encoding};
use alhazen::{BackendError, Control, Film, Job, NoisyPicture};
use std::collections::BTreeSet;
use std::sync::Arc;

impl State {
    /// A pass of the picture that is being rendered into a file.
    pub(super) fn record(&mut self, control: &Control) -> Result<(), BackendError> {
        let Some(sequence) = self.sequences.front() else { return Ok(()) };
        let Some(job) = sequence.job() else {
            self.end_sequence();
            return Ok(());
        };
        let mut view = self.possible(&job).view(0.0);
        let (adaptive, samples) = (sequence.adaptive(), sequence.samples());
        // With adaptive sampling each pixel goes on from what it has.
        view.first_sample = if adaptive.is_some() { 0 } else { sequence.spp };
        if sequence.spp == 0 {
            self.restart();
        }
        // What the window wishes meanwhile is no reason to give the pass up.
        lock(&self.shared.running).finish = true;
        let stats = match adaptive {
            Some(adaptive) => self.renderer.render_round(&view, &adaptive, samples, control)?,
            None => Some(self.renderer.render_pass(&view, samples, control)?),
        };
        let Some(sequence) = self.sequences.front_mut() else { return Ok(()) };
        if stats.as_ref().is_some_and(|stats| stats.cancelled) {
            sequence.spp = 0;
            return Ok(());
        }
        sequence.spp += samples;
        // No pixel may need any more samples.
        let has_all = stats.is_none() || sequence.spp >= sequence.recording.spp;
        let (spp, limit) = (sequence.spp, sequence.recording.noise);
        let noise = match limit {
            Some(_) => self.renderer.film()?.and_then(Film::relative_error),
            None => None,
        };
        let is_good = spp >= LEAST_TO_TELL && noise.zip(limit).is_some_and(|(noise, limit)| noise <= limit);
        if !has_all && !is_good {
            self.tell_recorded(noise, false);
            return Ok(());
        }
        if let Err(error) = self.write_recorded(&job) {
            self.tell(Event::Failed(full_text(&*error)));
            self.end_sequence();
            return Ok(());
        }
        self.show_recorded(job, spp)
    }

    /// Writes the picture that is done.
    fn write_recorded(&mut self, job: &Job) -> Result<(), Box<dyn std::error::Error>> {
        let Some(sequence) = self.sequences.front() else { return Ok(()) };
        let (spp, path, denoiser) = (sequence.spp, sequence.path(), sequence.recording.denoiser);
        let elapsed = sequence.begun.elapsed();
        let settings = self.settings(job);
        let backends = BTreeSet::from([self.renderer.backend_name().to_owned()]);
        let noisy = match (denoiser, self.renderer.film()?) {
            (Some(_), Some(film)) => Some(NoisyPicture::of_film(film)?),
            _ => None,
        };
        let denoised = match denoiser.zip(noisy) {
            Some((denoiser, noisy)) => Some(self.renderer.denoise(denoiser, &noisy)?),
            None => None,
        };
        let film = self.renderer.film()?.ok_or("there is no picture")?;
        let mut metadata = alhazen::metadata(&settings, film, spp, &backends, elapsed);
        if let Some(denoised) = &denoised {
            metadata.insert("denoiser".into(), denoised.by.clone());
        }
        let colour = denoised.as_ref().map(|denoised| &denoised.picture);
        output::write_as(&path, film, colour, &job.tone, &metadata, &Encoding::default())?;
        Ok(())
    }

    /// Shows a picture of a sequence, and goes on to the next one.
    fn show_recorded(&mut self, job: Job, spp: u32) -> Result<(), BackendError> {
        let Some(sequence) = self.sequences.front_mut() else { return Ok(()) };
        (sequence.next, sequence.spp) = (sequence.next + 1, 0);
        // A single picture may have another shape than the window's.
        if !sequence.recording.is_single {
            let rendered = Rendered { job: Arc::new(job), preview: false, changes: self.changes };
            let progress = Progress { rendered: Some(rendered), spp, visible: true, ..Progress::default() };
            self.pictures[0] = progress;
            self.show(0)?;
        }
        self.tell_recorded(None, false);
        Ok(())
    }

    fn tell_recorded(&self, noise: Option<f64>, ended: bool) {
        let Some(sequence) = self.sequences.front() else { return };
        let Sequence { recording, next, spp, begun } = sequence;
        self.tell(Event::Recorded(Recorded {
            done: *next,
            of: recording.cameras.len(),
            spp: *spp,
            wanted: recording.spp,
            noise,
            limit: recording.noise,
            elapsed: begun.elapsed(),
            waiting: self.sequences.len() - 1,
            path: recording.is_single.then(|| recording.path.clone()),
            ended,
        }));
    }

    /// Begins the picture that is rendered into a file anew: its film is gone.
    pub(super) fn restart_recorded(&mut self) {
        if let Some(sequence) = self.sequences.front_mut() {
            sequence.spp = 0;
        }
    }

    /// Ends what is being rendered into files; what waits for it begins.
    pub(super) fn end_sequence(&mut self) {
        self.tell_recorded(None, true);
        if self.sequences.pop_front().is_none() {
            return;
        }
        if let Some(next) = self.sequences.front_mut() {
            next.begun = std::time::Instant::now();
        }
        // The film has a picture of the sequence.
        self.forget_pictures();
        self.restart();
    }
}
