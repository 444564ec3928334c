// The fixed-cost renderer: every sample from the camera on in one invocation. What happens on the way is in `direct.wgsl`.

#import direct, film
#import optics::camera

fn render_pixel(work: PixelWork) {
    let pixel = work.pixel;
    var sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    for (var i = 0u; i < view.sample_count; i++) {
        sums = add_sample(sums, direct_radiance(pixel, work.first_sample + i));
    }
    store_samples(work, sums);
}

fn direct_radiance(pixel: vec2u, sample: u32) -> vec3f {
    let sampler = pixel_sampler(pixel, sample);
    let ray = pixel_ray(pixel, sampler);
    next_pair = PAIR_LENS + 1u;
    let chain = new_chain(ray.origin, ray.direction);
    return seen_radiance(ray, chain_radiance(chain, 0u, sampler, pixel, sample));
}
