// The end of a frame: its radiance goes to the film, and the number of its rays to the device's counter.

var<workgroup> group_rays: atomic<u32>;

@compute @workgroup_size(8, 8)
fn compose(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if local == 0u {
        atomicStore(&group_rays, 0u);
    }
    workgroupBarrier();
    if is_in_rows(id) {
        compose_pixel(pixel_in_rows(id));
    }
    workgroupBarrier();
    if local == 0u {
        count_rays(atomicLoad(&group_rays));
    }
}

fn compose_pixel(pixel: vec2u) {
    let at = pixel_number(pixel);
    atomicAdd(&group_rays, ray_counts[at]);
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
