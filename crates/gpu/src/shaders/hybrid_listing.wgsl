// Lists the pixels that send out reflection rays. A pass of its own: counting within a workgroup first takes barriers, which software
// drivers compile slowly in long shaders, and invocations that count on the device one by one wait for each other.

#import hybrid_pixels, hybrid_reflecting

var<workgroup> listed: atomic<u32>;
var<workgroup> first_place: u32;

/// Makes room for a workgroup's pixels in the list; returns where.
fn reserve_places(count: u32) -> u32 {
    let place = atomicAdd(&reflecting.count, count);
    let row = REFLECTING_GROUP * reflecting.groups_across;
    atomicMax(&reflecting.groups_down, (place + count + row - 1u) / row);
    return place;
}

/// The list's order is that in which workgroups come; pixels of a workgroup are together.
@compute @workgroup_size(8, 8)
fn list_reflecting(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if local == 0u {
        atomicStore(&listed, 0u);
    }
    workgroupBarrier();
    let at = pixel_number(pixel_in_rows(id));
    let reflects = is_in_rows(id) && pixel_radiance(at).w > 0.0;
    var place = 0u;
    if reflects {
        place = atomicAdd(&listed, 1u);
    }
    workgroupBarrier();
    if local == 0u {
        first_place = reserve_places(atomicLoad(&listed));
    }
    workgroupBarrier();
    if reflects {
        reflecting.pixels[first_place + place] = at;
    }
}
