// Walks through our own hierarchy that begin at entries.

#import bvh_entries, tracer_bvh

// As `trace_any`, where all that the ray can hit is below the `count` entries of a list.
fn trace_any_below(list: u32, count: u32, origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> bool {
    bvh_entry_list = list;
    bvh_entry_count = count;
    return trace_any(origin, direction, t_min, t_max, salt);
}
