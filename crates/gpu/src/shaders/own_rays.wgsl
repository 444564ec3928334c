// Each invocation adds its rays to the device's counter. Where processor cores work off a
// workgroup, nothing is gained by adding them up first, and a barrier would be dear: Mesa's
// software driver compiles for minutes what can stop in the middle.

#import film

/// Before anything else, by all invocations.
fn begin_group_rays(local: u32) {}

/// At the end, by all invocations, each with its rays.
fn end_group_rays(local: u32, rays: u32) {
    count_rays(rays);
}
