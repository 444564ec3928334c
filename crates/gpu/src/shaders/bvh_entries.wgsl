// Walks that begin at entries: nodes below the root, of which others have found that all that a ray can hit is below them.
//
// `entry_lists` has fn bvh_entry_low(list: u32, i: u32) -> vec4u and fn bvh_entry_high(list: u32, i: u32) -> vec4u: the lower and
// the upper corner of the box of a list's entry `i` as bits of floats, and in w the structure that it is in (an index of
// `bvh_instances`) and its node.

#import bvh_nodes, bvh_records, bvh_scene, entry_lists

// The list of a walk's entries, and how many there are, at most 32.
var<private> bvh_entry_list: u32;
var<private> bvh_entry_count: u32;

// The structure whose space an entry's box is in: the world's, where an instance stands as it is.
fn bvh_space(structure: u32) -> u32 {
    return select(structure, 0u, (bvh_instances[structure].flags & BVH_INSTANCE_IDENTITY) != 0u);
}

// The ray in a space, if it was in another before.
fn bvh_ray_in_space(ray: BvhRay, before: u32, space: u32, origin: vec3f, direction: vec3f) -> BvhRay {
    if space == before {
        return ray;
    }
    if space == 0u {
        return bvh_ray(origin, direction, bvh_instances[0].extent);
    }
    return bvh_enter(space, origin, direction);
}

// Whether a ray may hit a box within an interval.
fn bvh_hits_box(low: vec3f, high: vec3f, ray: BvhRay, t_min: f32, t_max: f32) -> bool {
    let a = (low - ray.origin) * ray.inverse;
    let b = (high - ray.origin) * ray.inverse;
    let enter = min(a, b) - ray.room;
    let leave = max(a, b) + ray.room;
    return max(max(enter.x, enter.y), max(enter.z, t_min)) <= min(min(leave.x, leave.y), min(leave.z, t_max));
}

// Which entries a ray may hit, as bits. `world_ray` is that of `origin` and `direction`.
fn bvh_entries(world_ray: BvhRay, origin: vec3f, direction: vec3f, t_min: f32, t_max: f32) -> u32 {
    var ray = world_ray;
    var space = 0u;
    var hits = 0u;
    for (var i = 0u; i < bvh_entry_count; i++) {
        let low = bvh_entry_low(bvh_entry_list, i);
        let high = bvh_entry_high(bvh_entry_list, i);
        if !BVH_SINGLE {
            let next = bvh_space(low.w);
            ray = bvh_ray_in_space(ray, space, next, origin, direction);
            space = next;
        }
        if bvh_hits_box(bitcast<vec3f>(low.xyz), bitcast<vec3f>(high.xyz), ray, t_min, t_max) {
            hits |= 1u << i;
        }
    }
    return hits;
}

// Structure and node of the walk's entry `i`.
fn bvh_entry(i: u32) -> vec2u {
    return vec2u(bvh_entry_low(bvh_entry_list, i).w, bvh_entry_high(bvh_entry_list, i).w);
}
