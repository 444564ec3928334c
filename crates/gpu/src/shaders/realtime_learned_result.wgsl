// From what the network has filtered to radiance: what is emitted joins again. In a view that
// stands still, frames go on to converge: nothing is moved farther than the noise explains.

#import realtime_frame, realtime_guides
#import optics::math, optics::scatter, optics::signal

/// What frames have gathered.
@group(3) @binding(15) var<storage, read> signals: array<vec4u>;
/// Three values a pixel of the window.
@group(3) @binding(28) var<storage, read> learned_result: array<f32>;
/// Radiance; w: 1 where there is any to show.
@group(3) @binding(21) var<storage, read_write> colors_out: array<vec4f>;

/// Standard deviations that the network may move a pixel by.
const MOST_DEVIATIONS: f32 = 4.0;

/// What the network says, no farther from what was gathered than the noise of both lobes allows.
fn limited(filtered: vec3f, light: Signal, colors: LobeColors) -> vec3f {
    let gathered = signal_radiance(light, 1.0, colors.diffuse, colors.specular);
    let diffuse = light.diffuse_deviation * colors.diffuse;
    let specular = light.specular_deviation * colors.specular;
    let reach = MOST_DEVIATIONS * sqrt(diffuse * diffuse + specular * specular);
    return clamp(filtered, gathered - reach, gathered + reach);
}

@compute @workgroup_size(8, 8)
fn finish_learned(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    var radiance = guide_emitted(at);
    if guide_distance(at) > 0.0 {
        var filtered = vec3f(learned_result[3u * at], learned_result[3u * at + 1u], learned_result[3u * at + 2u]);
        if is_set(REALTIME_STANDS_STILL) {
            filtered = limited(filtered, unpack_signal(signals[at]), guide_colors(at));
        }
        radiance += realtime.white * filtered;
    }
    colors_out[at] = select(vec4f(0.0), vec4f(radiance, 1.0), is_finite3(radiance));
}
