//! Scattering of sixteen vertices at once: see `lanes`.

use crate::batch::departures::NextLanes;
use crate::batch::lanes::{LANES, Pairs, Vectors};
use crate::batch::vertices::Vertices;
use backend::PathSettings;
use optics::dielectric::{dielectric_bsdf, smooth_dielectric_sample};
use optics::frame::{frame_from_normal, to_local, to_world};
use optics::offset::offset_ray_origin;
use optics::path::{PathState, roulette_survival};
use optics::scatter::BsdfValue;
use optics::vector::dot;
use optics::warp::{pdf_cosine_hemisphere, sample_cosine_hemisphere};
use optics::{Vec3f, vec3f};

/// What light samples ask of the surfaces at vertices.
pub(crate) trait Lobes {
    /// Value times cosine and density for the unit direction `wi`, in world space, from the vertex of a lane. What is below the surface
    /// does not count.
    fn eval(&self, v: &Vertices, lane: usize, wi: Vec3f) -> BsdfValue;
}

/// Surfaces that are ideally diffuse.
pub(crate) struct CosineLobes;

impl Lobes for CosineLobes {
    #[inline(always)]
    fn eval(&self, v: &Vertices, lane: usize, wi: Vec3f) -> BsdfValue {
        let pdf = pdf_cosine_hemisphere(dot(wi, v.shading_normal.get(lane)));
        BsdfValue { value_cos: v.color.get(lane) * pdf, pdf }
    }
}

/// Samples the cosine lobe of every lane. `origin`: where rays start that leave on the side of the viewer.
#[inline(always)]
pub(crate) fn sample_cosine_lobes(v: &Vertices, origin: &Vectors, u: &Pairs, out: &mut NextLanes) {
    for lane in 0..LANES {
        let normal = v.normal.get(lane);
        let local = sample_cosine_hemisphere(u.get(lane));
        let wi = to_world(frame_from_normal(v.shading_normal.get(lane)), local);
        out.wi.set(lane, wi);
        out.pdf.0[lane] = pdf_cosine_hemisphere(local.z);
        out.alive.0[lane] = u32::from(local.z > 0.0 && dot(wi, normal) > 0.0);
        out.origin.set(lane, origin.get(lane));
        // Value times cosine over density of a cosine lobe.
        out.throughput.set(lane, v.throughput.get(lane) * v.color.get(lane));
        out.eta_scale.0[lane] = v.eta_scale.0[lane];
    }
}

/// Chooses between reflection and refraction in every lane, by the first of two random numbers.
#[inline(always)]
pub(crate) fn sample_smooth_interfaces(v: &Vertices, u: &Pairs, out: &mut NextLanes) {
    for lane in 0..LANES {
        let (normal, eta) = (v.normal.get(lane), v.eta.0[lane]);
        let frame = frame_from_normal(v.shading_normal.get(lane));
        let bsdf = dielectric_bsdf(v.color.get(lane), 0.0, eta, false, 1.0);
        let sample = smooth_dielectric_sample(bsdf, to_local(frame, v.wo.get(lane)), u.x.0[lane]);
        let wi = to_world(frame, sample.wi);
        let above = dot(wi, normal) > 0.0;
        let side = if above { 1.0 } else { -1.0 };
        out.wi.set(lane, wi);
        out.pdf.0[lane] = -1.0;
        out.alive.0[lane] = u32::from(above != sample.transmitted);
        let origin = offset_ray_origin(v.position.get(lane), normal * side, v.clearance.0[lane]);
        out.origin.set(lane, origin);
        out.throughput.set(lane, v.throughput.get(lane) * sample.weight);
        out.eta_scale.0[lane] = v.eta_scale.0[lane] * if sample.transmitted { eta * eta } else { 1.0 };
    }
}

/// Lets Russian roulette decide in every lane, by the second of two random numbers. `depth`: of the vertices.
#[inline(always)]
pub(crate) fn play_roulette(u: &Pairs, depth: u32, settings: &PathSettings, out: &mut NextLanes) {
    for lane in 0..LANES {
        let state = PathState {
            throughput: out.throughput.get(lane),
            radiance: vec3f(0.0, 0.0, 0.0),
            pdf: out.pdf.0[lane],
            specular: false,
            eta_scale: out.eta_scale.0[lane],
            depth: depth + 1,
        };
        let survival = roulette_survival(state, settings.roulette_start, settings.roulette_min_survival);
        out.alive.0[lane] &= u32::from(u.get(lane).y < survival);
        out.throughput.set(lane, state.throughput * (1.0 / survival));
    }
}
