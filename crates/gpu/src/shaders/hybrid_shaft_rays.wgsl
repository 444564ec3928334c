// Shadow rays that begin at the nodes of their shaft.

#import hybrid_shaft_lists, rays, tracer_bvh_below

fn occluded_in_shaft(tile: u32, light: u32, origin: vec3f, direction: vec3f, distance: f32, salt: u32) -> bool {
    let list = shaft_list(tile, light);
    let count = light_masks[list].x;
    if count == 0u {
        return false;
    }
    rays_traced += 1u;
    return trace_any_below(list, count, origin, direction, 0.0, distance, salt);
}
