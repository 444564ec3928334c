// The first vertices of a wave.

/// Begins a sample of each pixel that wants one, at what the camera's ray hits.
@compute @workgroup_size(64)
fn begin_paths(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let pixel = 8u * group.xy + vec2u(local % 8u, local / 8u);
    var path: Path;
    var shadow = no_shadow_ray();
    var alive = false;
    var at = 0u;
    if is_in_picture(pixel) {
        at = place_of(pixel);
        if lights_found[at].count < lights_found[at].wanted {
            let ray = frame_ray(pixel);
            let hit = first_hit(at);
            path = Path(path_start(), pixel_sampler(pixel, lights_found[at].drawn), ray.origin, ray.direction, 0.0, ALL_SIDES);
            let s = surface_at(path.origin, path.direction, hit);
            let footprint = travel(&path, s, hit.t);
            let lobes = first_lobes(path, s, footprint);
            alive = depart(&path, s, footprint, 0u, true, &shadow);
            var sample = SplitSample(vec3f(0.0), 0.0, vec3f(0.0), 0u, vec3f(0.0), 0u);
            if is_wanted(shadow) {
                let of_light = share_of_diffuse(lobes, shadow.direction);
                sample.diffuse = of_light * shadow.contribution;
                sample.specular = (1.0 - of_light) * shadow.contribution;
            }
            if alive && !path.state.specular {
                sample.diffuse_share = share_of_diffuse(lobes, path.direction);
            }
            split_samples[at] = sample;
        }
    }
    hand_on(local, path, alive, shadow, at, 1u);
}
