//! What becomes of a film: it is shown, without its noise where that is wanted, or written.

use super::{Clean, Rendered, State, full_text};
use crate::worker::show::{display, layer_image};
use crate::worker::upscale::upscaled;
use crate::worker::whole::Whole;
use crate::worker::{Event, Layer, PassReport, Shot};
use alhazen::edits::Editable;
use alhazen::{
    BackendError, DenoiseFilmError, Denoised, Denoiser, Description, FrameView, Integrator, Job, NoisyPicture,
};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// So many times as long as denoising takes is rendered before a picture is denoised again: most of the time goes into samples.
const PATIENCE: u32 = 4;

/// Pictures in a hurry are denoised up to so many pixels. The time that takes counts as theirs, so they
/// get smaller; without it one sample per pixel shows little but noise.
const FEW_PIXELS: u32 = 60_000;

impl State {
    /// The picture of a side without its noise, if that is wanted: as it is now if it is done, or as it was some passes ago.
    fn denoised(&mut self, side: usize) -> Result<Option<Arc<Denoised>>, BackendError> {
        let picture = &self.pictures[side];
        let Some(denoiser) = self.shown.denoiser else { return Ok(None) };
        let Some(Rendered { job, preview, .. }) = &picture.rendered else { return Ok(None) };
        if self.shown.layer != Layer::Picture {
            return Ok(None);
        }
        let grows = !self.makes_frames(job) && (!preview || picture.pixels <= FEW_PIXELS);
        if !picture.done && !grows {
            return Ok(None);
        }
        if let Some(clean) = &picture.clean
            && clean.denoiser == denoiser
            && !picture.done
            && clean.made.elapsed() < PATIENCE * clean.took
        {
            return Ok(Some(clean.picture.clone()));
        }
        self.denoise(side, denoiser)
    }

    /// The picture of a side as it is now, without its noise.
    fn denoise(&mut self, side: usize, denoiser: Denoiser) -> Result<Option<Arc<Denoised>>, BackendError> {
        let picture = &self.pictures[side];
        if self.shown.layer != Layer::Picture {
            return Ok(None);
        }
        if let Some(clean) = &picture.clean
            && (clean.denoiser, clean.is_current) == (denoiser, true)
        {
            return Ok(Some(clean.picture.clone()));
        }
        let film = match &picture.film {
            Some(film) => Some(film),
            None => self.renderer.film()?,
        };
        let Some(film) = film else { return Ok(None) };
        let begin = Instant::now();
        let noisy = NoisyPicture::of_film(film).map_err(DenoiseFilmError::from);
        match noisy.and_then(|noisy| self.renderer.denoise(denoiser, &noisy)) {
            Ok(denoised) => {
                let (picture, took) = (Arc::new(denoised), begin.elapsed());
                let clean = Clean {
                    denoiser,
                    picture: picture.clone(),
                    is_current: true,
                    made: Instant::now(),
                    took,
                };
                self.pictures[side].clean = Some(clean);
                Ok(Some(picture))
            }
            Err(error) => {
                self.tell(Event::Notice(full_text(&error)));
                Ok(None)
            }
        }
    }

    /// Publishes a film as it is.
    pub(super) fn show(&mut self, side: usize) -> Result<(), BackendError> {
        let Some(Rendered { job, preview, changes }) = self.pictures[side].rendered.clone() else {
            return Ok(());
        };
        let start = Instant::now();
        let denoised = self.denoised(side)?;
        let frames = frame_view(&self.possible(&job));
        let picture = &self.pictures[side];
        let film = match &picture.film {
            Some(film) => film,
            None => match self.renderer.film()? {
                Some(film) => film,
                None => return Ok(()),
            },
        };
        let mut linear = match &denoised {
            Some(denoised) => denoised.picture.clone(),
            None => layer_image(film, self.shown.layer),
        };
        let mut image = display(&linear, film, &self.shown, frames);
        let mut counts: Vec<u32> = film.pixels().iter().map(|p| p.count() as u32).collect();
        if let Some(whole) = Whole::of(film) {
            (image, linear) = (whole.display(&image), whole.image(&linear));
            counts = whole.counts(&counts);
        }
        if preview {
            image = upscaled(image, [job.width, job.height]);
        }
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
    pub(super) fn save(&mut self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        if !self.sequences.is_empty() {
            return Err("a picture is being rendered to a file: wait for it, or stop it".into());
        }
        let denoised = match self.shown.denoiser {
            Some(denoiser) => self.denoise(0, denoiser)?,
            None => None,
        };
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
    pub(super) fn settings(&self, job: &Job) -> std::collections::BTreeMap<String, String> {
        let empty = alhazen::Scene::default();
        let scene = self.scene.as_ref().map_or(&empty, Editable::scene);
        Description::new(&scene.name, &[], scene).settings(&self.possible(job))
    }
}

/// What a picture's frames show; `Picture` where it has none.
fn frame_view(job: &Job) -> FrameView {
    if let Integrator::Realtime(settings) = job.integrator { settings.show } else { FrameView::Picture }
}
