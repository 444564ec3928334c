// What a path asks of the surface that it is on, in scenes without layered materials: the optics' models as they are.

#import material, surface
#import optics::bsdf, optics::frame, optics::scatter

alias Scattering = Bsdf;

/// Whether `surface_scattering` needs `u_model`.
fn wants_model_number(material: u32) -> bool {
    return mixes_models(material);
}

/// What scatters at a surface, prepared for its viewing direction. `u_model`: as `u_mix` of `surface_bsdf`. `throughput`: of
/// the path; layers that disperse light depend on it.
fn surface_scattering(s: Surface, footprint: f32, throughput: vec3f, u_model: f32, single_scatter: bool) -> Scattering {
    return surface_bsdf(s, footprint, u_model, single_scatter);
}

/// Whether anything scatters.
fn scatters(b: Scattering) -> bool {
    return b.kind != BSDF_NONE;
}

/// The frame of directions in the functions below.
fn scattering_frame(b: Scattering, s: Surface) -> Frame {
    return frame_from_normal(s.shading_normal);
}

fn scattering_has_smooth_part(b: Scattering) -> bool {
    return bsdf_has_smooth_part(b);
}

fn scattering_has_lobes(b: Scattering) -> bool {
    return bsdf_has_lobes(b);
}

fn scattering_transmits(b: Scattering) -> bool {
    return bsdf_transmits(b);
}

fn scattering_eval(b: Scattering, wo: vec3f, wi: vec3f) -> BsdfValue {
    return bsdf_eval(b, wo, wi);
}

fn scattering_sample(b: Scattering, wo: vec3f, u_lobe: f32, u: vec2f) -> BsdfSample {
    return bsdf_sample(b, wo, u_lobe, u);
}

fn scattering_eta(b: Scattering) -> f32 {
    return b.eta;
}
