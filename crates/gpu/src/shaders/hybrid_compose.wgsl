// The end of a frame: its radiance goes to the film, and the number of its rays to the device's counter.

#import film, hybrid_frame, hybrid_pixels, ray_sum, surface, variant
#import optics::constants

@compute @workgroup_size(8, 8)
fn compose(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    begin_group_rays(local);
    var rays = 0u;
    if is_in_rows(id) {
        let pixel = pixel_in_rows(id);
        rays = ray_counts[pixel_number(pixel)];
        compose_pixel(pixel);
    }
    end_group_rays(local, rays);
}

fn compose_pixel(pixel: vec2u) {
    let at = pixel_number(pixel);
    let sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    add_to_film(film_place(pixel), add_sample(sums, pixel_radiance(at).xyz));
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
