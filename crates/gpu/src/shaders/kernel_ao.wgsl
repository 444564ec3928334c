// The share of the hemisphere above the first hit that is open, weighted by the cosine (pbrt-v4,
// AOIntegrator). The same rays with the same random numbers as the CPU's.

#import film, rays, surface, variant
#import optics::camera, optics::constants, optics::frame, optics::random, optics::warp

fn render_pixel(work: PixelWork) {
    let pixel = work.pixel;
    var sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    for (var i = 0u; i < view.sample_count; i++) {
        let sample = work.first_sample + i;
        let sampler = pixel_sampler(pixel, sample);
        let ray = pixel_ray(pixel, sampler);
        let hit = closest(ray.origin, ray.direction, sampler.scramble);
        if hit.instance == NONE {
            sums = add_sample(sums, vec3f(0.0));
            if WANTS_AOVS {
                record_miss(pixel, sample);
            }
            continue;
        }
        let s = surface_at(ray.origin, ray.direction, hit);
        sums = add_sample(sums, seen_radiance(ray, vec3f(open_share(s, sampler))));
        if WANTS_AOVS {
            record_hit(pixel, sample, s, hit.t);
        }
    }
    store_samples(work, sums);
}

/// The share of the rays into the hemisphere about the surface's horizon that meet nothing within
/// the view's distance.
fn open_share(s: Surface, sampler: PixelSampler) -> f32 {
    let frame = frame_from_normal(s.horizon);
    let origin = ray_origin(s, true);
    let count = max(view.ambient_samples, 1u);
    var open = 0u;
    for (var i = 0u; i < count; i++) {
        let pair = PAIR_LENS + 1u + i;
        let wi = to_world(frame, sample_cosine_hemisphere(sample_2d(sampler, pair)));
        if !occluded(origin, wi, view.ambient_distance, sampler.scramble + pair) {
            open += 1u;
        }
    }
    return f32(open) / f32(count);
}
