// The shadow rays of a wave's first vertices.

/// Takes away what lights bring to first surfaces that do not see them.
@compute @workgroup_size(GROUP)
fn connect_first(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.shadow_rays {
        return;
    }
    let ray = shadow_records[id.x];
    if occluded(ray.origin, ray.direction, ray.distance, ray.salt) {
        split_samples[ray.slot].diffuse = vec3f(0.0);
        split_samples[ray.slot].specular = vec3f(0.0);
    }
}
