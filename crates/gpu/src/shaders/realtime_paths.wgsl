// Paths from the first hits, each followed to its end: one sample of a pixel for each invocation, added to what the frame has
// found there.

#import film, hybrid_frame, hybrid_pixels, lights, lights_found, material, path_vertex
#import ray_sum, rays, realtime_first, realtime_found, realtime_frame, realtime_tiles, scattering, scene
#import surface, texels
#import optics::constants, optics::light_tree, optics::path, optics::random, optics::reservoir
#import optics::signal, optics::vertex

/// Whether first surfaces look at the lights of their tiles.
fn uses_tiles() -> bool {
    return realtime.light_candidates > 0u && scene.light_count > 0u;
}

/// The question whether a light sample at the first surface counts: one of some lights of the tile, in proportion to what they
/// would bring if nothing were in between, which then stands for all of them.
fn tile_shadow_ray(path: Path, s: Surface, lobes: FirstLobes, pixel: vec2u) -> ShadowRay {
    let tile = candidate_tile_of(pixel);
    let area = tile_area(tile);
    let count = realtime.light_candidates;
    let u = sample_2d(path.sampler, vertex_pair(1u) + PAIR_LIGHT);
    let begin = uniform_light(u.x, area);
    let fraction = candidate_fraction(u.x, area);
    var reservoir = reservoir_empty(sample_2d(path.sampler, vertex_pair(1u) + PAIR_MODEL).y);
    var chosen = no_shadow_ray();
    for (var i = 0u; i < count; i++) {
        let offer = tile_place(tile, (begin + i * area / count) % area);
        let offered = lights_found[in_plane(FOUND_OFFER, offer)];
        let probability = bitcast<f32>(offered.y);
        if probability <= 0.0 {
            continue;
        }
        let on_light = candidate_place(vec2f(fraction, u.y), i);
        var light = sample_one_light(offered.x, s.origin, on_light);
        light.pdf = candidate_pdf(light.pdf, probability, count);
        let ray = light_shadow_ray(path, s, lobes.frame, lobes.all, lobes.wo, light);
        let before = reservoir.sum;
        reservoir = reservoir_add(reservoir, i, candidate_weight(ray.contribution));
        if reservoir.sum > before && reservoir.chosen == i {
            chosen = ray;
        }
    }
    chosen.contribution = reservoir_contribution(reservoir, chosen.contribution);
    return chosen;
}

/// Density with which the last vertex would have sampled what the path has found by chance, as `surface_light_pdf` has it.
fn found_light_pdf(path: Path, s: Surface, t: f32, pixel: vec2u) -> f32 {
    if s.light == NONE || !(uses_tiles() && path.state.depth == 2u) {
        return surface_light_pdf(s, path.origin, path.sampling_normal, path.direction, t);
    }
    let center = seen_point(lights_found[in_plane(FOUND_OFFER, place_of(pixel))].z);
    return candidates_pdf(realtime.light_candidates, tile_probability(s.light, center),
        surface_direction_pdf(s, path.origin, path.direction, t));
}

/// Light from infinitely far away, where a path leaves the scene.
fn add_distant(path: Path, pixel: vec2u) -> PathState {
    if uses_tiles() && path.state.depth == 2u {
        let center = seen_point(lights_found[in_plane(FOUND_OFFER, place_of(pixel))].z);
        let count = realtime.light_candidates;
        let chooser = LightChooser(center, ALL_SIDES, expected_candidates(count, tile_share()),
            expected_candidates(count, any_light_probability()));
        return path_add_distant_chosen(path.state, path.origin, chooser, path.direction);
    }
    return path_add_distant(path.state, path.origin, path.sampling_normal, path.direction);
}

/// Follows a path that begins with what the camera's ray hits.
fn sample_light_at(pixel: vec2u, first: Hit, index: u32) -> SplitLight {
    let ray = frame_ray(pixel);
    var path = Path(path_start(), pixel_sampler(pixel, index), ray.origin, ray.direction, 0.0, ALL_SIDES, false);
    var light = SplitLight(vec3f(0.0), vec3f(0.0), 0.0);
    var share = vec3f(0.0);
    var hit = first;
    loop {
        if hit.instance == NONE {
            path.state = add_distant(path, pixel);
            break;
        }
        if ends_in_the_dark(path, hit) {
            break;
        }
        let s = surface_at(path.origin, path.direction, hit);
        let is_first = path.state.depth == 1u;
        if path.state.depth == 2u {
            light.hit_distance = hit.t;
        }
        let footprint = travel(&path, s, hit.t);
        var shadow = no_shadow_ray();
        var lobes: FirstLobes;
        if is_first {
            // What is seen directly has no noise and is kept apart.
            lobes = first_lobes(path, s, footprint);
            if uses_tiles() && path.state.depth < view.max_depth && scattering_has_smooth_part(lobes.all) {
                shadow = tile_shadow_ray(path, s, lobes, pixel);
            }
        } else {
            let emitted = surface_emission(s, footprint);
            if emitted.x + emitted.y + emitted.z > 0.0 {
                let pdf = found_light_pdf(path, s, hit.t, pixel);
                path.state = path_add_emission(path.state, emitted, pdf, MIS);
            }
        }
        let alive = depart(&path, s, footprint, 0u, !(is_first && uses_tiles()), &shadow);
        if is_wanted(shadow) && !occluded(shadow.origin, shadow.direction, shadow.distance, shadow.salt) {
            if is_first {
                light = split_light_add(light, share_of_diffuse(lobes, shadow.direction), shadow.contribution);
            } else {
                path.state.radiance += shadow.contribution;
            }
        }
        if !alive {
            break;
        }
        if is_first && !path.state.specular {
            share = share_of_diffuse(lobes, path.direction);
        }
        hit = closest(path.origin, path.direction, path_salt(path));
    }
    return split_light_add(light, share, path.state.radiance);
}

fn sample_pixel(at: u32) {
    let pixel = vec2u(at % realtime.size.x, at / realtime.size.x);
    add_light(at, sample_light_at(pixel, first_hit(at), samples_drawn(at)));
}

/// A sample for each pixel that wants one.
@compute @workgroup_size(64)
fn sample_pixels(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    begin_group_rays(local);
    rays_traced = 0u;
    let at = pixel_of(group, groups, local);
    if at != NONE {
        if wants_light(at) {
            sample_pixel(at);
        }
    }
    end_group_rays(local, rays_traced);
}
