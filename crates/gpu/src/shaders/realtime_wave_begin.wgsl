// The first vertices of a wave.

#import film, handing, hybrid_frame, hybrid_pixels, path_vertex, realtime_first, realtime_found
#import realtime_frame, realtime_wave, surface
#import optics::constants, optics::light_tree, optics::path, optics::signal

/// Begins the record of a sample that a path has left to its `shadow` ray and, if it is `alive`, to what it gathers.
fn begin_sample(at: u32, lobes: FirstLobes, path: Path, alive: bool, shadow: ShadowRay) {
    var light = SplitLight(vec3f(0.0), vec3f(0.0), 0.0);
    if is_wanted(shadow) {
        light = split_light_add(light, share_of_diffuse(lobes, shadow.direction), shadow.contribution);
    }
    var share = vec3f(0.0);
    if alive && !path.state.specular {
        share = share_of_diffuse(lobes, path.direction);
    }
    split_samples[in_split_samples(SPLIT_DIFFUSE, at)] = vec4f(light.diffuse, 0.0);
    split_samples[in_split_samples(SPLIT_SPECULAR, at)] = vec4f(light.specular, 0.0);
    split_samples[in_split_samples(SPLIT_SHARE, at)] = vec4f(share, 0.0);
}

/// Begins a sample of each pixel that wants one, at what the camera's ray hits.
@compute @workgroup_size(64)
fn begin_paths(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let at = pixel_of(group, groups, local);
    var path: Path;
    var shadow = no_shadow_ray();
    var alive = false;
    if at != NONE {
        if wants_light(at) {
            let pixel = vec2u(at % realtime.size.x, at / realtime.size.x);
            let ray = frame_ray(pixel);
            let hit = first_hit(at);
            path = Path(path_start(), pixel_sampler(pixel, samples_drawn(at)), ray.origin, ray.direction, 0.0, ALL_SIDES, false);
            let s = surface_at(path.origin, path.direction, hit);
            let footprint = travel(&path, s, hit.t);
            let lobes = first_lobes(path, s, footprint);
            alive = depart(&path, s, footprint, 0u, true, &shadow);
            begin_sample(at, lobes, path, alive, shadow);
        }
    }
    hand_on(local, path, alive, shadow, at, 1u);
}
