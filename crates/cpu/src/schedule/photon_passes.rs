//! The passes of photons that a picture needs, one after the other.

use crate::integrate::volume::VolumeTracer;
use crate::photons::{Photon, PhotonLights, PhotonMap};
use crate::scene::CpuScene;
use backend::{BackendError, Integrator, PathSettings, Switch, View};
use optics::photons::{photon_radius2, photon_sampler};
use rayon::prelude::*;
use std::sync::Arc;

/// Photons of a pass that are emitted for each pixel of the picture.
const PHOTONS_PER_PIXEL: f64 = 4.0;
/// Fewest and most photons that a pass emits.
const PHOTONS: std::ops::RangeInclusive<u64> = 1 << 15..=1 << 21;
/// Photons that a disc of the first pass is to hold, were all of them spread evenly over the discs of the targets.
const PHOTONS_PER_DISC: f32 = 24.0;
/// Photons that a thread follows at a time.
const CHUNK: u32 = 4096;

/// What all passes of a picture share, and the last pass.
pub(crate) struct PhotonPasses {
    lights: Arc<PhotonLights>,
    /// Photons that a pass emits.
    count: u32,
    /// Square of the radius of pass 0, m².
    first_radius2: f32,
    last: Option<(u32, Arc<PhotonMap>)>,
}

/// The settings of a view's paths, if it wants caustics from photons in this scene.
pub(crate) fn wanted<'v>(scene: &CpuScene, view: &'v View) -> Option<&'v PathSettings> {
    let Integrator::Path(settings) = &view.integrator else { return None };
    let wanted = match settings.caustics {
        Switch::Off => false,
        Switch::On => true,
        Switch::Auto => scene.tables.caustics_advice().wanted,
    };
    wanted.then_some(settings)
}

/// Refuses caustics that were asked for and that photons cannot make.
pub(crate) fn check(scene: &CpuScene, view: &View) -> Result<(), BackendError> {
    let asked = matches!(&view.integrator, Integrator::Path(s) if s.caustics == Switch::On);
    if asked && (scene.tables.motion.is_some() || view.camera_moves()) {
        let reason = "caustics are asked for, but photons know no motion: leave the shutter closed".into();
        return Err(BackendError::View { reason });
    }
    Ok(())
}

impl PhotonPasses {
    /// For a view that wants them; `None` if nothing in the scene makes caustics.
    pub fn new(scene: &CpuScene, view: &View) -> Option<Self> {
        wanted(scene, view)?;
        let lights = Arc::new(PhotonLights::new(scene)?);
        let pixels = f64::from(view.width) * f64::from(view.height);
        let count = ((pixels * PHOTONS_PER_PIXEL) as u64).clamp(*PHOTONS.start(), *PHOTONS.end()) as u32;
        let first_radius2 = PHOTONS_PER_DISC * lights.targets_radius2() / count as f32;
        Some(Self { lights, count, first_radius2, last: None })
    }

    /// The photons of a pass, and the rays that it took now. The last one is kept. Runs on the threads of the current pool.
    pub fn pass(&mut self, scene: &CpuScene, view: &View, pass: u32) -> (Arc<PhotonMap>, u64) {
        if let Some((last, map)) = &self.last
            && *last == pass
        {
            return (map.clone(), 0);
        }
        let Integrator::Path(settings) = &view.integrator else { return (self.nothing(), 0) };
        let chunks: Vec<(Vec<Photon>, u64)> = (0..self.count.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut tracer = VolumeTracer::new(scene, view, settings, None);
                let mut found = Vec::new();
                for index in chunk * CHUNK..((chunk + 1) * CHUNK).min(self.count) {
                    let sampler = photon_sampler(view.seed, pass, index);
                    if let Some(emitted) = self.lights.emit(scene, sampler) {
                        tracer.follow_photon(&emitted, sampler, &mut found);
                    }
                }
                (found, tracer.rays_traced)
            })
            .collect();
        let rays: u64 = chunks.iter().map(|(_, rays)| rays).sum();
        let share = 1.0 / self.count as f32;
        let photons = chunks.into_iter().flat_map(|(found, _)| found);
        let photons = photons.map(|p| Photon { flux: p.flux * share, ..p }).collect();
        let radius2 = photon_radius2(self.first_radius2, pass);
        let map = Arc::new(PhotonMap::new(photons, radius2, self.count, self.lights.clone()));
        self.last = Some((pass, map.clone()));
        (map, rays)
    }
}

impl PhotonPasses {
    /// A pass without photons.
    fn nothing(&self) -> Arc<PhotonMap> {
        Arc::new(PhotonMap::new(Vec::new(), self.first_radius2, self.count, self.lights.clone()))
    }
}

/// A view without what photons do not depend on.
pub(crate) fn comparable(view: &View) -> View {
    let window = film::Rect::full(view.width, view.height);
    View { first_sample: 0, window, aovs: Vec::new(), ..view.clone() }
}
