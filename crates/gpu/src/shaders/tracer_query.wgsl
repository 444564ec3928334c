// Tracing by the driver: ray queries on its acceleration structures (DXR 1.1, Vulkan, Metal).
//
// Triangles without holes are opaque to the driver; others, and the boxes of spheres, come up as candidates. The custom
// data of an instance is its index. Vulkan and DXR number primitives within each geometry, so the first primitive's number
// in its bottom-level structure is added.

enable wgpu_ray_query;
#import material, primitive, scene, scene_records, variant

@group(1) @binding(0) var structure: acceleration_structure;

/// Number of the primitive within its bottom-level structure.
fn query_primitive(candidate: RayIntersection) -> u32 {
    let binding = instances[candidate.instance_custom_data].first_binding + candidate.geometry_index;
    return bindings[binding].first_in_blas + candidate.primitive_index;
}

/// Where the ray crosses the sphere of a candidate within its interval; zero if it does not.
fn query_sphere(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, candidate: RayIntersection) -> f32 {
    let instance = candidate.instance_custom_data;
    let binding = bindings[instances[instance].first_binding + candidate.geometry_index];
    let sphere = sphere_at(binding, candidate.primitive_index);
    var o = origin;
    if (instances[instance].flags & INSTANCE_IDENTITY) == 0u {
        o = transform_point(instances[instance].world_to_object, origin);
    }
    let d = query_direction(instance, direction);
    let primitive = binding.first_in_blas + candidate.primitive_index;
    return sphere_crossing(instance, candidate.geometry_index, primitive, sphere, o, d, t_min, t_max);
}

/// The ray's direction in the space of an instance's bottom-level structure.
fn query_direction(instance: u32, direction: vec3f) -> vec3f {
    if (instances[instance].flags & INSTANCE_IDENTITY) != 0u {
        return direction;
    }
    return transform_vector(instances[instance].world_to_object, direction);
}

/// Whether a candidate triangle counts.
fn query_accepts(direction: vec3f, candidate: RayIntersection, salt: u32) -> bool {
    let instance = candidate.instance_custom_data;
    return alpha_accepts(instance, candidate.geometry_index, query_primitive(candidate), candidate.barycentrics.x,
        candidate.barycentrics.y, query_direction(instance, direction), salt);
}

fn trace_closest(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> Hit {
    return trace_either(origin, direction, t_min, t_max, salt, false);
}

fn trace_either(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32, any: bool) -> Hit {
    var query: ray_query;
    let flags = select(RAY_FLAG_NONE, RAY_FLAG_TERMINATE_ON_FIRST_HIT, any);
    rayQueryInitialize(&query, structure, RayDesc(flags, 0xffu, t_min, t_max, origin, direction));
    var end = t_max;
    // Kept here, because Mesa's software driver (25.0) may report another candidate's distance and instance in the end.
    var sphere = hit_nothing();
    while rayQueryProceed(&query) {
        let candidate = rayQueryGetCandidateIntersection(&query);
        if candidate.kind == RAY_QUERY_INTERSECTION_AABB {
            let t = query_sphere(origin, direction, t_min, end, candidate);
            if t > 0.0 {
                end = t;
                sphere = Hit(t, 0.0, 0.0, candidate.instance_custom_data, candidate.geometry_index,
                    query_primitive(candidate));
                rayQueryGenerateIntersection(&query, t);
            }
        } else if !SCENE_HAS_ALPHA || query_accepts(direction, candidate, salt) {
            end = min(end, candidate.t);
            rayQueryConfirmIntersection(&query);
        }
    }
    let hit = rayQueryGetCommittedIntersection(&query);
    if hit.kind == RAY_QUERY_INTERSECTION_NONE {
        return hit_nothing();
    }
    if hit.kind != RAY_QUERY_INTERSECTION_TRIANGLE {
        return sphere;
    }
    let inside = hit.barycentrics;
    return Hit(hit.t, inside.x, inside.y, hit.instance_custom_data, hit.geometry_index, query_primitive(hit));
}

fn trace_any(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> bool {
    if !(t_max > t_min) {
        return false;
    }
    var query: ray_query;
    let flags = RAY_FLAG_TERMINATE_ON_FIRST_HIT;
    rayQueryInitialize(&query, structure, RayDesc(flags, 0xffu, t_min, t_max, origin, direction));
    while rayQueryProceed(&query) {
        let candidate = rayQueryGetCandidateIntersection(&query);
        if candidate.kind == RAY_QUERY_INTERSECTION_AABB {
            let t = query_sphere(origin, direction, t_min, t_max, candidate);
            if t > 0.0 {
                rayQueryGenerateIntersection(&query, t);
            }
        } else if !SCENE_HAS_ALPHA || query_accepts(direction, candidate, salt) {
            rayQueryConfirmIntersection(&query);
        }
    }
    return rayQueryGetCommittedIntersection(&query).kind != RAY_QUERY_INTERSECTION_NONE;
}
