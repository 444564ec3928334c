//! Rendering and writing the pictures of a sequence.

use super::{Progress, Rendered, State, full_text};
use crate::worker::Event;
use alhazen::{BackendError, Control};
use std::collections::BTreeSet;
use std::sync::Arc;

impl State {
    /// A pass of the sequence that is being recorded.
    pub(super) fn record(&mut self, control: &Control) -> Result<(), BackendError> {
        let Some(sequence) = &self.sequence else { return Ok(()) };
        let Some(job) = sequence.job() else {
            self.end_sequence();
            return Ok(());
        };
        let mut view = self.possible(&job).view(0.0);
        view.first_sample = sequence.spp;
        if sequence.spp == 0 {
            self.restart();
        }
        let Some(sequence) = &mut self.sequence else { return Ok(()) };
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

    pub(super) fn end_sequence(&mut self) {
        if let Some(sequence) = self.sequence.take() {
            let of = sequence.recording.cameras.len();
            self.tell(Event::Recorded { done: sequence.next, of, ended: true });
        }
        // The film has a picture of the sequence.
        self.forget_pictures();
        self.restart();
    }
}
