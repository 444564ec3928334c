// One pass of the spatial filter: an average over pixels around, FILTER_STEP pixels apart, of those that show the same plane and
// differ by no more than their noise explains. FILTER_RADIUS: how many steps in each direction.

#import filter_steps, planes, realtime_frame, realtime_guides
#import optics::edge_stops, optics::light_tree, optics::math

@group(3) @binding(15) var<storage, read> signals_in: array<vec4u>;
@group(3) @binding(16) var<storage, read_write> signals_out: array<vec4u>;

/// Power of the cosine between normals.
const NORMAL_POWER: f32 = 64.0;
/// Standard deviations of luminance that leave 1/e of a weight.
const LUMINANCE_TOLERANCE: f32 = 4.0;
/// Radii of a pixel's footprint by which neighbours one pixel away may be off the plane.
const PLANE_TOLERANCE: f32 = 1.0;

/// Whether a place is in the picture.
fn is_inside(place: vec2i) -> bool {
    return all(place >= vec2i(0)) && all(place < vec2i(realtime.size));
}

/// The variances around a pixel, smoothed over 3 × 3: one pixel's own is too noisy to judge by.
fn smooth_variances(pixel: vec2i) -> vec2f {
    var sum = vec2f(0.0);
    var weights = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let there = pixel + vec2i(x, y);
            if is_inside(there) {
                let signal = unpack_signal(signals_in[place_of(vec2u(there))]);
                let weight = binomial_weight(u32(abs(x))) * binomial_weight(u32(abs(y)));
                let deviations = vec2f(signal.diffuse_deviation, signal.specular_deviation);
                sum += deviations * deviations * weight;
                weights += weight;
            }
        }
    }
    return sum / weights;
}

/// Weight of a pixel so many steps away.
fn step_weight(steps: vec2i) -> f32 {
    let away = vec2u(abs(steps));
    if FILTER_RADIUS == 1 {
        return binomial_weight(away.x) * binomial_weight(away.y);
    }
    return spline_weight(away.x) * spline_weight(away.y);
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
    let deviations = sqrt(smooth_variances(vec2i(id.xy)));
    let luminances = vec2f(luminance(center.diffuse), luminance(center.specular));
    let lobe = lobe_share(guide_colors(at).roughness);
    let allowed = PLANE_TOLERANCE * realtime.pixel_spread * distance * sqrt(f32(FILTER_STEP)) + 1e-4 * distance;
    var diffuse = vec4f(0.0);
    var specular = vec4f(0.0);
    var weights = vec2f(0.0);
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
            let geometry = step_weight(steps)
                * normal_weight(dot(normal, octahedral_decode(other_point.w)), NORMAL_POWER)
                * plane_weight(dot(normal, plane_vector(other_point) - position), allowed);
            let differences = vec2f(luminance(other.diffuse), luminance(other.specular)) - luminances;
            let of_lobe = select(lobe, 1.0, x == 0 && y == 0);
            let weight = geometry * vec2f(luminance_weight(differences.x, deviations.x, LUMINANCE_TOLERANCE),
                luminance_weight(differences.y, deviations.y, LUMINANCE_TOLERANCE) * of_lobe);
            let weighted = vec2f(other.diffuse_deviation, other.specular_deviation) * weight;
            diffuse += vec4f(other.diffuse * weight.x, weighted.x * weighted.x);
            specular += vec4f(other.specular * weight.y, weighted.y * weighted.y);
            weights += weight;
        }
    }
    // The pixel itself always counts, so no weight is zero.
    signals_out[at] = pack_signal(Signal(diffuse.xyz / weights.x, sqrt(diffuse.w) / weights.x,
        specular.xyz / weights.y, sqrt(specular.w) / weights.y));
}
