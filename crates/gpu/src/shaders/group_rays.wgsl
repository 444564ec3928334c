// Rays of a workgroup are added up among its invocations, and then once to the device's counter.

#import film

var<workgroup> group_rays: atomic<u32>;

/// Before anything else, by all invocations.
fn begin_group_rays(local: u32) {
    if local == 0u {
        atomicStore(&group_rays, 0u);
    }
    workgroupBarrier();
}

/// At the end, by all invocations, each with its rays.
fn end_group_rays(local: u32, rays: u32) {
    atomicAdd(&group_rays, rays);
    workgroupBarrier();
    if local == 0u {
        count_rays(atomicLoad(&group_rays));
    }
}
