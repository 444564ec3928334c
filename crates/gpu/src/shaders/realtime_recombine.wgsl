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
    let scale = 1.0 / max(f32(light.count), 1.0);
    return vec4f(emitted + (light.diffuse + light.specular) * scale, select(0.0, 1.0, light.count > 0u));
}

fn picture(at: u32) -> vec4f {
    if !is_set(REALTIME_GATHERS) {
        return unfiltered(at);
    }
    var radiance = guide_emitted(at);
    if guide_distance(at) > 0.0 {
        let colors = guide_colors(at);
        let light = unpack_signal(signals[at]);
        radiance += remodulate(light.diffuse * realtime.white, colors.diffuse)
            + remodulate(light.specular * realtime.white, colors.specular);
    }
    return vec4f(radiance, 1.0);
}

/// Variance of a pixel's mean from that of its samples; where nothing was known of it, the most that can be.
fn noise_of_mean(of_sample: f32, h: History) -> f32 {
    return select(of_sample / max(h.diffuse_count, 1.0), 1.0, of_sample == NOTHING_KNOWN);
}

fn shown(at: u32) -> vec4f {
    let h = load_history(at);
    switch realtime.show {
        case SHOW_VARIANCE: {
            return vec4f(sample_variance(h.moments.x, h.moments.y, h.diffuse_count) / max(h.diffuse_count, 1.0),
                sample_variance(h.moments.z, h.moments.w, h.specular_count) / max(h.specular_count, 1.0), 0.0, 1.0);
        }
        case SHOW_HISTORY: {
            return vec4f(vec3f(h.diffuse_count / max(realtime.most_history, 1.0)), 1.0);
        }
        case SHOW_NOISE: {
            return vec4f(vec3f(0.5 * noise_of_mean(noise[at], h) / realtime.tolerance), 1.0);
        }
        case SHOW_BLURRED_NOISE: {
            return vec4f(vec3f(0.5 * noise_of_mean(spread[at], h) / realtime.tolerance), 1.0);
        }
        case SHOW_MASK: {
            return vec4f(vec3f(select(0.0, 1.0, samples_wanted_at(at) > 0u)), 1.0);
        }
        case SHOW_SAMPLES: {
            return vec4f(vec3f(f32(found_count(at)) / f32(realtime.most_samples)), 1.0);
        }
        case SHOW_DIFFUSE: {
            return vec4f(unpack_signal(signals[at]).diffuse * realtime.white, 1.0);
        }
        case SHOW_SPECULAR: {
            return vec4f(unpack_signal(signals[at]).specular * realtime.white, 1.0);
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
