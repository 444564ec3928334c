// The entry point of kernels that run in a ray tracing pipeline: one ray generation shader a pixel. What it calls,
// `render_pixel`, knows nothing of how it was started.

#import film, kernel, rays

@ray_generation
fn main(@builtin(ray_invocation_id) id: vec3u) {
    rays_traced = 0u;
    // Portions are one row.
    render_pixel(pixel_work(id.y * view.window_width + id.x));
    count_rays(rays_traced);
}
