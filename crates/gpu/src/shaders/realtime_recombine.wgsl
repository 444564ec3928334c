// From light without colour to radiance, or to one of the views of what went on before.

#import realtime_found, realtime_frame, realtime_guides, realtime_history
#import optics::allocation, optics::math, optics::signal

@group(3) @binding(15) var<storage, read> signals: array<vec4u>;
@group(3) @binding(18) var<storage, read> noise: array<f32>;
@group(3) @binding(25) var<storage, read> spread: array<f32>;
/// Radiance; w: 1 where there is any to show.
@group(3) @binding(21) var<storage, read_write> colors_out: array<vec4f>;

/// The frame's own samples: an unbiased estimate of the pixel, if it had any.
fn unfiltered(at: u32) -> vec4f {
    let emitted = guide_emitted(at);
    if guide_distance(at) <= 0.0 {
        return vec4f(emitted, 1.0);
    }
    let light = load_found_light(at);
    let reflected = found_mean(light.diffuse + light.specular, light.count);
    return vec4f(emitted + reflected, select(0.0, 1.0, light.count > 0u));
}

fn picture(at: u32) -> vec4f {
    if !is_set(REALTIME_GATHERS) {
        return unfiltered(at);
    }
    var radiance = guide_emitted(at);
    if guide_distance(at) > 0.0 {
        let colors = guide_colors(at);
        let light = unpack_signal(signals[at]);
        radiance += signal_radiance(light, realtime.white, colors.diffuse, colors.specular);
    }
    return vec4f(radiance, 1.0);
}

fn grey(value: f32) -> vec4f {
    return vec4f(vec3f(value), 1.0);
}

fn shown(at: u32) -> vec4f {
    let h = load_history(at);
    switch realtime.show {
        case SHOW_VARIANCE: {
            return vec4f(mean_variance(h.moments.x, h.moments.y, h.diffuse_count),
                mean_variance(h.moments.z, h.moments.w, h.specular_count), 0.0, 1.0);
        }
        case SHOW_HISTORY: {
            return grey(shown_samples(h.diffuse_count, realtime.most_history));
        }
        case SHOW_NOISE: {
            return grey(shown_noise(noise_of_mean(noise[at], h.diffuse_count), realtime.tolerance));
        }
        case SHOW_BLURRED_NOISE: {
            return grey(shown_noise(noise_of_mean(spread[at], h.diffuse_count), realtime.tolerance));
        }
        case SHOW_MASK: {
            return grey(select(0.0, 1.0, samples_wanted_at(at) > 0u));
        }
        case SHOW_SAMPLES: {
            return grey(shown_samples(f32(found_count(at)), f32(realtime.most_samples)));
        }
        case SHOW_DIFFUSE: {
            return vec4f(signal_light(unpack_signal(signals[at]).diffuse, realtime.white), 1.0);
        }
        case SHOW_SPECULAR: {
            return vec4f(signal_light(unpack_signal(signals[at]).specular, realtime.white), 1.0);
        }
        default: {
            return picture(at);
        }
    }
}

@compute @workgroup_size(8, 8)
fn recombine(@builtin(global_invocation_id) id: vec3u) {
    if is_in_picture(id.xy) {
        let at = place_of(id.xy);
        let color = shown(at);
        colors_out[at] = select(vec4f(0.0), color, is_finite3(color.xyz));
    }
}
