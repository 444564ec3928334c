// The entry point of kernels that run in a ray tracing pipeline: one ray generation shader a pixel. What it calls,
// `render_pixel`, knows nothing of how it was started.

@ray_generation
fn main(@builtin(ray_invocation_id) id: vec3u) {
    rays_traced = 0u;
    render_pixel(vec2u(id.x, view.first_row + id.y));
    count_rays(rays_traced);
}
