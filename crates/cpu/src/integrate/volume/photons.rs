//! How photons go: from a light by specular scattering alone, stored at every surface behind.
//!
//! They follow what paths follow, with what is different for light (Veach 1997, section 5.3): power is not compressed
//! where radiance is, and shading normals count the other way round.

use super::interiors::{crossed, passes, segment};
use super::{VolumePath, VolumeTracer};
use crate::fetch::surface::Surface;
use crate::photons::{Emitted, Photon};
use crate::scene::vec3;
use crate::shade::closures::wants_model_number;
use crate::shade::path_batch::roulette;
use optics::closure::{
    Closure, closure_eta, closure_is_delta, closure_is_sharp, closure_sample, closure_scatters,
};
use optics::frame::to_local;
use optics::light_tree::ALL_SIDES;
use optics::math::max_component;
use optics::motion::MOTION_MIDDLE;
use optics::path::path_start;
use optics::photons::{adjoint_factor, etendue_scale};
use optics::random::PixelSampler;
use optics::scatter::{BSDF_THIN_DIELECTRIC, BsdfSample};
use optics::vec2f;
use optics::vertex::{PAIR_BSDF, PAIR_LOBE, continue_from_surface};
use optics::volume::{MOST_SEGMENTS, STREAM_SHADOW, stream_start};

/// By what étendue grows where a path is scattered: what light is refracted, thin sheets let straight through.
pub(super) fn etendue_of(closure: &Closure, sample: &BsdfSample) -> f32 {
    let thin = !closure.layered && closure.plain.kind == BSDF_THIN_DIELECTRIC;
    etendue_scale(closure_eta(*closure), sample.transmitted && !thin)
}

impl VolumeTracer<'_> {
    /// Follows a photon to the first surface that is not specular, and stores it wherever camera paths may gather it.
    pub(crate) fn follow_photon(
        &mut self,
        emitted: &Emitted,
        sampler: PixelSampler,
        found: &mut Vec<Photon>,
    ) {
        let mut path = VolumePath {
            ray: emitted.ray,
            state: path_start(),
            sampler,
            time: MOTION_MIDDLE,
            inside: emitted.inside,
            segments: 0,
            vertex: vec3(emitted.ray.origin),
            since_vertex: 0.0,
            length: 0.0,
            sampling_normal: ALL_SIDES,
            merge: 0.0,
            by_specular: false,
        };
        let (mut flux, mut density) = (emitted.flux, emitted.density);
        while path.segments < MOST_SEGMENTS {
            path.segments += 1;
            let hit = self.closest(&path.ray, path.time);
            if hit.is_miss() {
                return;
            }
            let surface = Surface::new(self.scene, &path.ray, &hit, path.time);
            let tables = &*self.scene.tables;
            if let Some(segment) = segment(path.inside, tables, &path.ray, hit.t, Some(&surface)) {
                let mut stream = stream_start(sampler, path.segments, STREAM_SHADOW);
                flux *= self.segment_transmittance(&path.ray, &segment, &mut stream);
            }
            if passes(tables, &surface, path.inside) {
                path.inside = crossed(path.inside, tables, &surface);
                path.ray.origin = surface.ray_origin(false).to_array();
                continue;
            }
            // One more segment at least leads to the camera.
            if path.state.depth >= self.settings.max_depth || max_component(flux) <= 0.0 {
                return;
            }
            let material = self.material(&surface);
            path.state.throughput *= flux;
            let closure = self.closure_at(&path, &surface, material);
            path.state.throughput = path_start().throughput;
            let sharp = closure_is_sharp(closure);
            // Which of the models a point shows is the camera path's choice.
            if path.by_specular && (!sharp || wants_model_number(tables, material)) {
                found.push(Photon {
                    position: surface.position,
                    wi: surface.wo,
                    flux,
                    normal: surface.normal,
                    density,
                    segments: path.state.depth,
                });
            }
            if !sharp || !closure_scatters(closure) {
                return;
            }
            let wo = to_local(closure.frame, surface.wo);
            let u_lobe = path.draw(PAIR_LOBE);
            let u = if closure_is_delta(closure) { vec2f(0.0, 0.0) } else { path.draw(PAIR_BSDF) };
            let sample = closure_sample(closure, wo, u_lobe.x, u);
            let (eta, chance) = (closure_eta(closure), roulette(self.settings));
            let next = continue_from_surface(
                path.state,
                sample,
                closure.frame,
                surface.horizon,
                eta,
                chance,
                u_lobe.y,
            );
            if !next.alive {
                return;
            }
            let scale = etendue_of(&closure, &sample);
            let normals = adjoint_factor(surface.wo, next.wi, closure.frame.normal, surface.normal);
            flux *= next.state.throughput * (scale * normals);
            density *= scale;
            path.state = next.state;
            path.state.throughput = path_start().throughput;
            path.state.eta_scale = 1.0;
            path.by_specular = true;
            if sample.transmitted && material.is_body() {
                path.inside = crossed(path.inside, tables, &surface);
            }
            path.leave(surface.origin, surface.ray_origin(next.above), next.wi);
        }
    }
}
