// What scatters at a surface, in scenes without layered materials: the optics' single models as they are.

#import material, surface
#import optics::bsdf, optics::frame, optics::scatter

alias Scattering = Bsdf;

/// Whether `surface_scattering` needs `u_model`.
fn wants_model_number(material: u32) -> bool {
    return mixes_models(material);
}

/// What scatters at a surface, prepared for its viewing direction. `u_model`: as for `surface_bsdf`. `throughput`: of
/// the path; layers that disperse light depend on it.
fn surface_scattering(s: Surface, footprint: f32, throughput: vec3f, u_model: f32, single_scatter: bool) -> Scattering {
    return surface_bsdf(s, footprint, u_model, single_scatter);
}

/// Colour for auxiliary layers.
fn surface_albedo(s: Surface, footprint: f32) -> vec3f {
    return base_color(s, footprint);
}

/// Whether light may come through a material.
fn may_transmit(material: u32) -> bool {
    return may_refract(material);
}

/// The frame of directions in the functions below, which are those of `bsdf` and `closure`.
fn scattering_is_layered(b: Scattering) -> bool {
    return false;
}

fn scattering_frame(b: Scattering, s: Surface) -> Frame {
    return frame_from_normal(s.shading_normal);
}

fn scatters(b: Scattering) -> bool {
    return bsdf_scatters(b);
}

fn scattering_has_smooth_part(b: Scattering) -> bool {
    return bsdf_has_smooth_part(b);
}

fn scattering_has_lobes(b: Scattering) -> bool {
    return bsdf_has_lobes(b);
}

fn scattering_is_sharp(b: Scattering) -> bool {
    return bsdf_is_sharp(b);
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

fn scattering_diffuse_albedo(b: Scattering) -> vec3f {
    return bsdf_diffuse_albedo(b);
}

fn scattering_diffuse_albedo_below(b: Scattering) -> vec3f {
    return vec3f(0.0);
}

fn scattering_without_diffuse(b: Scattering) -> Scattering {
    return bsdf_without_diffuse(b);
}

fn scattering_lobe_colors(b: Scattering) -> LobeColors {
    return bsdf_lobe_colors(b);
}

fn scattering_reflects(b: Scattering) -> bool {
    return bsdf_reflects(b);
}

fn scattering_is_interface(b: Scattering) -> bool {
    return bsdf_is_interface(b);
}

fn scattering_reflected_share(b: Scattering, cos_o: f32) -> f32 {
    return bsdf_reflected_share(b, cos_o);
}

fn scattering_phong_eval(b: Scattering, wo: vec3f, wi: vec3f) -> vec3f {
    return bsdf_phong_eval(b, wo, wi);
}
