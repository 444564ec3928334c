// What a path asks of the surface that it is on, in scenes with layered materials. The functions are those of
// `scattering_plain.wgsl`; a surface has either one of the optics' plain models or layers.
//
// The layers of a material lie in `words`, from the word on that `MaterialRecord.layers` says: a LayersRecord, then the
// uses of its textures.

#import layer_constants, layer_readers, material, scene, surface, texels, texture, use_readers
#import optics::closure, optics::constants, optics::frame, optics::layered, optics::layers
#import optics::material, optics::scatter, optics::sheen

alias Scattering = Closure;

/// A texture of layers, if they have one there; ones otherwise.
fn layer_texel(layers: u32, slot: u32, point: TexturePoint) -> vec4f {
    let use_ = read_TextureUse(layers + LAYERS_RECORD_WORDS + TEXTURE_USE_WORDS * slot);
    if use_.first_texel == NONE {
        return vec4f(1.0);
    }
    return sample_texture(use_, point);
}

/// Share of light that white fibres scatter.
fn lookup_sheen_albedo(cos_theta: f32, roughness: f32) -> f32 {
    let at = sheen_albedo_coordinates(cos_theta, roughness);
    let x = table_place(at.x, SHEEN_ALBEDO_WIDTH);
    let y = table_place(at.y, SHEEN_ALBEDO_HEIGHT);
    let corner = scene.sheen_albedo + u32(y.index) * SHEEN_ALBEDO_WIDTH + u32(x.index);
    let near = mix(word_f32(corner), word_f32(corner + 1u), x.beyond);
    let far = mix(word_f32(corner + SHEEN_ALBEDO_WIDTH), word_f32(corner + SHEEN_ALBEDO_WIDTH + 1u), x.beyond);
    return mix(near, far, y.beyond);
}

/// Whether a material has layers.
fn is_layered(material: u32) -> bool {
    return materials[material].model == ModelTag_Layered;
}

fn wants_model_number(material: u32) -> bool {
    if is_layered(material) {
        return read_LayersRecord(materials[material].layers).dispersion > 0.0;
    }
    return mixes_models(material);
}

fn surface_scattering(s: Surface, footprint: f32, throughput: vec3f, u_model: f32, single_scatter: bool) -> Scattering {
    if is_layered(s.material) {
        return surface_layers(s, footprint, throughput, u_model, single_scatter);
    }
    return plain_closure(surface_bsdf(s, footprint, u_model, single_scatter), s.shading_normal);
}

/// A material with layers at a surface.
fn surface_layered_point(s: Surface, footprint: f32, throughput: vec3f, u_dispersion: f32) -> LayeredPoint {
    let at = materials[s.material].layers;
    let place = texture_point(s, footprint_width(footprint, dot(s.wo, s.normal)));
    var texels: LayerTexels;
    for (var slot = 0u; slot < LAYER_TEXTURES; slot++) {
        texels.layers[slot] = layer_texel(at, slot, place);
    }
    texels.metallic_roughness = sample_slot(s.material, SLOT_METALLIC_ROUGHNESS, place);
    texels.transmission = sample_slot(s.material, SLOT_TRANSMISSION, place);
    let directions = SurfaceDirections(s.wo, s.normal, s.shading_normal, s.layer_frame);
    return layered_point(materials[s.material], read_LayersRecord(at), directions, base_color(s, footprint),
        texels, surface_ior(s), s.front, throughput, u_dispersion);
}

/// The lobes at a surface with layers.
fn surface_layers(s: Surface, footprint: f32, throughput: vec3f, u_dispersion: f32, single_scatter: bool) -> Scattering {
    let point = surface_layered_point(s, footprint, throughput, u_dispersion);
    let tint = point.refraction_tint;
    return layered_closure(layered_bsdf(point.parameters, layer_albedos(point), point.wo, tint, single_scatter), point.frame);
}

/// Colour for auxiliary layers: base colour, or that of layers.
fn surface_albedo(s: Surface, footprint: f32) -> vec3f {
    if !is_layered(s.material) {
        return base_color(s, footprint);
    }
    let point = surface_layered_point(s, footprint, vec3f(1.0), 0.5);
    return layered_color(point.parameters, layer_albedos(point).sheen);
}

/// Whether light may come through a material.
fn may_transmit(material: u32) -> bool {
    return is_layered(material) || may_refract(material);
}

/// Directional albedos of the lobes that are there.
fn layer_albedos(p: LayeredPoint) -> LayeredAlbedos {
    let m = p.parameters;
    let cos_o = saturate(p.wo.z);
    var e = no_albedos();
    e.base = lookup_ggx_albedo(cos_o, m.roughness);
    if has_coat(m) {
        e.coat = lookup_ggx_albedo(coat_cosine(p), m.coat_roughness);
    }
    if has_sheen(m) {
        e.sheen = lookup_sheen_albedo(cos_o, m.sheen_roughness);
    }
    if has_interface(m) {
        e.whole_interface = lookup_dielectric_albedo(cos_o, m.roughness * m.roughness, m.eta);
    }
    return e;
}

fn scattering_is_layered(b: Scattering) -> bool {
    return b.layered;
}

fn scattering_frame(b: Scattering, s: Surface) -> Frame {
    return b.frame;
}

fn scatters(b: Scattering) -> bool {
    return closure_scatters(b);
}

fn scattering_has_smooth_part(b: Scattering) -> bool {
    return closure_has_smooth_part(b);
}

fn scattering_has_lobes(b: Scattering) -> bool {
    return closure_has_lobes(b);
}

fn scattering_is_sharp(b: Scattering) -> bool {
    return closure_is_sharp(b);
}

fn scattering_transmits(b: Scattering) -> bool {
    return closure_transmits(b);
}

fn scattering_eval(b: Scattering, wo: vec3f, wi: vec3f) -> BsdfValue {
    return closure_eval(b, wo, wi);
}

fn scattering_sample(b: Scattering, wo: vec3f, u_lobe: f32, u: vec2f) -> BsdfSample {
    return closure_sample(b, wo, u_lobe, u);
}

fn scattering_eta(b: Scattering) -> f32 {
    return closure_eta(b);
}

fn scattering_diffuse_albedo(b: Scattering) -> vec3f {
    return closure_diffuse_albedo(b);
}

fn scattering_diffuse_albedo_below(b: Scattering) -> vec3f {
    return closure_diffuse_albedo_below(b);
}

fn scattering_without_diffuse(b: Scattering) -> Scattering {
    return closure_without_diffuse(b);
}

fn scattering_lobe_colors(b: Scattering) -> LobeColors {
    return closure_lobe_colors(b);
}

fn scattering_reflects(b: Scattering) -> bool {
    return closure_reflects(b);
}

fn scattering_is_interface(b: Scattering) -> bool {
    return closure_is_interface(b);
}

fn scattering_reflected_share(b: Scattering, cos_o: f32) -> f32 {
    return closure_reflected_share(b, cos_o);
}

fn scattering_phong_eval(b: Scattering, wo: vec3f, wi: vec3f) -> vec3f {
    return closure_phong_eval(b, wo, wi);
}
