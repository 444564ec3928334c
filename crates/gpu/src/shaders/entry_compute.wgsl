// The entry point of kernels that run in a compute shader: one invocation a pixel. What it calls, `render_pixel`, knows
// nothing of how it was started.

var<workgroup> group_rays: atomic<u32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if local == 0u {
        atomicStore(&group_rays, 0u);
    }
    workgroupBarrier();
    rays_traced = 0u;
    if id.x < view.window_width && id.y < view.row_count {
        render_pixel(vec2u(id.x, view.first_row + id.y));
    }
    atomicAdd(&group_rays, rays_traced);
    workgroupBarrier();
    if local == 0u {
        count_rays(atomicLoad(&group_rays));
    }
}
