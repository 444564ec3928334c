// The first hits by rays, where no rasteriser draws them.

#import film, hybrid_frame, hybrid_pixels, ray_sum, rays

@compute @workgroup_size(8, 8)
fn camera_rays(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    begin_group_rays(local);
    if is_in_rows(id) {
        let pixel = pixel_in_rows(id);
        let ray = frame_ray(pixel);
        store_first_hit(pixel, ray, closest(ray.origin, ray.direction, pixel_sampler(pixel, frame.sample).scramble));
    }
    end_group_rays(local, rays_traced);
}
