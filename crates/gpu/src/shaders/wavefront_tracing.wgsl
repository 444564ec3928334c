// The wavefront's stages that ask the tracer, and do nothing else. `prepare` counts the rays.

#import path_vertex, rays, tracer, wavefront

/// Finds where the paths arrive.
@compute @workgroup_size(GROUP)
fn extend(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.path_count {
        return;
    }
    let path = load_path(half_of(wave.depth) + id.x);
    store_hit(id.x, closest(path.origin, path.direction, path_salt(path)));
}

/// The same on the paths' last segments. Most of them only have to miss, and for these any hit will do. It is a stage of its own
/// because a walk that is told so at run time is slower everywhere.
@compute @workgroup_size(GROUP)
fn extend_last(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.path_count {
        return;
    }
    let path = load_path(half_of(wave.depth) + id.x);
    let any = only_has_to_miss(path);
    store_hit(id.x, trace_either(path.origin, path.direction, 0.0, RAY_END, path_salt(path), any));
}

/// Adds what lights contribute that are not hidden. A path has at most one shadow ray at a time, so nobody else adds to its
/// place.
@compute @workgroup_size(GROUP)
fn connect(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= wave.shadow_rays {
        return;
    }
    let ray = load_shadow_ray(id.x);
    if !occluded(ray.origin, ray.direction, ray.distance, ray.salt) {
        gathered[shadow_ray_slot(id.x)] += vec4f(ray.contribution, 0.0);
    }
}
