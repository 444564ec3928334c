// The first hit only: the surface's colour under a headlight, and auxiliary layers.

#import film, lights, rays, scattering, surface, variant
#import optics::camera, optics::constants

fn render_pixel(work: PixelWork) {
    let pixel = work.pixel;
    var sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
    for (var i = 0u; i < view.sample_count; i++) {
        let sample = work.first_sample + i;
        let sampler = pixel_sampler(pixel, sample);
        let ray = pixel_ray(pixel, sampler);
        let hit = closest(ray.origin, ray.direction, sampler.scramble);
        if hit.instance == NONE {
            sums = add_sample(sums, seen_radiance(ray, distant_radiance(ray.direction)));
            if WANTS_AOVS {
                record_miss(pixel, sample);
            }
            continue;
        }
        let s = surface_at(ray.origin, ray.direction, hit);
        let color = surface_albedo(s, pixel_footprint(pixel_spread(), hit.t));
        sums = add_sample(sums, headlit_color(color, s.wo, s.shading_normal));
        if WANTS_AOVS {
            record_hit(pixel, sample, s, hit.t);
        }
    }
    store_samples(work, sums);
}
