// The tracer of ray tracing pipelines: ray generation shaders call it, the driver walks its own structure and runs the
// shaders of `pipeline_hits.wgsl`. Recursion ends here: those shaders trace no rays.

#import pipeline_numbers, pipeline_payload, scene
#import optics::constants

@group(1) @binding(0) var scene_structure: acceleration_structure;

var<ray_payload> payload: Payload;

// Ray flags and instance masks of Vulkan.
const ANY_HIT_WILL_DO: u32 = 0x4u; // terminate on the first hit
const NO_CLOSEST_HIT: u32 = 0x8u; // skip closest-hit shaders
const ALL_INSTANCES: u32 = 0xFFu;
// The ray type stands above the mask's eight bits: `pipeline/spirv.rs` moves it from there to where WGSL has no words
// for it.

// Whether the driver may be given the ray: what it does with NaN is not defined.
fn ray_is_traceable(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32) -> bool {
    let sizes = abs(origin) + abs(direction);
    let finite = sizes.x < 3.4e38 && sizes.y < 3.4e38 && sizes.z < 3.4e38;
    return finite && max(t_min, 0.0) < t_max && any(direction != vec3f(0.0));
}

fn trace_closest(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> Hit {
    return trace_either(origin, direction, t_min, t_max, salt, false);
}

fn trace_either(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32, any: bool) -> Hit {
    if !ray_is_traceable(origin, direction, t_min, t_max) {
        return hit_nothing();
    }
    payload = Payload(hit_nothing(), NONE, NONE, salt);
    let mask = ALL_INSTANCES | (RAY_RADIANCE << RAY_TYPE_SHIFT);
    traceRay(scene_structure, RayDesc(select(0u, ANY_HIT_WILL_DO, any), mask, max(t_min, 0.0), t_max, origin, direction), &payload);
    return payload.hit;
}

fn trace_any(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> bool {
    if !ray_is_traceable(origin, direction, t_min, t_max) {
        return false;
    }
    // Occluded, unless the miss shader says otherwise: no closest-hit shader runs.
    payload = Payload(hit_nothing(), NONE, NONE, salt);
    payload.hit.instance = 0u;
    let mask = ALL_INSTANCES | (RAY_SHADOW << RAY_TYPE_SHIFT);
    let flags = ANY_HIT_WILL_DO | NO_CLOSEST_HIT;
    traceRay(scene_structure, RayDesc(flags, mask, max(t_min, 0.0), t_max, origin, direction), &payload);
    return payload.hit.instance != NONE;
}
