// From a wave back to its pixels.

#import realtime_first, realtime_found, realtime_wave, wavefront
#import optics::constants, optics::signal

/// Notes how far away the second surfaces are.
@compute @workgroup_size(GROUP)
fn measure(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.path_count {
        return;
    }
    let hit = load_hit(id.x);
    if hit.instance != NONE {
        let slot = path_slot(half_of(wave.depth) + id.x);
        split_samples[in_split_samples(SPLIT_DIFFUSE, slot)].w = hit.t;
    }
}

/// Adds the wave's samples to their pixels.
@compute @workgroup_size(64)
fn finish_paths(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let at = pixel_of(group, groups, local);
    if at == NONE {
        return;
    }
    if wants_light(at) {
        let diffuse = split_samples[in_split_samples(SPLIT_DIFFUSE, at)];
        let specular = split_samples[in_split_samples(SPLIT_SPECULAR, at)].xyz;
        let share = split_samples[in_split_samples(SPLIT_SHARE, at)].xyz;
        let radiance = gathered[at].xyz;
        // The next wave adds to nothing.
        gathered[at] = vec4f(0.0);
        add_light(at, split_light_add(SplitLight(diffuse.xyz, specular, diffuse.w), share, radiance));
    }
}
