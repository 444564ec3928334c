// The end of a frame: its radiance goes to the film.

@compute @workgroup_size(8, 8)
fn compose(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= view.window_width || id.y >= view.row_count {
        return;
    }
    let pixel = vec2u(id.x, view.first_row + id.y);
    let at = pixel_number(pixel);
    let sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    store_samples(pixel, add_sample(sums, pixels[at].radiance));
    if WANTS_AOVS {
        let hit = first_hit(at);
        if hit.instance == NONE {
            record_miss(pixel, frame.sample);
        } else {
            let ray = frame_ray(pixel);
            record_hit(pixel, frame.sample, surface_at(ray.origin, ray.direction, hit), hit.t);
        }
    }
}
