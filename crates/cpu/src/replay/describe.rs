//! From the optics' values to records.

use super::record::{FoundLight, LightSampleRecord, LightVisibility};
use optics::Vec3f;
use optics::closure::Closure;
use optics::constants::FAR;
use optics::light::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_PROJECTOR, LIGHT_RECTANGLE, LIGHT_SPHERE,
    LIGHT_SPOT, LIGHT_TRIANGLE, LightSample,
};
use optics::mis::{MisHeuristic, bsdf_sample_weight};
use optics::path::{PathState, path_add_emission};
use optics::scatter::{
    BSDF_GLOSSY, BSDF_MIRROR, BSDF_ROUGH_DIELECTRIC, BSDF_SMOOTH_DIELECTRIC, BSDF_THIN_DIELECTRIC,
};

/// Light that a path in this state has come upon.
pub(super) fn found_light(
    state: &PathState,
    radiance: Vec3f,
    light_pdf: f32,
    mis: MisHeuristic,
) -> FoundLight {
    let counts_in_full = state.specular || light_pdf <= 0.0;
    FoundLight {
        radiance: radiance.to_array(),
        scattering_pdf: (!state.specular).then_some(state.pdf),
        light_pdf,
        weight: if counts_in_full { 1.0 } else { bsdf_sample_weight(mis, state.pdf, light_pdf) },
        contribution: path_add_emission(*state, radiance, light_pdf, mis).radiance.to_array(),
    }
}

/// A light sample that is behind the surface.
pub(super) fn light_record(index: u32, kind: u32, light: &LightSample) -> LightSampleRecord {
    LightSampleRecord {
        light: index,
        kind: light_name(kind),
        direction: light.wi.to_array(),
        distance: if light.distance >= FAR { f32::INFINITY } else { light.distance },
        radiance: light.radiance.to_array(),
        pdf: light.pdf,
        delta: light.delta,
        scattering: [0.0; 3],
        scattering_pdf: 0.0,
        weight: 0.0,
        visibility: LightVisibility::Behind,
        contribution: [0.0; 3],
    }
}

fn light_name(kind: u32) -> &'static str {
    match kind {
        LIGHT_TRIANGLE => "triangle",
        LIGHT_RECTANGLE => "rectangle",
        LIGHT_SPHERE => "sphere",
        LIGHT_POINT => "point",
        LIGHT_SPOT => "spot",
        LIGHT_DIRECTIONAL => "directional",
        LIGHT_ENVIRONMENT => "environment",
        LIGHT_PROJECTOR => "projector",
        _ => "light",
    }
}

/// The model that scatters, in words.
pub(super) fn model_name(closure: &Closure) -> &'static str {
    if closure.layered {
        return "layers";
    }
    match closure.plain.kind {
        BSDF_GLOSSY => "diffuse and glossy",
        BSDF_SMOOTH_DIELECTRIC => "smooth dielectric",
        BSDF_ROUGH_DIELECTRIC => "rough dielectric",
        BSDF_THIN_DIELECTRIC => "thin dielectric",
        BSDF_MIRROR => "mirror",
        _ => "nothing",
    }
}
