// The first vertex of paths, whose light is kept apart by the first surface's lobes.

#import film, lights_found, path_vertex, planes, realtime_found, realtime_frame, scattering
#import surface
#import optics::constants, optics::frame, optics::random, optics::signal, optics::vertex

/// The first surface as its lobes are told apart.
struct FirstLobes {
    all: Scattering,
    others: Scattering,
    frame: Frame,
    wo: vec3f,
}

/// As `scatter` makes them, with the same random numbers.
fn first_lobes(path: Path, s: Surface, footprint: f32) -> FirstLobes {
    var u_model = 0.0;
    if wants_model_number(s.material) {
        u_model = sample_2d(path.sampler, vertex_pair(1u) + PAIR_MODEL).x;
    }
    let all = surface_scattering(s, footprint, path.state.throughput, u_model, view.single_scatter != 0u);
    let frame = scattering_frame(all, s);
    return FirstLobes(all, scattering_without_diffuse(all), frame, to_local(frame, s.wo));
}

fn share_of_diffuse(lobes: FirstLobes, direction: vec3f) -> vec3f {
    let wi = to_local(lobes.frame, direction);
    return diffuse_share(scattering_eval(lobes.all, lobes.wo, wi).value_cos,
        scattering_eval(lobes.others, lobes.wo, wi).value_cos);
}

/// The pixel that an invocation works on, or NONE. Where pixels have different numbers of samples, those of the list that want
/// more than they had in the dispatches before: pixels that want most come first, so that each dispatch works on the list's
/// beginning.
fn pixel_of(group: vec3u, groups: vec3u, local: u32) -> u32 {
    if !is_set(REALTIME_ADAPTS) {
        let pixel = 8u * group.xy + vec2u(local % 8u, local / 8u);
        return select(NONE, place_of(pixel), is_in_picture(pixel));
    }
    let entry = (group.y * groups.x + group.x) * 64u + local;
    if entry >= realtime.size.x * realtime.size.y {
        return NONE;
    }
    return lights_found[in_plane(FOUND_OFFER, entry)].w;
}

/// Adds a sample to a pixel, unless it is no number.
fn add_light(at: u32, light: SplitLight) {
    var found = load_found_light(at);
    found.drawn += 1u;
    if is_valid_sample(light.diffuse) && is_valid_sample(light.specular) {
        found = found_light_add(found, light);
    }
    lights_found[in_plane(FOUND_DIFFUSE, at)] = plane_words(found.diffuse, found.count);
    lights_found[in_plane(FOUND_SPECULAR, at)] = plane_floats(found.specular, found.hit_distance);
    lights_found[in_plane(FOUND_SQUARES, at)] = vec4u(bitcast<vec2u>(found.squares), found.drawn, found.wanted);
}
