// From the stages at a vertex to the queues of the next ones, each invocation by itself: the twin of `wavefront_handing` without
// barriers, for software drivers.

#import path_vertex, wavefront

/// Puts the path of an invocation that stands at vertex `depth` into the queue of the next, if it is `alive`, and its shadow ray
/// into another, if that is wanted.
fn hand_on(local: u32, path: Path, alive: bool, shadow: ShadowRay, slot: u32, depth: u32) {
    if alive {
        store_path(half_of(depth + 1u) + atomicAdd(&wave.next_path_count, 1u), path, slot);
    }
    if is_wanted(shadow) {
        store_shadow_ray(atomicAdd(&wave.casting, 1u), shadow, slot);
    }
}
