// The end of a frame: it goes to the film.

#import film, hybrid_frame, hybrid_pixels, realtime_frame, surface, variant
#import optics::constants

@group(3) @binding(26) var<storage, read> sums_in: array<vec4f>;

@compute @workgroup_size(8, 8)
fn compose_frame(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    if sums_in[at].w > 0.0 {
        let sums = SampleSums(vec3f(0.0), vec3f(0.0), 0u, 0u);
        add_to_film(film_place(id.xy), add_sample(sums, sums_in[at].xyz));
    }
    if WANTS_AOVS {
        let hit = first_hit(at);
        if hit.instance == NONE {
            record_miss(id.xy, frame.sample);
        } else {
            let ray = frame_ray(id.xy);
            record_hit(id.xy, frame.sample, surface_at(ray.origin, ray.direction, hit), hit.t);
        }
    }
}
