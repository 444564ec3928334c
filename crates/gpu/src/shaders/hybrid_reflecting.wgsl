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

var<workgroup> group_reflecting: atomic<u32>;
var<workgroup> group_first: u32;

/// Adds the pixels of a workgroup that reflect to the list, in one place, so that neighbours stay together. All invocations of the
/// group call it.
fn list_reflecting(local: u32, pixel: u32, reflects: bool) {
    if local == 0u {
        atomicStore(&group_reflecting, 0u);
    }
    workgroupBarrier();
    var place = 0u;
    if reflects {
        place = atomicAdd(&group_reflecting, 1u);
    }
    workgroupBarrier();
    if local == 0u {
        let count = atomicLoad(&group_reflecting);
        if count > 0u {
            group_first = atomicAdd(&reflecting.count, count);
            let groups = (group_first + count + REFLECTING_GROUP - 1u) / REFLECTING_GROUP;
            let across = reflecting.groups_across;
            atomicMax(&reflecting.groups_down, (groups + across - 1u) / across);
        }
    }
    workgroupBarrier();
    if reflects {
        reflecting.pixels[group_first + place] = pixel;
    }
}

/// Where an invocation of the pass finds its pixel in the list.
fn reflecting_index(group: vec3u, local: u32) -> u32 {
    return (group.y * reflecting.groups_across + group.x) * REFLECTING_GROUP + local;
}
