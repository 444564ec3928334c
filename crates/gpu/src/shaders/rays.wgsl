// Asking the tracer, and counting what was asked.

#import scene, tracer

/// Farther than anything.
const RAY_END: f32 = 3.0e38;

/// Rays that this invocation has traced.
var<private> rays_traced: u32;

fn closest(origin: vec3f, direction: vec3f, salt: u32) -> Hit {
    rays_traced += 1u;
    return trace_closest(origin, direction, 0.0, RAY_END, salt);
}

fn occluded(origin: vec3f, direction: vec3f, distance: f32, salt: u32) -> bool {
    rays_traced += 1u;
    return trace_any(origin, direction, 0.0, distance, salt);
}
