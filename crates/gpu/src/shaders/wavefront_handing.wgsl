// From the stages at a vertex to the queues of the next ones.

#import path_vertex, wavefront

/// What a workgroup hands out, and where that begins in the queues: paths that go on, shadow rays.
var<workgroup> group_next_paths: atomic<u32>;
var<workgroup> group_casting: atomic<u32>;
var<workgroup> group_first: vec2u;

/// Puts the path of an invocation that stands at vertex `depth` into the queue of the next, if it is `alive`, and its shadow ray
/// into another, if that is wanted. All of a workgroup take part: one addition a workgroup to the counters that all share, and
/// the paths of a workgroup stay neighbours.
fn hand_on(local: u32, path: Path, alive: bool, shadow: ShadowRay, slot: u32, depth: u32) {
    if local == 0u {
        atomicStore(&group_next_paths, 0u);
        atomicStore(&group_casting, 0u);
    }
    workgroupBarrier();
    let casts = is_wanted(shadow);
    var place = vec2u(0u);
    if alive {
        place.x = atomicAdd(&group_next_paths, 1u);
    }
    if casts {
        place.y = atomicAdd(&group_casting, 1u);
    }
    workgroupBarrier();
    if local == 0u {
        group_first.x = atomicAdd(&wave.next_path_count, atomicLoad(&group_next_paths));
        group_first.y = atomicAdd(&wave.casting, atomicLoad(&group_casting));
    }
    workgroupBarrier();
    place += group_first;
    if alive {
        store_path(half_of(depth + 1u) + place.x, path, slot);
    }
    if casts {
        store_shadow_ray(place.y, shadow, slot);
    }
}
