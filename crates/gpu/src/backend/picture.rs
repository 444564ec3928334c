//! A film that is being accumulated, on the device and on the host.

use crate::film::FilmBuffers;
use crate::rounds::Rounds;
use crate::timing::Timer;
use crate::{Gpu, GpuError};
use backend::{Integrator, View};
use film::Film;
use std::time::Instant;

/// The host's part of a film. To make one anew, or empty it, takes longer than a device takes for a sample of all its pixels. So it is
/// emptied only when somebody looks or adds to it.
pub(super) struct HostFilm {
    film: Film,
    /// Whether what is in it belongs to another picture.
    is_stale: bool,
}

impl HostFilm {
    /// The film, without anything that does not belong there.
    pub fn get(&mut self) -> &mut Film {
        if std::mem::take(&mut self.is_stale) {
            self.film.clear();
        }
        &mut self.film
    }
}

/// A film that is being accumulated.
pub(super) struct Picture {
    pub view: View,
    pub film: HostFilm,
    pub buffers: FilmBuffers,
    /// Samples that a pixel may have on the device; see [`FOLD_SAMPLES`](crate::film::FOLD_SAMPLES).
    pub pending: u32,
    pub last_fold: Instant,
    /// How often that has been moved to the host's film.
    folds: u32,
    /// Rays that the current call has traced.
    pub rays: u64,
    /// What decides about rounds, once there is one.
    pub rounds: Option<Rounds>,
}

impl Picture {
    /// An empty one.
    pub fn new(view: &View, film: Film, buffers: FilmBuffers) -> Self {
        Self {
            view: view.clone(),
            film: HostFilm { film, is_stale: false },
            buffers,
            pending: 0,
            last_fold: Instant::now(),
            folds: 0,
            rays: 0,
            rounds: None,
        }
    }

    /// Whether it is the picture of a view, whatever the first sample.
    pub fn is_of(&self, view: &View) -> bool {
        View { first_sample: view.first_sample, ..self.view.clone() } == *view
    }

    /// Whether a picture of `view` can have its memory.
    pub fn fits(&self, view: &View) -> bool {
        let shape = |v: &View| (v.width, v.height, v.window, v.sampler, v.aovs.clone());
        // What keeps a past knows by its film whose past it is.
        let has_past = |v: &View| matches!(v.integrator, Integrator::Hybrid(_) | Integrator::Realtime(_));
        shape(&self.view) == shape(view) && !has_past(&self.view) && !has_past(view)
    }

    /// Becomes an empty picture of a view that it fits.
    ///
    /// # Errors
    /// When the device fails.
    pub fn begin_anew(mut self, gpu: &Gpu, view: &View) -> Result<Self, GpuError> {
        self.buffers.set_view(view);
        self.buffers.clear(gpu)?;
        if let Some(rounds) = &mut self.rounds {
            rounds.forget(gpu)?;
        }
        self.film.is_stale = true;
        let (view, last_fold) = (view.clone(), Instant::now());
        Ok(Self { view, pending: 0, last_fold, folds: 0, rays: 0, ..self })
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.buffers.memory_bytes() + self.rounds.as_ref().map_or(0, Rounds::memory_bytes)
    }

    /// Takes what shaders have counted.
    ///
    /// # Errors
    /// When the device fails.
    pub fn count(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        let counters = self.buffers.take_counters(gpu)?;
        self.rays += counters.rays();
        if counters.invalid_aovs() > 0 {
            self.film.get().add_invalid_aovs(counters.invalid_aovs());
        }
        Ok(())
    }

    /// Moves what the device has summed to the host's film.
    ///
    /// # Errors
    /// When the device fails.
    pub fn fold(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        self.rays += self.buffers.fold_into(gpu, self.film.get())?.rays();
        self.pending = 0;
        self.folds = self.folds.wrapping_add(1);
        self.last_fold = Instant::now();
        Ok(())
    }

    /// Has the device decide about a round: see [`Rounds::decide`].
    ///
    /// # Errors
    /// When the device fails at once.
    pub fn decide(
        &mut self,
        gpu: &Gpu,
        first_sample: u32,
        total: u64,
        floor: Option<f64>,
        timer: &mut Timer,
    ) -> Result<(), GpuError> {
        let Some(rounds) = &mut self.rounds else { return Ok(()) };
        rounds.follow(gpu, self.film.get(), self.folds)?;
        rounds.decide(gpu, first_sample, total, floor, timer)
    }
}
