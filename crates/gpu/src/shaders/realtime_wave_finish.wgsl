// From a wave back to its pixels.

/// Notes how far away the second surfaces are.
@compute @workgroup_size(GROUP)
fn measure(@builtin(global_invocation_id) id: vec3u) {
    if id.x < wave.arriving && hits[id.x].instance != NONE {
        split_samples[paths[half_of(wave.depth) + id.x].slot].hit_distance = hits[id.x].t;
    }
}

/// Adds the wave's samples to their pixels.
@compute @workgroup_size(8, 8)
fn finish_paths(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    if lights_found[at].count < lights_found[at].wanted {
        let sample = split_samples[at];
        let radiance = gathered[at];
        // The next wave adds to nothing.
        gathered[at] = vec3f(0.0);
        add_light(at, SplitLight(sample.diffuse + sample.diffuse_share * radiance,
            sample.specular + (1.0 - sample.diffuse_share) * radiance, sample.hit_distance));
    }
}
