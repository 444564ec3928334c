// Direct light at the first hit: every light that counts there, with its shadow rays.
//
// Few lights take two passes: one that only asks which of them are hidden, and leaves a bit for each ray; and one that shades. A
// kernel that keeps no material while it traces leaves room for more rays at a time than one that does both. The bits of many
// lights would take too much memory: those are traced and shaded in one pass, light by light.
//
// `hybrid_light_masks.wgsl` says what `light_masks` holds. `shafts` says how its words are read and written, and whether there are
// shafts.
//
// Sample `i` of the light with bit `b` of the cluster's word `w` is bit `b` of word `i` × `light_words` + `w`.

#import direct, film, hybrid_frame, hybrid_light_masks, hybrid_pixels, hybrid_tracing, lights
#import material, scattering, scene, shafts, surface, texels
#import optics::camera, optics::constants, optics::direct_light, optics::frame
#import optics::ggx, optics::light, optics::material, optics::random, optics::vertex

/// The lights from 32 × `word` on that may count in a cluster, the first as the lowest bit.
fn lights_of_cluster(cluster: u32, word: u32) -> u32 {
    let first = 32u * word;
    if first >= scene.light_count {
        return 0u;
    }
    let existing = 0xffffffffu >> (32u - min(scene.light_count - first, 32u));
    if frame.clustered == 0u {
        return existing;
    }
    return existing & light_word(cluster * frame.light_words + word);
}

fn cluster_at(pixel: vec2u, position: vec3f) -> u32 {
    let tile = pixel / frame.tile;
    let slice = cluster_slice(view_depth(position, frame.eye, frame.axis));
    return (slice * frame.clusters.y + tile.y) * frame.clusters.x + tile.x;
}

/// Random numbers of a light's sample do not depend on the other lights.
fn first_pair(index: u32) -> u32 {
    return PAIR_LIGHTS + index * view.shadow_samples;
}

/// Whether a material may have a lobe that lights are sampled for. What says no is not asked for textures.
fn may_be_lit(material: u32) -> bool {
    let model = materials[material].model;
    let polished = model == ModelTag_Dielectric && is_polished(materials[material].roughness);
    return model != ModelTag_Unlit && model != ModelTag_Mirror && !polished;
}

/// Of the lights in a mask, those whose sample `i` is hidden from a surface.
fn hidden_lights(s: Surface, tile: u32, mask: u32, word: u32, i: u32, sampler: PixelSampler) -> u32 {
    let transmits = may_transmit(s.material);
    var answer = 0u;
    var left = select(0u, mask, may_be_lit(s.material));
    while left != 0u {
        let bit = firstTrailingBit(left);
        left &= left - 1u;
        let index = 32u * word + bit;
        if !may_light(index, s) || (i > 0u && !has_soft_shadows(index)) {
            continue;
        }
        next_pair = first_pair(index) + i;
        let light = light_sample(load_light(index), s.origin, light_draw(index, sampler));
        let dark = all(light.radiance == vec3f(0.0)) && lights[index].textured_material == NONE;
        if dark || !light_is_possible(light.wi, light.pdf, s.shading_normal, s.horizon, transmits) {
            continue;
        }
        let ray = shadow_ray(s, light);
        if occluded_in_shaft(tile, index, ray.origin, ray.direction, ray.distance, sampler.scramble + next_pair) {
            answer |= 1u << bit;
        }
    }
    return answer;
}

/// Asks which lights are hidden from the first hits.
@compute @workgroup_size(8, 8)
fn shadow_rays(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_rows(id) {
        return;
    }
    let pixel = pixel_in_rows(id);
    let at = pixel_number(pixel);
    ray_counts[at] = 0u;
    let hit = first_hit(at);
    if hit.instance == NONE {
        return;
    }
    let ray = frame_ray(pixel);
    let s = surface_at(ray.origin, ray.direction, hit);
    let sampler = pixel_sampler(pixel, frame.sample);
    let cluster = cluster_at(pixel, s.position);
    for (var word = 0u; word < frame.light_words; word++) {
        let mask = lights_of_cluster(cluster, word);
        for (var i = 0u; i < view.shadow_samples; i++) {
            set_light_word(hidden_word(at, i, word), hidden_lights(s, tile_of(id.xy), mask, word, i, sampler));
        }
    }
    count_pixel_rays(at);
}

/// Sample `i` of a light of which it is known whether it is hidden.
fn known_light(index: u32, i: u32, vertex: FirstVertex, there: Frame) -> vec3f {
    let count = select(1u, view.shadow_samples, has_soft_shadows(index));
    if i >= count || !may_light(index, vertex.surface) {
        return vec3f(0.0);
    }
    next_pair = first_pair(index) + i;
    let s = vertex.surface;
    let light = sample_one_light(index, s.origin, light_draw(index, vertex.sampler));
    return share_of_samples(unshadowed_light(s, there, vertex.bsdf, to_local(there, s.wo), light), count);
}

/// All lights that count at a first hit, by what `shadow_rays` has found.
fn known_lights(pixel: vec2u, vertex: FirstVertex) -> vec3f {
    let there = scattering_frame(vertex.bsdf, vertex.surface);
    let cluster = cluster_at(pixel, vertex.surface.position);
    let at = pixel_number(pixel);
    var sum = vec3f(0.0);
    for (var word = 0u; word < frame.light_words; word++) {
        let mask = lights_of_cluster(cluster, word);
        for (var i = 0u; i < view.shadow_samples; i++) {
            var left = mask;
            if view.shadows != 0u {
                left &= ~light_word(hidden_word(at, i, word));
            }
            while left != 0u {
                sum += known_light(32u * word + firstTrailingBit(left), i, vertex, there);
                left &= left - 1u;
            }
        }
    }
    return sum;
}

/// All lights that count at a first hit, with their shadow rays.
fn traced_lights(pixel: vec2u, vertex: FirstVertex) -> vec3f {
    let there = scattering_frame(vertex.bsdf, vertex.surface);
    let cluster = cluster_at(pixel, vertex.surface.position);
    var sum = vec3f(0.0);
    for (var word = 0u; word < frame.light_words; word++) {
        var left = lights_of_cluster(cluster, word);
        while left != 0u {
            let index = 32u * word + firstTrailingBit(left);
            left &= left - 1u;
            next_pair = first_pair(index);
            sum += light_with_shadows(index, vertex.surface, there, vertex.bsdf, true, vertex.sampler);
        }
    }
    return sum;
}

/// Begins a pixel's radiance: with what its surface emits, and direct light.
fn store_lit(at: u32, vertex: FirstVertex, direct: vec3f) {
    let emitted = surface_emission(vertex.surface, vertex.footprint);
    store_radiance(at, emitted + direct, reflection_weight(vertex));
}

/// A pixel's first vertex. Returns whether there is one; where not, its radiance is that of what lies behind everything.
fn find_first_vertex(pixel: vec2u, vertex: ptr<function, FirstVertex>) -> bool {
    let at = pixel_number(pixel);
    let hit = first_hit(at);
    if hit.instance == NONE {
        let ray = frame_ray(pixel);
        store_radiance(at, seen_radiance(ray, distant_radiance(ray.direction)), 0.0);
        return false;
    }
    *vertex = first_vertex(pixel, hit);
    return true;
}

/// Shades what `shadow_rays` has asked.
@compute @workgroup_size(8, 8)
fn lit_surfaces(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_rows(id) {
        return;
    }
    let pixel = pixel_in_rows(id);
    let at = pixel_number(pixel);
    if view.shadows == 0u {
        ray_counts[at] = 0u;
    }
    var vertex: FirstVertex;
    if find_first_vertex(pixel, &vertex) {
        var direct = vec3f(0.0);
        if scattering_has_smooth_part(vertex.bsdf) {
            direct = known_lights(pixel, vertex);
        }
        store_lit(at, vertex, direct);
    }
}

/// Traces and shades.
@compute @workgroup_size(8, 8)
fn direct_lights(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_rows(id) {
        return;
    }
    let pixel = pixel_in_rows(id);
    let at = pixel_number(pixel);
    ray_counts[at] = 0u;
    var vertex: FirstVertex;
    if find_first_vertex(pixel, &vertex) {
        var direct = vec3f(0.0);
        if scattering_has_smooth_part(vertex.bsdf) {
            direct = traced_lights(pixel, vertex);
        }
        store_lit(at, vertex, direct);
        count_pixel_rays(at);
    }
}
