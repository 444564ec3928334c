// The entry point of kernels that run in a ray tracing pipeline: one ray generation shader a pixel. What it calls,
// `render_pixel`, knows nothing of how it was started.

@ray_generation
fn main(@builtin(ray_invocation_id) id: vec3u) {
    rays_traced = 0u;
    // Lists are one row.
    let work = pixel_work(id.y * view.window_width + id.x);
    render_pixel(work.pixel, work.first_sample);
    count_rays(rays_traced);
}
