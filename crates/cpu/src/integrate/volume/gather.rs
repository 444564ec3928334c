//! Where camera paths meet photons: what they gather at a vertex, and what light counts that they find by chance.
//!
//! Both are the same light, from a lamp by specular scattering to a surface, and count by the balance heuristic; see
//! `optics::photons`. A path carries one number for that from the surface where photons were gathered.

use super::photons::etendue_of;
use super::{BLACK, VolumePath, VolumeTracer};
use crate::fetch::surface::Surface;
use optics::Vec3f;
use optics::closure::{Closure, closure_eval, closure_is_sharp, closure_transmits};
use optics::path::limit_indirect;
use optics::photons::{chance_share, expected_photons, photon_kernel, photon_share};
use optics::scatter::BsdfSample;
use optics::vector::dot;
use optics::vertex::light_side;

/// Least cosine of a photon's normal with that of the surface that gathers it: around edges lies other light.
const SAME_SIDE: f32 = 0.5;
/// Least cosine that light is divided by.
const GRAZING: f32 = 1e-3;

impl VolumeTracer<'_> {
    /// Adds the light that photons have brought to a vertex.
    pub(super) fn gather_photons(
        &mut self,
        path: &VolumePath,
        surface: &Surface,
        closure: &Closure,
        wo: Vec3f,
    ) {
        let Some(map) = self.photons else { return };
        let transmits = closure_transmits(*closure);
        let (radius2, count) = (map.radius2(), map.count());
        let mut sum = BLACK;
        map.for_each_near(surface.position, |photon, distance2| {
            let segments = path.state.depth + photon.segments;
            let side = light_side(photon.wi, 1.0, closure.frame, surface.horizon, transmits);
            let away = dot(photon.wi, surface.normal);
            let alike = dot(photon.normal, surface.normal) * away.signum();
            if segments > self.settings.max_depth || !side.possible || alike < SAME_SIDE {
                return;
            }
            let value = closure_eval(*closure, wo, side.wi);
            let expected = expected_photons(count, radius2, away, value.pdf) * photon.density;
            let weight = photon_kernel(distance2, radius2) * photon_share(expected) / away.abs().max(GRAZING);
            let found = path.state.throughput * value.value_cos * photon.flux * weight;
            sum += limit_indirect(found, segments, self.settings.most_indirect());
        });
        self.radiance += sum;
    }

    /// Whether light that the path samples at a surface has been gathered by photons before.
    pub(super) fn photons_bring_lights(&self, path: &VolumePath, closure: &Closure) -> bool {
        path.merge > 0.0 && closure_is_sharp(*closure)
    }

    /// Notes for the balance heuristic how the path has been scattered at a surface towards `wi`.
    pub(super) fn note_scattering(
        &self,
        path: &mut VolumePath,
        surface: &Surface,
        closure: &Closure,
        sample: &BsdfSample,
        wi: Vec3f,
    ) {
        let Some(map) = self.photons else { return };
        if closure_is_sharp(*closure) {
            path.merge /= etendue_of(closure, sample);
            path.by_specular = true;
        } else {
            let cosine = dot(wi, surface.normal);
            path.merge = expected_photons(map.count(), map.radius2(), cosine, sample.pdf);
            path.by_specular = false;
        }
    }

    /// What light counts that the path finds by chance, if `density` is that per étendue with which photons bring it;
    /// `None` if they do not gather it.
    pub(super) fn chance(&self, path: &VolumePath, density: impl FnOnce() -> f32) -> Option<f32> {
        let shared = self.photons.is_some() && path.by_specular && path.merge > 0.0;
        shared.then(|| chance_share(path.merge * density()))
    }

    /// The light in the path's own coordinates, for [`VolumeTracer::chance`]: a surface that shines.
    pub(super) fn density_of_surface(&self, surface: &Surface) -> f32 {
        let lights = self.photons.map(|map| map.lights());
        let cosine = dot(surface.wo, surface.normal);
        lights.map_or(0.0, |l| {
            l.surface_density(self.scene, surface.light, surface.position, surface.wo, cosine)
        })
    }

    /// The same of what is infinitely far away in unit direction `wi`: light `index`.
    pub(super) fn density_of_distant(&self, path: &VolumePath, index: u32, wi: Vec3f) -> f32 {
        let from = crate::scene::vec3(path.ray.origin);
        self.photons.map_or(0.0, |map| map.lights().distant_density(self.scene, index, from, wi))
    }
}
