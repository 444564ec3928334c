// From a material and a surface to emission, coverage and a prepared BSDF.

#import material_constants, scene, surface, texture, variant
#import optics::dielectric, optics::ggx, optics::glossy, optics::pattern, optics::random
#import optics::scatter

/// Linear base colour at a surface: factor × texture × vertex colour, or the pattern's. `footprint`: radius of the ray's
/// footprint, metres.
fn base_color(s: Surface, footprint: f32) -> vec3f {
    let index = s.material;
    if (materials[index].flags & MATERIAL_CHECKERBOARD) != 0u {
        let scale = materials[index].checkerboard_scale;
        let width = footprint_width(footprint, dot(s.wo, s.normal)) * scale;
        let odd = checkerboard(s.pattern_position * scale, width);
        return materials[index].checkerboard_even
            + (materials[index].checkerboard_odd - materials[index].checkerboard_even) * odd;
    }
    return materials[index].base_color.rgb * s.color.rgb * sample_slot(index, SLOT_BASE_COLOR, s.coords).rgb;
}

/// Coverage in [0, 1] at a point: `coords` and `color` as in a Surface, `position` in the x–z plane of object space.
fn coverage(material: u32, coords: vec4f, color: vec4f, position: vec2f) -> f32 {
    let flags = materials[material].flags;
    var alpha = 1.0;
    if (flags & (MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND)) != 0u {
        alpha = materials[material].base_color.a * color.a * sample_slot(material, SLOT_BASE_COLOR, coords).a;
    }
    if (flags & MATERIAL_ALPHA_MASK) != 0u {
        alpha = select(0.0, 1.0, alpha >= materials[material].alpha_cutoff);
    }
    if (flags & MATERIAL_CHECKERBOARD_FADES) != 0u {
        let fade = materials[material].checkerboard_fade;
        alpha *= distance_fade(length(position), fade.x, fade.y);
    }
    return alpha;
}

/// Whether a candidate hit counts where a surface has holes.
///
/// Partial coverage is decided by a hash of the hit's barycentrics: two hits that differ in their last bit decide
/// independently, so the pattern is finer than any pixel, costs no transmittance bookkeeping, and is the same for every
/// query of the same ray. Spheres have no texture coordinates at this point and always count. `salt` is not used: a
/// transmittance that is drawn anew for every ray would need it.
fn alpha_accepts(instance: u32, geometry: u32, primitive: u32, u: f32, v: f32, salt: u32) -> bool {
    let binding = bindings[instances[instance].first_binding + geometry];
    if (binding.flags & (BINDING_ALPHA | BINDING_SPHERES)) != BINDING_ALPHA {
        return true;
    }
    // To all others a boundary is one big hole.
    if FOLLOWS_VOLUMES && materials[binding.material].model == MODEL_BOUNDARY {
        return true;
    }
    let corners = triangle_corners(binding, primitive - binding.first_in_blas);
    let weights = vec3f(1.0 - u - v, u, v);
    let position = vertices[binding.first_vertex + corners.x].position * weights.x
        + vertices[binding.first_vertex + corners.y].position * weights.y
        + vertices[binding.first_vertex + corners.z].position * weights.z;
    let coords = triangle_coords(binding, corners, weights);
    let alpha = coverage(binding.material, coords, triangle_color(binding, corners, weights), position.xz);
    if alpha >= 1.0 || alpha <= 0.0 {
        return alpha >= 1.0;
    }
    let place = hash_combine(hash_combine(instance, primitive), bitcast<u32>(u));
    return unit_float(hash_combine(place, bitcast<u32>(v))) < alpha;
}

/// Whether a sphere is there, and not only the end of a medium of which the shader knows nothing.
fn sphere_accepts(binding: Binding) -> bool {
    return !HIDES_BOUNDARIES || materials[binding.material].model != MODEL_BOUNDARY;
}

/// Radiance that an emissive material emits at texture coordinates.
fn emission_at(material: u32, coords: vec4f) -> vec3f {
    return materials[material].emission * sample_slot(material, SLOT_EMISSION, coords).rgb;
}

/// Whether a path may find light on surfaces of a material.
fn may_shine(material: u32) -> bool {
    return (materials[material].flags & MATERIAL_EMISSIVE) != 0u || materials[material].model == MODEL_UNLIT;
}

/// Radiance that the surface emits towards the viewer.
fn surface_emission(s: Surface, footprint: f32) -> vec3f {
    if materials[s.material].model == MODEL_UNLIT {
        return base_color(s, footprint);
    }
    let flags = materials[s.material].flags;
    let shines = (flags & MATERIAL_EMISSIVE) != 0u && (s.front || (flags & MATERIAL_EMISSION_TWO_SIDED) != 0u);
    if !shines {
        return vec3f(0.0);
    }
    return emission_at(s.material, s.coords);
}

/// Index of refraction of what is behind a surface.
fn surface_ior(s: Surface) -> f32 {
    if FOLLOWS_VOLUMES && s.relative_ior > 0.0 {
        return s.relative_ior;
    }
    return materials[s.material].ior;
}

/// Whether `surface_bsdf` needs `u_mix`.
fn mixes_models(material: u32) -> bool {
    return materials[material].transmission > 0.0;
}

/// The BSDF at a surface, prepared for its viewing direction.
///
/// - `u_mix`: uniform number that chooses between refraction and diffuse reflection where a material mixes them.
fn surface_bsdf(s: Surface, footprint: f32, u_mix: f32, single_scatter: bool) -> Bsdf {
    let index = s.material;
    let model = materials[index].model;
    if model == MODEL_UNLIT {
        return black_bsdf();
    }
    let color = base_color(s, footprint);
    if model == MODEL_LAMBERT {
        return lambert_bsdf(color);
    }
    if model == MODEL_MIRROR {
        return mirror_bsdf(color);
    }
    let scale = sample_slot(index, SLOT_METALLIC_ROUGHNESS, s.coords);
    let roughness = materials[index].roughness * scale.g;
    if model == MODEL_DIELECTRIC {
        return surface_dielectric(s, color, roughness, single_scatter);
    }
    let metallic = materials[index].metallic * scale.b;
    let transmission = materials[index].transmission * sample_slot(index, SLOT_TRANSMISSION, s.coords).r;
    let refracted = transmission * (1.0 - metallic);
    if u_mix < refracted {
        return surface_dielectric(s, color, roughness, single_scatter);
    }
    var m: MetallicRoughness;
    m.base_color = color;
    // What is not refracted: the metal, and the rest of the dielectric.
    m.metallic = saturate(metallic / max(1.0 - refracted, 1e-6));
    m.roughness = saturate(roughness);
    m.specular = materials[index].specular;
    m.ior = surface_ior(s);
    let albedo = lookup_ggx_albedo(saturate(dot(s.wo, s.shading_normal)), m.roughness);
    return metallic_roughness_bsdf(m, albedo, single_scatter);
}

fn surface_dielectric(s: Surface, tint: vec3f, roughness: f32, single_scatter: bool) -> Bsdf {
    let thin = (materials[s.material].flags & MATERIAL_THIN) != 0u;
    let ior = surface_ior(s);
    let eta = select(1.0 / ior, ior, s.front || thin);
    let alpha = roughness * roughness;
    var compensation = 1.0;
    if alpha >= MIN_ALPHA && !single_scatter {
        let cos_o = saturate(dot(s.wo, s.shading_normal));
        if thin {
            compensation = sheet_compensation(lookup_ggx_albedo(cos_o, roughness));
        } else {
            compensation = dielectric_compensation(lookup_dielectric_albedo(cos_o, alpha, eta));
        }
    }
    return dielectric_bsdf(tint, alpha, eta, thin, compensation);
}
