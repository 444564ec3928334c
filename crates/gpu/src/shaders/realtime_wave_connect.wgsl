// The shadow rays of a wave's first vertices.

#import rays, realtime_wave, wavefront

/// Takes away what lights bring to first surfaces that do not see them.
@compute @workgroup_size(GROUP)
fn connect_first(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.shadow_rays {
        return;
    }
    let ray = load_shadow_ray(id.x);
    if occluded(ray.origin, ray.direction, ray.distance, ray.salt) {
        // How far away second surfaces are comes later.
        let slot = shadow_ray_slot(id.x);
        split_samples[in_split_samples(SPLIT_DIFFUSE, slot)] = vec4f(0.0);
        split_samples[in_split_samples(SPLIT_SPECULAR, slot)] = vec4f(0.0);
    }
}
