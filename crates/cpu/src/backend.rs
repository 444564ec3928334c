//! [`CpuBackend`]: the trait's implementation; film, threads, views.

use crate::guided::prepare::Guides;
use crate::scene::CpuScene;
use crate::schedule::passes;
use crate::schedule::photon_passes::{self, PhotonPasses};
use crate::schedule::pixel_list;
use crate::threads::Threads;
use crate::views;
use accel::Quality;
use backend::{
    Backend, BackendError, Control, Integrator, LoadStats, PixelSamples, Stats, View, ViewBatch,
    ViewPictures, check_media, check_pixels,
};
use film::Film;
use scene::tables::{Changes, SceneTables};
use std::sync::Arc;
use web_time::Instant;

/// Renders on every core of the machine; always there.
pub struct CpuBackend {
    threads: Threads,
    quality: Quality,
    scene: Option<CpuScene>,
    film: Option<(View, Film)>,
    /// A view, but for its window, and its photons, if it wants some.
    photons: Option<(View, Option<PhotonPasses>)>,
    guides: Guides,
}

impl CpuBackend {
    /// A back end on `threads` threads; `None` uses all cores.
    ///
    /// # Errors
    /// When the system refuses to make threads.
    pub fn new(threads: Option<usize>) -> Result<Self, BackendError> {
        let threads = Threads::new(threads)?;
        Ok(Self {
            threads,
            quality: Quality::Balanced,
            scene: None,
            film: None,
            photons: None,
            guides: Guides::default(),
        })
    }

    /// Makes the film for a view, or keeps the one that is being accumulated.
    fn prepare_film(&mut self, view: &View) -> Result<(), BackendError> {
        let same = |old: &View| View { first_sample: view.first_sample, ..old.clone() } == *view;
        if !self.film.as_ref().is_some_and(|(old, _)| same(old)) {
            let film = || Film::with_window(view.width, view.height, view.window, &view.aovs);
            let film = self.threads.install(film)?;
            self.film = Some((view.clone(), film));
        }
        Ok(())
    }

    /// Makes ready the photons that a view wants, or keeps those of the view before.
    fn prepare_photons(&mut self, view: &View) -> Result<(), BackendError> {
        let Some(scene) = &self.scene else { return Ok(()) };
        photon_passes::check(scene, view)?;
        let wanted = photon_passes::comparable(view);
        if !self.photons.as_ref().is_some_and(|(view, _)| *view == wanted) {
            let passes = self.threads.install(|| PhotonPasses::new(scene, view));
            self.photons = Some((wanted, passes));
        }
        Ok(())
    }
}

impl CpuBackend {
    /// Sees to it that paths of a view follow the guide that they are to; see [`Guides::prepare`].
    fn prepare_guide(&mut self, view: &View, control: &Control) -> Result<Option<u64>, BackendError> {
        let (guides, Some(scene)) = (&mut self.guides, &mut self.scene) else {
            return Err(BackendError::NoScene { backend: "cpu" });
        };
        self.threads.install(|| guides.prepare(scene, view, control))
    }
}

impl Backend for CpuBackend {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn describe(&self) -> String {
        format!("CPU, {:?}, {} threads", accel::InstructionSet::best(), self.threads.count())
    }

    fn load(&mut self, tables: Arc<SceneTables>) -> Result<LoadStats, BackendError> {
        (self.film, self.photons) = (None, None);
        self.guides.forget();
        let start = Instant::now();
        let table_bytes = tables.memory_bytes();
        let quality = self.quality;
        let scene = self.threads.install(|| CpuScene::new(tables, quality));
        let acceleration_bytes = scene.tlas.memory_bytes();
        self.scene = Some(scene);
        Ok(LoadStats { build: start.elapsed(), acceleration_bytes, table_bytes, device_bytes: 0 })
    }

    fn update(&mut self, tables: Arc<SceneTables>, changes: Changes) -> Result<LoadStats, BackendError> {
        let Some(scene) = self.scene.take() else {
            return Err(BackendError::NoScene { backend: self.name() });
        };
        (self.film, self.photons) = (None, None);
        self.guides.forget();
        let start = Instant::now();
        let table_bytes = tables.memory_bytes();
        let quality = self.quality;
        let scene = self.threads.install(|| scene.update(tables, changes, quality));
        let acceleration_bytes = scene.tlas.memory_bytes();
        self.scene = Some(scene);
        Ok(LoadStats { build: start.elapsed(), acceleration_bytes, table_bytes, device_bytes: 0 })
    }

    fn render(&mut self, view: &View, samples: u32, control: &Control) -> Result<Stats, BackendError> {
        let Some(scene) = &self.scene else {
            return Err(BackendError::NoScene { backend: self.name() });
        };
        check_media(&scene.tables, view)?;
        if view.first_sample.checked_add(samples).is_none() {
            return Err(BackendError::View { reason: format!("sample index beyond {}", u32::MAX) });
        }
        if let Integrator::Hybrid(settings) = &view.integrator
            && !settings.equals_direct()
        {
            let reason =
                "the CPU renders `hybrid` as `direct`, which has shadows and leaves no light out".into();
            return Err(BackendError::View { reason });
        }
        refuse_realtime(view)?;
        self.prepare_film(view)?;
        self.prepare_photons(view)?;
        let start = Instant::now();
        let wanted = u64::from(samples) * view.window.area() as u64;
        let Some(training) = self.prepare_guide(view, control)? else {
            return Ok(Stats { cancelled: true, elapsed: start.elapsed(), ..Stats::default() });
        };
        let (Some(scene), Some((_, film))) = (&self.scene, &mut self.film) else {
            return Err(BackendError::NoScene { backend: "cpu" });
        };
        let photons = self.photons.as_mut().and_then(|(_, photons)| photons.as_mut());
        control.begin(wanted);
        let mut stats = Stats::default();
        let wanted = view.first_sample..view.first_sample + samples;
        let rays = self.threads.install(|| passes::render(scene, view, wanted, film, photons, control));
        stats.rays = training + rays;
        stats.samples = control.progress().samples_done;
        stats.cancelled = control.is_cancelled();
        stats.elapsed = start.elapsed();
        Ok(stats)
    }

    fn render_pixels(
        &mut self,
        view: &View,
        pixels: &[PixelSamples],
        control: &Control,
    ) -> Result<Stats, BackendError> {
        check_pixels(view, pixels)?;
        refuse_realtime(view)?;
        if let Some(scene) = &self.scene {
            check_media(&scene.tables, view)?;
        }
        self.prepare_film(view)?;
        self.prepare_photons(view)?;
        let start = Instant::now();
        let wanted = pixels.iter().map(|p| u64::from(p.count)).sum();
        let Some(training) = self.prepare_guide(view, control)? else {
            return Ok(Stats { cancelled: true, elapsed: start.elapsed(), ..Stats::default() });
        };
        let (Some(scene), Some((_, film))) = (&self.scene, &mut self.film) else {
            return Err(BackendError::NoScene { backend: "cpu" });
        };
        let photons = self.photons.as_mut().and_then(|(_, photons)| photons.as_mut());
        control.begin(wanted);
        let rays = training
            + self.threads.install(|| pixel_list::render(scene, view, pixels, film, photons, control));
        let samples = control.progress().samples_done;
        let cancelled = control.is_cancelled();
        Ok(Stats { samples, rays, elapsed: start.elapsed(), cancelled, device_time: None })
    }

    fn render_views(
        &mut self,
        batch: &ViewBatch,
        control: &Control,
    ) -> Result<(ViewPictures, Stats), BackendError> {
        batch.check()?;
        let Some(scene) = &mut self.scene else {
            return Err(BackendError::NoScene { backend: self.name() });
        };
        scene.guide = None;
        if batch.wants_colors() {
            check_media(&scene.tables, &batch.view)?;
        }
        let start = Instant::now();
        let all = batch.all_samples();
        control.begin(all);
        let (pictures, counted) = self.threads.install(|| {
            let mut pictures = ViewPictures::empty(batch);
            let counted = views::render(scene, batch, &mut pictures, control);
            (pictures, counted)
        });
        let pictures = ViewPictures { invalid_samples: counted.invalid_samples, ..pictures };
        let stats = Stats {
            samples: control.progress().samples_done,
            rays: counted.rays,
            elapsed: start.elapsed(),
            cancelled: control.is_cancelled(),
            device_time: None,
        };
        Ok((pictures, stats))
    }

    fn restart(&mut self) {
        self.film = None;
    }

    fn take_notices(&mut self) -> Vec<String> {
        self.guides.take_notices()
    }

    fn film(&mut self) -> Result<Option<&Film>, BackendError> {
        Ok(self.film.as_ref().map(|(_, film)| film))
    }
}

/// What keeps frames and draws them by a rasteriser is not written for processors.
fn refuse_realtime(view: &View) -> Result<(), BackendError> {
    if matches!(view.integrator, Integrator::Realtime(_)) {
        let reason = "`realtime` needs a GPU; on the CPU `path` makes the picture that it comes near".into();
        return Err(BackendError::View { reason });
    }
    Ok(())
}
