// The first hits by rays, where no rasteriser draws them.

var<workgroup> group_rays: atomic<u32>;

@compute @workgroup_size(8, 8)
fn camera_rays(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if local == 0u {
        atomicStore(&group_rays, 0u);
    }
    workgroupBarrier();
    if is_in_rows(id) {
        let pixel = pixel_in_rows(id);
        let ray = frame_ray(pixel);
        store_first_hit(pixel, ray, closest(ray.origin, ray.direction, pixel_sampler(pixel, frame.sample).scramble));
    }
    atomicAdd(&group_rays, rays_traced);
    workgroupBarrier();
    if local == 0u {
        count_rays(atomicLoad(&group_rays));
    }
}
