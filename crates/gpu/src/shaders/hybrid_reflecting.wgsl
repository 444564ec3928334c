// Which pixels send out reflection rays, one after the other, so that the others cost nothing.

/// Invocations of a workgroup of the pass that traces them. Few, because a group is there until its last ray has ended.
const REFLECTING_GROUP: u32 = 32u;

struct Reflecting {
    /// Workgroups of that pass.
    groups_across: u32,
    groups_down: atomic<u32>,
    groups_deep: u32,
    /// Pixels in the list.
    count: atomic<u32>,
    /// Their numbers; see `pixel_number`.
    pixels: array<u32>,
}

@group(3) @binding(9) var<storage, read_write> reflecting: Reflecting;

/// Where an invocation of the pass finds its pixel in the list.
fn reflecting_index(group: vec3u, local: u32) -> u32 {
    return (group.y * reflecting.groups_across + group.x) * REFLECTING_GROUP + local;
}
