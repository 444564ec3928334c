// The entry point of kernels that run in a compute shader: one invocation a pixel. What it calls, `render_pixel`, knows
// nothing of how it was started.

#import film, kernel, ray_sum, rays

@compute @workgroup_size(8, 8)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    begin_group_rays(local);
    rays_traced = 0u;
    // A workgroup is a square of the rows, or a run of portions.
    var index = id.y * view.window_width + id.x;
    var wanted = id.x < view.window_width && id.y < view.row_count;
    if view.list_length > 0u {
        index = (group.y * groups.x + group.x) * 64u + local;
        wanted = index < view.list_length;
    }
    if wanted {
        render_pixel(pixel_work(index));
    }
    end_group_rays(local, rays_traced);
}
