//! What comes back of a narrow beam of light, such as a laser's.
//!
//! A beam goes straight on through what is clear and is refracted where glass has a thickness.
//! Light returns by the same way, so what a surface or a medium lets through dims an echo twice.
//! Reflections are not followed: what a pane or a mirror reflects is lost.

use super::{PIECE, RayQueries, Scratch};
use crate::fetch::filter::BoundaryFilter;
use crate::fetch::surface::Surface;
use crate::integrate::volume::{
    crossed, interiors_around, ior_along, optical_depth, passes, relative_ior, segment,
};
use crate::shade::material::{Shading, mixes_models, shade};
use accel::{Coherence, Hit, MISS, Ray};
use backend::Control;
use elementary::exp;
use optics::bsdf::bsdf_eval;
use optics::constants::PI;
use optics::dielectric::transmitted_beam;
use optics::frame::{to_local, to_world};
use optics::fresnel::fresnel_dielectric;
use optics::interiors::Interiors;
use optics::motion::MOTION_MIDDLE;
use optics::scatter::BSDF_THIN_DIELECTRIC;
use optics::vector::dot;
use optics::{Vec3f, vec3f};
use rayon::prelude::*;
use scene::tables::{MaterialRecord, MediumRecord, ModelTag};

/// Light that came back to where a beam started.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BeamEcho {
    /// Half of the way that light went, each metre counted as often as the index of refraction
    /// says: what the time of flight tells, metres.
    pub range: f32,
    /// Share of the light that comes back, linear RGB; 1 for a white diffuse surface that faces the
    /// beam, at any distance.
    pub intensity: [f32; 3],
    /// Index of the instance that sent it back.
    pub instance: u32,
}

/// Surfaces and boundaries that a beam is followed through.
const MOST_SURFACES: u32 = 64;
/// Echoes of less than this share are not followed any more.
const LEAST_SHARE: f32 = 1e-6;
/// Light that a rough pane turns by more than this is lost to the receiver, radians.
const ACCEPTANCE: f32 = 0.01;
/// Over so many chances a material is averaged that is either glass or not.
const MIXTURE: u32 = 16;

/// What a surface does to a beam.
struct Encounter {
    /// Share that is sent back, see [`BeamEcho::intensity`].
    back: Vec3f,
    /// Share of an echo from behind that is left after both passages; zero if the beam ends.
    through: Vec3f,
    /// Direction behind the surface.
    direction: Vec3f,
    /// Whether the surface is clear: it has an echo only if light comes back.
    clear: bool,
}

impl RayQueries {
    /// What comes back of `beams` beams, each made of `rays` rays, as `record` makes something of
    /// their echoes.
    ///
    /// - `origin`: where all start, world space. `reach`: largest range, metres.
    /// - `direction`: of a ray by its number, unit length; the rays of a beam follow each other.
    /// - `record`: gets a beam's number and the echoes of its rays, ray by ray and nearest first.
    /// - `control`: is told how many rays are done, and may cancel: what was not traced then is
    ///   `T::default()`.
    pub fn beams<T: Send + Clone + Default>(
        &self,
        (beams, rays): (usize, usize),
        (origin, reach): ([f32; 3], f32),
        control: &Control,
        direction: impl Fn(usize) -> [f32; 3] + Sync,
        record: impl Fn(usize, &mut Vec<BeamEcho>) -> T + Sync,
    ) -> Vec<T> {
        control.begin((beams * rays) as u64);
        let around = interiors_around(&self.scene, vec3f(origin[0], origin[1], origin[2]), MOTION_MIDDLE);
        let together = (PIECE / rays).max(1);
        let mut results = vec![T::default(); beams];
        let trace = |(scratch, echoes): &mut (Scratch, Vec<BeamEcho>),
                     (piece, results): (usize, &mut [T])| {
            if control.is_cancelled() {
                return;
            }
            let first = piece * together;
            scratch.rays.clear();
            scratch.rays.extend((first * rays..(first + results.len()) * rays).map(|i| Ray {
                origin,
                t_min: 0.0,
                direction: direction(i),
                t_max: reach,
            }));
            self.first_hits(scratch);
            let beams = scratch.rays.chunks(rays).zip(scratch.hits.chunks(rays));
            for (i, (result, (rays, hits))) in results.iter_mut().zip(beams).enumerate() {
                echoes.clear();
                for (ray, hit) in rays.iter().zip(hits) {
                    self.follow_beam(*ray, *hit, around, echoes);
                }
                *result = record(first + i, echoes);
            }
            control.advance(scratch.rays.len() as u64);
        };
        let pieces = results.par_chunks_mut(together).enumerate();
        self.threads.install(|| pieces.for_each_init(Default::default, trace));
        results
    }

    /// The first surface or boundary that each ray meets.
    fn first_hits(&self, scratch: &mut Scratch) {
        scratch.hits.clear();
        if self.scene.tables.has_boundaries() {
            scratch.hits.extend(scratch.rays.iter().map(|ray| self.closest(ray)));
        } else {
            scratch.hits.resize(scratch.rays.len(), MISS);
            self.closest_stream(&scratch.rays, &mut scratch.hits, Coherence::Incoherent);
        }
    }

    fn closest(&self, ray: &Ray) -> Hit {
        self.scene.tlas.closest(ray, &BoundaryFilter(&self.scene))
    }

    /// Adds the echoes of one ray, of which the first hit is known.
    fn follow_beam(&self, mut ray: Ray, mut hit: Hit, mut inside: Interiors, echoes: &mut Vec<BeamEcho>) {
        let (scene, tables) = (&self.scene, &*self.scene.tables);
        let reach = ray.t_max;
        let (mut range, mut share) = (0.0, vec3f(1.0, 1.0, 1.0));
        // The way from the surface that the ray left to the ray's origin, metres.
        let mut skipped = 0.0;
        for _ in 0..MOST_SURFACES {
            if hit.is_miss() {
                return;
            }
            let surface = Surface::new(scene, &ray, &hit, MOTION_MIDDLE);
            if let Some(segment) = segment(inside, tables, &ray, hit.t, Some(&surface))
                && !segment.subsurface
            {
                let depth = optical_depth(tables, &ray, &segment) * -2.0;
                share *= vec3f(exp(depth.x), exp(depth.y), exp(depth.z));
            }
            range += (hit.t + skipped) * ior_along(inside, tables, &surface);
            if range > reach {
                return;
            }
            let material = &tables.materials[surface.material as usize];
            let (above, direction) = if passes(tables, &surface, inside) {
                inside = crossed(inside, tables, &surface);
                (false, -surface.wo)
            } else {
                let met = self.encounter(&surface, material, inside);
                let back = share * met.back;
                if !met.clear || back.x + back.y + back.z > 0.0 {
                    echoes.push(BeamEcho { range, intensity: back.to_array(), instance: surface.object });
                }
                share *= met.through;
                if share.x.max(share.y).max(share.z) < LEAST_SHARE {
                    return;
                }
                if material.is_body() {
                    inside = crossed(inside, tables, &surface);
                }
                (dot(met.direction, surface.normal) > 0.0, met.direction)
            };
            // Between shading and geometric normal there are directions that would leak back.
            if above {
                return;
            }
            let origin = surface.ray_origin(false);
            skipped = dot(origin - surface.position, direction);
            ray = Ray {
                origin: origin.to_array(),
                t_min: 0.0,
                direction: direction.to_array(),
                t_max: reach - range,
            };
            hit = self.closest(&ray);
        }
    }

    fn encounter(&self, surface: &Surface, material: &MaterialRecord, inside: Interiors) -> Encounter {
        let tables = &*self.scene.tables;
        let nothing = vec3f(0.0, 0.0, 0.0);
        let clear = material.model == ModelTag::Dielectric || material.transmission > 0.0;
        let mut met = Encounter { back: nothing, through: nothing, direction: -surface.wo, clear };
        let wo = to_local(surface.frame(), surface.wo);
        if wo.z <= 0.0 {
            return met;
        }
        let medium = tables.media.get(material.medium as usize);
        if let Some(medium) = medium.filter(|m| m.subsurface && surface.front) {
            let entered = 1.0 - fresnel_dielectric(wo.z.min(1.0), material.ior).reflectance;
            return Encounter {
                back: subsurface_color(medium, material.ior) * (entered * wo.z),
                clear: false,
                ..met
            };
        }
        let nested = tables.nested && material.is_body();
        let ior = if nested { relative_ior(inside, tables, surface) } else { material.ior };
        let shading = Shading { single_scatter: false, pixel_spread: 0.0 };
        let strata = if mixes_models(material) { MIXTURE } else { 1 };
        let (mut passed, mut eta) = (nothing, 1.0);
        for i in 0..strata {
            let u_mix = (i as f32 + 0.5) / strata as f32;
            let bsdf = shade(tables, material, surface, &shading, 0.0, ior, u_mix);
            met.back += bsdf_eval(bsdf, wo, wo).value_cos * (PI / strata as f32);
            let beam = transmitted_beam(bsdf, wo, ACCEPTANCE);
            if beam.transmitted {
                met.direction = to_world(surface.frame(), beam.wi);
                passed += beam.weight * (1.0 / strata as f32);
                eta = if bsdf.kind == BSDF_THIN_DIELECTRIC { 1.0 } else { bsdf.eta };
            }
        }
        // The weight is that of radiance, which refraction changes by 1/η². The power of the beam
        // does not change by it.
        met.through = passed * passed * (eta * eta);
        met
    }
}

/// Of light that has got into wax, skin or marble, the share that comes out again, around the same
/// place and as from a diffuse surface.
///
/// Sources: van de Hulst 1980 for a half-space without a surface, with the similarity relation for
/// the anisotropy; Saunderson 1942 for what the surface throws back inwards, whose mean is Egan and
/// Hilgeman's (in Jensen et al. 2001).
fn subsurface_color(medium: &MediumRecord, ior: f32) -> Vec3f {
    let internal = (-1.44 / (ior * ior) + 0.71 / ior + 0.668 + 0.0636 * ior).clamp(0.0, 1.0);
    let of = |channel: usize| {
        let (scattering, absorption) = (medium.scattering[channel], medium.absorption[channel]);
        let extinction = scattering + absorption;
        let albedo = if extinction > 0.0 { scattering / extinction } else { 0.0 };
        let s = ((1.0 - albedo) / (1.0 - medium.anisotropy * albedo)).max(0.0).sqrt();
        let half_space = (1.0 - 0.139 * s) * (1.0 - s) / (1.0 + 1.17 * s);
        half_space * (1.0 - internal) / (1.0 - internal * half_space)
    };
    vec3f(of(0), of(1), of(2))
}
