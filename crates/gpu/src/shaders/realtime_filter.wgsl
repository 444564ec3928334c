// One pass of the spatial filter: an average over pixels around, FILTER_STEP pixels apart, of those that show the same plane and
// differ by no more than their noise explains. FILTER_RADIUS: how many steps in each direction.

#import filter_steps, planes, realtime_frame, realtime_guides
#import optics::edge_stops, optics::light_tree, optics::math, optics::spatial_filter

@group(3) @binding(15) var<storage, read> signals_in: array<vec4u>;
@group(3) @binding(16) var<storage, read_write> signals_out: array<vec4u>;

/// Whether a place is in the picture.
fn is_inside(place: vec2i) -> bool {
    return all(place >= vec2i(0)) && all(place < vec2i(realtime.size));
}

/// The deviations around a pixel, smoothed over 3 × 3: one pixel's own is too noisy to judge by.
fn smooth_deviations(pixel: vec2i) -> vec2f {
    var sum = vec2f(0.0);
    var weights = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let there = pixel + vec2i(x, y);
            if is_inside(there) {
                let signal = unpack_signal(signals_in[place_of(vec2u(there))]);
                let weight = binomial_product(u32(abs(x)), u32(abs(y)));
                sum += weighted_variances(signal, weight);
                weights += weight;
            }
        }
    }
    return smoothed_deviations(sum, weights);
}

/// Weight of a pixel so many steps away.
fn step_weight(steps: vec2i) -> f32 {
    let away = vec2u(abs(steps));
    if FILTER_RADIUS == 1 {
        return binomial_product(away.x, away.y);
    }
    return spline_product(away.x, away.y);
}

@compute @workgroup_size(8, 8)
fn filter_signals(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    let distance = guide_distance(at);
    if distance <= 0.0 {
        signals_out[at] = signals_in[at];
        return;
    }
    let center = unpack_signal(signals_in[at]);
    let point = guide_point(at);
    let position = plane_vector(point);
    let normal = octahedral_decode(point.w);
    let deviations = smooth_deviations(vec2i(id.xy));
    let luminances = vec2f(luminance(center.diffuse), luminance(center.specular));
    let lobe = lobe_share(guide_colors(at).roughness);
    let allowed = allowed_off_plane(realtime.pixel_spread, distance, f32(FILTER_STEP));
    var sum = FilterSum(vec4f(0.0), vec4f(0.0), vec2f(0.0));
    for (var y = -FILTER_RADIUS; y <= FILTER_RADIUS; y++) {
        for (var x = -FILTER_RADIUS; x <= FILTER_RADIUS; x++) {
            let steps = vec2i(x, y);
            let there = vec2i(id.xy) + steps * FILTER_STEP;
            if !is_inside(there) {
                continue;
            }
            let other_at = place_of(vec2u(there));
            let other = unpack_signal(signals_in[other_at]);
            let other_point = guide_point(other_at);
            let geometry = surface_weight(step_weight(steps), normal, position, octahedral_decode(other_point.w),
                plane_vector(other_point), allowed);
            let differences = vec2f(luminance(other.diffuse), luminance(other.specular)) - luminances;
            let of_lobe = select(lobe, 1.0, x == 0 && y == 0);
            sum = filter_sum_add(sum, other, signal_weights(geometry, differences, deviations, of_lobe));
        }
    }
    // The pixel itself always counts, so no weight is zero.
    signals_out[at] = pack_signal(filter_sum_mean(sum));
}
