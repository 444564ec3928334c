// What a path asks of the surface that it is on, in scenes with layered materials. The functions are those of
// `scattering_plain.wgsl`; a surface has either one of the optics' plain models or layers.
//
// The layers of a material lie in `words`, from the word on that `Material.layers` says; LAYERS_… are the places of their
// fields, in words.

#import layer_constants, material, material_constants, scene, surface, texels, texture
#import optics::bsdf, optics::constants, optics::frame, optics::layered, optics::lobes
#import optics::scatter, optics::sheen

struct Scattering {
    layered: bool,
    /// What scatters, if that is not layered.
    plain: Bsdf,
    layers: Layered,
    /// The shading frame of layers; its X is the direction of anisotropy.
    frame: Frame,
}

/// Where the use of a texture by layers begins, in `words`.
fn layer_texture(layers: u32, slot: u32) -> u32 {
    return layers + LAYERS_TEXTURES + LAYERS_TEXTURE_WORDS * slot;
}

/// A texture of layers, if they have one there; ones otherwise.
fn layer_texel(layers: u32, slot: u32, coords: vec4f) -> vec4f {
    let at = layer_texture(layers, slot);
    var use_: TextureUse;
    use_.row_u = words_vec3(at);
    use_.first_texel = words[at + 3u];
    use_.row_v = words_vec3(at + 4u);
    use_.flags = words[at + 7u];
    use_.width = words[at + 8u];
    use_.height = words[at + 9u];
    use_.image = words[at + 10u];
    if use_.first_texel == NONE {
        return vec4f(1.0);
    }
    return sample_texture(use_, coords);
}

fn has_layer_texture(layers: u32, slot: u32) -> bool {
    return words[layer_texture(layers, slot) + 3u] != NONE;
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
    return materials[material].model == MODEL_LAYERED;
}

fn wants_model_number(material: u32) -> bool {
    if is_layered(material) {
        return word_f32(materials[material].layers + LAYERS_DISPERSION) > 0.0;
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

/// The coat's unit normal: of its own map, or without one.
fn coat_normal(s: Surface, layers: u32) -> vec3f {
    if !has_layer_texture(layers, LAYER_SLOT_COAT_NORMAL) {
        return s.layer_frame.normal;
    }
    let stored = layer_texel(layers, LAYER_SLOT_COAT_NORMAL, s.coords).rgb;
    let mapped = map_normal(s.layer_frame, stored, word_f32(layers + LAYERS_COAT_NORMAL_SCALE));
    return bend_normal(s.wo, s.normal, mapped);
}

/// The lobes at a surface with layers.
fn surface_layers(s: Surface, footprint: f32, throughput: vec3f, u_dispersion: f32, single_scatter: bool) -> Scattering {
    let index = s.material;
    let layers = materials[index].layers;
    let scale = sample_slot(index, SLOT_METALLIC_ROUGHNESS, s.coords);
    let specular_color = layer_texel(layers, LAYER_SLOT_SPECULAR_COLOR, s.coords);
    var roughness = materials[index].roughness * scale.g;
    if (words[layers + LAYERS_FLAGS] & LAYERS_GLOSSINESS) != 0u {
        roughness = 1.0 - (1.0 - materials[index].roughness) * specular_color.a;
    }
    let thin = (materials[index].flags & MATERIAL_THIN) != 0u;
    let transmission = materials[index].transmission * sample_slot(index, SLOT_TRANSMISSION, s.coords).r;
    let inside = !s.front && !thin && transmission > 0.0;
    let dispersed = choose_dispersed(
        word_f32(layers + LAYERS_DISPERSION), surface_ior(s), throughput, u_dispersion);

    var grain = vec3f(1.0, 0.5, 1.0);
    if has_layer_texture(layers, LAYER_SLOT_ANISOTROPY) {
        grain = layer_texel(layers, LAYER_SLOT_ANISOTROPY, s.coords).rgb;
    }
    let axis = anisotropy_axis(s.layer_frame, words_vec2(layers + LAYERS_ANISOTROPY_DIRECTION), grain.rg);
    let frame = frame_from_tangent(s.shading_normal, axis);
    let wo = to_local(frame, s.wo);
    let thickness = words_vec2(layers + LAYERS_FILM_THICKNESS);

    var m: LayeredParameters;
    m.base_color = base_color(s, footprint);
    m.metallic = saturate(materials[index].metallic * scale.b);
    m.roughness = saturate(roughness);
    m.specular = materials[index].specular * layer_texel(layers, LAYER_SLOT_SPECULAR, s.coords).a;
    m.specular_color = words_vec3(layers + LAYERS_SPECULAR_COLOR) * specular_color.rgb;
    m.ior = word_f32(layers + LAYERS_REFLECTANCE_IOR);
    m.anisotropy = word_f32(layers + LAYERS_ANISOTROPY) * grain.b;
    m.transmission = transmission;
    m.diffuse_transmission = word_f32(layers + LAYERS_DIFFUSE_TRANSMISSION)
        * layer_texel(layers, LAYER_SLOT_DIFFUSE_TRANSMISSION, s.coords).a;
    m.diffuse_transmission_color = words_vec3(layers + LAYERS_DIFFUSE_TRANSMISSION_COLOR)
        * layer_texel(layers, LAYER_SLOT_DIFFUSE_TRANSMISSION_COLOR, s.coords).rgb;
    m.sheen_color = words_vec3(layers + LAYERS_SHEEN_COLOR)
        * layer_texel(layers, LAYER_SLOT_SHEEN_COLOR, s.coords).rgb;
    m.sheen_roughness = word_f32(layers + LAYERS_SHEEN_ROUGHNESS)
        * layer_texel(layers, LAYER_SLOT_SHEEN_ROUGHNESS, s.coords).a;
    m.coat = word_f32(layers + LAYERS_COAT) * layer_texel(layers, LAYER_SLOT_COAT, s.coords).r;
    m.coat_roughness = saturate(word_f32(layers + LAYERS_COAT_ROUGHNESS)
        * layer_texel(layers, LAYER_SLOT_COAT_ROUGHNESS, s.coords).g);
    m.coat_normal = to_local(frame, coat_normal(s, layers));
    m.iridescence = word_f32(layers + LAYERS_IRIDESCENCE) * layer_texel(layers, LAYER_SLOT_IRIDESCENCE, s.coords).r;
    m.film_ior = word_f32(layers + LAYERS_FILM_IOR);
    m.film_thickness = thickness.x
        + (thickness.y - thickness.x) * layer_texel(layers, LAYER_SLOT_FILM_THICKNESS, s.coords).g;
    m.eta = select(dispersed.ior, 1.0 / dispersed.ior, inside);
    m.thin = thin;
    m.inside = inside;
    let b = layered_bsdf(m, layer_albedos(m, wo), wo, dispersed.tint, single_scatter);
    return Scattering(true, black_bsdf(), b, frame);
}

/// Directional albedos of the lobes that are there.
fn layer_albedos(m: LayeredParameters, wo: vec3f) -> LayeredAlbedos {
    let cos_o = saturate(wo.z);
    var e = LayeredAlbedos(lookup_ggx_albedo(cos_o, m.roughness), vec2f(1.0, 0.0), 0.0, 1.0);
    if m.coat > 0.0 {
        e.coat = lookup_ggx_albedo(saturate(dot(m.coat_normal, wo)), m.coat_roughness);
    }
    if m.sheen_color.x + m.sheen_color.y + m.sheen_color.z > 0.0 {
        e.sheen = lookup_sheen_albedo(cos_o, m.sheen_roughness);
    }
    if m.transmission > 0.0 && !m.thin {
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
