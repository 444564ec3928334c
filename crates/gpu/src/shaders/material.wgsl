// What a material is at a surface: fetches texels and table entries for the optics' `material` and `plain`.

#import primitive, scene, scene_records, surface, texture, texture_points, variant
#import optics::intersect, optics::material, optics::pattern, optics::plain, optics::random, optics::scatter
#import optics::shape, optics::texture_point

/// Linear base colour at a surface. `footprint`: radius of the ray's footprint, metres.
fn base_color(s: Surface, footprint: f32) -> vec3f {
    let width = footprint_width(footprint, dot(s.wo, s.normal));
    let texel = sample_slot(s.material, SLOT_BASE_COLOR, texture_point(s, width));
    return material_base_color(material_at(s.material), s.color, texel, s.object_position.xz, width);
}

/// Coverage in [0, 1] at a point.
fn coverage(material: u32, point: TexturePoint) -> f32 {
    var texel_alpha = 1.0;
    if material_reads_alpha(materials[material]) {
        texel_alpha = sample_slot(material, SLOT_BASE_COLOR, point).a;
    }
    return material_coverage(materials[material], point.color.a, texel_alpha, point.position.xz);
}

/// Whether a candidate hit on a triangle counts where a surface has holes or backs that are culled.
///
/// Partial coverage is decided by a hash of the hit's barycentrics: two hits that differ in their last bit decide
/// independently, so the pattern is finer than any pixel, costs no transmittance bookkeeping, and is the same for every
/// query of the same ray. `salt` is not used: a transmittance that is drawn anew for every ray would need it.
///
/// - `direction`: of the ray, in the space of the bottom-level structure, of any length.
fn alpha_accepts(
    instance: u32,
    geometry: u32,
    primitive: u32,
    u: f32,
    v: f32,
    direction: vec3f,
    salt: u32,
) -> bool {
    let binding = bindings[instances[instance].first_binding + geometry];
    if (binding.flags & BINDING_ALPHA) == 0u {
        return true;
    }
    // To all others a boundary is one big hole.
    if FOLLOWS_VOLUMES && materials[binding.material].model == ModelTag_Boundary {
        return true;
    }
    let corners = triangle_corners(binding, primitive - binding.first_in_blas);
    let p0 = vertices[binding.first_vertex + corners.x].position;
    let p1 = vertices[binding.first_vertex + corners.y].position;
    let p2 = vertices[binding.first_vertex + corners.z].position;
    if is_culled(binding.material, cross(p1 - p0, p2 - p0), direction) {
        return false;
    }
    if !material_has_holes(materials[binding.material]) {
        return true;
    }
    let weights = vec3f(1.0 - u - v, u, v);
    var point: TexturePoint;
    if SCENE_HAS_GRAPHS && has_graphs(binding.material) {
        point = triangle_texture_point(binding, instance, primitive - binding.first_in_blas, weights);
    } else {
        point.coords = triangle_coords(binding, corners, weights);
        point.color = triangle_color(binding, corners, weights);
        point.position = object_position(binding, p0 * weights.x + p1 * weights.y + p2 * weights.z);
    }
    let alpha = coverage(binding.material, point);
    return alpha >= 1.0 || (alpha > 0.0 && hashed_threshold(instance, primitive, u, v) < alpha);
}

/// The same of a sphere. `outward`: from its centre to the hit, of unit length, in the space of the bottom-level structure.
fn sphere_accepts(
    instance: u32,
    geometry: u32,
    primitive: u32,
    sphere: vec4f,
    outward: vec3f,
    direction: vec3f,
) -> bool {
    let binding = bindings[instances[instance].first_binding + geometry];
    if (binding.flags & BINDING_ALPHA) == 0u || (FOLLOWS_VOLUMES && materials[binding.material].model == ModelTag_Boundary) {
        return true;
    }
    if is_culled(binding.material, outward, direction) {
        return false;
    }
    if !material_has_holes(materials[binding.material]) {
        return true;
    }
    var point: TexturePoint;
    if SCENE_HAS_GRAPHS && has_graphs(binding.material) {
        point = sphere_texture_point(binding, instance, primitive - binding.first_in_blas, outward);
    } else {
        point.coords = sphere_uv(sphere_direction(binding, outward)).xyxy;
        point.color = vec4f(1.0);
        point.position = object_position(binding, sphere.xyz + outward * sphere.w);
    }
    let alpha = coverage(binding.material, point);
    return alpha >= 1.0 || (alpha > 0.0 && hashed_threshold(instance, primitive, outward.x, outward.y) < alpha);
}

/// Where a ray crosses a sphere first between `t_min` and `t_max` and the sphere is there; zero if it does not.
fn sphere_crossing(
    instance: u32,
    geometry: u32,
    primitive: u32,
    sphere: vec4f,
    origin: vec3f,
    direction: vec3f,
    t_min: f32,
    t_max: f32,
) -> f32 {
    let crossing = intersect_sphere(origin, direction, sphere.xyz, sphere.w);
    if !crossing.hit {
        return 0.0;
    }
    var t = select(crossing.far, crossing.near, crossing.near > t_min);
    if !(t > t_min && t < t_max) {
        return 0.0;
    }
    // Once, or twice where the near side is not there: what looks for holes is in the shader once.
    while SCENE_HAS_SPHERE_HOLES {
        let outward = normalize(origin + direction * t - sphere.xyz);
        if sphere_accepts(instance, geometry, primitive, sphere, outward, direction) {
            break;
        }
        if t == crossing.far || crossing.far >= t_max {
            return 0.0;
        }
        t = crossing.far;
    }
    return t;
}

/// Whether a ray meets the back of a surface whose backs are not there. `outward`: a normal of the front, of any length.
fn is_culled(material: u32, outward: vec3f, direction: vec3f) -> bool {
    return SCENE_CULLS_BACKS && (materials[material].flags & MATERIAL_CULLS_BACKS) != 0u && dot(outward, direction) > 0.0;
}

fn hashed_threshold(instance: u32, primitive: u32, a: f32, b: f32) -> f32 {
    let place = hash_combine(hash_combine(instance, primitive), bitcast<u32>(a));
    return unit_float(hash_combine(place, bitcast<u32>(b)));
}

/// Radiance that an emissive material emits at a point.
fn emission_at(material: u32, point: TexturePoint) -> vec3f {
    return material_emission(material_at(material), sample_slot(material, SLOT_EMISSION, point));
}

/// Whether a path may find light on surfaces of a material.
fn may_shine(material: u32) -> bool {
    return material_shines(material_at(material));
}

/// Radiance that the surface emits towards the viewer.
fn surface_emission(s: Surface, footprint: f32) -> vec3f {
    if material_at(s.material).model == ModelTag_Unlit {
        return base_color(s, footprint);
    }
    if !material_emits(material_at(s.material), s.front) {
        return vec3f(0.0);
    }
    // A light's samples have no footprint either.
    return emission_at(s.material, texture_point(s, 0.0));
}

/// Index of refraction of what is behind a surface.
fn surface_ior(s: Surface) -> f32 {
    if FOLLOWS_VOLUMES && s.relative_ior > 0.0 {
        return s.relative_ior;
    }
    return materials[s.material].ior;
}

/// Whether light may come through a material without layers.
fn may_refract(material: u32) -> bool {
    return material_may_refract(material_at(material));
}

/// Whether `surface_bsdf` needs `u_model`.
fn mixes_models(material: u32) -> bool {
    return material_mixes_models(material_at(material));
}

/// The BSDF at a surface, prepared for its viewing direction; without layers.
///
/// - `u_model`: uniform number that chooses between refraction and reflection where a material mixes them.
fn surface_bsdf(s: Surface, footprint: f32, u_model: f32, single_scatter: bool) -> Bsdf {
    let at = texture_point(s, footprint_width(footprint, dot(s.wo, s.normal)));
    let metallic_roughness = sample_slot(s.material, SLOT_METALLIC_ROUGHNESS, at);
    let transmission = sample_slot(s.material, SLOT_TRANSMISSION, at);
    let point = plain_point(material_at(s.material), base_color(s, footprint), metallic_roughness, transmission,
        surface_ior(s), s.front, u_model, single_scatter);
    let cos_o = saturate(dot(s.wo, s.shading_normal));
    var albedo = vec2f(1.0, 0.0);
    if point.albedo_table == ALBEDO_GGX {
        albedo = lookup_ggx_albedo(cos_o, point.roughness);
    } else if point.albedo_table == ALBEDO_DIELECTRIC {
        albedo.x = lookup_dielectric_albedo(cos_o, point.roughness * point.roughness, point.eta);
    }
    return plain_bsdf(point, albedo, single_scatter);
}
