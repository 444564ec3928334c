// What a path asks of the surface that it is on, in scenes with layered materials. The functions are those of
// `scattering_plain.wgsl`; a surface has either one of the optics' plain models or layers.
//
// The layers of a material lie in `words`, from the word on that `MaterialRecord.layers` says: a LayersRecord, then the
// uses of its textures.

#import layer_constants, layer_readers, material, scene, surface, texels, texture, use_readers
#import optics::bsdf, optics::constants, optics::frame, optics::layered, optics::layers
#import optics::lobes, optics::material, optics::scatter, optics::sheen

struct Scattering {
    layered: bool,
    /// What scatters, if that is not layered.
    plain: Bsdf,
    layers: Layered,
    /// The shading frame of layers; its X is the direction of anisotropy.
    frame: Frame,
}

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
    let plain = surface_bsdf(s, footprint, u_model, single_scatter);
    return Scattering(false, plain, no_layers(), frame_from_normal(s.shading_normal));
}

/// The lobes at a surface with layers.
fn surface_layers(s: Surface, footprint: f32, throughput: vec3f, u_dispersion: f32, single_scatter: bool) -> Scattering {
    let at = materials[s.material].layers;
    let place = texture_point(s, footprint_width(footprint, dot(s.wo, s.normal)));
    var texels: LayerTexels;
    for (var slot = 0u; slot < LAYER_TEXTURES; slot++) {
        texels.layers[slot] = layer_texel(at, slot, place);
    }
    texels.metallic_roughness = sample_slot(s.material, SLOT_METALLIC_ROUGHNESS, place);
    texels.transmission = sample_slot(s.material, SLOT_TRANSMISSION, place);
    let directions = SurfaceDirections(s.wo, s.normal, s.shading_normal, s.layer_frame);
    let point = layered_point(materials[s.material], read_LayersRecord(at), directions, base_color(s, footprint),
        texels, surface_ior(s), s.front, throughput, u_dispersion);
    let b = layered_bsdf(point.parameters, layer_albedos(point), point.wo, point.refraction_tint, single_scatter);
    return Scattering(true, black_bsdf(), b, point.frame);
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

fn scatters(b: Scattering) -> bool {
    return b.layered || b.plain.kind != BSDF_NONE;
}

fn scattering_frame(b: Scattering, s: Surface) -> Frame {
    return b.frame;
}

fn scattering_has_smooth_part(b: Scattering) -> bool {
    return b.layered || bsdf_has_smooth_part(b.plain);
}

fn scattering_has_lobes(b: Scattering) -> bool {
    return b.layered || bsdf_has_lobes(b.plain);
}

fn scattering_transmits(b: Scattering) -> bool {
    return select(bsdf_transmits(b.plain), layered_transmits(b.layers), b.layered);
}

fn scattering_eval(b: Scattering, wo: vec3f, wi: vec3f) -> BsdfValue {
    if b.layered {
        return layered_eval(b.layers, wo, wi);
    }
    return bsdf_eval(b.plain, wo, wi);
}

fn scattering_sample(b: Scattering, wo: vec3f, u_lobe: f32, u: vec2f) -> BsdfSample {
    if b.layered {
        return layered_sample(b.layers, wo, u_lobe, u);
    }
    return bsdf_sample(b.plain, wo, u_lobe, u);
}

fn scattering_eta(b: Scattering) -> f32 {
    return select(b.plain.eta, b.layers.eta, b.layered);
}
